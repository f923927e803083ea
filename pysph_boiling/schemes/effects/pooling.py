"""Pooled latent heat: latent heat stored around a bubble is pooled, and vaporises the liquid nearest to its centre."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.device import Subset, values
from pysph_boiling.equations import pooling
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import NO_BUBBLE, Property, fill
from pysph_boiling.schemes.effects.base import Effect, Rule
from pysph_boiling.schemes.stages import Term
from pysph_boiling.schemes.vapour import Vapour, nearest_image

__all__ = ["LatentPooling", "Pools"]


@dataclass(frozen=True, kw_only=True)
class LatentPooling(Effect):
    """Latent heat stored around a bubble is pooled, and vaporises the liquid nearest to the bubble's centroid.

    Liquid in transition within the kinetic radius of vapour belongs to the bubble of the nearest vapour. All of it is
    at saturation, so heat may be exchanged within it. Without pooling each particle has to collect its own latent heat,
    and a bubble in superheated liquid grows dendrites instead of a disc or a sphere (``benchmarks/growth.py``).

    Limits: in a periodic domain a bubble must be shorter than half a period.
    """

    slot: ClassVar[str] = "pooling"
    title: ClassVar[str] = "pooled latent heat"
    requires: ClassVar[tuple[str, ...]] = ("bubbles",)
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: chosen["phases"].kinetic == "site" and chosen["phases"].vapour_as_site,
        "bubbles grow by the heat of the liquid around them", "vapour does not act as a site, so bubbles do not grow")

    def properties(self, scene):
        return (
            Property("joined", "-", "bubble for which liquid in transition stores its latent heat; NO_BUBBLE elsewhere",
                     "unsigned int"),
            Property("pooled", "J/kg", "enthalpy given by the pool; negative without a pool"),
        )

    def constants(self, scene):
        return {"relabel": 0.0}

    def hooks(self, scene):
        pools = Pools(scene)
        return {"bubbles.start": pools.begin, "bubbles.interface": pools.share}

    def terms(self, scene, fluid):
        material = scene.material
        if scene.effects["phases"].grows():
            yield Term("heat.interface", pooling.PoolingInterface(fluid, None, spacing=scene.spacing))
        yield Term("bubbles.interface", pooling.PoolingJoin(
            fluid, list(scene.fluids), radius=scene.bubble_radius(scene.effects["phases"].kinetic_radius)))
        yield Term("bubbles.pool", pooling.PoolingShare(
            fluid, None, T_sat=material.T_sat, L=material.L, c_v=material.c_v))


class Pools:
    """Computes what each particle gets from the pool of its bubble, and requests new labels if there is new vapour.

    A pool Q = sum m e completes the latent heat of as many of its particles as possible, in the order of their distance
    from the bubble's centroid (ties: smaller uid). The others share the rest equally; if there are none, the excess
    stays with the new vapour. A second pass over the bubbles, which only renews the labels, changes no pool.
    """

    def __init__(self, scene):
        self.scene, self.again = scene, False

    def begin(self, arrays):
        """Begin a pass over the bubbles; it is the second one of a step if new labels were requested."""
        self.again = any(pa.relabel[0] > 0.0 for pa in arrays)

    def share(self, arrays):
        """Set the property ``pooled``."""
        (pa,) = arrays  # as the labels demand
        fill(pa, "pooled", -1.0)
        members = Subset(pa, values(pa, "joined") != NO_BUBBLE)
        if ranks.anywhere(len(members)) and not self.again:
            vapour, L = Vapour(arrays), self.scene.material.L
            centroid = vapour.places(self.scene.period)[1]
            index = np.searchsorted(vapour.label, members.get("joined"))
            place = np.stack([members.get(name) for name in ("x", "y", "z")], -1)
            # rounded, since the last digits of a centroid depend on the order of its sum, and lattices have many ties
            distance2 = np.round(np.sum(nearest_image(place - centroid[index], self.scene.period) ** 2, axis=1)
                                 / self.scene.spacing**2, 9)
            index, own = ranks.gather(index)  # a pool belongs to a whole bubble, on all ranks
            distance2, uid, mass, enthalpy = (ranks.gather(part)[0] for part in (
                distance2, *(members.get(name) for name in ("uid", "m", "e"))))
            order = np.lexsort((uid, distance2, index))
            pooled = np.empty(len(order))
            for pool in np.split(order, np.flatnonzero(np.diff(index[order])) + 1):
                m, e = mass[pool], enthalpy[pool]
                heat, price = float(np.sum(m * e)), np.cumsum(m * L)
                n = int(np.searchsorted(price, heat, side="right"))
                if n == len(pool):
                    pooled[pool] = heat / np.sum(m)
                else:
                    pooled[pool[:n]] = L
                    pooled[pool[n:]] = (heat - (price[n - 1] if n else 0.0)) / np.sum(m[n:])
                if n:
                    pa.relabel[0] = 1.0
            members.put("pooled", pooled[own])
