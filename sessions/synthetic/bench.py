"""A bench with instruments: their meshes, their places, and the scene that declares them."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.geometry.rotations import IDENTITY, Array
from sessions.glassware.catalogue import made_instrument
from sessions.glassware.instrument import Cavity, Instrument
from sessions.mesh_data import MeshData
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.model.session import Session
from sessions.scene_files.scene_toml import parse_scene, scene_to_toml
from sessions.synthetic.assembly import MADE_UP, START_NS, Recorded
from sessions.synthetic.choreography import Buttons
from sessions.synthetic.paths import Point, Poses, Quaternion
from sessions.synthetic.truth import Truth

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


class Instruments:
    """Instruments by body name, made once with so many ``faces``, and where each is placed."""

    def __init__(self, placed: Mapping[str, Placed], faces: int) -> None:
        self.placed, self._faces = dict(placed), faces
        self.instruments: dict[str, Instrument] = {
            name: made_instrument(item.instrument, item.faces or faces, tuple(sorted(item.options.items())))
            for name, item in placed.items()
        }

    def mesh(self, name: str) -> MeshData:
        """The body's mesh."""
        return self.instruments[name].mesh

    @property
    def meshes(self) -> dict[str, MeshData]:
        """All meshes by body name."""
        return {name: instrument.mesh for name, instrument in self.instruments.items()}

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
            fixed=None if item.moves else Pose(item.position, item.quaternion),
            tags=tuple(dict.fromkeys((*instrument.tags, *item.tags))),
            extra=extra,
        )


def standing(x: float, z: float, height: float = 0.0) -> Point:
    """A place on the bench, ``height`` above its top, lifted by `STAND_M`."""
    return (x, BENCH_TOP + height + STAND_M, z)


def made_session(
    truth: Truth,
    seen: Recorded,
    things: Mapping[str, Poses],
    layout: Instruments,
    buttons: Buttons,
    scene: Scene,
    version: int = 1,
    **more: Any,
) -> Session:
    """The session of a bench: what the trackers saw, the things that the program placed, and what the hands pressed.

    ``version`` of the choreography: another one has other poses for the same seed.
    """
    tracks = seen.tracks(things)
    facts = {"synthetic": truth.name, "seed": str(truth.seed), "noise": truth.noise, **MADE_UP}
    facts["choreography"] = str(version)
    session = Session.from_tracks(
        {name: tracks[name] for name in layout.placed if name in tracks},
        meshes=layout.meshes,
        scene=scene,
        facts={**facts, "vr_type": "immersive"},
        **more,
    )
    return replace(session, hands=buttons.tracks(seen.stamps + START_NS))


def with_text(scene: Scene, remarks: Sequence[str]) -> Scene:
    """The scene as read from its own TOML, headed by remarks: as an author would have written it.

    SceneError where it names a body, tag or instrument that it does not have.
    """
    head = "".join(f"# {line}\n" for line in remarks)
    return parse_scene(f"{head}\n{scene_to_toml(scene)}", f"{scene.name}.toml")


def declared_bench(file: Path) -> dict[str, Any]:
    """What a TOML file declares: ``placed`` by body name, ``effects`` of the scene, ``tasks``, and all else."""
    declared = tomllib.loads(file.read_text(encoding="utf-8"))
    placed = {body: Placed(**_as_tuples(item)) for body, item in declared.pop("bodies").items()}
    effects = tuple(SceneEffect(effect.pop("kind"), effect) for effect in declared.pop("effect"))
    tasks = declared.pop("task", ())
    return {"placed": placed, "effects": effects, "tasks": tasks, **_as_tuples(declared)}


def _as_tuples(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}
