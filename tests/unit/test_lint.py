"""Lint of all that PySPH translates: what the package obeys, and that each rule fires.

``BREAKS`` holds, for each rule, edits of a clean module that the rule has to notice.
"""
import ast
from functools import cache
from pathlib import Path

import pytest

from pysph_boiling.lint import RULES, helpers, kernels, lint, main, sources, translated

PACKAGE = Path(__file__).parents[2] / "pysph_boiling"


# ---- the package -----------------------------------------------------------------------------------------------------

@cache
def package_findings():
    return lint(sources(PACKAGE))


@pytest.mark.parametrize("rule", RULES)
def test_package_obeys(rule):
    found = [str(f) for f in package_findings() if f.rule == rule]
    assert not found, "\n".join(found)


def test_kernels_and_helpers_are_found():
    trees = {file: ast.parse(text) for file, text in sources(PACKAGE).items()}
    assert sum(bool(translated(n)) for _, n in kernels(trees)[0]) > 5
    assert helpers(trees)


# ---- the rules themselves --------------------------------------------------------------------------------------------

CLEAN = '''
from pysph.sph.equation import Equation
from pysph.sph.integrator_step import IntegratorStep


def lint_hash(k=0, seed=0):
    h = declare('unsigned int')
    h = k + seed*40503
    h = h ^ (h >> 16)
    return h


def checked(value) -> float:
    return float(value)


class LintBase(Equation):
    """Parameters that kernels share; no kernel of its own."""

    def __init__(self, dest, sources, k, n):
        if not 0.0 < k < 1.0:
            raise ValueError(k)
        self.k = float(k)
        self.n = int(n)
        self.label = k
        super().__init__(dest, sources)


class LintProbe(LintBase):
    """A sum. Source: none. Reads s_m. Writes d_a."""

    def __init__(self, dest, sources, k, n):
        self.c = checked(k)
        self.scale = 2 * self.c if n else 0.5
        super().__init__(dest, sources, k, n)

    def _get_helpers_(self):
        return [lint_hash]

    def loop(self, d_idx, d_a, s_idx, s_m,
             RIJ, WIJ):
        i, j = declare('int', 2)
        q = declare('matrix(3)')
        low = 0.0 if RIJ > 0.5 else 1.0
        j = self.n
        for i in range(j):
            q[i] = self.k / 2
        if RIJ > 0.0 and RIJ < 1.0:
            d_a[d_idx] += self.scale * max(low, s_m[s_idx]) * WIJ * q[0] * M_PI
        elif lint_hash(1, self.n) > 3:
            d_a[d_idx] = -self.c

    def reduce(self, dst, t, dt):
        dst.total[0] = float(numpy.sum(dst.a)) if 0.0 < t < 1.0 else 0.0


class LintStep(IntegratorStep):
    """One move. Source: none. Reads d_u. Writes d_x."""

    def stage1(self, d_idx, d_x, d_u, dt):
        d_x[d_idx] += dt * d_u[d_idx]
'''

