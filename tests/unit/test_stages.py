"""Stages: their groups suit every backend, and what would never run is refused."""
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import sets
from full import make, subgroups

from pysph_boiling.equations.density_constraint import PATIENCE, book_sweep
from pysph_boiling.schemes.effects import EFFECTS, Drag
from pysph_boiling.schemes.solver import vector_tag
from pysph_boiling.schemes.stages import PLACES, STAGES, Term


def test_stage_without_terms_is_not_built():
    scheme, _, equations = make(effects=sets.SETS["slab"])
    assert len(equations.groups) == 1 and list(scheme.integrator.stages) == ["heat"]


@pytest.mark.parametrize("name", sets.SETS)
def test_groups_suit_every_backend(name):
    scheme, _, equations = make(effects=sets.SETS[name], lean=False)  # the lean ones are the host's
    parents = [parent for stage in equations.groups for parent in stage]
    for parent in parents:
        assert parent.has_subgroups and not parent.update_nnps
        assert parent.pre is None and parent.post is None and parent.condition is None
    for parent, group in subgroups(equations):
        assert not group.has_subgroups and not group.iterate
        assert not (parent.iterate and group.condition is not None)
    names = [group.name for group in parents] + [group.name for _, group in subgroups(equations)]
    assert len(set(names)) == len(names) and not any(name.startswith("Group") for name in names)
    assert {parent.name for parent in parents if parent.iterate} == \
           {f"{stage.name}{n}{vector_tag()}" for stage in STAGES for n, block in enumerate(stage.blocks)
            if block.iterate and stage.name in scheme.integrator.stages}


def test_sweeps_are_limited_as_asked():
    effects = {**sets.SETS["motion"], "density": EFFECTS["density"][0](min_sweeps=3, max_sweeps=5)}
    (parent,) = [parent for parent, group in subgroups(make(effects=effects, lean=False)[2])
                 if group.name == "density_move"]
    assert (parent.iterate, parent.min_iterations, parent.max_iterations) == (True, 3, 50)


def swept_array():
    """The constants of an array that are read and written when a sweep is booked."""
    return SimpleNamespace(density_error=[0.0, 0.0], sweeps=[0.0, 0.0], first_sweeps=[0.0, 0.0], prior=[1.0] * 3)


def sweeps_of_steps(*errors, fluid=None, tolerance=1e-2, most=6):
    """Number of sweeps in each step, if n sweeps leave a mean density error of error/n."""
    fluid, counts = fluid or swept_array(), []
    for error in errors:
        fluid.sweeps[:] = 0.0, 0.0
        while not book_sweep(fluid, error / (fluid.sweeps[0] + 1.0), 1.0, error / (fluid.sweeps[0] + 1.0), tolerance,
                             most, 1.0):
            pass
        counts.append(fluid.sweeps[0])
    return counts


def test_sweeps_come_in_pairs_and_a_step_begins_with_as_many_as_the_last():
    assert sweeps_of_steps(0.0) == [2.0] and sweeps_of_steps(1.0) == [6.0] and sweeps_of_steps(1.0, most=3) == [4.0]
    assert sweeps_of_steps(0.019, 0.03, 0.019, 0.03, 0.019) == [2.0, 4.0, 4.0, 4.0, 4.0], "the error varies a little"
    calm = [1e-3] * PATIENCE
    assert sweeps_of_steps(0.05, *calm, *calm, *calm)[::PATIENCE] == [6.0, 6.0, 4.0, 2.0], "water no longer needs them"
    assert sweeps_of_steps(0.05, *calm[:-1], 0.05, *calm)[-1] == 6.0, "and not for long enough"


def test_sweeps_after_the_first_run_in_a_step_end_when_they_may():
    fluid = swept_array()
    assert sweeps_of_steps(0.05, fluid=fluid) == [6.0]
    fluid.sweeps[0] = 0.0  # as the integrator begins the run after an oscillation
    assert [book_sweep(fluid, 0.0, 0.0, 0.0, 1e-2, 6, 1.0) for _ in range(2)] == [False, True]
    assert fluid.first_sweeps[0] == 6.0, "what the next step begins with"


@pytest.mark.parametrize(("method", "given", "message"), [
    ("terms", lambda: iter([Term("forces.summ", Mock())]),
     "no place for Mock of effect 'drag': 'forces.summ'; did you mean 'forces.sum'?"),
    ("terms", lambda: iter([Term("forces", Mock())]), "no place for Mock of effect 'drag': 'forces'"),
    ("hooks", lambda: {"heat.updat": print}, "no place for a hook of effect 'drag': 'heat.updat'; did you mean"),
    ("hooks", lambda: {"phases.emit": print}, "effect 'drag' hooks on 'phases.emit', which has no equations here"),
    ("conditions", lambda: {"bubles": print},
     "no stage for a condition of effect 'drag': 'bubles'; did you mean 'bubbles'"),
    ("conditions", lambda: {"dynamic_nucleation": print},
     "condition for the stage 'dynamic_nucleation', which has no equations here"),
])
def test_what_would_never_run_is_refused(monkeypatch, method, given, message):
    monkeypatch.setattr(Drag, method, lambda *_: given())
    with pytest.raises(ValueError, match=message):
        make(effects=sets.BOIL)


def test_places_are_those_of_the_stages():
    assert len(PLACES) == sum(len(block.groups) for stage in STAGES for block in stage.blocks)
    assert PLACES["forces.sum"] == "forces" and PLACES["bubbles.label"] == "bubbles"
