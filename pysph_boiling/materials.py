"""Materials: the constants of a fluid at saturation, with units and source, and how they compare between fluids.

Example: ethanol at twice the pressure of the atmosphere, which needs CoolProp.

>>> from pysph_boiling.materials import saturated
>>> ethanol = saturated("ethanol", pressure=2e5)
>>> ethanol.name, round(ethanol.T_sat, 1), round(ethanol.L / 1e3)  # K, kJ/kg
('Ethanol at 200 kPa', 369.9, 817)
"""
import functools
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

from pysph_boiling.extras import needed
from pysph_boiling.names import nearest, unknown

__all__ = ["ATMOSPHERE", "LAWS", "WATER_1ATM", "Material", "in_proportion", "named", "saturated"]

ATMOSPHERE = 101325.0  # Pa


@dataclass(frozen=True, kw_only=True)
class Material:
    """Constants of a boiling fluid at one pressure.

    Parameters
    ----------
    T_sat, T_crit : float   Saturation and critical temperature [K], 0 < T_sat < T_crit.
    rho_l, rho_v : float    Density of liquid and vapour at saturation [kg/m^3].
    c_l, c_v : float        Specific heat capacity of liquid and vapour [J/(kg K)].
    k_l, k_v : float        Thermal conductivity of liquid and vapour [W/(m K)].
    L : float               Latent heat of vaporisation [J/kg], > 0.
    sigma : float           Surface tension [N/m].
    mu_l : float            Dynamic viscosity of the liquid [Pa s].
    beta : float            Thermal expansion coefficient of the liquid [1/K].
    T_melt : float          Melting temperature [K], the lowest temperature of the liquid; 0 K if not given.
    pressure : float        Pressure at which the constants hold [Pa]; unknown if not given.
    kappa : float           Isentropic exponent of the vapour [-]; unknown if not given.

    Errors: ``ValueError`` that names the constant, its value and its unit. Limits: the constants do not vary with
    temperature.
    """

    name: str
    T_sat: float
    T_crit: float
    rho_l: float
    rho_v: float
    c_l: float
    c_v: float
    k_l: float
    k_v: float
    L: float
    sigma: float
    mu_l: float
    beta: float
    T_melt: float | None = None
    pressure: float | None = None
    kappa: float | None = None

    UNITS = {
        "T_sat": "K", "T_crit": "K", "rho_l": "kg/m^3", "rho_v": "kg/m^3", "c_l": "J/(kg K)", "c_v": "J/(kg K)",
        "k_l": "W/(m K)", "k_v": "W/(m K)", "L": "J/kg", "sigma": "N/m", "mu_l": "Pa s", "beta": "1/K",
        "T_melt": "K", "pressure": "Pa", "kappa": "-",
    }

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "name" or (value is None and field.default is None):
                continue
            value = float(value)
            object.__setattr__(self, field.name, value)
            if not 0.0 < value < float("inf"):
                unit = self.UNITS[field.name].replace("-", "")
                raise ValueError(f"{field.name} of {self.name} must be > 0{unit and ' ' + unit}, got {value}")
        if self.T_sat >= self.T_crit:
            raise ValueError(f"T_sat must be below T_crit = {self.T_crit} K, got {self.T_sat} K")

    def check_melted(self, T: float, name: str) -> None:
        """Raise ``ValueError`` for a temperature ``T`` [K] below melting; the message calls it ``name``."""
        if self.T_melt is not None and T < self.T_melt:
            raise ValueError(f"{name} must be >= {self.T_melt} K, the melting point of {self.name}, got {T} K: "
                             f"temperatures are in kelvin, and {T:g} degrees Celsius are {T + 273.15:g} K")

    def with_(self, **changes: Any) -> "Material":
        """A copy with some constants changed."""
        return replace(self, **changes)

    def constants(self) -> dict[str, dict[str, Any]]:
        """The constants in the form of ``run.json``: name -> value and unit."""
        return {name: {"value": getattr(self, name), "unit": unit} for name, unit in self.UNITS.items()}


# IAPWS values of saturated liquid and vapour at 101.325 kPa to three digits, c_l, L, T_crit to four; T_sat is 100
# degrees Celsius, .026 K above the boiling point at that pressure. A test compares them with CoolProp.
WATER_1ATM = Material(
    name="water at 1 atm", T_sat=373.15, T_crit=647.1, rho_l=958.0, rho_v=0.598, c_l=4216.0, c_v=2077.0, k_l=0.677,
    k_v=0.0246, L=2.257e6, sigma=0.0589, mu_l=2.82e-4, beta=7.5e-4, T_melt=273.15,
    pressure=ATMOSPHERE, kappa=1.33,
)

# What CoolProp calls the constants, with the quality of the state (0 liquid, 1 vapour) and what they are in words.
COOLPROP = {
    "T_sat": ("T", 0, "saturation temperature"), "rho_l": ("D", 0, "density of the liquid"),
    "rho_v": ("D", 1, "density of the vapour"), "c_l": ("C", 0, "heat capacity of the liquid"),
    "c_v": ("C", 1, "heat capacity of the vapour"), "k_l": ("L", 0, "thermal conductivity of the liquid"),
    "k_v": ("L", 1, "thermal conductivity of the vapour"), "sigma": ("I", 0, "surface tension"),
    "mu_l": ("V", 0, "viscosity of the liquid"), "beta": ("isobaric_expansion_coefficient", 0, "thermal expansion"),
    "kappa": ("isentropic_expansion_coefficient", 1, "isentropic exponent of the vapour"),
}
GLIDE = 0.01  # K between the first and the last of the liquid to boil, above which a fluid is no pure substance


