"""The base of all effects: parameters with unit and bounds, what an effect knows of its scene, and what it can add."""
import dataclasses
import functools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, ClassVar, NamedTuple

import numpy as np
from pysph.base.particle_array import ParticleArray

from pysph_boiling.device import real
from pysph_boiling.materials import Material
from pysph_boiling.names import check_renamed, nearest
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property, host
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.reductions import GENERAL, has
from pysph_boiling.schemes.stages import Term

__all__ = [
    "EFFECTS", "Column", "Effect", "Flow", "Rule", "SchemeContext", "Snapshot", "any_vapour", "check_parameters",
    "check_temperatures", "computed_once", "constant", "cumulative", "joined", "largest_over", "param",
    "sum_over", "totals",
]

EFFECTS: dict[str, list[Any]] = {}  # slot -> effect classes, in the order in which their terms stand in a group


@dataclass(frozen=True, kw_only=True, eq=False)
class SchemeContext:
    """What an effect may know about the scheme that it belongs to. Lengths in m, times in s, masses in kg."""

    fluids: tuple[str, ...]
    solids: tuple[str, ...]
    sites: tuple[str, ...]
    dim: int
    spacing: float
    h: float
    kernel: Any
    rho0: float
    material: Any
    gravity: tuple[float, float, float]
    effects: dict[str, Any]  # slot -> effect
    period: np.ndarray  # (3,) length of the domain along each axis, 0 if not periodic or without a solver
    hosted: bool = False  # whether another scheme moves the particles (BoilingGuest)

    @property
    def moves(self) -> bool:
        """Whether the particles move."""
        return self.hosted or "density" in self.effects

    @property
    def g(self) -> float:
        """Magnitude of gravity [m/s^2]."""
        return float(np.linalg.norm(self.gravity))

    @property
    def up(self) -> tuple[float, ...]:
        """Unit vector against gravity; along the last axis if there is no gravity."""
        if self.g == 0.0:
            return tuple(float(axis == self.dim - 1) for axis in range(3))
        return tuple(-component / self.g for component in self.gravity)

    @property
    def particle_mass(self) -> float:
        """Mass of a particle of the rest lattice [kg, or kg/m in 2-D]."""
        return self.rho0 * self.spacing**self.dim

    @property
    def fall_time(self) -> float:
        """``t* = sqrt(spacing/|g|)`` [s], the unit of time for tuned rates; infinite without gravity."""
        return math.sqrt(self.spacing / self.g) if self.g else math.inf

    def bubble_radius(self, spacings: float) -> float:
        """A radius of action on vapour [m] from one in spacings of vapour; at most the support of the kernel."""
        v_exp = self.effects["expansion"].v_exp if "expansion" in self.effects else 1.0
        return min(spacings * self.spacing * v_exp ** (1.0 / self.dim), max(self.support, spacings * self.spacing))

    @property
    def support(self) -> float:
        """Support radius of the kernel [m]."""
        return self.kernel.radius_scale * self.h


class Snapshot(list):
    """Fluid arrays that do not change for a while, with the results of :func:`computed_once` functions of them.

    ``reductions`` are those of the scheme, and ``summed`` names properties whose sums are made together with the others
    (:func:`totals`).
    """

    def __init__(self, arrays: Sequence[ParticleArray], reductions: Any = GENERAL, summed: Sequence[str] = ()):
        super().__init__(arrays)
        self.reductions, self.summed, self.known = reductions, summed, {}


NOT_YET = object()


def computed_once(function):
    """Decorator for a function of fluid arrays whose result is computed once for each :class:`Snapshot`.

    Further arguments must be hashable. For a plain list of arrays it is computed each time. Do not modify the result.
    """
    @functools.wraps(function)
    def call(arrays, *args):
        if not isinstance(arrays, Snapshot):
            return function(arrays, *args)
        key = function, *args
        found = arrays.known.get(key, NOT_YET)
        if found is NOT_YET:
            found = arrays.known[key] = function(arrays, *args)
        return found

    return call


class Column(NamedTuple):
    """A column of ``results.npz``; ``value(arrays, scene)`` takes the fluid arrays, of a row as a :class:`Snapshot`.

    ``unit`` is that of a 3-D scene; :meth:`unit_in` gives that of a scene in ``dim`` dimensions.
    """

    name: str
    unit: str
    meaning: str
    value: Callable

    def unit_in(self, dim: int) -> str:
        """The unit in a 2-D or 3-D scene: in 2-D masses and energies are those of a metre of depth."""
        if dim == 2 and self.unit in ("kg", "J"):
            return f"{self.unit}/m"
        return self.unit.replace("m^dim", f"m^{dim}")


