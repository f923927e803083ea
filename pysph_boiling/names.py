"""What users type or pass: a name that must be known, a number that must be whole. Errors say what would be right."""
import difflib
import re
from numbers import Real

__all__ = ["SchemeError", "as_typed", "nearest", "unknown", "whole_number"]


class SchemeError(ValueError):
    """A scheme that cannot be, and what to do: ``python`` for who writes it, ``option`` for who types it."""

    def __init__(self, what, python, option):
        super().__init__(f"{what}: {python}")
        self.typed = f"{what}: {option}"


def as_typed(error, slots):
    """The message of an error in the words of the command line: ``--heater.temperature`` for ``heater.temperature``."""
    def option(found):
        slot, name = found[1], found[2].replace("_", "-")
        return f"--{name}" if slot == "scene" else f"--{slot}.{name}"

    return re.sub(rf"(?<![-.\w])({'|'.join(['scene', *slots])})\.([a-zA-Z]\w*)", option,
                  getattr(error, "typed", str(error)))


def nearest(name, known):
    """``"; did you mean 'dam_break'?"`` for the known name that is most like ``name``; empty where none is."""
    found = difflib.get_close_matches(str(name), list(map(str, known)), n=1)
    return f"; did you mean '{found[0]}'?" if found else ""


def unknown(what, name, known):
    """The ``ValueError`` of a name that is not among ``known``: ``no scene 'dam_brek'; did you mean ...? There are:``.

    ``what`` tells what is named: ``"scene"``.
    """
    close = nearest(name, known)
    return ValueError(f"no {what} '{name}'{close or ';'} {'There' if close else 'there'} are: "
                      f"{', '.join(map(str, known)) or 'none'}")


def whole_number(name, value, *, low, unit=""):
    """``value`` as an int; ``ValueError`` that names it where it is not a whole number of at least ``low``."""
    if isinstance(value, bool) or not isinstance(value, Real) or value != value // 1 or value < low:
        raise ValueError(f"{name} must be a whole number >= {low}{unit and ' ' + unit}, got {value!r}")
    return int(value)