def saturated(name: str, pressure: float = ATMOSPHERE, **given: float) -> Material:
    """The :class:`Material` of a fluid at saturation, from the equations of state and the fits of CoolProp.

    Parameters
    ----------
    name : str         Name of a pure fluid in CoolProp, or another name that it knows ("R134a", "ethanol", "C2H6O").
    pressure : float   Pressure [Pa], from that of the triple point to below that of the critical point.
    **given : float    Constants to take instead of CoolProp's, such as those for which it has no model.

    Errors: ``ValueError`` for an unknown fluid, a mixture, a pressure outside the range, and a constant for which
    CoolProp has no model and that is not given; ``ModuleNotFoundError`` without CoolProp.
    Limits: the melting temperature is that of the triple point.
    """
    coolprop = needed("CoolProp.CoolProp", "fluids")
    fluid = _canonical(coolprop, name)
    for constant in given:
        if constant not in Material.UNITS or constant == "pressure":
            raise unknown("constant of a fluid", constant, [key for key in Material.UNITS if key != "pressure"])
    low, high = (coolprop.PropsSI(limit, fluid) for limit in ("ptriple", "pcrit"))
    if not low <= pressure < high:
        raise ValueError(f"pressure of {fluid} must be >= {low:.6g} Pa (triple point) and < {high:.6g} Pa (critical "
                         f"point) for it to boil, got {pressure} Pa")

    def state(what, quality):
        return coolprop.PropsSI(what, "P", pressure, "Q", quality, fluid)

    first, last = state("T", 0), state("T", 1)
    if last - first > GLIDE:
        raise ValueError(f"{fluid} is a mixture, which boils from {first:.5g} to {last:.5g} K and not at one "
                         "temperature: name a pure fluid")
    found, lacks = dict(L=state("H", 1) - state("H", 0), T_crit=coolprop.PropsSI("Tcrit", fluid),
                        T_melt=coolprop.PropsSI("Ttriple", fluid)), []
    for constant, (what, quality, words) in COOLPROP.items():
        if constant not in given:
            try:
                found[constant] = state(what, quality)
            except ValueError:
                lacks.append(f"{words} ({constant} [{Material.UNITS[constant]}])")
    if lacks:
        raise ValueError(f"CoolProp has no model of {fluid} for its {', '.join(lacks)}: give it, as in "
                         f"saturated('{fluid}', {lacks[0].partition('(')[2].split()[0]}=...), or choose another fluid")
    return Material(name=f"{fluid} at {1e-3 * pressure:.6g} kPa", pressure=pressure, **{**found, **given})


@functools.cache
def _fluids(coolprop):
    """All names of fluids that CoolProp knows, in lower case -> its own name."""
    known = {}
    for fluid in coolprop.get_global_param_string("FluidsList").split(","):
        for other in (fluid, *coolprop.get_fluid_param_string(fluid, "aliases").split(",")):
            known.setdefault(other.lower(), fluid)
    return known


def _canonical(coolprop, name):
    """CoolProp's own name of a fluid."""
    known = _fluids(coolprop)
    if str(name).lower() not in known:
        close = nearest(str(name).lower(), known)
        raise ValueError(f"no fluid '{name}' in CoolProp{close or '; such as water, ethanol, R134a, nitrogen'}")
    return known[str(name).lower()]


def named(name: str, pressure: float | None = None) -> Material:
    """The :class:`Material` with a name and a pressure [Pa], the atmosphere's if not given.

    Water at the atmosphere's pressure is :data:`WATER_1ATM`, which needs no other package. All else is
    :func:`saturated`, with its errors.
    """
    if str(name).lower() == "water" and pressure in (None, ATMOSPHERE):
        return WATER_1ATM
    return saturated(name, ATMOSPHERE if pressure is None else pressure)


# What a parameter that was tuned for one fluid is in proportion to in others, so that a scene boils alike.
# Lengths, times and accelerations stay as they are; these laws keep the numbers that compare heat with them.
LAWS: dict[str, Callable[[Material], float]] = {
    "L/c_l": lambda fluid: fluid.L / fluid.c_l,  # Stefan number c_l dT/L
    "rho_l c_l/k_l": lambda fluid: fluid.rho_l * fluid.c_l / fluid.k_l,  # Fourier number A alpha t/dx^2
    "k_l": lambda fluid: fluid.k_l,  # Biot number eta dx/k_l
    "sigma T_sat c_l/(rho_v L^2)": lambda fluid:  # activation superheat of a cavity over L/c_l
        fluid.sigma * fluid.T_sat * fluid.c_l / (fluid.rho_v * fluid.L**2),
    "sigma": lambda fluid: fluid.sigma,
}


def in_proportion(value: float, law: str, tuned_for: Material, fluid: Material) -> float:
    """A ``value`` that was tuned for one fluid, for another: in proportion to ``law`` of :data:`LAWS`, to four digits.
    """
    if fluid == tuned_for:
        return value
    return float(f"{value * LAWS[law](fluid) / LAWS[law](tuned_for):.4g}")