class Rule(NamedTuple):
    """The rule by which ``effects="auto"`` chooses an effect.

    The effect is chosen if all effects that it requires and all slots in ``after`` have been chosen, and ``holds(facts,
    chosen)`` is true, where ``facts`` is a :class:`pysph_boiling.schemes.auto.Facts` and ``chosen`` is slot -> effect.
    The slots in ``decided`` are decided before it, and may have been left out.

    ``why`` and ``why_not`` are the reasons to print, in which ``{}`` is the result of ``holds`` and ``{f}`` the facts.
    """

    holds: Callable | None
    why: str
    why_not: str = ""
    after: tuple[str, ...] = ()
    decided: tuple[str, ...] = ()


class Flow(NamedTuple):
    """Enthalpy that crosses the border of the domain [J]: the sum of a property of the particles, or a constant.

    ``sign`` is +1 if a positive value brings energy in, and ``meaning`` describes a positive value. ``leak`` marks
    energy that a literal formula of the paper creates or loses; it is not a flow, but the energy balance includes it.
    """

    name: str
    sign: int
    meaning: str
    prop: str | None = None
    constant: str | None = None
    leak: bool = False


def param(default: Any, unit: str, meaning: str, *, low: float | None = None, high: float | None = None,
          above: float | None = None, choices: Sequence | None = None, may_change: bool = False,
          temperature: bool = False, sets: str | None = None, law: str | None = None) -> Any:
    """A parameter of an effect or a scene: a dataclass field with unit, meaning and bounds.

    Values from ``low`` to ``high`` are allowed, and values must be greater than ``above``. The default ``None`` means
    that the scene decides. ``may_change`` means that a resumed run may have another value, which is possible if the
    files of a run do not depend on it. ``temperature`` marks an absolute temperature, which must not be below melting
    (:func:`check_temperatures`). ``sets`` is the parameter of an effect ("slot.name") that a parameter of a scene sets,
    unless it is given itself. ``law`` names what a value that was tuned for one fluid is in proportion to in others
    (:data:`pysph_boiling.materials.LAWS`); without one it is the same in all.
    """
    meta = dict(unit=unit, meaning=meaning, low=low, high=high, above=above, choices=choices, may_change=may_change,
                temperature=temperature, sets=sets, law=law)
    return field(default=default, metadata=meta)


def check_temperatures(instance: Any, label: Callable[[str], str], material: Material) -> None:
    """Check that absolute temperatures among the parameters are above melting, so that degrees Celsius are noticed.

    Errors: ``ValueError`` with ``label(name)`` for the name of the parameter, the limit and the unit.
    """
    for spec in dataclasses.fields(instance):
        T = getattr(instance, spec.name)
        if spec.metadata.get("temperature") and T is not None:
            material.check_melted(T, label(spec.name))


