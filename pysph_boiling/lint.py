"""Lint for the code that PySPH translates. It reads the source; nothing is imported or compiled.

PySPH turns the methods of ``Equation`` and ``IntegratorStep`` classes, and the helper functions they call, into Cython,
OpenCL or CUDA. Each rule below names valid Python that this translation rejects on some backend, or silently gets
wrong. It works on anybody's equations::

    python -m pysph_boiling.lint my_equations.py another_folder

It prints one line per finding, and its exit status is 1 if there are any.
"""
import argparse
import ast
import importlib.util
import re
import sys
import warnings
from collections import Counter, defaultdict
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from compyle.translator import CConverter

__all__ = ["Finding", "RULES", "lint", "main", "sources"]

ROOTS = {"Equation", "IntegratorStep"}
HOST = {"reduce", "converged"}  # run on the host everywhere; Cython still compiles them
INTEGER_TYPES = ("int", "long", "unsigned int", "unsigned long", "uint", "ulong")
FUNCTIONS = set("dot cross length distance mix step sign clamp pi normalize".split())  # built into OpenCL
# Keywords and types of OpenCL and C++ (CUDA), and macros of PySPH's generated code; not even attributes.
WORDS = set(
    "half kernel global local constant private uint ulong KERNEL GRADIENT GRADH DWDQ "
    "new delete class template this typename namespace operator public protected virtual friend".split()  # C++: CUDA
)
# Nodes that compyle handles within their parents.
SYNTAX = {ast.Constant, ast.Load, ast.Store, ast.arguments, ast.arg, ast.keyword, ast.Tuple}
RULES = {
    "unique-name": "if two kernels or helpers have the same name, one silently replaces the other",
    "inherited-kernel": "OpenCL code does not inherit translated methods",
    "class-statement": "names at class level leak to file scope on OpenCL",
    "coerced-attribute": "the last instance decides the C type for all instances: write float(...) or int(...)",
    "integer-division": "1/2 is 0 in C",
    "one-comparison": "a < x < b does not translate to OpenCL",
    "one-target": "a = b = 0.0 and tuple assignment do not translate to OpenCL",
    "reserved-name": "the name clashes with OpenCL or with PySPH's macros",
    "declare": "declare(...) must be on a line of its own at the top level of a function, with literal types",
    "loop-index": "an undeclared loop index is a double in Cython",
    "cast": "int(), float() and bool() do not exist in C; use cast(x, 'int')",
    "loop-limit": "range(self.n) does not translate to OpenCL: assign it to a name first",
    "mixed-minmax": "min(1, x) is ambiguous on OpenCL; write min(1.0, x)",
    "one-statement": "write one statement per line: Cython code is generated line by line",
    "def-line": "end the line of a signature with ':', otherwise Cython drops the statements after it",
    "unknown-name": "the name is neither an argument nor a local: OpenCL makes it a double without a value",
    "bare-conditional": "OpenCL gets 'a if c else b' without brackets: assign it to a name first",
    "keyword-argument": "OpenCL drops keyword arguments",
    "untranslatable": "syntax that compyle's translator does not know",
    "docstring": "the docstring of a kernel must have the entries Source, Reads and Writes",
}


class Finding(NamedTuple):
    rule: str
    where: str
    what: str

    def __str__(self):
        return f"{self.where}: {self.what} [{self.rule}: {RULES[self.rule]}]"


# ---- reading ---------------------------------------------------------------------------------------------------------

def sources(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder.parent)): path.read_text(encoding="utf-8") for path in folder.rglob("*.py")}


def class_nodes(trees):
    """(file, node) of every class, kernel or not."""
    return [(file, n) for file, tree in trees.items() for n in ast.walk(tree) if isinstance(n, ast.ClassDef)]


