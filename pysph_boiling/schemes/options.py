"""Command-line options of a scheme, which are made from the parameters of its effects."""
import dataclasses

from pysph_boiling.materials import named
from pysph_boiling.names import add_renamed, former_names, option
from pysph_boiling.schemes.effects import EFFECTS

__all__ = ["add_former_options", "add_material_options", "add_options", "apply_options", "chosen_material",
           "described", "option_table"]


def add_former_options(group, name, prefix=""):
    """Add the earlier options of a slot or a parameter to an argparse group; they end the command with the new name.

    ``prefix`` is "no_" for the switches that leave a slot out. An earlier option that is the switch of a slot now, such
    as ``--cohesion``, is left out.
    """
    for old in former_names(name):
        if old.removeprefix("scene.") not in EFFECTS:
            add_renamed(group, option(prefix + old), option(prefix + name))


def add_material_options(group):
    """Add ``--material`` and ``--pressure`` to an argparse group."""
    group.add_argument("--material", metavar="FLUID", default=None,
                       help="the fluid: water, or a pure fluid of CoolProp such as ethanol or R134a; what the scene "
                            "has for water follows from it (docs/fluids.md)")
    group.add_argument("--pressure", metavar="PA", type=float, default=None,
                       help="pressure at which the fluid boils [Pa]; default 101325")


def chosen_material(options, default):
    """The :class:`~pysph_boiling.materials.Material` that the options ask for; ``default`` without any."""
    if options.material is None and options.pressure is None:
        return default
    return named("water" if options.material is None else options.material, options.pressure)


def option_table(slots):
    """Rows (slot, field name, flag, field) for all parameters of all effects in ``slots``."""
    rows, seen = [], set()
    for slot in slots:
        for cls in EFFECTS[slot]:
            for spec in dataclasses.fields(cls):
                flag = option(f"{slot}.{spec.name}")
                if "unit" in spec.metadata and flag not in seen:
                    seen.add(flag)
                    rows.append((slot, spec.name, flag, spec))
    return rows


def _boolean(text):
    if text.lower() not in ("true", "yes", "1", "false", "no", "0"):
        raise ValueError(f"expected yes or no, got {text!r}")
    return text.lower() in ("true", "yes", "1")


def _numbers(text):
    return tuple(float(part) for part in text.split(","))


_boolean.__name__, _numbers.__name__ = "yes or no", "numbers separated by commas"  # argparse: invalid ... value


def _parser_type(spec):
    return {bool: _boolean, int: int, str: str, float: float}.get(spec.type, _numbers)


def described(meta, default):
    """The help of a parameter, from its metadata: ``temperature [K] (> 0.0); default 400.0``."""
    bounds = [f"{word} {meta[key]}" for key, word in (("above", ">"), ("low", ">="), ("high", "<="))
              if meta[key] is not None]
    unit = "" if meta["unit"] == "-" else f" [{meta['unit']}]"
    law = f" for the scene's own fluid, in proportion to {meta['law']}" if meta.get("law") else ""
    known = "" if default is None else f"; default {default}{law}"
    return f"{meta['meaning']}{unit}{' (' + ', '.join(bounds) + ')' if bounds else ''}{known}".replace("%", "%%")


def add_options(group, slots):
    """Add a switch for every effect in ``slots`` and an option for every parameter to an argparse group.

    Their defaults are ``None``, so that values set by a scene are kept.
    """
    for slot in slots:
        titles = " or ".join(cls.title for cls in EFFECTS[slot])
        group.add_argument(option(slot), dest=f"{slot}.on", action="store_true", default=None, help=f"with {titles}")
        group.add_argument(option(f"no_{slot}"), dest=f"{slot}.on", action="store_false", default=None,
                           help=f"without {titles}")
        for prefix in ("", "no_"):
            add_former_options(group, slot, prefix)
    for slot, name, flag, spec in option_table(slots):
        choices = spec.metadata["choices"]
        group.add_argument(flag, dest=f"{slot}.{name}", type=_parser_type(spec), default=None, choices=choices,
                           metavar=None if choices else name.upper(), help=described(spec.metadata, spec.default))
        add_former_options(group, f"{slot}.{name}")


def apply_options(options, effects, slots):
    """The effects, as a new dict, after options have switched them on or off or replaced their parameters."""
    values = vars(options)
    result = dict(effects)
    for slot in slots:
        given = {name: values[f"{slot}.{name}"] for cls in EFFECTS[slot] for name in
                 (spec.name for spec in dataclasses.fields(cls)) if values.get(f"{slot}.{name}") is not None}
        switch = values.get(f"{slot}.on")
        if switch is False:
            if given:
                raise ValueError(f"{option(f'no_{slot}')} and {option(f'{slot}.{next(iter(given))}')} contradict each "
                                 "other")
            result.pop(slot, None)
        elif slot in result and given:
            result[slot] = result[slot].replaced(**given)
        elif slot not in result and (switch or given):
            cls = next((cls for cls in EFFECTS[slot]
                        if given.keys() <= {spec.name for spec in dataclasses.fields(cls)}), None)
            if cls is None:
                raise ValueError(f"no form of '{slot}' has all of these parameters: {', '.join(sorted(given))}")
            result[slot] = cls(**given)
    return result
