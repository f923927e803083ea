"""Scenes as tables: what is in a vessel, read from and written to files in TOML.

A file describes a scene of its own (``[vessel]``, ``[[fluids]]``, ``[[heaters]]``, ``[[obstacles]]``, ``[sites]``), or
starts from a built-in one (``scene = "geyser"`` with ``[parameters]``). Both may have ``[effects]``. Lengths are in m,
temperatures in K. docs/scenes.md explains every key.
"""
import dataclasses
from dataclasses import dataclass, field
from pathlib import Path

from pysph_boiling import rooms
from pysph_boiling.names import SchemeError, nearest
from pysph_boiling.schemes.effects import EFFECTS, check_parameters, param

__all__ = [
    "CylinderSize", "Description", "Fluid", "HeatedPart", "Obstacle", "SceneFile", "SceneFileError", "Sites", "Vessel",
    "effect_changes", "effects_from", "one_of", "parameters_from", "read_scene", "scene_text", "table",
]

DEFAULT = "default"  # a parameter of an effect that has its default, which may be none: TOML has no such value
TABLES = ("parameters", "vessel", "fluids", "heaters", "obstacles", "sites", "effects")


class SceneFileError(SchemeError):
    """A scene file that is wrong, as an error whose message names the file and the key."""

    def __init__(self, message):
        ValueError.__init__(self, message)
        self.typed = message


def table(cls, values, where):
    """An instance of the dataclass ``cls`` from a table of a file; errors name ``where`` in the file."""
    known = [spec.name for spec in dataclasses.fields(cls) if spec.init]
    if not isinstance(values, dict):
        raise SceneFileError(f"{where} must be a table with {', '.join(known)}, got {values!r}")
    for name in values:
        if name not in known:
            raise SceneFileError(f"{where} has no key '{name}'{nearest(name, known)} (there are: {', '.join(known)})")
    try:
        made = cls(**values)
        check_parameters(made, where)
    except SceneFileError:
        raise
    except (ValueError, TypeError) as error:
        text = str(error)
        raise SceneFileError(text if text.startswith(where) else f"{where}: {text}") from error
    return made


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A sphere, in 2-D a disc."""

    centre: list
    radius: float


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder along an axis, from the middle of its start."""

    start: list
    radius: float
    height: float
    axis: str = "z"


def one_of(part, names, where):
    """The name of the only one of some keys of a table that is given; ``SceneFileError`` for none and for several."""
    given = [name for name in names if getattr(part, name) is not None]
    if len(given) != 1:
        raise SceneFileError(f"{where}: give one of {', '.join(names)}, got {' and '.join(given) or 'none'}")
    return given[0]


def _corners(values, where):
    if not isinstance(values, (list, tuple)) or len(values) != 2:
        raise SceneFileError(f"{where}: box must be two corners [[x, y, z], [x, y, z]] in m, got {values!r}")
    return values


@dataclass(frozen=True, kw_only=True)
class Region:
    """A part of space: a box between two corners, a sphere, a cylinder, or a mesh in a file."""

    box: list | None = None
    sphere: dict | None = None
    cylinder: dict | None = None
    mesh: str | None = None
    scale: float = param(1.0, "-", "metres per unit of length of the mesh", above=0.0)

    def shape(self, dim, spacing, folder, where) -> rooms.Shape:
        """The :class:`~pysph_boiling.rooms.Shape`; a mesh is in a file in ``folder``, unless its path is absolute."""
        kind = one_of(self, ("box", "sphere", "cylinder", "mesh"), where)
        if dim == 2 and kind in ("cylinder", "mesh"):
            raise SceneFileError(f"{where}: a {kind} is 3-D, and the scene has dim = 2: use a box or a sphere")
        try:
            if kind == "box":
                lower, upper = _corners(self.box, where)
                return rooms.box(lower, upper, dim)
            if kind == "sphere":
                made = table(Ball, self.sphere, f"{where}.sphere")
                return rooms.ball(made.centre, made.radius, dim)
            if kind == "cylinder":
                made = table(Cylinder, self.cylinder, f"{where}.cylinder")
                return rooms.cylinder(made.start, made.radius, made.height, made.axis)
            from pysph_boiling.meshes import mesh_shape

            return mesh_shape(folder / self.mesh, spacing=spacing, scale=self.scale)
        except SceneFileError:
            raise
        except (ValueError, TypeError) as error:
            raise SceneFileError(f"{where}: {error}") from error


@dataclass(frozen=True, kw_only=True)
class Vessel:
    """The inside of the vessel. A box has its lower corner at the origin, a cylinder the middle of its floor.

    ``box`` is the inner size [m], and ``cylinder`` has a radius and a height [m]; a sphere touches the origin with its
    lowest point.
    """

    box: list | None = None
    cylinder: dict | None = None
    sphere: float = param(None, "m", "inner radius", above=0.0)
    mesh: str | None = None
    scale: float = param(1.0, "-", "metres per unit of length of the mesh", above=0.0)
    lid: bool = param(True, "-", "vapour comes back as liquid; without a lid it leaves")

    KINDS = ("box", "cylinder", "sphere", "mesh")