STEP = "        d_x[d_idx] += dt * d_u[d_idx]\n"
BREAKS = [  # rule, what to replace in CLEAN, by what
    ("unique-name", "class LintStep(", "class LintProbe("),
    ("unique-name", "class LintStep(", "class EulerStep("),
    ("unique-name", "lint_hash", "gj_solve"),
    ("inherited-kernel", "(IntegratorStep)", "(EulerStep)"),
    ("inherited-kernel", "(IntegratorStep)", "(LintProbe)"),
    ("class-statement", "    def stage1", "    scale = 2.0\n\n    def stage1"),
    ("coerced-attribute", "self.k = float(k)", "self.k = k"),
    ("coerced-attribute", "self.k = float(k)", "self.k = abs(k)"),
    ("coerced-attribute", "self.k = float(k)", "self.k = None"),
    ("coerced-attribute", "if n else 0.5", "if n else 1"),
    ("coerced-attribute", "value) -> float:", "value):"),
    ("loop-limit", "range(j)", "range(self.n)"),
    ("integer-division", "self.k / 2", "self.n / 2"),
    ("integer-division", "k + seed*40503", "k / 2"),
    ("integer-division", "low = 0.0", "low = 1 / 2"),
    ("one-comparison", "RIJ > 0.0 and RIJ < 1.0", "0.0 < RIJ < 1.0"),
    ("one-comparison", STEP, "        if 0.0 < dt < 1.0:\n    " + STEP),
    ("one-target", STEP, "        a = b = dt\n"),
    ("one-target", STEP, "        a, b = dt, 1.0\n"),
    ("reserved-name", STEP, "        length = dt\n"),
    ("reserved-name", "d_u, dt", "d_u, half, dt"),
    ("reserved-name", "seed", "sign"),
    ("reserved-name", "low", "new"),
    ("reserved-name", "self.scale", "self.half"),
    ("declare", "i, j = declare('int', 2)", "i, j = declare(\n            'int', 2)"),
    ("declare", STEP, "        if dt > 0.0:\n            k = declare('int')\n"),
    ("declare", "q = declare('matrix(3)')", "q = declare(size)"),
    ("declare", "q = declare('matrix(3)')", "q = declare('matrix(3)'); low = 1.0"),
    ("loop-index", "i, j = declare('int', 2)", "i, j = declare('double', 2)"),
    ("loop-index", "dst.total[0] =", "for k in range(3):\n            dst.total[k] ="),
    ("cast", STEP, "        d_x[d_idx] = int(dt)\n"),
    ("mixed-minmax", "max(low, ", "max(0, "),
    ("mixed-minmax", "max(low, ", "max(-1, "),
    ("one-statement", "low = 0.0 if", "j = 1; low = 0.0 if"),
    ("one-statement", STEP, "        if dt > 0.0: d_x[d_idx] = 0.0\n"),
    ("def-line", "d_u, dt):", "d_u, dt):  # moves"),
    ("def-line", "t, dt):", "t, dt):  # on the host"),
    ("unknown-name", STEP, "        d_x[d_idx] = EPS\n"),
    ("unknown-name", STEP, "        d_x[d_idx] = Phase.VAPOUR\n"),
    ("bare-conditional", STEP, "        d_x[d_idx] = 1.0 + (2.0 if dt > 0.0 else 3.0)\n"),
    ("keyword-argument", "lint_hash(1, self.n)", "lint_hash(1, seed=self.n)"),
    ("untranslatable", STEP, "        d_x[d_idx] = d_u[d_idx] // dt\n"),
    ("untranslatable", STEP, "        d_x[d_idx] = [dt, dt][0]\n"),
    ("untranslatable", STEP, "        d_x[d_idx] = sum(d_u[0:3])\n"),
    ("docstring", "Source: none. Reads d_u. ", "Source: none. "),
]


def test_clean_module_has_no_findings():
    assert not lint({"clean.py": CLEAN})


@pytest.mark.parametrize(("rule", "old", "new"), BREAKS, ids=[f"{i}-{b[0]}" for i, b in enumerate(BREAKS)])
def test_rule_fires(rule, old, new):
    assert old in CLEAN
    assert rule in {f.rule for f in lint({"broken.py": CLEAN.replace(old, new)})}


def test_every_rule_has_a_break():
    assert {b[0] for b in BREAKS} == set(RULES)


# ---- the command -----------------------------------------------------------------------------------------------------

def test_command_reads_the_modules_of_others(tmp_path, capsys):
    clean, broken = tmp_path / "clean.py", tmp_path / "broken.py"
    clean.write_text(CLEAN)
    assert main([str(clean)]) == 0
    assert capsys.readouterr().out == "3 kernels, 0 findings\n"
    broken.write_text(CLEAN.replace("self.k = float(k)", "self.k = k").replace("Source: none. Reads s_m. ", ""))
    assert main([str(broken)]) == 1
    out = capsys.readouterr().out.splitlines()
    line = CLEAN.splitlines().index("        self.k = float(k)") + 1
    assert out == [f"{broken}:{line}: LintBase: self.k [coerced-attribute: {RULES['coerced-attribute']}]",
                   "3 kernels, 1 findings"]
    assert main(["--docstrings", str(broken)]) == 1 and "[docstring:" in capsys.readouterr().out


@pytest.mark.parametrize("what", ["missing", "empty", "syntax"])
def test_command_says_what_it_cannot_read(what, tmp_path, capsys):
    path = tmp_path / what
    if what == "empty":
        path.mkdir()
    elif what == "syntax":
        path.write_text("def f(:\n")
    assert main([str(path)]) == 2
    captured = capsys.readouterr()
    assert str(path) in captured.err and not captured.out
