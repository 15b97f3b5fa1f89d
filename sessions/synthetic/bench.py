"""A bench laid with instruments: their meshes, where they stand, and the scene that says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.glassware.catalogue import make_instrument
from sessions.glassware.instrument import Instrument
from sessions.mesh_data import MeshData
from sessions.scene import Pose, SceneBody
from sessions.synthetic.choreography import Point, Quaternion
from sessions.synthetic.rotations import IDENTITY

BENCH_TOP = 0.9

# Things stand this far above what carries them. Glass exactly on a bench is contact in every frame (and where it is
# turned, an engine's rounding decides), which would drown the contacts somebody looks for; from 0.1 mm on every
# engine agrees that a standing glass is clear, and a glass set down too hard is an event.
STAND_M = 1e-4


@dataclass(frozen=True)
class Placed:
    """One instrument of a scene: what it is, where it stands at first, and what the scene says of it.

    Parameters
    ----------
    instrument : a name of the catalogue.
    position, quaternion : at time 0; the origin is the centre of the base.
    options : for the instrument's maker.
    moves : whether it has a track; otherwise the scene fixes it.
    faces : resolution, ``None``: that of the layout.
    properties : keys that effects read.
    """

    instrument: str
    position: Point = (0.0, 0.0, 0.0)
    quaternion: Quaternion = IDENTITY
    options: Mapping[str, Any] = field(default_factory=dict)
    moves: bool = True
    group: str = ""
    faces: int | None = None
    tags: tuple[str, ...] = ()
    properties: Mapping[str, Any] = field(default_factory=dict)


class Layout:
    """Instruments by body name, made once.

    Parameters
    ----------
    placed : body name -> instrument and place.
    faces : resolution of the meshes.
    """

    def __init__(self, placed: Mapping[str, Placed], faces: int) -> None:
        self.placed, self._faces = dict(placed), faces
        self.instruments: dict[str, Instrument] = {
            name: _made(item.instrument, item.faces or faces, tuple(sorted(item.options.items())))
            for name, item in placed.items()
        }

    def mesh(self, name: str) -> MeshData:
        """The body's mesh."""
        return self.instruments[name].mesh

    @property
    def meshes(self) -> dict[str, MeshData]:
        """All meshes by body name."""
        return {name: instrument.mesh for name, instrument in self.instruments.items()}

    def at(self, name: str) -> NDArray[np.float64]:
        """Where the body stands at first, (3,)."""
        return np.array(self.placed[name].position)

    def site(self, name: str, site: str) -> NDArray[np.float64]:
        """A named place in the body's own frame, (3,)."""
        return np.array(self.instruments[name].sites[site].point)

    def bodies(self) -> tuple[SceneBody, ...]:
        """The scene's bodies in the order they were given."""
        return tuple(self._body(name, item) for name, item in self.placed.items())

    def _body(self, name: str, item: Placed) -> SceneBody:
        instrument = self.instruments[name]
        extra: dict[str, Any] = {"mass": round(float(instrument.mass), 4), "faces": item.faces or self._faces}
        if item.options:
            extra["options"] = dict(item.options)
        if instrument.cavity is not None:
            extra["cavity"] = _cavity(instrument)
        if item.properties:
            extra["properties"] = dict(item.properties)
        return SceneBody(
            name,
            instrument=item.instrument,
            group=item.group,
            fixed=None if item.moves else Pose(item.position, item.quaternion),
            tags=tuple(dict.fromkeys((*instrument.tags, *item.tags))),
            extra=extra,
        )


@lru_cache(maxsize=192)
def _made(name: str, faces: int, options: tuple[tuple[str, Any], ...]) -> Instrument:
    """An instrument, made once: hands take most of a second, instruments never change, and all scenes need 60."""
    return make_instrument(name, faces, **dict(options))


def _cavity(instrument: Instrument) -> dict[str, Any]:
    """The space for liquid in words of the scene: metres and millilitres, in the body's frame."""
    cavity = instrument.cavity
    assert cavity is not None
    table: dict[str, Any] = {
        "capacity_ml": round(float(cavity.capacity_m3) * 1e6, 3),
        "floor": round(float(cavity.floor_height), 6),
        "mark": round(float(cavity.mark_height), 6),
    }
    if "beaker" in instrument.tags or "gas_jar" in instrument.tags:
        table["radius"], table["height"] = (round(size, 6) for size in cylinder_of(instrument))
    if cavity.opening is not None:
        table["opening_radius"] = round(float(cavity.opening.radius), 6)
        table["opening"] = [round(float(value), 6) for value in cavity.opening.centre]
        table["lip"] = [round(float(value), 6) for value in cavity.opening.lip]
    return table


def cylinder_of(instrument: Instrument) -> tuple[float, float]:
    """Inner radius and height, metres, of the cylinder that holds as much as the vessel up to its mark and its lip.

    Raises
    ------
    ValueError
        The instrument is no open vessel.
    """
    cavity = instrument.cavity
    if cavity is None or cavity.opening is None:
        raise ValueError(f"{instrument.name} is no open vessel; pour from a beaker")
    floor = float(cavity.floor_height)
    radius = float(np.sqrt(cavity.capacity_m3 / (np.pi * (cavity.mark_height - floor))))
    return radius, float(cavity.opening.centre[1]) - floor


def standing(x: float, z: float, height: float = 0.0) -> Point:
    """A place on the bench, ``height`` above its top, lifted by `STAND_M`."""
    return (x, BENCH_TOP + height + STAND_M, z)


def widest(mesh: MeshData, origin: Sequence[float] = (0.0, 0.0, 0.0)) -> float:
    """Largest distance of a surface point from a point of the body's frame: the lever of a small rotation."""
    return float(np.linalg.norm(mesh.vertices - np.asarray(origin), axis=1).max())
