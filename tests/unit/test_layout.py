"""Where modules stand: no module imports, even late, from a part of the package above its own, and none in a circle."""
import ast
from collections import defaultdict
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "pysph_boiling"
# From the bottom to the top; each part may import from those before it, and from itself.
PARTS = ("", "names", "checks", "extras", "materials", "cavities", "phases", "search", "native", "particles", "rooms",
         "meshes", "device", "threads", "lint", "files", "results", "equations", "parallel", "schemes", "analysis",
         "runs", "examples",
         "report", "evaluation", "cli", "__main__")


def name_of(path, root):
    parts = path.relative_to(root.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(root):
    """Module -> modules of the package that it imports anywhere, at its head or inside a function."""
    modules = {name_of(path, root): path for path in root.rglob("*.py")}
    found = defaultdict(set)
    for name, path in modules.items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == root.name:
                for alias in node.names:
                    longer = f"{node.module}.{alias.name}"
                    other = longer if longer in modules else node.module
                    if other != name:  # code that is compiled elsewhere imports the module it was written in
                        found[name].add(other)
    return found


def part(module):
    return (module.split(".") + [""])[1]


def upwards(found, parts):
    return [(name, other) for name, others in sorted(found.items()) for other in sorted(others)
            if parts.index(part(other)) > parts.index(part(name))]


def circles(found):
    """Groups of modules that import each other, by following imports until nothing new is reached."""
    def reached(start):
        seen, pending = set(), [start]
        while pending:
            for other in found.get(pending.pop(), ()):
                if other not in seen:
                    seen.add(other)
                    pending.append(other)
        return seen

    reach = {name: reached(name) for name in found}
    return sorted({tuple(sorted(other for other in reach[name] if name in reach.get(other, ()))) for name in reach
                   if name in reach[name]})


def test_no_arrow_points_upwards():
    found = imports(PACKAGE)
    assert len(found) > 100 and {part(name) for name in found} <= set(PARTS)
    assert not upwards(found, PARTS)


def test_no_modules_import_each_other():
    assert not circles(imports(PACKAGE))


@pytest.mark.parametrize(("text", "arrows", "rings"), [
    ("from made.high import b", [("made.low.a", "made.high.b")], [("made.high.b", "made.low.a")]),
    ("def later():\n    from made.high.b import x", [("made.low.a", "made.high.b")], [("made.high.b", "made.low.a")]),
    ("import os", [], []),
])
def test_both_are_noticed(text, arrows, rings, tmp_path):
    root = tmp_path / "made"
    for name, source in (("low/a.py", text), ("high/b.py", "from made.low import a")):
        (root / name).parent.mkdir(parents=True)
        (root / name).write_text(source)
    found = imports(root)
    assert upwards(found, ("low", "high")) == arrows and circles(found) == rings


def test_examples_are_scenes_alone():
    from pysph_boiling.examples import scene_class, scenes

    names = {path.stem for path in (PACKAGE / "examples").glob("*.py")} - {"__init__"}
    assert set(scenes()) == names and all(scene_class(name) for name in names)
