"""A vessel as the scene declares it: its cavity, its opening, what stands in it; what is missing is named."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.models.ballistic import Disc, disc_entered, place_at_height
from replay.effects.models.transfers import Transfer, total_ml
from replay.effects.output import EffectEvent, FloatArray, Liquid, Series, Vector, vector_of
from replay.effects.spans import BoolArray
from replay.errors import EffectError
from sessions.model.scene import SceneBody
from sessions.scene_files.toml_table import is_number

Rgba = tuple[int, int, int, int]

WATERY: Final[Rgba] = (120, 170, 220, 150)
"""A liquid that no effect gives a colour."""

COLOURS: Final[Mapping[str, Rgba]] = {
    "colourless": WATERY, "white": (245, 245, 245, 235), "black": (25, 25, 25, 235), "red": (215, 40, 40, 200),
    "orange": (240, 140, 30, 200), "yellow": (245, 215, 50, 200), "green": (50, 165, 80, 200),
    "blue": (40, 90, 215, 200), "violet": (140, 70, 190, 200), "pink": (235, 90, 165, 200),
    "brown": (130, 80, 40, 220),
}  # fmt: skip
"""Word -> red, green, blue, alpha; drawn, not measured."""


def blended(first: Rgba, second: Rgba, share: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(n, 4) from the first colour (share 0) to the second (share 1)."""
    part = np.clip(share, 0.0, 1.0)[:, None]
    mixed = (1.0 - part) * np.array(first, dtype=np.float64) + part * np.array(second, dtype=np.float64)
    return np.round(mixed).astype(np.uint8)


ML = 1e-6
"""Cubic metres in a millilitre."""


@dataclass(frozen=True)
class Vessel:
    """One vessel and its declaration."""

    body: SceneBody

    def __post_init__(self) -> None:
        if not isinstance(self.body.extra.get("cavity"), Mapping):
            raise self.fail("has no cavity; give capacity_ml, floor, mark, opening, opening_radius, lip")

    def fail(self, words: str) -> EffectError:
        """The error to raise, naming the body."""
        return EffectError(f"scene: body {self.body.id!r} {words}")

    def contents(self, kind: str) -> Mapping[str, Any]:
        """``properties.liquid`` or ``properties.solid`` as written, empty where there is none."""
        return (self.body.extra.get("properties") or {}).get(kind) or {}

    def amount(self, kind: str, key: str, default: float | None = None) -> float:
        """A number of at least 0 that the scene declares in ``properties.liquid`` or ``properties.solid``."""
        value: Any = self.contents(kind).get(key, default)
        if not is_number(value) or value < 0.0:
            raise self.fail(f"has {kind}.{key} = {value!r}; give a finite number of at least 0")
        return float(value)

    @property
    def volume_ml(self) -> float:
        """What stands in it at first."""
        return self.amount("liquid", "volume_ml", 0.0)

    @property
    def floor(self) -> float:
        """Height of the cavity's floor in the body's frame, metres."""
        return self.size("floor", above=-math.inf)

    @property
    def level(self) -> float:
        """Height of the surface at first, upright, in the body's frame, metres."""
        return self.floor + self.volume_ml * ML / self.section_m2

    @property
    def cylinder(self) -> tuple[float, float] | None:
        """Inner radius and height up to the lip, metres, of a cylindrical vessel; ``None`` for any other."""
        cavity = self.body.extra["cavity"]
        return (self.size("radius"), self.size("height")) if "radius" in cavity and "height" in cavity else None

    @property
    def brim_ml(self) -> float:
        """What it holds upright; infinite where the scene does not say, so that such a vessel never runs over."""
        sizes = self.cylinder
        return math.inf if sizes is None else math.pi * sizes[0] ** 2 * sizes[1] / ML

    @property
    def section_m2(self) -> float:
        """Mean cross-section between floor and mark."""
        height = self.size("mark") - self.floor
        if height <= 0.0:
            raise self.fail("has a mark that is not above its floor; measure both along +Y from its origin")
        return self.size("capacity_ml") * ML / height

    def size(self, key: str, above: float = 0.0) -> float:
        """A number of the cavity."""
        value = self.body.extra["cavity"].get(key)
        if not is_number(value) or not value > above:
            raise self.fail(f"has cavity.{key} = {value!r}; give a number above {above:g}")
        return float(value)

    def place(self, key: str) -> FloatArray:
        """A point (3,) of the cavity, in the body's frame."""
        value = self.body.extra["cavity"].get(key)
        if not isinstance(value, list | tuple) or len(value) != 3 or not all(is_number(one) for one in value):
            raise self.fail(f"has cavity.{key} = {value!r}; give three numbers in metres")
        return np.array(value, dtype=np.float64)

    def opening(self, poses: BodyPoses, frame: int) -> Disc:
        """Its opening in the room at a frame."""
        turn = poses.rotation[frame]
        centre = poses.translation[frame] + turn @ self.place("opening")
        return Disc(self.body.id, centre, turn[:, 1], self.size("opening_radius"))

    def drawn(self, times: FloatArray, volume_ml: FloatArray) -> Liquid:
        """What stands in it, as a cylinder of its mean cross-section."""
        colour = np.tile(np.array(WATERY, dtype=np.uint8), (len(times), 1))
        level = self.floor + volume_ml * ML / self.section_m2
        return Liquid(times, level, self.floor, math.sqrt(self.section_m2 / math.pi), colour)


