"""A vessel as the scene declares it: its cavity, its opening, what stands in it; what is missing is named."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.models.ballistic import Disc
from replay.effects.models.colours import WATERY
from replay.effects.models.transfers import Transfer
from replay.effects.output import FloatArray, Liquid, Series
from replay.errors import EffectError
from sessions.scene import SceneBody
from sessions.toml_table import is_number

ML = 1e-6
"""Cubic metres in a millilitre."""


@dataclass(frozen=True)
class Vessel:
    """One vessel.

    Parameters
    ----------
    body : its declaration.
    """

    body: SceneBody

    def __post_init__(self) -> None:
        if not isinstance(self.body.extra.get("cavity"), Mapping):
            raise self.fail("has no cavity; give capacity_ml, floor, mark, opening, opening_radius, lip")

    def fail(self, words: str) -> EffectError:
        """The error to raise, naming the body."""
        return EffectError(f"scene: body {self.body.id!r} {words}")

    @property
    def liquid(self) -> Mapping[str, Any]:
        """``properties.liquid`` as written, empty where nothing stands in it."""
        properties = self.body.extra.get("properties") or {}
        found: Mapping[str, Any] = properties.get("liquid") or {}
        return found

    @property
    def solid(self) -> Mapping[str, Any]:
        """``properties.solid`` as written, empty where there is none."""
        properties = self.body.extra.get("properties") or {}
        found: Mapping[str, Any] = properties.get("solid") or {}
        return found

    def told(self, table: Mapping[str, Any], place: str, key: str) -> float:
        """A number of at least 0 that the scene says in ``properties``."""
        value: Any = table.get(key)
        if not is_number(value) or value < 0.0:
            raise self.fail(f"has {place}.{key} = {value!r}; give a finite number of at least 0")
        return float(value)

    @property
    def volume_ml(self) -> float:
        """What stands in it at first."""
        return self.told({"volume_ml": 0.0, **self.liquid}, "liquid", "volume_ml")

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
        height = self.size("mark") - self.size("floor", above=-math.inf)
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

    def drawn(self, times: FloatArray, volume_ml: FloatArray, rgba: NDArray[np.uint8] | None = None) -> Liquid:
        """What stands in it, as a cylinder of its mean cross-section."""
        floor = self.size("floor", above=-math.inf)
        colour = np.tile(np.array(WATERY, dtype=np.uint8), (len(times), 1)) if rgba is None else rgba
        level = floor + volume_ml * ML / self.section_m2
        return Liquid(times, level, floor, math.sqrt(self.section_m2 / math.pi), colour)


def vessels_of(inputs: EffectInputs, names: tuple[str, ...]) -> dict[str, Vessel]:
    """The vessels of these names.

    Raises
    ------
    EffectError
        One has no cavity.
    """
    return {name: Vessel(inputs.body(name)) for name in dict.fromkeys(names)}


def last_known(poses: BodyPoses) -> NDArray[np.int64]:
    """(T,) the frame of the last pose there was, -1 before the first: a glass lost for a moment stays where it was."""
    rows = np.where(poses.valid, np.arange(len(poses.valid)), -1)
    return np.maximum.accumulate(rows)


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
