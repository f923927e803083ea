"""The documents: links and pictures lead somewhere, modules that they name exist, lines fit a screen."""
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/tutorials/*.md"),
                    *ROOT.glob("example_plugin/*.md"), *ROOT.glob("pysph_boiling/evaluation/validation/*/README.md")])
MODULES = {path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.py") if ".venv" not in path.parts}
WRITTEN = ("accuracy_results", "reproduction", "stability", "validation", "CHANGELOG")  # lines of any length
documents = pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())


def prose(path):
    """The text of a document without its blocks of code."""
    return re.sub(r"^ *```.*?^ *```|^    .*?$", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(path):
    """Anchors of the headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", prose(path), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@documents
def test_links_and_pictures_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(path)):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = path.parent / name if name else path
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


@documents
def test_modules_that_are_named_exist(path):
    if path.name == "CHANGELOG.md":  # it tells of modules that are gone
        return
    for name in re.findall(r"`([\w/]+\.py)`", prose(path)):
        if "swirl" not in name and f"Save this as `{name}`" not in prose(path):  # what a reader adds
            assert any(f"/{module}".endswith(f"/{name}") for module in MODULES), name


@documents
def test_lines_of_prose_fit_a_screen(path):
    if path.stem not in WRITTEN:
        lines = path.read_text(encoding="utf-8").splitlines()
        longest = max((line for line in lines if not line.lstrip().startswith("|")), key=len)
        assert len(longest) <= 120, longest


def test_every_page_is_in_the_index_of_the_site():
    named = set(re.findall(r"^([\w./]+)$", (ROOT / "docs/index.md").read_text(encoding="utf-8"), re.M))
    pages = {path.relative_to(ROOT / "docs").with_suffix("").as_posix() for path in ROOT.glob("docs/**/*.*")
             if path.suffix in (".md", ".ipynb") and "generated" not in path.parts} - {"index"}
    assert pages <= named


def test_readme_can_be_read_at_one_sitting():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 1000


def test_pictures_of_the_readme_are_small():
    sizes = {path.name: path.stat().st_size for path in ROOT.glob("docs/pictures/*")}
    assert sizes.pop("boiling.webp") <= 8e6 and max(sizes.values()) <= 60e3, sizes