@cache
def pysph():
    """Class nodes of the installed PySPH, and the names of its classes and helpers."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PySPH's escape sequences
        texts = sources(Path(importlib.util.find_spec("pysph").origin).parent)
        trees = {file: ast.parse(text) for file, text in texts.items()}
    nodes = [n for _, n in class_nodes(trees)]
    return nodes, {n.name for n in nodes} | {n.name for _, n in helpers(trees)}


def base_names(node):
    return {getattr(b, "id", getattr(b, "attr", None)) for b in node.bases}


def ancestors(node, classes):
    """Base classes of ``node`` without the roots; ``classes`` maps a name to all class nodes of that name."""
    seen, queue = [], list(base_names(node) - ROOTS)
    while queue:
        for parent in classes[queue.pop()]:
            if parent not in seen:
                seen.append(parent)
                queue += base_names(parent) - ROOTS
    return seen


def translated(node):
    """The methods of a class that PySPH compiles: all but ``_private`` and ``py_`` ones."""
    return [f for f in node.body if isinstance(f, ast.FunctionDef) and not f.name.startswith(("_", "py_"))]


def helpers(trees):
    """(file, node) of the functions that any ``_get_helpers_`` returns, by name or in a module-level list."""
    named, listed = set(), defaultdict(set)
    for tree in trees.values():
        for n in ast.walk(tree):
            if isinstance(n, ast.FunctionDef) and n.name == "_get_helpers_":
                named |= {x.id for x in ast.walk(n) if isinstance(x, ast.Name)}
        for n in tree.body:
            if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name):
                listed[n.targets[0].id] |= {x.id for x in ast.walk(n.value) if isinstance(x, ast.Name)}
    named |= {x for name in named for x in listed[name]}
    return [(file, n) for file, tree in trees.items() for n in tree.body
            if isinstance(n, ast.FunctionDef) and n.name in named]


def kernels(trees):
    """(file, node) of our classes that derive from Equation or IntegratorStep, through PySPH's classes or ours."""
    ours = class_nodes(trees)
    classes = defaultdict(list)
    for n in [n for _, n in ours] + pysph()[0]:
        classes[n.name].append(n)
    found = [(file, n) for file, n in ours
             if any(base_names(c) & ROOTS for c in [n, *ancestors(n, classes)])]
    return found, classes


# ---- rules -----------------------------------------------------------------------------------------------------------

def called(node, *names):
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names


def is_self(node):
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"


def body(node):
    """Statements of a class or function, without its docstring."""
    return node.body[1:] if ast.get_docstring(node) is not None else node.body


def inside(fn):
    return [n for top in body(fn) for n in ast.walk(top)]


def declared(statement):
    """Names that ``i, j = declare('int', 2)`` declares as integers."""
    if isinstance(statement, ast.Assign) and called(statement.value, "declare"):
        if any(getattr(a, "value", None) in INTEGER_TYPES for a in statement.value.args):
            return {n.id for n in ast.walk(statement.targets[0]) if isinstance(n, ast.Name)}
    return set()


def check_names(trees, found):
    """Compare the names of kernels and helpers with each other and with those of PySPH."""
    named = found + helpers(trees)
    count = Counter(n.name for _, n in named)
    for file, n in named:
        if count[n.name] > 1 or n.name in pysph()[1]:
            yield "unique-name", file, n, n.name


def check_class(file, node, classes):
    for parent in ancestors(node, classes):
        for method in translated(parent):
            yield "inherited-kernel", file, node, f"{node.name} inherits {parent.name}.{method.name}"
    for n in body(node):
        if not isinstance(n, ast.FunctionDef) and translated(node):
            yield "class-statement", file, n, f"{node.name}: {ast.unparse(n)}"
    text = ast.get_docstring(node) or ""
    missing = [word for word in ("source", "reads", "writes") if not re.search(rf"\b{word}\b", text, re.I)]
    if translated(node) and missing:
        yield "docstring", file, node, f"{node.name} lacks {', '.join(missing)}"


def assigned(init):
    """(target, value) of the plain assignments in ``__init__``, in order; tuples are unpacked."""
    for n in sorted((n for n in ast.walk(init) if isinstance(n, ast.Assign | ast.AnnAssign)), key=lambda n: n.lineno):
        for target in getattr(n, "targets", None) or [n.target]:
            if isinstance(target, ast.Tuple):
                values = n.value.elts if isinstance(n.value, ast.Tuple) else [n.value] * len(target.elts)
                yield from zip(target.elts, values, strict=True)
            else:
                yield target, n.value