def vessels_of(inputs: EffectInputs, names: tuple[str, ...]) -> dict[str, Vessel]:
    """The vessels of these names; `EffectError` where one has no cavity."""
    return {name: Vessel(inputs.body(name)) for name in dict.fromkeys(names)}


def inside(places: FloatArray, poses: BodyPoses, vessel: Vessel) -> BoolArray:
    """(T,) whether world places (T, 3) lie between a vessel's floor and mouth and no wider than the mouth."""
    local, middle = poses.local(places), vessel.place("opening")
    across = np.hypot(local[:, 0] - middle[0], local[:, 2] - middle[2])
    between = (local[:, 1] >= vessel.floor) & (local[:, 1] <= middle[1])
    return np.asarray(between & (across <= vessel.size("opening_radius")) & poses.valid)


def landing(
    inputs: EffectInputs, vessels: Mapping[str, Vessel], held: Mapping[str, BodyPoses], frame: int, start: FloatArray,
    velocity: FloatArray,
) -> tuple[str, Vector]:  # fmt: skip
    """Where liquid goes that is let go at a frame: the vessel it falls into and where it started, or ``""`` and where
    it lands.

    ``held``: vessels that may receive, each with the last pose there was.
    """
    there = {name: poses for name, poses in held.items() if poses.valid[frame]}
    discs = [vessels[name].opening(poses, frame) for name, poses in there.items()]
    inputs.count("arcs", len(discs))
    if target := disc_entered(start, velocity, discs):
        return target, vector_of(start)
    floor = min((float(poses.translation[frame, 1]) for poses in there.values()), default=float(start[1]))
    return "", vector_of(place_at_height(start, velocity, floor))


def flow_event(inputs: EffectInputs, flow: tuple[Transfer, ...], name: str, words: str, digits: int = 1) -> EffectEvent:
    """The event of a flow with its volume and time; ``words`` follow the volume. One without a target is a warning."""
    first, last, volume = flow[0], flow[-1], total_ml(flow)
    bodies, level = ((first.source, first.target), "info") if first.target else ((first.source,), "warning")
    values = {"volume_ml": volume, "seconds": last.time - first.time}
    end = None if last.frame == len(inputs) - 1 else last.time
    return EffectEvent(first.time, name, bodies, end, values, f"{volume:.{digits}f} mL {words}", level, first.point)


def volumes(times: FloatArray, initial_ml: Mapping[str, float], transfers: tuple[Transfer, ...]) -> dict[str, Series]:
    """Vessel -> its volume wherever it changed, and at the first and the last of ``times``."""
    found: dict[str, Series] = {}
    for name, volume in initial_ml.items():
        rows: dict[float, float] = {float(times[0]): volume} if len(times) else {}
        for one in transfers:
            if name in (one.source, one.target):
                volume += one.volume_ml if one.target == name else -one.volume_ml
                rows[one.time] = volume
        if len(times):
            rows.setdefault(float(times[-1]), volume)
        found[name] = Series(np.array(list(rows)), np.array(list(rows.values())), "mL")
    return found
