"""A vessel as the scene declares it: its cavity, its opening, what stands in it; what is missing is named."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from replay import words
from replay.effects.declaring import Declaration
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.models.outflow import Stream
from replay.effects.models.sliced import SlicedCavity, tilt_of, volume_kept
from replay.effects.output import WATERY, EffectEvent, FloatArray, Liquid, vector_of
from replay.effects.spans import BoolArray
from replay.errors import EffectError, PlanError
from sessions.errors import SessionError
from sessions.input_files import is_number
from sessions.model.scene import Scene, SceneBody
from sessions.scene_files.scene_meshes import INSTRUMENT_FACES

if TYPE_CHECKING:
    from sessions.glassware.instrument import Cavity

M3_PER_ML = 1e-6
"""Cubic metres in a millilitre."""


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A round vessel in closed form (`replay.effects.models.sliced`); ``down`` (n, 3): gravity in its frame."""

    radius: float
    height: float
    lip: FloatArray  # (3,)
    opening: FloatArray  # (3,)
    opening_radius: float

    @property
    def brim_ml(self) -> float:
        """Volume of the upright vessel."""
        return math.pi * self.radius**2 * self.height / M3_PER_ML

    def kept_ml(self, down: FloatArray) -> FloatArray:
        """Millilitres (n,) that it keeps when overfull, by its tilt alone."""
        return volume_kept(tilt_of(down), self.radius, self.height) / M3_PER_ML

    def exit(self, down: FloatArray) -> FloatArray:
        """Points (n, 3) at which the stream leaves: the lip, or the lowest point of the rim where that is lower."""
        along = down * np.array([1.0, 0.0, 1.0])
        length = np.linalg.norm(along, axis=1, keepdims=True)
        lowest = self.opening + self.opening_radius * along / np.where(length > 0.0, length, 1.0)
        deeper = (lowest * down).sum(axis=1) > down @ self.lip
        return np.where(deeper[:, None], lowest, self.lip)


class Vessel:
    """One vessel and its declaration: the cylinder whose radius and height are told, else its instrument's own form.

    Raises EffectError: it has no cavity.
    """

    def __init__(self, body: SceneBody) -> None:
        self.body = body
        self._properties, cavity = (_table(body.extra, key) for key in ("properties", "cavity"))
        try:
            own_cavity = _own_cavity(body) if body.instrument else None
        except (SessionError, TypeError, ValueError) as error:  # the latter two from options of the wrong type
            raise self.fail(f"has a cavity that cannot be made: {error}") from error
        self.cavity = {**(own_cavity.table if own_cavity else {}), **cavity}
        if not self.cavity:
            raise self.fail(
                "has no cavity; give capacity_ml, floor, mark, opening, opening_radius, lip, "
                "or an instrument that is a vessel"
            )
        self.sliced = _sliced_cavity(own_cavity) if own_cavity and not cavity.keys() >= {"radius", "height"} else None

    def fail(self, text: str) -> EffectError:
        """The error to raise, naming the body."""
        return EffectError(f"scene: body {self.body.id!r} {text}")

    def contents(self, kind: str) -> Mapping[str, Any]:
        """``properties.liquid`` or ``properties.solid`` as written, empty where there is no such table."""
        return _table(self._properties, kind)

    def amount(
        self, kind: str, key: str, default: float | None = None, within: Mapping[str, Any] | None = None
    ) -> float:
        """A number of at least 0 of ``properties.liquid`` or ``properties.solid``, or of a table ``within`` it."""
        value: Any = (self.contents(kind) if within is None else within).get(key, default)
        if value is None:
            raise self.fail(f"has no {kind}.{key}; give a finite number of at least 0")
        if not is_number(value) or value < 0.0:
            raise self.fail(f"has {kind}.{key} = {value!r}; give a finite number of at least 0")
        return float(value)

    @property
    def volume_ml(self) -> float:
        """Initial volume of its liquid; a declared liquid has a volume."""
        return self.amount("liquid", "volume_ml", None if self.contents("liquid") else 0.0)

    @property
    def glass_j_per_k(self) -> float:
        """Heat capacity of the vessel itself, the constant of a calorimeter; 0 where the scene does not tell it."""
        return self.amount("", "heat_capacity_j_per_k", 0.0, within=self._properties)

    def celsius(self, room: float) -> float:
        """Temperature of what is in it at first; that of the room where the scene does not tell it."""
        value: Any = self._properties.get("temperature_c", room)
        if not is_number(value):
            raise self.fail(f"has temperature_c = {value!r}; give it in degC")
        return float(value)

    @property
    def floor(self) -> float:
        """Height of the cavity's floor in the body's frame, metres."""
        return self.size("floor", above=-math.inf)

    def level(self, volume_ml: FloatArray) -> FloatArray:
        """Height (n,) of the surface, upright, in the body's frame, metres: by its own cavity, else evenly."""
        if self.sliced is not None:
            return self.sliced.level(volume_ml)
        return self.floor + volume_ml * M3_PER_ML / self.section_m2

    @property
    def shape(self) -> Cylinder | SlicedCavity:
        """Its form: its instrument's own, or the cylinder which the scene declares. Raises EffectError: it has none."""
        if self.sliced is not None:
            if self.sliced.normal[1] < 0.0:
                raise self.fail(
                    "opens downwards: its bulb holds the liquid, which no effect lets go; leave it out of from and into"
                )
            return self.sliced
        if not self._has_form:
            raise self.fail(
                "is poured from and its cavity has no radius and height; give those of the cylinder that it is, from "
                "its floor to its lip, or an instrument"
            )
        point, size = self.point, self.size
        return Cylinder(size("radius"), size("height"), point("lip"), point("opening"), size("opening_radius"))

    @property
    def _has_form(self) -> bool:
        """Whether anything tells its form."""
        return self.sliced is not None or {"radius", "height"} <= self.cavity.keys()

    @property
    def brim_ml(self) -> float:
        """Volume of the upright vessel; infinite where the scene does not say: it never runs over."""
        return self.shape.brim_ml if self._has_form else math.inf

    @property
    def section_m2(self) -> float:
        """Mean cross-section between floor and mark."""
        height = self.size("mark") - self.floor
        if height <= 0.0:
            raise self.fail("has a mark that is not above its floor; measure both along +Y from its origin")
        return self.size("capacity_ml") * M3_PER_ML / height

    def size(self, key: str, above: float = 0.0) -> float:
        """A number of the cavity."""
        value: Any = self.cavity.get(key)
        if not is_number(value) or not value > above:
            raise self.fail(f"has cavity.{key} = {value!r}; give a number above {above:g}")
        return float(value)

    def point(self, key: str) -> FloatArray:
        """A point (3,) of the cavity, in the body's frame."""
        value = self.cavity.get(key)
        if not isinstance(value, list | tuple) or len(value) != 3 or not all(is_number(item) for item in value):
            raise self.fail(f"has cavity.{key} = {value!r}; give three numbers in metres")
        return np.array(value, dtype=np.float64)

    def liquid_to_draw(self, times: FloatArray, volume_ml: FloatArray) -> Liquid:
        """Its liquid up to its level, as a cylinder of the vessel's mean cross-section."""
        colour = np.tile(np.array(WATERY, dtype=np.uint8), (len(times), 1))
        return Liquid(times, self.level(volume_ml), self.floor, math.sqrt(self.section_m2 / math.pi), colour)


