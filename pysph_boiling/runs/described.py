"""DescribedScene: the application of a scene that is described by a table: a vessel, and what is in it.

:mod:`pysph_boiling.runs.scene_file` has the tables; ``pysph-boiling run FILE`` and the scene ``vessel`` use it.
"""
import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pysph_boiling.cavities import activation_superheat, cavity_radii
from pysph_boiling.checks import require
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import fluid_array, positions, site_array, surface_places, wall_array
from pysph_boiling.rooms import Room, ball, box, cylinder, wall_points
from pysph_boiling.runs.application import SceneApplication, SceneParameters
from pysph_boiling.runs.scene_file import (
    PARTS,
    CylinderSize,
    SceneFile,
    SceneFileError,
    effect_changes,
    one_of,
    table,
)
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BoxContainer, CylinderContainer, DistanceContainer, Heater, param
from pysph_boiling.schemes.recipes import ADHESION, K_BUBBLE, boiling_effects

__all__ = ["DescribedParameters", "DescribedScene", "described_content"]

SUBCOOLING = 2.0  # K below saturation at which liquid starts if its temperature is not given
REACH = 2.4  # spacings, radius of action of a site
FARTHEST_OUT = 0.5  # spacings that a particle may be outside at the end


@dataclass(frozen=True, kw_only=True)
class DescribedParameters(SceneParameters):
    """The parameters of a scene in a file that are not part of a table."""

    duration: float = param(2.0, "s", "simulated time", above=0.0, may_change=True)
    dim: int = param(3, "-", "dimension", choices=(2, 3))
    spacing: float = param(0.004, "m", "particle spacing", above=0.0)
    time_scaling: float = param(800.0, "-", "A: factor by which heat is faster relative to motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")


