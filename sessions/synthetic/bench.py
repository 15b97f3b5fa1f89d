"""A bench with instruments: their meshes, their places, and the scene that declares them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sessions.geometry.rotations import IDENTITY, Array
from sessions.glassware.catalogue import made_instrument
from sessions.glassware.instrument import Cavity
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene, scene_to_toml
from sessions.synthetic.paths import Point, Quaternion

BENCH_TOP = 0.9
SIDES = ("left", "right")
EVENT_TEXTS = {
    "grasp": "takes {}",
    "release": "lets go of {}",
    "drop": "drops {}",
    "break": "breaks {}",
    "end_point": "sees the end point in {}",
}

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
        """The initial position of a body, (3,)."""
        return np.array(self.placed[name].position)

    def site(self, name: str, site: str) -> Array:
        """A named place in the body's own frame, (3,)."""
        return np.array(self.instruments[name].sites[site])

    def bodies(self) -> list[SceneBody]:
        """The scene's bodies in the order they were given."""
        bodies = []
        for name, item in self.placed.items():
            instrument = self.instruments[name]
            extra: dict[str, Any] = {"mass": round(float(instrument.mass), 4), "faces": item.faces or self._faces}
            tables = {"options": dict(item.options), "properties": dict(item.properties)}
            body = SceneBody(
                name,
                instrument=item.instrument,
                group=item.group,
                parent=item.parent,
                fixed=None if item.moves else Pose(item.position, item.quaternion),
                tags=tuple(dict.fromkeys((*instrument.tags, *item.tags))),
                extra=extra | {key: table for key, table in tables.items() if table},
            )
            bodies.append(body)
        return bodies


@dataclass(frozen=True)
class Declaration:
    """The declaration of a session at the bench: its bodies, its steps, the effects of its scene."""

    name: str
    remarks: tuple[str, ...]
    bodies: Mapping[str, Placed]
    """Instruments by body name, without bench, hands and headset where there are ``grips``."""
    tasks: Sequence[Mapping[str, Any]]
    """What is done: each has a ``name``, a ``stage`` where a stage of learning begins with it, and ``steps``, which
    ``do`` what a method of `Lab`, or of the `Script` of one side, or a function of `steps` or `bench_bumps` does with
    the step's other keys."""
    effects: tuple[SceneEffect, ...]
    """Of the scene, in the words of the catalogue of effects."""
    grips: tuple[float, ...] = ()
    """Radii of what the left and the right hand hold."""
    travel: float = 1.25
    """Height at which hands cross the bench."""
    lever: float = 0.25
    """How far from its origin the surface of a hand, or of what it holds, may be."""
    seconds: float = 0.0
    """Length where the steps say when things are done (then a task tells ``from`` when ``to`` when it lasts); 0: as
    long as the procedure takes."""
    event_texts: Mapping[str, str] = field(default_factory=lambda: EVENT_TEXTS)
    """What the program logs of a fact of this kind."""
    version: int = 1
    """Of the choreography: another one has other poses for the same seed."""

    def layout(self, faces: int) -> Instruments:
        """The instruments, with bench, hands and headset where there are ``grips``."""
        if not self.grips:
            return Instruments(self.bodies, faces)
        hands = {
            f"hand-{side}": Placed(f"hand_{side}", (x, 1.12, 0.30), options={"grip_radius": grip})
            for side, x, grip in zip(SIDES, (-0.22, 0.22), self.grips, strict=True)
        }
        headset = Placed("proxy_headset", faces=max(600, faces // 2))
        bench = Placed("bench", faces=500, moves=False)
        return Instruments({"bench": bench, **self.bodies, **hands, "headset": headset}, faces)


def with_text(scene: Scene, remarks: Sequence[str]) -> Scene:
    """The scene as read from its own TOML, headed by remarks: as an author would have written it.

    SceneError where it names a body, tag or instrument that it does not have.
    """
    head = "".join(f"# {line}\n" for line in remarks)
    return parse_scene(f"{head}\n{scene_to_toml(scene)}", f"{scene.name}.toml")
