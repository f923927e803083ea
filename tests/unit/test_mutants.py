"""The mutants of ``make mutants`` fit the equations as they are now. Nothing is compiled."""
import ast
from collections import Counter

import mutants
import pytest

MODULES = {path.stem for path in (mutants.ROOT / mutants.EQUATIONS).glob("*.py")} - {"__init__"} | {
    path.name for path in (mutants.ROOT / mutants.NATIVE).glob("*.h")}


def code(source):
    """Syntax tree of a module as text, without its docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return ast.dump(tree)


@pytest.mark.parametrize("mutant", mutants.MUTANTS, ids=[f"{m.module}: {m.what}" for m in mutants.MUTANTS])
def test_mutant_changes_a_kernel_and_is_still_python(mutant):
    whole, mutated = (mutants.ROOT / mutant.path).read_text(), mutants.mutated(mutant)
    assert mutated != whole if mutant.path.suffix == ".h" else code(mutated) != code(whole)
    assert all((mutants.ROOT / "tests" / name).is_file() for name in mutant.tests)


def test_every_module_of_equations_has_two_mutants_or_more():
    count = Counter(mutant.module for mutant in mutants.MUTANTS)
    assert set(count) == MODULES and min(count.values()) >= 2
    assert len({(mutant.module, mutant.what) for mutant in mutants.MUTANTS}) == len(mutants.MUTANTS)


def test_text_that_does_not_occur_once_is_refused(capsys, monkeypatch):
    for old, count in (("no such text", "0 times"), ("float(", r"\d+ times")):
        with pytest.raises(ValueError, match=f"occurs {count}"):
            mutants.mutated(mutants.MUTANTS[0]._replace(old=old))
    monkeypatch.setattr(mutants, "MUTANTS", [mutants.MUTANTS[0]._replace(old="no such text")])
    assert mutants.main([]) == 2
    assert "occurs 0 times: 'no such text'" in capsys.readouterr().err


def test_choice():
    assert {m.module for m in mutants.chosen(only="heat")} == {"heat"}
    assert [m.module for m in mutants.chosen(quick=True)] == sorted(MODULES)
    assert len(mutants.chosen(only="heat", quick=True)) == 1
    with pytest.raises(ValueError, match="no mutants of 'cold'; there are of: artificial_pressure"):
        mutants.chosen(only="cold")


@pytest.mark.parametrize(("killers", "status"), [(["test_a", "test_b"], 0), (["test_a", None], 1)])
def test_survivor_fails_the_command(killers, status, monkeypatch, tmp_path, capsys):
    """With the tests' outcome made up; the working tree stays as it is."""
    monkeypatch.setattr(mutants, "MUTANTS", [m for m in mutants.MUTANTS if m.module == "container"][:len(killers)])
    answers = iter([None, *killers])  # the first is the run without a mutant
    monkeypatch.setattr(mutants, "copy_repository", lambda folder: (mutants.ROOT, {}))
    monkeypatch.setattr(mutants, "run_tests", lambda *_: next(answers))
    monkeypatch.setattr(mutants, "hunt", lambda *_: next(answers))
    assert mutants.main(["--only", "container", "--json", str(tmp_path / "out.json")]) == status
    assert f"{len(killers)} mutants, {status} survived" in capsys.readouterr().out
    assert f'"survivors": {status}' in (tmp_path / "out.json").read_text()


def test_tests_that_fail_without_a_mutant_are_no_proof(monkeypatch, capsys):
    monkeypatch.setattr(mutants, "copy_repository", lambda folder: (mutants.ROOT, {}))
    monkeypatch.setattr(mutants, "run_tests", lambda *_: "test_a")
    assert mutants.main(["--only", "container"]) == 2
    assert "test_a fails without any mutant" in capsys.readouterr().err