class DescribedScene(SceneApplication):
    """A vessel of any shape with liquid, heaters, obstacles and sites, as a :class:`Description` says.

    Subclasses override ``described(parameters)``. Walls are particles around the room that is left for the fluid; the
    container is the vessel itself where it is a box or a cylinder without obstacles, and the signed distance otherwise.
    """

    Parameters = DescribedParameters
    title = "scene"

    def described(self, p):
        """The :class:`~pysph_boiling.runs.scene_file.Description` of this scene."""
        return self.file.description

    def where(self, what):
        """What errors say of a part of the description."""
        return f"{self.file.path}: {what}" if self.file else what

    @property
    def folder(self):
        """The folder in which the files of meshes lie."""
        return self.file.path.parent if self.file else Path()

    # --- geometry -----------------------------------------------------------------------------------------------------

    def geometry(self, p):
        """(room, walls (n, 3) [m], container): made once for each set of parameters."""
        if self._made is None or self._made[0] != p:
            self._made = p, self.make_geometry(p, self.described(p))
        return self._made[1]

    _made = None

    def make_geometry(self, p, description):
        vessel, dim = description.vessel, p.dim
        kind = one_of(vessel, vessel.KINDS, self.where("vessel"))
        if dim == 2 and kind in ("mesh", "sphere"):
            raise SceneFileError(f"{self.where('vessel')}: a {kind} is 3-D, and dim is 2")
        try:
            inside, container = getattr(self, f"{kind}_vessel")(vessel, dim)
        except (ValueError, TypeError) as error:
            raise SceneFileError(f"{self.where('vessel')}: {error}") from error
        obstacles = [one.shape(dim, p.spacing, self.folder, self.where(f"obstacles[{number}]"))
                     for number, one in enumerate(description.obstacles, 1)]
        if kind == "mesh":
            from pysph_boiling.meshes import mesh_room, mesh_shape

            path = self.folder / vessel.mesh
            room = mesh_room(path, spacing=p.spacing, scale=vessel.scale)  # which checks the mesh
            inside = mesh_shape(path, spacing=p.spacing, scale=vessel.scale) if obstacles else None
        if inside is not None:
            room = Room.of(inside.without(obstacles), spacing=p.spacing)
        walls = wall_points(room, spacing=p.spacing)
        if kind in ("box", "cylinder"):  # open at the top, where the container is the lid
            walls = walls[walls[:, dim - 1] < room.upper[dim - 1]]
        return room, walls, container if container and not obstacles else DistanceContainer(room=room)

    def box_vessel(self, vessel, dim):
        inside = box([0.0] * dim, vessel.box, dim)
        return inside, BoxContainer(lower=tuple(inside.lower), upper=tuple(inside.upper))

    def cylinder_vessel(self, vessel, dim):
        size = table(CylinderSize, vessel.cylinder, self.where("vessel.cylinder"))
        inside = cylinder((0.0, 0.0, 0.0), size.radius, size.height) if dim == 3 else box(
            (-size.radius, 0.0), (size.radius, size.height), 2)
        return inside, CylinderContainer(radius=size.radius, top=size.height)

    def sphere_vessel(self, vessel, dim):
        return ball((0.0, 0.0, vessel.sphere), vessel.sphere), None

    def mesh_vessel(self, vessel, dim):
        return None, None

    # --- what a scene overrides ---------------------------------------------------------------------------------------

    def create_scheme(self):
        """A scheme for the options of the command line; the description may not be known yet."""
        return BoilingScheme(["fluid"], ["wall"], dim=3, spacing=self.parameters.spacing)

    def make_scheme(self, p):
        description, material = self.described(p), self.material
        _, _, container = self.geometry(p)
        for part, several in (("fluids", description.fluids), ("heaters", description.heaters)):
            for number, one in enumerate(several, 1):
                if one.temperature is not None:
                    material.check_melted(one.temperature, self.where(f"{part}[{number}].temperature"))
        sites = description.sites
        effects = boiling_effects(
            time_scaling=p.time_scaling, own_cavities=sites is not None and sites.smallest_cavity > 0.0,
            embryo=sites.embryo if sites else 1.0, seed=p.seed, adhesion=ADHESION[p.dim], k_bubble=K_BUBBLE[p.dim],
            T_feed=self.temperature(description.fluids[0]), lid=description.vessel.lid)
        if sites is None:
            for slot in ("preset_nucleation", "adhesion"):
                del effects[slot]
        heater = self.heater(p, description)
        return BoilingScheme(["fluid"], ["wall"], dim=p.dim, spacing=p.spacing, sites=["sites"] if sites else [],
                             material=material, container=container, **({"heater": heater} if heater else {}),
                             **effects)

    def temperature(self, block):
        """Temperature of a block of liquid at the start [K]."""
        return self.material.T_sat - SUBCOOLING if block.temperature is None else block.temperature

    def heated(self, p, description):
        """For each heater the mask (n,) of the wall particles that belong to it, the later ones first."""
        room, walls, _ = self.geometry(p)
        first = np.flatnonzero(room(walls) > -p.spacing)
        feet = room.moved(walls[first], 0.0)
        taken, masks = np.zeros(len(walls), bool), []
        for number, heater in list(enumerate(description.heaters, 1))[::-1]:
            where, mask = self.where(f"heaters[{number}]"), np.zeros(len(walls), bool)
            if heater.below is not None:
                if any(getattr(heater, kind) is not None for kind in ("box", "sphere", "cylinder", "mesh")):
                    raise SceneFileError(f"{where}: give below or a region, not both")
                mask[first] = feet[:, p.dim - 1] < room.bottom + heater.below + 1e-6 * p.spacing
            elif heater.mesh is not None:
                from pysph_boiling.meshes import patch_mask

                mask[first] = patch_mask(self.folder / heater.mesh, feet, spacing=p.spacing, scale=heater.scale)
            else:
                region = heater.shape(p.dim, p.spacing, self.folder, where)
                mask[first] = region.distance(feet) > -1e-3 * p.spacing
            mask &= ~taken
            if not mask.any():
                raise SceneFileError(f"{where} covers no wall: walls lie between {np.round(room.lower, 4)[:p.dim]} and "
                                     f"{np.round(room.upper, 4)[:p.dim]} m")
            taken |= mask
            masks.insert(0, mask)
        return masks

    def heater(self, p, description):
        """The effect of the heaters; ``None`` without any."""
        heaters = description.heaters
        if not heaters:
            return None
        for number, one in enumerate(heaters, 1):
            if (one.temperature is None) == (one.power is None):
                raise SceneFileError(f"{self.where(f'heaters[{number}]')}: give a temperature [K] or a power [W]")
        if len({one.power is None for one in heaters}) > 1:
            raise SceneFileError(f"{self.where('heaters')}: all must have a temperature, or all a power")
        if heaters[0].power is None:
            return Heater(temperature=heaters[0].temperature)
        fluxes = [one.power / (mask.sum() * p.spacing**(p.dim - 1))
                  for one, mask in zip(heaters, self.heated(p, description))]
        if max(fluxes) > min(fluxes) * (1.0 + 1e-9):
            told = ", ".join(f"{flux:.4g}" for flux in fluxes)
            raise SceneFileError(f"{self.where('heaters')}: heaters with a power must have equal fluxes, got {told} "
                                 "W/m^2: give them temperatures")
        return Heater(flux=fluxes[0])

    def make_particles(self, p, scheme):
        description = self.described(p)
        room, walls, _ = self.geometry(p)
        masks = self.heated(p, description)
        T_heater = np.zeros(len(walls))
        for mask, one in zip(masks, description.heaters):  # 0: the temperature of the effect, that of the first one
            if one.temperature != description.heaters[0].temperature:
                T_heater[mask] = one.temperature
        hot = np.any(masks, axis=0) if masks else None
        common = dict(spacing=p.spacing, dim=p.dim, rho0=scheme.rho0, hdx=scheme.hdx)
        places, self.blocks = self.fluid_places(p, description, room)
        places[:, :p.dim] += 0.01 * p.spacing * np.random.default_rng(p.seed).uniform(-1.0, 1.0, (len(places), p.dim))
        made = [fluid_array(places, **common),
                wall_array(walls, kernel=scheme.kernel, heated=hot, T_heater=T_heater, jitter=scheme.wall_jitter,
                           **common)]
        if description.sites is not None:
            made.append(self.make_sites(p, description.sites, room, walls[hot] if masks else walls[:0]))
        return made

    def fluid_places(self, p, description, room):
        """(places (n, 3) [m], block (n,)): where the fluid starts, from the bottom to the top, and in which block."""
        free = room.places(p.spacing)
        random = np.random.default_rng([p.seed, 2])
        layer = np.round(free[:, p.dim - 1] / p.spacing, 3)
        free = free[np.lexsort((random.random(len(free)), layer))]  # the last layer is filled at random places
        block, cell = np.full(len(free), -1), p.spacing**p.dim
        for number, one in enumerate(description.fluids):
            where = self.where(f"fluids[{number + 1}]")
            if (one.fill is None) == (one.box is None):
                raise SceneFileError(f"{where}: give fill, a share of the inner volume, or box, two corners")
            empty = block < 0
            if one.box is not None:
                try:
                    chosen = np.flatnonzero(empty & box(*one.box, p.dim).contains(free))
                except (ValueError, TypeError) as error:
                    raise SceneFileError(f"{where}: {error}") from error
            else:
                wanted = round(one.fill * room.volume / cell)
                chosen = np.flatnonzero(empty)[:wanted]
                if len(chosen) < wanted:
                    raise SceneFileError(f"{where}: fill = {one.fill} needs {wanted} particles, and the vessel has "
                                         f"room for {len(chosen)} more at the start, since walls keep a distance: use "
                                         "less")
            if not len(chosen):
                raise SceneFileError(f"{where} has no room for a particle at a spacing of {p.spacing:g} m")
            block[chosen] = number
        filled = block >= 0
        return free[filled], block[filled]

    def make_sites(self, p, sites, room, heated):
        """The array of nucleation sites."""
        where = self.where("sites")
        if (sites.number is None) == (sites.places is None):
            raise SceneFileError(f"{where}: give number, of sites on the heaters, or places, a list of [x, y, z] in m")
        if sites.places is not None:
            points = np.zeros((len(sites.places), 3))
            try:
                points[:, :p.dim] = np.asarray(sites.places, float)
            except ValueError as error:
                raise SceneFileError(f"{where}: places must be lists of {p.dim} lengths in m: {error}") from error
            off = np.abs(room(points)) > p.spacing
            if off.any():
                raise SceneFileError(f"{where}: the place {points[off][0, :p.dim].tolist()} m is farther than a "
                                     "spacing from a wall")
        elif not len(heated):
            raise SceneFileError(f"{where}: number puts sites on heaters, and there are none: add [[heaters]], or give "
                                 "places")
        else:
            try:
                points = surface_places(sites.number, room.moved(heated, 0.0), dim=p.dim, pattern=sites.pattern,
                                        seed=p.seed)
            except ValueError as error:
                raise SceneFileError(f"{where}: {error}") from error
        activation = 0.0
        if sites.smallest_cavity > 0.0:
            radii = cavity_radii(len(points), smallest=sites.smallest_cavity, largest=sites.largest_cavity or math.inf,
                                 seed=[p.seed, 1])
            activation = activation_superheat(radii, self.material)
        return site_array(points, reach=REACH * p.spacing, spacing=p.spacing, activation=activation)

    def start_temperature(self, p):
        return np.array([self.temperature(one) for one in self.described(p).fluids])

    def start(self, arrays, p, scheme):
        fluid = arrays["fluid"]
        scheme.set_temperature(fluid, self.start_temperature(p)[self.blocks[fluid.uid]])

    def facts(self):
        p, scheme = self.parameters, self.scheme
        room, _, _ = self.geometry(p)
        unit = f"m^{p.dim}"
        facts = {"inner volume": (room.volume, unit),
                 "volume of the liquid at the start": (len(self.blocks) * p.spacing**p.dim, unit),
                 "t* = sqrt(dx/g)": (scheme.scene().fall_time, "s")}
        if "heat" in scheme.effects:
            facts["A (heat relative to motion)"] = (scheme.effects["heat"].time_scaling, "-")
        return facts

    def check_from(self, p):
        return p.duration

    def at_end(self):
        """Also how far the outermost particle is outside [spacings]."""
        room, _, _ = self.geometry(self.parameters)
        outside = max((-float(room(positions(pa)[:pa.get_number_of_particles(True)]).min())
                       for pa in self.scheme.arrays if pa.get_number_of_particles(True)), default=-math.inf)
        return super().at_end() | {"outside": ranks.largest(outside) / self.parameters.spacing}

    def check_final(self):
        outside = self.final["outside"]
        require(outside <= FARTHEST_OUT, f"a particle is {outside:.2f} spacings outside the vessel; it may be at most "
                f"{FARTHEST_OUT}")

    def draw_water(self):
        """None of a room of any shape: the surface view draws a box or a round vessel around it."""
        return [] if isinstance(self.scheme.effects.get("container"), DistanceContainer) else super().draw_water()

    def scene_name(self):
        return self.file.name if self.file else super().scene_name()

    def settings_of_scene(self):
        if self.file is None:  # it follows from the parameters
            return {}
        found = self.described(self.parameters).table()
        return {part: found.get(part) for part in PARTS}

    def scene_content(self):
        p = self.parameters
        names = [spec.name for spec in dataclasses.fields(DescribedParameters)]
        return described_content(self, self.described(p), {name: getattr(p, name) for name in names})


def described_content(application, description, parameters):
    """The content of a scene file for an application whose scene a description says, in ``parameters`` of a file.

    Effects are written where they differ from those of a described scene with the same description.
    """
    p = DescribedParameters(**parameters)
    plain = DescribedScene(file=SceneFile(path=Path(), name="scene", description=description))
    plain.material = application.material
    usual = {slot: effect for slot, effect in plain.make_scheme(p).effects.items() if slot != "container"}
    effects = {slot: effect for slot, effect in application.scheme.effects.items() if slot != "container"}
    changed = effect_changes(usual, effects)
    given = {spec.name: getattr(p, spec.name) for spec in dataclasses.fields(p)}
    return {**{name: value for name, value in given.items() if value is not None}, **description.table(),
            **({"effects": changed} if changed else {})}