def check_parameters(instance: Any, label: str) -> None:
    """Convert the parameters of a dataclass with :func:`param` fields to their types, and check their bounds."""
    for spec in dataclasses.fields(instance):
        value, meta = getattr(instance, spec.name), spec.metadata
        kind: Any = spec.type
        if "unit" not in meta or (value is None and spec.default is None):
            continue
        name, unit = f"{label}.{spec.name}", "" if meta["unit"] == "-" else f" {meta['unit']}"
        if meta["choices"]:
            if value not in meta["choices"] or not isinstance(value, kind):
                raise ValueError(f"{name} must be one of {', '.join(map(str, meta['choices']))}; got {value!r}"
                                 f"{nearest(value, meta['choices'])}")
            continue
        if spec.type is str:
            if not isinstance(value, str) or not value:
                raise ValueError(f"{name} must be text, got {value!r}")
            continue
        if isinstance(spec.default, bool):
            if not isinstance(value, bool):
                raise ValueError(f"{name} must be True or False, got {value!r}")
            continue
        several = isinstance(value, (tuple, list, np.ndarray))
        if several != isinstance(spec.default, tuple) or not all(
                isinstance(v, Real) and not isinstance(v, (bool, np.bool_)) for v in (value if several else [value])):
            raise ValueError(f"{name} must be {'numbers' if isinstance(spec.default, tuple) else 'a number'}"
                             f"{' in' + unit if unit else ''}, got {value!r}")
        numbers: Any = tuple(float(v) for v in value) if several else float(value)
        for number in numbers if isinstance(numbers, tuple) else (numbers,):
            for bad, text in (
                (not math.isfinite(number), "be finite"),
                (meta["low"] is not None and number < meta["low"], f"be >= {meta['low']}{unit}"),
                (meta["high"] is not None and number > meta["high"], f"be <= {meta['high']}{unit}"),
                (meta["above"] is not None and number <= meta["above"], f"be > {meta['above']}{unit}"),
            ):
                if bad:
                    raise ValueError(f"{name} must {text}, got {number}{unit}")
        if kind is int:
            if numbers != int(numbers):
                raise ValueError(f"{name} must be a whole number, got {value}")
            numbers = int(numbers)
        object.__setattr__(instance, spec.name, numbers)


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Base class of all effects. Subclasses are frozen dataclasses whose fields are made by :func:`param`.

    Example: an effect that decelerates bubbles. A real one also overrides :meth:`terms`, to yield its equations.

    >>> from dataclasses import dataclass
    >>> from typing import ClassVar
    >>> from pysph_boiling.schemes.effects.base import Effect, param
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Brake(Effect):
    ...     slot: ClassVar[str] = "brake"
    ...     rate: float = param(0.1, "1/s", "rate at which velocities decay", low=0.0)
    >>> Brake(rate=2.0).replaced(rate=3.0)
    Brake(rate=3.0)
    >>> Brake(rate=-1.0)
    Traceback (most recent call last):
        ...
    ValueError: brake.rate must be >= 0.0 1/s, got -1.0 1/s
    """

    slot: ClassVar[str] = ""
    title: ClassVar[str] = ""
    requires: ClassVar[tuple[str, ...]] = ()
    auto_rule: ClassVar[Rule | None] = None  # None: only if asked for; the rule of the first class of a slot counts
    on_ranks: ClassVar[bool] = True  # whether it runs on several MPI ranks
    in_guest: ClassVar[bool] = True  # whether it works where another scheme moves the particles (BoilingGuest)
    parameter_constants: ClassVar[tuple[str, ...]] = ()  # they hold parameters: a resumed run has those asked for now

    def __new__(cls, **given):
        check_renamed(cls.slot, given, [spec.name for spec in dataclasses.fields(cls)])
        return super().__new__(cls)

    @property
    def removes_particles(self) -> bool:
        """Whether it removes particles, so that their cumulative properties must be kept in constants."""
        return False

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        if not re.fullmatch("[a-z]+(_[a-z]+)*", cls.slot):
            raise TypeError(f"effect {cls.__name__} needs a slot of its own, a name in lower-case letters such as "
                            f"slot = \"swirl\", got {cls.slot!r}")
        # not twice if a module is imported again
        others = [other for other in EFFECTS.get(cls.slot, ()) if _place(other) != _place(cls)]
        EFFECTS[cls.slot] = [*others, cls]

    def __post_init__(self):
        check_parameters(self, self.slot)

    def replaced(self, **changes: Any) -> "Effect":
        """A copy with some parameters changed."""
        known = [spec.name for spec in dataclasses.fields(self)]
        check_renamed(self.slot, changes, known)
        for name in changes:
            if name not in known:
                raise ValueError(f"{self.title} has no parameter {name}{nearest(name, known)}")
        return dataclasses.replace(self, **changes)

    def properties(self, scene: SchemeContext) -> tuple[Property, ...]:
        """Properties this effect adds to each fluid array."""
        return ()

    def constants(self, scene: SchemeContext) -> dict[str, Any]:
        """Constants this effect adds to each fluid array, with their initial values."""
        return {}

    def flows(self, scene: SchemeContext) -> tuple[Flow, ...]:
        """Enthalpy flows of this effect across the border of the domain."""
        return ()

    def columns(self, scene: SchemeContext) -> tuple[Column, ...]:
        """Columns this effect adds to the results."""
        return ()

    def check(self, scene: SchemeContext, arrays: dict[str, ParticleArray]) -> None:
        """Raise ``ValueError`` if this effect cannot work with the scene's arrays."""

    def prepare(self, scene: SchemeContext, arrays: dict[str, ParticleArray]) -> None:
        """Set constants that depend on the arrays, which now have all their properties."""

    def warnings(self, scene: SchemeContext, dt: float) -> Iterator[str]:
        """Yields a sentence for each parameter that is known to give poor results with the time step ``dt`` [s]."""
        return iter(())

    def terms(self, scene: SchemeContext, fluid: str) -> Iterator[Term]:
        """Yields the equations with the array ``fluid`` as their destination."""
        return iter(())

    def hooks(self, scene: SchemeContext) -> dict[str, Callable]:
        """Functions that run on the host after a group: place -> function of the fluid arrays."""
        return {}

    def conditions(self, scene: SchemeContext) -> dict[str, Callable]:
        """Conditions for stages: name -> function of the fluid arrays, true if this effect needs the stage."""
        return {}

    def site_properties(self, scene: SchemeContext) -> tuple[Property, ...]:
        """Properties this effect adds to each array of sites."""
        return ()

    def wall_properties(self, scene: SchemeContext) -> tuple[Property, ...]:
        """Properties this effect adds to each array of walls."""
        return ()

    def rate_of_velocity(self, scene: SchemeContext) -> float:
        """Rate [1/s] at which this effect reduces velocity differences; steps too long for it are split."""
        return 0.0

    def stored(self, sites: Sequence[ParticleArray]) -> float:
        """Enthalpy [J] that this effect stores in the arrays of ``sites``; it belongs to the domain."""
        return 0.0

    def tools(self, scheme: Any) -> Iterator:
        """PySPH tools that act between steps, before the ledger."""
        return iter(())


