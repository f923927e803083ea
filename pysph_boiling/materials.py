"""Materials: the constants of a fluid at saturation, with units and source."""
from dataclasses import dataclass, fields, replace

__all__ = ["WATER_1ATM", "Material"]


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

    UNITS = {
        "T_sat": "K", "T_crit": "K", "rho_l": "kg/m^3", "rho_v": "kg/m^3", "c_l": "J/(kg K)", "c_v": "J/(kg K)",
        "k_l": "W/(m K)", "k_v": "W/(m K)", "L": "J/kg", "sigma": "N/m", "mu_l": "Pa s", "beta": "1/K",
        "T_melt": "K",
    }

    def __post_init__(self):
        for field in fields(self):
            if field.name == "name" or (field.name == "T_melt" and self.T_melt is None):
                continue
            value = float(getattr(self, field.name))
            object.__setattr__(self, field.name, value)
            if not 0.0 < value < float("inf"):
                raise ValueError(f"{field.name} of {self.name} must be > 0 {self.UNITS[field.name]}, got {value}")
        if self.T_sat >= self.T_crit:
            raise ValueError(f"T_sat must be below T_crit = {self.T_crit} K, got {self.T_sat} K")

    def check_melted(self, T, name):
        """Raise ``ValueError`` for a temperature ``T`` [K] below melting; the message calls it ``name``."""
        if self.T_melt is not None and T < self.T_melt:
            raise ValueError(f"{name} must be >= {self.T_melt} K, the melting point of {self.name}, got {T} K: "
                             f"temperatures are in kelvin, and {T:g} degrees Celsius are {T + 273.15:g} K")

    def with_(self, **changes):
        """A copy with some constants changed."""
        return replace(self, **changes)


# IAPWS values of saturated liquid and vapour at 101.325 kPa to three digits, c_l, L, T_crit to four; T_sat is 100
# degrees Celsius, .026 K above the boiling point at that pressure. A test compares them with CoolProp.
WATER_1ATM = Material(
    name="water at 1 atm", T_sat=373.15, T_crit=647.1, rho_l=958.0, rho_v=0.598, c_l=4216.0, c_v=2077.0, k_l=0.677,
    k_v=0.0246, L=2.257e6, sigma=0.0589, mu_l=2.82e-4, beta=7.5e-4, T_melt=273.15,
)
