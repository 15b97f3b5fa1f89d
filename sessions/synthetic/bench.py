"""A bench with instruments: their meshes, their places, and the scene that declares them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sessions.geometry.rotations import IDENTITY, Array
from sessions.glassware.catalogue import made_instrument
from sessions.glassware.instrument import Cavity
from sessions.model.scene import Pose, Scene, SceneBody
from sessions.scene_files.scene_toml import parse_scene, scene_to_toml
from sessions.synthetic.paths import Point, Quaternion

BENCH_TOP = 0.9

# Things stand this far above what carries them. Glass exactly on a bench is contact in every frame (and where it is
# turned, an engine's rounding decides), which would drown the contacts somebody looks for; from 0.1 mm on every
# engine agrees that a standing glass is clear, and a glass set down too hard is an event.
STAND_M = 1e-4


@dataclass(frozen=True)
class Placed:
    """One instrument of a scene: what it is, where it stands at time 0, and what the scene says of it."""

    instrument: str
    """A name of the catalogue; the origin is the centre of the base."""
    position: Point = (0.0, 0.0, 0.0)
    quaternion: Quaternion = IDENTITY
    options: Mapping[str, Any] = field(default_factory=dict)
    """For the instrument's maker."""
    moves: bool = True
    """Whether it has a track; otherwise the scene fixes it."""
    group: str = ""
    faces: int | None = None
    """Resolution, ``None``: that of the layout."""
    tags: tuple[str, ...] = ()
    properties: Mapping[str, Any] = field(default_factory=dict)
    """Keys that effects read."""
    parent: str = ""
    """The body whose frame its pose is relative to."""


class Instruments:
    """Instruments by body name, made once with so many ``faces``, and where each is placed."""

    def __init__(self, placed: Mapping[str, Placed], faces: int) -> None:
        self.placed, self._faces = dict(placed), faces
        self.instruments = {
            name: made_instrument(item.instrument, item.faces or faces, tuple(sorted(item.options.items())))
            for name, item in placed.items()
        }
        self.meshes = {name: instrument.mesh for name, instrument in self.instruments.items()}

    def cavity(self, name: str) -> Cavity:
        """The space for liquid of a body that is a vessel."""
        cavity = self.instruments[name].cavity
        assert cavity is not None
        return cavity

    def at(self, name: str) -> Array:
        """Where the body stands at first, (3,)."""
        return np.array(self.placed[name].position)

    def site(self, name: str, site: str) -> Array:
        """A named place in the body's own frame, (3,)."""
        return np.array(self.instruments[name].sites[site])

    def bodies(self) -> tuple[SceneBody, ...]:
        """The scene's bodies in the order they were given."""
        return tuple(self._body(name, item) for name, item in self.placed.items())

    def _body(self, name: str, item: Placed) -> SceneBody:
        instrument = self.instruments[name]
        extra: dict[str, Any] = {"mass": round(float(instrument.mass), 4), "faces": item.faces or self._faces}
        if item.options:
            extra["options"] = dict(item.options)
        if item.properties:
            extra["properties"] = dict(item.properties)
        return SceneBody(
            name,
            instrument=item.instrument,
            group=item.group,
            parent=item.parent,
            fixed=None if item.moves else Pose(item.position, item.quaternion),
            tags=tuple(dict.fromkeys((*instrument.tags, *item.tags))),
            extra=extra,
        )


def with_text(scene: Scene, remarks: Sequence[str]) -> Scene:
    """The scene as read from its own TOML, headed by remarks: as an author would have written it.

    SceneError where it names a body, tag or instrument that it does not have.
    """
    head = "".join(f"# {line}\n" for line in remarks)
    return parse_scene(f"{head}\n{scene_to_toml(scene)}", f"{scene.name}.toml")
