"""Command-line options: every parameter of every effect has one, and it arrives."""
import argparse
import dataclasses

import pytest
from full import CLASSES, FULL
from sets import SETS

from pysph_boiling.examples.dam_break import DamBreak
from pysph_boiling.names import option
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import EFFECTS, CylinderContainer, DistanceContainer, Heater, HeatSource
from pysph_boiling.schemes.options import add_options, apply_options, option_table


def parse(*arguments):
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_options(parser, BoilingScheme.slots)
    return parser.parse_args(list(arguments))


def plain(cls):
    """An effect with its defaults; a heater, a source and a room have none."""
    return cls(**{Heater: dict(temperature=400.0), HeatSource: dict(density=1e3),
                  DistanceContainer: dict(room=SETS["room"]["container"].room)}.get(cls, {}))


def another(cls, spec):
    """A valid value of a parameter other than its default, as (text, value)."""
    if spec.metadata["choices"]:
        value = next(choice for choice in spec.metadata["choices"] if choice != spec.default)
        return value, value
    if isinstance(spec.default, bool):
        return ("no", False) if spec.default else ("yes", True)
    if isinstance(spec.default, tuple):
        value = tuple(v + 0.5 for v in spec.default)
        return ",".join(map(str, value)), value
    for value in (4.0, 3, 1.3, 0.3, 300.0):
        try:
            plain(cls).replaced(**{spec.name: value})
        except ValueError:
            continue
        if value != spec.default and not (spec.type is int and isinstance(value, float)):
            return str(value), value
    raise AssertionError(f"no value found for {cls.slot}.{spec.name}")


PARAMETERS = [(cls, spec) for cls in CLASSES for spec in dataclasses.fields(cls) if "unit" in spec.metadata]


@pytest.mark.parametrize(("cls", "spec"), PARAMETERS, ids=[f"{c.__name__}.{s.name}" for c, s in PARAMETERS])
def test_every_parameter_arrives(cls, spec):
    rows = [row for row in option_table(BoilingScheme.slots) if row[:2] == (cls.slot, spec.name)]
    assert len(rows) == 1, "one option a parameter"
    text, value = another(cls, spec)
    effects = {"phases": FULL["phases"], cls.slot: plain(cls)}
    result = apply_options(parse(f"{rows[0][2]}={text}"), effects, BoilingScheme.slots)
    assert type(result[cls.slot]) is cls and getattr(result[cls.slot], spec.name) == value
    changed = {s.name for s in dataclasses.fields(cls) if getattr(result[cls.slot], s.name) !=
               getattr(effects[cls.slot], s.name)}
    assert changed - {spec.name} <= {"flux": {"temperature"}, "superheat_limit": {"q_crit"}}.get(spec.name, set())
    assert all(result[slot] == effects[slot] for slot in effects if slot != cls.slot)


def test_table_has_nothing_but_the_parameters():
    table = {(slot, name) for slot, name, *_ in option_table(BoilingScheme.slots)}
    assert table == {(cls.slot, spec.name) for cls, spec in PARAMETERS}


def test_no_option_changes_nothing():
    assert apply_options(parse(), FULL, BoilingScheme.slots) == FULL


@pytest.mark.parametrize("slot", [slot for slot in FULL if slot not in ("heater", "source")])
def test_switches(slot):
    off = apply_options(parse(option(f"no_{slot}")), FULL, BoilingScheme.slots)
    assert off == {name: effect for name, effect in FULL.items() if name != slot}
    on = apply_options(parse(option(slot)), off, BoilingScheme.slots)
    assert on[slot] == EFFECTS[slot][0]()


@pytest.mark.parametrize(("arguments", "effects", "message"), [
    (["--no-drag", "--drag.rate=3"], FULL, "--no-drag and --drag.rate contradict each other"),
    (["--heater"], {}, "heater: give exactly one"),
    (["--source"], {}, "source: the power density"),
    (["--heater.flux=1", "--heater.temperature=400"], FULL, "heater: give exactly one"),
    (["--container.radius=1"], FULL, "box container has no parameter radius"),
    (["--container.radius=1", "--container.upper=1,1,1"], {}, "has all of these parameters: radius, upper"),
    (["--drag.rate=-1"], FULL, r"drag.rate must be >= 0.0 1/s, got -1.0 1/s"),
    (["--density.min-sweeps=9"], {"density": EFFECTS["density"][0]()}, "min_sweeps = 9 is above density.max_sweeps"),
])
def test_contradictory_options(arguments, effects, message):
    with pytest.raises(ValueError, match=message):
        apply_options(parse(*arguments), effects, BoilingScheme.slots)


def test_parameter_switches_its_effect_on():
    result = apply_options(parse("--container.radius=0.2"), {}, BoilingScheme.slots)
    assert result == {"container": CylinderContainer(radius=0.2)}


def test_flux_takes_the_place_of_the_temperature():
    result = apply_options(parse("--heater.flux=2e4"), FULL, BoilingScheme.slots)
    assert result["heater"] == Heater(flux=2e4)
    assert FULL["heater"].replaced(temperature=400.0) == Heater(temperature=400.0)


def test_options_of_pysph_reach_the_scheme(tmp_path):
    """A kernel or a time step of one's own is that of the rest densities, walls and warnings too."""
    app = DamBreak()
    app.set_args(["--kernel", "WendlandQuintic", "--timestep", "0.002", "--frame", "0.02", "-d", str(tmp_path)])
    app._parse_command_line(force=True)
    app._prepare()
    assert type(app.scheme.kernel).__name__ == type(app.scheme.solver.kernel).__name__ == "WendlandQuintic"
    assert (app.scheme.dt, app.scheme.solver.pfreq) == (0.002, 10)