def _table(tables: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A table of a body; empty where none is written."""
    table = tables.get(key)
    return table if isinstance(table, Mapping) else {}


def _own_cavity(body: SceneBody) -> "Cavity | None":
    """That of its instrument, which is made only where a scene names one."""
    from sessions.glassware.catalogue import made_instrument

    faces, options = int(body.extra.get("faces", INSTRUMENT_FACES)), body.extra.get("options", {})
    return made_instrument(body.instrument, faces, tuple(sorted(options.items()))).cavity


@cache
def _sliced_cavity(cavity: "Cavity") -> SlicedCavity:
    """The cavity's mesh of an instrument that is a vessel, with one table for all scenes."""
    filled, opening = cavity.to_brim, cavity.opening
    return SlicedCavity(filled.vertices, filled.faces, np.array(opening.centre), np.array(opening.normal))


def check_vessels(tables: Mapping[str, tuple[Declaration, ...]], scene: Scene, file: str) -> None:
    """Raises PlanError: a vessel that the tables of liquids name lacks something."""
    faults, poured_names = [], {name for table in tables.get("pour", ()) for name in table["from"]}
    others = [name for table in tables.get("flame-test", ()) for name in table["vessels"]]
    for name in dict.fromkeys((*vessel_names(tables), *others)):
        try:
            vessel = Vessel(scene.body(name) or SceneBody(name))
            # Asked for, so that what is missing is named.
            for quantity in ("section_m2", "volume_ml", "shape" if name in poured_names else "brim_ml"):
                getattr(vessel, quantity)
            if vessel.volume_ml > vessel.brim_ml * (1.0 + 1e-9):
                raise vessel.fail(
                    f"has liquid.volume_ml = {vessel.volume_ml:g} and a brim at {words.decimal(vessel.brim_ml, 0)} mL"
                )
            vessel.point("opening")
            vessel.size("opening_radius")
        except EffectError as error:
            faults.append(f"{file}: {str(error).removeprefix('scene: ')}")
    if faults:
        raise PlanError(*faults)


def vessel_names(tables: Mapping[str, tuple[Declaration, ...]]) -> tuple[str, ...]:
    """Every vessel between which liquid may move or in which it is followed."""
    names = [name for table in tables.get("mixing", ()) for name in table["in"]]
    names += [name for table in tables.get("pour", ()) for key in ("from", "into") for name in table[key]]
    names += [name for table in tables.get("burette", ()) for name in (table["body"], *table["into"])]
    return tuple(dict.fromkeys(names))


def vessels_of(inputs: EffectInputs, names: Iterable[str]) -> dict[str, Vessel]:
    """The vessels of these names; `EffectError` where one has no cavity."""
    return {name: Vessel(inputs.body(name)) for name in names}


def is_inside(points: FloatArray, poses: BodyPoses, vessel: Vessel) -> BoolArray:
    """(T,) whether world places (T, 3) lie between a vessel's floor and mouth and no wider than the mouth."""
    local, middle = poses.to_body_frame(points), vessel.point("opening")
    radii = np.hypot(local[:, 0] - middle[0], local[:, 2] - middle[2])
    is_between = (local[:, 1] >= vessel.floor) & (local[:, 1] <= middle[1])
    return is_between & (radii <= vessel.size("opening_radius")) & poses.valid


def flow_event(inputs: EffectInputs, flow: Stream, name: str, text: str, digits: int = 1) -> EffectEvent:
    """The event of a flow with its volume and time, in these words unless it ran over; without a target a warning."""
    if flow.over:
        name, text = "overflow", f"run over the brim of {flow.source}"
    start, end, volume = float(flow.times[0]), float(flow.times[-1]), flow.total_ml
    bodies, level = ((flow.source, flow.target), "info") if flow.target else ((flow.source,), "warning")
    values = {"volume_ml": volume, "seconds": end - start}
    last = None if flow.frames[-1] == len(inputs) - 1 else end
    message, point = f"{volume:.{digits}f} mL {text}", vector_of(flow.points[0])
    return EffectEvent(start, name, bodies, last, values, message, level, point)