@dataclass(frozen=True, kw_only=True)
class CylinderSize:
    """Radius and height of a vessel."""

    radius: float
    height: float


@dataclass(frozen=True, kw_only=True)
class Fluid:
    """A block of liquid: a share of the vessel's volume, on top of the blocks before it, or a box."""

    fill: float = param(None, "-", "share of the inner volume", above=0.0, high=1.0)
    box: list | None = None
    temperature: float = param(None, "K", "temperature at the start; 2 K below saturation if not given",
                               temperature=True, above=0.0)


@dataclass(frozen=True, kw_only=True)
class HeatedPart(Region):
    """A part of the walls and obstacles that heats: all below a height over the lowest point, or what a region covers.
    """

    below: float = param(None, "m", "height over the lowest point inside, below which walls are heated", above=0.0)
    temperature: float = param(None, "K", "temperature of the heater", above=0.0, temperature=True)
    power: float = param(None, "W", "power of the heater, before the factor A (W/m in 2-D)", above=0.0)


@dataclass(frozen=True, kw_only=True)
class Obstacle(Region):
    """A solid body in the vessel."""


@dataclass(frozen=True, kw_only=True)
class Sites:
    """Preset nucleation sites: a number of them on the heaters, or a list of places."""

    number: int = param(None, "-", "number of sites on the heaters", low=1)
    pattern: str = param("random", "-", "places on the heaters", choices=("random", "regular"))
    places: list | None = None
    smallest_cavity: float = param(4e-6, "m", "smallest radius of the cavities; 0 makes all sites alike, active at "
                                   "saturation", low=0.0)
    largest_cavity: float = param(6e-6, "m", "largest radius of the cavities; 0 for none", low=0.0)
    embryo: float = param(0.25, "-", "smallest radius of the embryo that a bubble leaves, in radii of its cavity",
                          above=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class Description:
    """A scene: the vessel and what is in it."""

    vessel: Vessel
    fluids: tuple[Fluid, ...]
    heaters: tuple[HeatedPart, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    sites: Sites | None = None

    def table(self):
        """The description as a table for a file; what is not given, and defaults, are left out."""
        made = {}
        for spec in dataclasses.fields(self):
            value = getattr(self, spec.name)
            if isinstance(value, tuple) and value:
                made[spec.name] = [_plain(one) for one in value]
            elif isinstance(value, tuple):
                continue
            elif value is not None:
                made[spec.name] = _plain(value)
        return made


def _plain(instance):
    return {spec.name: _rounded(getattr(instance, spec.name)) for spec in dataclasses.fields(instance)
            if getattr(instance, spec.name) != spec.default}


def _rounded(value):
    """A value without the round-off of its last digits, for a file that people read."""
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(one) for one in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


@dataclass(frozen=True, kw_only=True)
class SceneFile:
    """The content of a scene file. ``description`` is ``None`` if it starts from the built-in scene ``scene``."""

    path: Path
    name: str
    scene: str | None = None
    description: Description | None = None
    material: str | None = None
    pressure: float | None = None  # Pa
    parameters: dict = field(default_factory=dict)
    effects: dict = field(default_factory=dict)


PARTS = {"vessel": Vessel, "fluids": Fluid, "heaters": HeatedPart, "obstacles": Obstacle, "sites": Sites}
MANY = ("fluids", "heaters", "obstacles")


def read_scene(path, parameters):
    """The :class:`SceneFile` in a file.

    ``parameters(scene)`` returns the names of the parameters of a built-in scene, or, for ``None``, of a described one.
    Errors: ``ValueError`` that names the file and what is wrong in it, ``OSError`` for a file that cannot be read.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    path = Path(path)
    try:
        content = tomlkit.parse(path.read_text(encoding="utf-8")).unwrap()
    except (TOMLKitError, UnicodeDecodeError) as error:
        raise SceneFileError(f"{path} is not TOML: {error}") from error
    scene, described = content.get("scene"), "vessel" in content
    if described == (scene is not None):
        raise SceneFileError(f"{path}: a scene needs a table [vessel], or scene = \"NAME\" of a built-in one to start "
                             "from" + (", not both" if described else ""))
    own = parameters(scene)
    keys = ["name", "material", "pressure", *(own if described else ["scene"]),
            *(TABLES[1:] if described else ("parameters", "effects"))]
    for key in content:
        if key not in keys:
            raise SceneFileError(f"{path}: there is no key '{key}'{nearest(key, keys)} (there are: {', '.join(keys)})")
    name = content.get("name", path.stem)
    if not isinstance(name, str) or not name.replace("_", "").replace("-", "").isalnum():
        raise SceneFileError(f"{path}: name must have letters, digits, '-' and '_' only, since files are called so, "
                             f"got {name!r}")
    if described:
        given = {key: value for key, value in content.items() if key in own}
    else:
        given = content.get("parameters", {})
        for key in given:
            if key not in own:
                raise SceneFileError(f"{path}: parameters: {scene} has no parameter '{key}'{nearest(key, own)}")
    material = content.get("material")
    if not isinstance(material, (str, type(None))):
        raise SceneFileError(f"{path}: material must be the name of a fluid, got {material!r}")
    pressure = content.get("pressure")
    if isinstance(pressure, bool) or not isinstance(pressure, (int, float, type(None))):
        raise SceneFileError(f"{path}: pressure must be a number in Pa, got {pressure!r}")
    parts = {}
    if described:
        for key, cls in PARTS.items():
            if key in content and key in MANY:
                if not isinstance(content[key], list):
                    raise SceneFileError(f"{path}: write [[{key}]], since there may be several")
                parts[key] = tuple(table(cls, one, f"{path}: {key}[{number}]")
                                   for number, one in enumerate(content[key], 1))
            elif key in content:
                parts[key] = table(cls, content[key], f"{path}: {key}")
        if not parts.get("fluids"):
            raise SceneFileError(f"{path}: there is no fluid: add [[fluids]] with fill, a share of the vessel's volume")
    return SceneFile(path=path, name=name, scene=scene, parameters=given, effects=content.get("effects", {}),
                     description=Description(**parts) if described else None, material=material,
                     pressure=pressure)


def parameters_from(file, cls):
    """The parameters that a file gives, for the dataclass ``cls`` of a scene's parameters, which checks them."""
    try:
        cls(**file.parameters)
    except (ValueError, TypeError) as error:
        raise SceneFileError(f"{file.path}: {str(error).removeprefix('scene.')}") from error
    return dict(file.parameters)


def effects_from(file, effects, slots):
    """The ``effects`` (slot -> effect), as a new dict, after those of a file: a table each, or true or false."""
    made = dict(effects)
    if not isinstance(file.effects, dict):
        raise SceneFileError(f"{file.path}: effects must be a table, got {file.effects!r}")
    for slot, values in file.effects.items():
        here = f"{file.path}: effects.{slot}"
        if slot not in slots:
            raise SceneFileError(f"{file.path}: there is no effect '{slot}'{nearest(slot, slots)} (there are: "
                                 f"{', '.join(slots)})")
        if values is False:
            made.pop(slot, None)
            continue
        values = {} if values is True else values
        if not isinstance(values, dict):
            raise SceneFileError(f"{here} must be a table of parameters, true or false, got {values!r}")
        cls = type(made[slot]) if slot in made else EFFECTS[slot][0]
        usual = {spec.name: spec.default for spec in dataclasses.fields(cls) if "unit" in spec.metadata}
        for name in values:
            if name not in usual:
                raise SceneFileError(f"{here} has no parameter '{name}'{nearest(name, usual)} (there are: "
                                     f"{', '.join(usual)})")
        values = {name: usual[name] if value == DEFAULT else tuple(value) if isinstance(value, list) else value
                  for name, value in values.items()}
        try:
            made[slot] = made[slot].replaced(**values) if slot in made else cls(**values)
        except (ValueError, TypeError) as error:
            raise SceneFileError(f"{here}: {str(error).removeprefix(f'{slot}.')}") from error
    return made


def effect_changes(before, after):
    """The table ``effects`` of a scene file that turns the effects ``before`` (slot -> effect) into those ``after``."""
    changed = {slot: False for slot in before if slot not in after}
    for slot, effect in after.items():
        old = before.get(slot)
        values = {}
        for spec in dataclasses.fields(effect):
            value = getattr(effect, spec.name)
            if "unit" in spec.metadata and value != getattr(old, spec.name, spec.default):
                values[spec.name] = DEFAULT if value is None else list(value) if isinstance(value, tuple) else value
        if values:
            changed[slot] = values
        elif old is None:
            changed[slot] = True
    return changed


def scene_text(content, comments):
    """A scene as the text of a TOML file.

    ``content`` is a nested dict, and ``comments`` maps the dotted names of keys to what is said behind them.
    """
    import tomlkit

    def filled(into, values, prefix):
        for key, value in values.items():
            name = f"{prefix}{key}"
            if isinstance(value, dict):
                into.add(key, filled(tomlkit.table(), value, f"{name}."))
            elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
                tables = tomlkit.aot()
                for one in value:
                    tables.append(filled(tomlkit.table(), one, f"{name}."))
                into.add(key, tables)
            else:
                item = tomlkit.item(value)
                if name in comments:
                    item.comment(comments[name])
                into.add(key, item)
        return into

    return tomlkit.dumps(filled(tomlkit.document(), content, ""))