def attributes(init, coercers):
    """Attributes and locals of ``__init__``: name -> "float", "int", or None if the type depends on the caller.

    ``coercers`` maps functions to the type they return: float, int, and annotated functions of this package.
    """
    kinds = {}

    def kind(v):
        if isinstance(v, ast.Constant):
            return {float: "float", int: "int"}.get(type(v.value))
        if called(v, *coercers):
            return coercers[v.func.id]
        if isinstance(v, ast.Name | ast.Attribute):
            return kinds.get(ast.unparse(v))
        if isinstance(v, ast.UnaryOp):
            return kind(v.operand)
        if isinstance(v, ast.BinOp | ast.IfExp):
            a, b = (kind(v.left), kind(v.right)) if isinstance(v, ast.BinOp) else (kind(v.body), kind(v.orelse))
            if isinstance(v, ast.BinOp) and None not in (a, b):
                return "float" if "float" in (a, b) or isinstance(v.op, ast.Div) else "int"
            return a if a == b else None
        return None

    nodes = {}
    for target, value in assigned(init):
        name = ast.unparse(target)
        new = kind(value)
        kinds[name] = new if kinds.get(name, new) == new or isinstance(target, ast.Name) else None
        nodes[name] = target
    return {name: (kind, nodes[name]) for name, kind in kinds.items()}


def check_attributes(file, node, coercers, reads):
    for init in (f for f in node.body if isinstance(f, ast.FunctionDef) and f.name == "__init__"):
        for name, (kind, target) in attributes(init, coercers).items():
            if is_self(target) and target.attr in reads and kind is None:
                yield "coerced-attribute", file, target, f"{node.name}: {name}"


def check_layout(file, fn, lines):
    """Check the rules of the line-by-line translation to Cython; they also apply to ``reduce`` and ``converged``."""
    signature = next((i for i, line in enumerate(lines[fn.lineno - 1:], fn.lineno) if line.rstrip().endswith(":")), 0)
    if signature >= fn.body[0].lineno or not signature:
        yield "def-line", file, fn, fn.name
    all_statements = [n for n in inside(fn) if isinstance(n, ast.stmt)]
    per_line = Counter(n.lineno for n in all_statements)
    for n in all_statements:
        if per_line[n.lineno] > 1:
            yield "one-statement", file, n, ast.unparse(n)
    good, ints = set(), {}
    for n in fn.body:
        if isinstance(n, ast.Assign) and called(n.value, "declare") and per_line[n.lineno] == 1:
            if n.lineno == n.end_lineno and isinstance(n.value.args[0], ast.Constant):
                good.add(n.value)
                ints |= dict.fromkeys(declared(n), n.lineno)
    for n in inside(fn):
        if called(n, "declare") and n not in good:
            yield "declare", file, n, ast.unparse(n)
        if isinstance(n, ast.For) and ints.get(ast.unparse(n.target), n.lineno) >= n.lineno:
            yield "loop-index", file, n, ast.unparse(n.target)


