"""Storage in sites: preset sites store latent heat and emit whole bubbles (the model of Li & Xiao)."""
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.equations import site_storage
from pysph_boiling.names import SchemeError
from pysph_boiling.particles import Property, host, positions
from pysph_boiling.schemes.effects.base import Column, Effect, cumulative, param, sum_over
from pysph_boiling.schemes.stages import Term
from pysph_boiling.schemes.vapour import nearest_image

__all__ = ["SiteStorage"]


@dataclass(frozen=True, kw_only=True)
class SiteStorage(Effect):
    """Superheated liquid gives its excess heat to its nearest site, which emits a bubble of ``n_emit`` particles.

    A site has one bubble at a time: an occupied site, with vapour within its radius, neither absorbs nor emits. A site
    stops absorbing when it holds the heat that vaporises its nearest particles.

    Limits: a bubble does not grow after it was emitted, and only sites make vapour.
    """

    slot: ClassVar[str] = "storage"
    title: ClassVar[str] = "storage of latent heat in sites"
    on_ranks: ClassVar[bool] = False  # particles know the index of their site, which differs between ranks
    requires: ClassVar[tuple[str, ...]] = ("phases", "preset_nucleation")
    rate: float = param(None, "1/s", "rate at which liquid gives its excess heat to a site; that of conduction to "
                                     "its 2 dim nearest neighbours if not given", low=0.0)
    n_emit: int = param(None, "-", "particles in an emitted bubble; 15 in 2-D and 20 in 3-D if not given", low=1)

    N_EMIT: ClassVar[dict] = {2: 15, 3: 20}  # tuned: bubbles of this size depart from their site

    def number(self, scene):
        """Number of particles in an emitted bubble."""
        return self.n_emit if self.n_emit is not None else self.N_EMIT[scene.dim]

    def rate_in(self, scene):
        """Rate of absorption [1/s]."""
        material, heat = scene.material, scene.effects["heat"]
        diffusivity = heat.conductivity(material.k_l) / (material.rho_l * material.c_l)
        return self.rate if self.rate is not None else 2.0 * scene.dim * diffusivity / scene.spacing**2

    def reach(self, scene):
        """Distance within which a site finds its particles [m]: the radius of a half disc or ball, plus one spacing."""
        n = self.number(scene)
        radius = math.sqrt(2.0 * n / math.pi) if scene.dim == 2 else math.cbrt(1.5 * n / math.pi)
        return max(radius + 1.0, scene.effects["preset_nucleation"].radius) * scene.spacing

    def site_properties(self, scene):
        return (
            Property("number", "-", "number of the site", "int", True),
            Property("place", "-", "index of the site with the number of this row", "int"),
            Property("Q_s", "J", "heat stored in the site (J/m in 2-D)", state=True),
            Property("occupied", "-", "1 while there is vapour within the radius of the site", "int"),
            Property("emits", "-", "1 in a step in which the site emits a bubble", "int"),
            Property("chosen", "-", "number of particles that it would emit now", "int"),
            Property("cut_r2", "m^2", "squared distance of the last chosen particle"),
            Property("cut_uid", "-", "uid of the last chosen particle", "unsigned int"),
            Property("cost", "J", "heat that vaporises the chosen particles"),
        )

    def properties(self, scene):
        return (
            Property("site", "-", "number of the nearest site; -1 if none is in reach", "int"),
            Property("site_r2", "m^2", "squared distance from the nearest site"),
            Property("paid", "J", "heat given to a site in this step"),
            Property("q_sites", "J", "heat given to sites minus heat received from them, since the start", state=True,
                     cumulative=True),
            Property("emitted", "-", "times the particle was emitted as vapour by a site", "int", True, True),
        )

    def columns(self, scene):
        return (
            cumulative("n_emitted", "-", "particles emitted as vapour by sites, since the start", "emitted"),
            Column("energy_sites", "J", "heat stored in the sites", lambda arrays, scene: sum_over(arrays, "q_sites")),
        )

    def stored(self, sites):
        return sum(float(np.sum(host(pa, "Q_s"))) for pa in sites)

    def conditions(self, scene):
        return {"phases": lambda arrays: True}  # a charged site may emit into liquid that has cooled

    def check(self, scene, arrays):
        if scene.effects["phases"].kinetic != "never":
            raise SchemeError("storage: latent heat is stored in the sites, so liquid must not store any",
                              "pass phases=PhaseChange(kinetic='never')",
                              "give --phases.kinetic never, as --mode li_xiao does")
        if len(scene.fluids) > 1:
            raise ValueError(f"storage: all liquid must be in one fluid array, got {scene.fluids}")
        for name in scene.sites:
            pa, needed = arrays[name], self.reach(scene)
            if float(pa.h.min()) * scene.kernel.radius_scale < needed * (1.0 - 1e-9):
                raise ValueError(f"sites '{name}' have too small a reach to find {self.number(scene)} particles: make "
                                 f"the array with site_array(reach={needed:.4g})")
            room = int(self.room(scene, positions(pa)).min())
            if room < self.number(scene):
                raise ValueError(f"storage.n_emit must be <= {room} for sites this close to each other, got "
                                 f"{self.number(scene)}")

    def room(self, scene, sites):
        """Number of lattice positions above each site that are in its reach and closer to it than to other sites."""
        k = math.ceil(self.reach(scene) / scene.spacing)
        lattice = np.zeros((3, (2 * k) ** scene.dim))
        lattice[:scene.dim] = (np.indices((2 * k,) * scene.dim).reshape(scene.dim, -1) - k + 0.5) * scene.spacing
        r = np.linalg.norm(lattice, axis=0)
        near = lattice.T[(r < self.reach(scene)) & (scene.up @ lattice > 0.0)]
        others = (np.linalg.norm(nearest_image(site + near[:, None] - sites, scene.period), axis=-1) for site in sites)
        return np.array([np.count_nonzero(np.argmin(distance, axis=1) == own) for own, distance in enumerate(others)])

    def prepare(self, scene, arrays):
        for name in scene.sites:
            arrays[name].number[:] = np.arange(len(arrays[name].number))

    def terms(self, scene, fluid):
        material, fluids, sites = scene.material, list(scene.fluids), list(scene.sites)
        radius = scene.effects["preset_nucleation"].radius * scene.spacing
        bubble = dict(n_emit=self.number(scene), L=material.L)
        yield Term("phases.occupied", site_storage.StorageNearest(fluid, sites, reach=self.reach(scene)))
        yield Term("phases.absorb", site_storage.StorageAbsorption(
            fluid, sites, radius=radius, rate=self.rate_in(scene), T_sat=material.T_sat, c_l=material.c_l))
        yield Term("phases.become", site_storage.StorageVapour(fluid, sites, T_sat=material.T_sat, L=material.L))
        for site in sites:
            yield Term("phases.occupied", site_storage.StorageOccupied(site, fluids, radius=radius))
            yield Term("phases.choose", site_storage.StorageChoice(site, fluids, **bubble))
            yield Term("phases.emit", site_storage.StorageEmission(site, fluids, **bubble))
