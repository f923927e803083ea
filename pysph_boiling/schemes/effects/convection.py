"""Convection: warm liquid rises."""
from dataclasses import dataclass
from typing import ClassVar

from pysph_boiling.device import counted, summed, values
from pysph_boiling.equations import convection
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.schemes.effects.base import Effect, Rule, param
from pysph_boiling.schemes.integrator import set_constant
from pysph_boiling.schemes.stages import Term

__all__ = ["Convection"]


@dataclass(frozen=True, kw_only=True)
class Convection(Effect):
    """Buoyancy of warm liquid (Boussinesq), or the paper's force along the temperature gradient.

    Limits: a gradient of a field is balanced by a pressure, so the second form only causes convection rolls where it is
    limited to ``|g|`` (measured over a base at +70 K: no rolls at a gain of .01, rolls of 5 mm/s at .3).
    """

    slot: ClassVar[str] = "convection"
    title: ClassVar[str] = "convection of liquid"
    requires: ClassVar[tuple[str, ...]] = ("heat", "density")
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: "phases" not in chosen and facts.g > 0.0,
        "warm liquid rises", "bubbles stir more than warm liquid does")
    form: str = param("boussinesq", "-", "form of the force", choices=("boussinesq", "gradient"))
    beta: float = param(None, "1/K", "form 'boussinesq': thermal expansion coefficient; the material's if not given",
                        low=0.0)
    T_ref: float = param(None, "K", "form 'boussinesq': neutral temperature; the mean of the liquid if not given",
                         above=0.0, temperature=True)
    gain: float = param(0.3, "-", "form 'gradient': acceleration over |g| for 1 K across a spacing, limited to 1; "
                        "tuned", low=0.0)

    def warnings(self, scene, dt):
        if scene.g == 0.0:
            yield "convection has no effect without gravity"

    def properties(self, scene):
        if self.form == "boussinesq":
            return ()
        return tuple(Property(f"gT{axis}", "K/m", "temperature gradient of the liquid") for axis in "xyz")

    def constants(self, scene):
        if self.form == "gradient":
            return {}
        return {"convection_T": scene.material.T_sat if self.T_ref is None else self.T_ref}

    def hooks(self, scene):
        k_liquid_min = scene.effects["heat"].k_liquid_min(scene.material)

        def mean_temperature(arrays):
            wet = [values(pa, "k") >= k_liquid_min for pa in arrays]
            n = ranks.total(sum(map(counted, wet)))
            if n:
                mean = ranks.total(sum(summed(values(pa, "T"), where) for pa, where in zip(arrays, wet))) / n
                for pa in arrays:
                    set_constant(pa, "convection_T", mean)

        return {"heat.update": mean_temperature} if self.form == "boussinesq" and self.T_ref is None else {}

    def terms(self, scene, fluid):
        k_liquid_min = scene.effects["heat"].k_liquid_min(scene.material)
        if self.form == "boussinesq":
            beta = scene.material.beta if self.beta is None else self.beta
            yield Term("forces.sum", convection.ConvectionBoussinesq(
                fluid, None, beta=beta, k_liquid_min=k_liquid_min, **dict(zip(("gx", "gy", "gz"), scene.gravity))))
        else:
            yield Term("forces.sum", convection.ConvectionGradient(
                fluid, list(scene.fluids), gain=self.gain * scene.g * scene.spacing, largest=scene.g, rho0=scene.rho0,
                k_liquid_min=k_liquid_min))