def _place(cls):
    return cls.__module__, cls.__qualname__


def constant(arrays, name):
    """Sum of a constant over all arrays and all of its entries; constants are equal on all ranks."""
    found = (pa.constants[name] for pa in arrays)
    return sum(entries[0] if len(entries) == 1 else float(np.sum(entries.get_npy_array())) for entries in found)


class Totals(NamedTuple):
    """Sums over the real particles of all arrays and ranks.

    ``count`` is their number, ``sums`` has the sum of each property in :attr:`Snapshot.summed`. ``number`` (5,) and
    ``energy`` (5,) [J] are particles and enthalpy by state, and ``hidden`` [J] is the held latent heat, as in
    :meth:`Reductions.states`; all of these are 0 without heat.
    """

    count: float  # type: ignore[assignment]  # in place of the method of a tuple
    sums: dict[str, float]
    number: list[float]
    energy: list[float]
    hidden: float


@computed_once
def totals(arrays: Sequence[ParticleArray]) -> Totals:
    """The :class:`Totals` of fluid arrays, which the ranks exchange at once."""
    arrays = arrays if isinstance(arrays, Snapshot) else Snapshot(arrays)
    parts = []
    for pa in arrays:
        count = len(host(pa, "m"))  # a device counts periodic ghosts among the real ones
        number, energy, hidden = arrays.reductions.states(pa) if "e" in pa.properties else ([0.0] * 5, [0.0] * 5, 0.0)
        parts.append([count, *arrays.reductions.sums(pa, arrays.summed), *number, *energy, hidden])
    (found,) = parts if len(parts) == 1 else [[sum(part) for part in zip(*parts)]]
    count, *found = found if ranks.size() == 1 else ranks.total(np.array(found)).tolist()
    sums, found = found[:len(arrays.summed)], found[len(arrays.summed):]
    return Totals(float(count), dict(zip(arrays.summed, sums)), found[:5], found[5:10], found[10])


def sum_over(arrays: Sequence[ParticleArray], name: str) -> float:
    """Sum of a property over the real particles of all arrays and ranks, with the values of removed particles."""
    if isinstance(arrays, Snapshot) and name in arrays.summed:
        value = totals(arrays).sums[name]
    else:
        value = ranks.total(sum(GENERAL.sum(pa, name) for pa in arrays))
    carried = f"carried_{name}"
    return value + sum(pa.constants[carried][0] for pa in arrays if carried in pa.constants)


@computed_once
def joined(arrays: Sequence[ParticleArray], name: str) -> np.ndarray:
    """A property of this rank's real particles of all arrays in one array, which must not be modified."""
    parts = [host(pa, name) for pa in arrays]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def largest_over(arrays, name):
    """Largest value of a property of this rank's particles of all arrays; 0 if it is not above 0 anywhere."""
    reductions = arrays.reductions if isinstance(arrays, Snapshot) else GENERAL
    return max([0.0, *(reductions.ends(pa, name)[1] for pa in arrays if real(pa))])


def any_vapour(arrays):
    """Whether there is any vapour on any rank."""
    return ranks.anywhere(any(has(pa, "phase", Phase.VAPOUR.value, Phase.VAPOUR.value) for pa in arrays))


def cumulative(name: str, unit: str, meaning: str, prop: str) -> Column:
    """A column with the sum of a cumulative property of the particles."""
    return Column(name, unit, meaning, lambda arrays, scene: sum_over(arrays, prop))
