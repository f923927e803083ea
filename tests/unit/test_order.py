"""No equation reads of its neighbours what its own group of equations writes.

PySPH takes the arrays of a group one after the other: all that is done to the first is done before the second begins.
If one of them moves meanwhile, or a property changes that the other reads of its neighbours, the result depends on
which array comes first, and a pair of particles in two arrays is not treated as a pair in one. Read from the kernels'
source.
"""
import ast
import dataclasses
import inspect
import itertools
import textwrap
from collections import defaultdict
from functools import cache

import pytest
import sets

from pysph_boiling.evaluation.stress.scenes import EVERYTHING
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    EFFECTS,
    BoxContainer,
    CylinderContainer,
    DensityConstraint,
)
from pysph_boiling.schemes.stages import Term

METHODS = ("initialize", "initialize_pair", "loop", "loop_all", "post_loop")
ALLOWED = {  # why the order does not matter
    ("BubbleHook", "parent"): "hooking: the fixed point of labels is unique, and labels need all in one array",
    ("BubbleHook", "unsettled"): "a flag that is only ever raised",
}
FORMS = {
    "density": [DensityConstraint(), DensityConstraint(chebyshev_radius=0.9)],
    "container": [BoxContainer(), CylinderContainer(), sets.SETS["room"]["container"]],
}


@cache
def accesses(cls):
    """(read of neighbours, written) properties of an equation class; to write what a neighbour has counts as both."""
    read, written = set(), set()
    for method in METHODS:
        if not hasattr(cls, method):
            continue
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(getattr(cls, method)))).body
        for node in ast.walk(tree):
            if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
                side, _, name = node.value.id.partition("_")
                if side == "s":
                    read.add(name)
                if side in ("s", "d") and isinstance(node.ctx, ast.Store):
                    written.add(name)
        read |= {name for arg in tree.args.args for name in PRECOMPUTED.get(arg.arg, ())}
    return frozenset(read), frozenset(written)


PRECOMPUTED = {**dict.fromkeys(("XIJ", "RIJ", "R2IJ", "WIJ", "DWIJ", "HIJ"), ("x", "y", "z", "h")),
               "VIJ": ("u", "v", "w"), "RHOIJ": ("rho",)}


def conflicts(terms):
    """(place, reader, writer, property): one writes of an array what the other, of the same group, reads of it."""
    groups = defaultdict(list)
    for term in terms:
        groups[term.place].append(term.equation)
    for place, equations in groups.items():
        for reader, writer in itertools.product(equations, repeat=2):
            if writer.dest in (reader.sources or ()):
                for name in accesses(type(reader))[0] & accesses(type(writer))[1]:
                    if (type(writer).__name__, name) not in ALLOWED:
                        yield place, type(reader).__name__, type(writer).__name__, name


def forms():
    """(slot, effect): each effect in each of its forms."""
    for slot in BoilingScheme.slots:
        for effect in FORMS.get(slot) or [EVERYTHING.get(slot) or EFFECTS[slot][0]()]:
            choices = {spec.name: spec.metadata["choices"] for spec in dataclasses.fields(effect)
                       if spec.metadata.get("choices")}
            for values in itertools.product(*choices.values()):
                yield slot, effect.replaced(**dict(zip(choices, values)))


@pytest.mark.parametrize(("slot", "effect"), list(forms()), ids=lambda x: x if isinstance(x, str) else "")
def test_no_group_changes_what_its_neighbour_sums_read(slot, effect):
    effects = {"container": BoxContainer(), **EVERYTHING, slot: effect}
    if slot == "storage":
        effects["dynamic_nucleation"] = None
    scheme = BoilingScheme(["left", "right"], ["wall"], dim=3, spacing=0.01, sites=["sites"], **effects)
    terms = scheme.terms()
    assert any(term.owner == slot for term in terms) or slot in ("refill", "mechanics")  # they have no equations
    assert sorted(set(conflicts(terms))) == []


def test_a_conflict_is_found():
    """The correction and the move in one group, as they once were."""
    scheme = BoilingScheme(["left", "right"], ["wall"], dim=2, spacing=0.01, **sets.SETS["motion"])
    merged = [Term(term.place.replace("move", "correction"), term.equation) for term in scheme.terms()]
    pair = "density.correction", "PBFPositionCorrection", "PBFMove"
    assert {(*pair, axis) for axis in "xyz"} <= set(conflicts(merged))
