"""Checks of names and numbers that users type or pass. The errors say which values would be right."""
import argparse
import difflib
import re
import sys
from numbers import Real
from pathlib import Path

__all__ = ["RENAMED", "Parser", "Refused", "SchemeError", "add_renamed", "as_typed", "check_renamed", "current_name",
           "current_quantity", "former_names", "nearest", "option", "scene_name", "unknown", "whole_number"]

# Old name -> new name: of a slot, and of a parameter of an effect ("slot.name", the slot by its new name) or of the
# scenes ("scene.name"). Errors for an old name give the new one; records of old runs are read with the new names.
RENAMED = {
    "burst": "dynamic_nucleation",
    "nucleation": "preset_nucleation",
    "tension": "cohesion",
    "cohesion.strength": "cohesion.sigma",
    "density.acceleration": "density.chebyshev_radius",
    "density.delay": "density.chebyshev_delay",
    "density.longest": "density.max_displacement",
    "density.most_error": "density.max_mean_error",
    "density.shortest": "density.short_step",
    "heat.acceleration": "heat.time_scaling",
    "heat.subcycle_share": "heat.max_enthalpy_change",
    "oscillation.time_scale": "oscillation.slowdown",
    "venting.cosine": "venting.cone_cosine",
    "venting.lowest": "venting.min_cover_height",
    "venting.share": "venting.free_fraction",
    "venting.steps": "venting.free_steps",
    "scene.acceleration": "scene.time_scaling",
    "scene.cohesion": "scene.cohesion_sigma",
    "scene.cohesion_strength": "scene.cohesion_sigma",
    "scene.heat_loss": "scene.loss_coefficient",
    "scene.heat_until": "scene.heater_until",
    "scene.limit": "scene.superheat_limit",
    "scene.region": "scene.region_radius",
}


def option(name):
    """The option of a slot (``--heater``), or of a parameter of an effect or a scene: ``--heater.temperature``."""
    return f"--{name.removeprefix('scene.').replace('_', '-')}"


def current_name(name):
    """The present name of a slot, or of a parameter such as ``"density.acceleration"``."""
    slot, dot, parameter = name.partition(".")
    name = f"{RENAMED.get(slot, slot)}{dot}{parameter}"
    return RENAMED.get(name, name)


def current_quantity(name):
    """The present name of a property, a constant or a column of results in the files of an older run."""
    head, _, slot = name.rpartition("_")
    if head == "work" or head.endswith("_by"):  # the mechanical ledger has work_tension and au_by_tension
        return f"{head}_{current_name(slot)}"
    return {"aim": "target_radius"}.get(name, name)


def former_names(name):
    """Earlier names of a slot, or of a parameter such as ``"density.chebyshev_radius"``."""
    slot, dot, parameter = name.partition(".")
    slots = [slot, *(old for old, new in RENAMED.items() if new == slot)]
    parameters = [parameter, *(old.partition(".")[2] for old, new in RENAMED.items() if dot and new == name)]
    return [f"{one}{dot}{other}" for one in slots for other in parameters][1:]


def check_renamed(slot, given, known):
    """Raise ``ValueError`` for the first name in ``given`` that is an earlier name of a parameter of ``slot``.

    ``known`` are the present names of its parameters.
    """
    for name in given:
        new = current_name(f"{slot}.{name}")
        if name not in known and new != f"{slot}.{name}":
            raise ValueError(f"{slot}.{name} is called {new} now")


class Refused(argparse.Action):
    """An option that ``--help`` does not list, and that ends the command with a ``reason``."""

    def __init__(self, option_strings, dest, *, reason, **keywords):
        super().__init__(option_strings, dest, nargs="?", help=argparse.SUPPRESS, **keywords)
        self.reason = reason

    def __call__(self, parser, namespace, values, option_string=None):
        parser.error(f"{self.option_strings[-1]} {self.reason}")


def add_renamed(parser, old, new):
    """Let the option ``old`` end the command with the message that it is called ``new`` now."""
    parser.add_argument(old, action=Refused, dest=old, default=argparse.SUPPRESS, reason=f"is called {new} now")


class Parser(argparse.ArgumentParser):
    """A parser of a command line whose errors name the option or the choice that is nearest to what was typed."""

    def parse_args(self, args=None, namespace=None):
        options, left = self.parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}"
                       + "".join(self.meant(token.partition("=")[0]) for token in left if token.startswith("--")))
        return options

    def meant(self, flag):
        """What to say of an option that is not there: the nearest one, or nothing if none is similar."""
        known = {name.lstrip("-"): name for name, action in self._option_string_actions.items()
                 if not isinstance(action, Refused)}
        return nearest(flag.lstrip("-"), known, known)

    def _check_value(self, action, value):
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            error.message += nearest(value, action.choices)
            raise


class SchemeError(ValueError):
    """A scheme that cannot be built, and the remedy: ``python`` in terms of Python, ``option`` of the command line."""

    def __init__(self, what, python, option):
        super().__init__(f"{what}: {python}")
        self.typed = f"{what}: {option}"


def as_typed(error, slots):
    """An error's message in terms of the command line: ``--heater.temperature`` for ``heater.temperature``."""
    named = rf"(?<![-./\w])({'|'.join(['scene', *slots])})\.(?!toml\b)[a-zA-Z]\w*"
    return re.sub(named, lambda found: option(found[0]), getattr(error, "typed", str(error)))


def nearest(name, known, shown=None):
    """``"; did you mean 'dam_break'?"`` with the known name most similar to ``name``; empty if none is similar.

    ``shown`` maps known names to what is printed for them.
    """
    found = difflib.get_close_matches(str(name), list(map(str, known)), n=1)
    return f"; did you mean '{shown[found[0]] if shown else found[0]}'?" if found else ""


def scene_name(cls):
    """The name of a scene from its class: that of its module, or of its file where Python runs that as a program.

    In a notebook, which has no file, it is the name of the class in small letters.
    """
    if cls.__module__ == "__main__":
        file = getattr(sys.modules["__main__"], "__file__", None)
        return Path(file).stem if file else cls.__name__.lower()
    return cls.__module__.rsplit(".", 1)[-1]


def unknown(what, name, known):
    """The ``ValueError`` for a name that is not in ``known``: ``no scene 'dam_brek'; did you mean ...? There are:``.

    ``what`` says what kind of thing it names, such as ``"scene"``.
    """
    close = nearest(name, known)
    return ValueError(f"no {what} '{name}'{close or ';'} {'There' if close else 'there'} are: "
                      f"{', '.join(map(str, known)) or 'none'}")


def whole_number(name, value, *, low, unit=""):
    """``value`` as an int; raises ``ValueError`` that names it if it is not a whole number >= ``low``."""
    if isinstance(value, bool) or not isinstance(value, Real) or value != value // 1 or value < low:
        raise ValueError(f"{name} must be a whole number >= {low}{unit and ' ' + unit}, got {value!r}")
    return int(value)