def check_device(file, fn, integer_attributes):
    """Check the rules of the translation to OpenCL and CUDA."""
    args = {a.arg for a in fn.args.args}
    nodes = inside(fn)
    stored = {n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    attributes = {n.attr for n in nodes if is_self(n)}
    for name in sorted((args | stored) & (FUNCTIONS | WORDS) | attributes & WORDS):
        yield "reserved-name", file, fn, f"{fn.name}: {name}"

    defaults = dict(zip([a.arg for a in fn.args.args][::-1], fn.args.defaults[::-1], strict=False))
    ints = {a for a, d in defaults.items() if isinstance(d, ast.Constant) and type(d.value) is int}
    ints = ints.union(*(declared(n) for n in nodes))

    def is_int(v):
        if isinstance(v, ast.BinOp):
            return is_int(v.left) and is_int(v.right)
        if isinstance(v, ast.UnaryOp):
            return is_int(v.operand)
        return (isinstance(v, ast.Constant) and type(v.value) is int or isinstance(v, ast.Name) and v.id in ints
                or is_self(v) and v.attr in integer_attributes)

    functions = {n.func for n in nodes if isinstance(n, ast.Call)}
    for n in nodes:
        rule = None
        if isinstance(n, ast.Compare) and len(n.ops) > 1:
            rule = "one-comparison"
        elif isinstance(n, ast.Assign):
            pair = isinstance(n.targets[0], ast.Tuple) and not called(n.value, "declare")
            rule = "one-target" if pair or len(n.targets) > 1 else None
        elif called(n, "int", "float", "bool"):
            rule = "cast"
        elif isinstance(n, ast.Call) and n.keywords:
            rule = "keyword-argument"
        elif called(n, "range") and any(is_self(a) for a in n.args):
            rule = "loop-limit"
        elif called(n, "min", "max") and len({is_int(a) for a in n.args}) > 1:
            rule = "mixed-minmax"
        elif isinstance(n, ast.BinOp) and isinstance(n.op, ast.Div) and is_int(n.left) and is_int(n.right):
            rule = "integer-division"
        elif isinstance(n, ast.Name) and n not in functions and n.id not in args | stored and not n.id.startswith("M_"):
            rule = "unknown-name"
        elif not hasattr(CConverter, f"visit_{type(n).__name__}") and type(n) not in SYNTAX:
            rule = "untranslatable"
        if rule:
            yield rule, file, n if hasattr(n, "lineno") else fn, f"{fn.name}: {ast.unparse(n) or type(n).__name__}"
        if isinstance(n, ast.BinOp | ast.UnaryOp | ast.BoolOp | ast.Compare):
            for c in ast.iter_child_nodes(n):
                if isinstance(c, ast.IfExp):
                    yield "bare-conditional", file, c, f"{fn.name}: {ast.unparse(n)}"


def check(texts, trees):
    found, classes = kernels(trees)
    lines = {file: text.splitlines() for file, text in texts.items()}
    coercers = {"float": "float", "int": "int"}
    for tree in trees.values():
        for n in ast.walk(tree):
            if isinstance(n, ast.FunctionDef) and isinstance(n.returns, ast.Name) and n.returns.id in ("float", "int"):
                coercers[n.name] = n.returns.id

    yield from check_names(trees, found)
    family = {id(n): [n, *ancestors(n, classes)] for _, n in found}
    for file, node in found:
        below = [n for _, n in found if node in family[id(n)]]  # itself, and kernels that inherit its __init__
        reads = {a.attr for n in below for f in translated(n) for a in ast.walk(f) if is_self(a)}
        inits = [f for n in family[id(node)] for f in n.body if getattr(f, "name", "") == "__init__"]
        integers = {name[5:] for f in inits for name, (kind, _) in attributes(f, coercers).items()
                    if kind == "int" and name.startswith("self.")}
        yield from check_class(file, node, classes)
        yield from check_attributes(file, node, coercers, reads)
        for fn in translated(node):
            yield from check_layout(file, fn, lines[file])
            if fn.name not in HOST:
                yield from check_device(file, fn, integers)
    for file, fn in helpers(trees):
        yield from check_layout(file, fn, lines[file])
        yield from check_device(file, fn, set())


def lint(texts: dict[str, str]) -> list[Finding]:
    """Findings in modules given as {file name: source}."""
    return findings(texts, {file: ast.parse(text) for file, text in texts.items()})


def findings(texts, trees):
    """Findings in modules given as {file name: source} and {file name: syntax tree}."""
    return [Finding(rule, f"{file}:{n.lineno}", what) for rule, file, n, what in check(texts, trees)]


def read(paths):
    """Sources and syntax trees of the modules in ``paths``, which are files or folders: two dicts by file name.

    Raises ``ValueError`` with what cannot be read.
    """
    texts, trees = {}, {}
    for path in map(Path, paths):
        files = sorted(path.rglob("*.py")) if path.is_dir() else [path]
        if not files:
            raise ValueError(f"there is no Python module in {path}")
        for file in files:
            try:
                texts[str(file)] = file.read_text(encoding="utf-8")
                trees[str(file)] = ast.parse(texts[str(file)])
            except (OSError, SyntaxError, UnicodeDecodeError, ValueError) as error:
                raise ValueError(f"cannot read {file}: {error}") from None
    return texts, trees


def main(arguments: Sequence[str] | None = None) -> int:
    """The command: print the findings. Returns the exit status, 0 if there are none, 1 if there are, 2 for no input."""
    parser = argparse.ArgumentParser(
        prog="python -m pysph_boiling.lint",
        description="Read PySPH equations and steppers, and report what Cython, OpenCL or CUDA would get wrong.")
    parser.add_argument("paths", nargs="+", metavar="FILE", help="a Python module, or a folder of them")
    parser.add_argument("--docstrings", action="store_true",
                        help="also require the entries Source, Reads and Writes in the docstring of each kernel")
    options = parser.parse_args(arguments)
    try:
        texts, trees = read(options.paths)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    shown = [finding for finding in findings(texts, trees) if options.docstrings or finding.rule != "docstring"]
    for finding in shown:
        print(finding)
    print(f"{len(kernels(trees)[0])} kernels, {len(shown)} findings")
    return 1 if shown else 0


if __name__ == "__main__":
    sys.exit(main())
