"""A moment apart from the cursor: its bodies in a tree of their own, as they stood then, and where it is seen from.

The cursor of a recording is one for all tabs. So a tab that is about one moment cannot show the room at the cursor: it
has bodies of its own, which stand as in its worked moment until a click leads to another.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import rerun as rr

from cdcore.numerics import FloatArray
from replay.outputs.camera import Eye, look_rotation
from replay.outputs.palette import Rgba, albedo, tags_of
from replay.outputs.rerun_log.recording_file import RecordingWriter, Steps, entity, packed, pose_columns
from replay.outputs.rerun_log.scene import log_shape
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

FADED: Final = 110
"""Alpha, at most, of a body that stands before the point of a picture."""

GROUND: Final = ("bench", "table", "furniture")
"""Tags of what stays solid."""

IN_FRONT: Final = 0.4
"""Share of the way from the eye at which words stand: nearer than what they speak of, so that nothing hides them."""

HANGING: Final = 0.05
"""Height of words, in distances of the eye from what it looks at."""


@dataclass(frozen=True)
class Standing:
    """Where all bodies stand at a moment, and those that are drawn."""

    assembly: Assembly
    frame: int
    bodies: Collection[int]


@dataclass(frozen=True, eq=False)
class Label:
    """Words beside what they speak of, and a line (2, 3) to it, world metres."""

    text: str
    place: FloatArray
    line: FloatArray
    colour: Rgba


def beside(eye: Eye, about: FloatArray, text: str, colour: Rgba, right: float, up: float) -> Label:
    """Words so far to the right and up on the screen, in distances of the eye from what it looks at."""
    axes = look_rotation(eye)
    distance = float(np.linalg.norm(np.subtract(eye.position, eye.target)))
    place = np.asarray(eye.target) + distance * (right * axes[:, 0] + up * axes[:, 1])
    # Words hang below their place: a line from above begins below them.
    start = place - distance * (HANGING if up > 0 else 0.0) * axes[:, 1]
    places = in_front(eye, np.stack([place, start, about]))
    return Label(text, places[0], places[1:], colour)


def in_front(eye: Eye, points: FloatArray) -> FloatArray:
    """The same places on the screen (n, 3), so near to the eye that nothing hides them."""
    position = np.asarray(eye.position)
    nearer: FloatArray = position + IN_FRONT * (points - position)
    return nearer


def faded(colour: Rgba, tags: Collection[str]) -> Rgba:
    """A colour that one can look through; that of the ground stays."""
    return colour if set(tags) & set(GROUND) else (*colour[:3], min(colour[3], FADED))


def log_standing(writer: RecordingWriter, root: str, scene: Scene, steps: Steps, at: Mapping[Any, Standing]) -> None:
    """Send bodies below a root: of each moment shown those that belong to it, and the ground."""
    first = next(iter(at.values()))
    tags = [tags_of(name, scene) for name in first.assembly.names]
    for body, name in enumerate(first.assembly.names):
        ground = bool(set(tags[body]) & set(GROUND))
        if not ground and not any(body in standing.bodies for standing in at.values()):
            continue
        path, colour = entity(*root.split("/"), name), faded(albedo(tags[body]), tags[body])
        log_shape(writer, f"{path}/mesh", first.assembly.bodies[body].mesh)
        spots = [at[shown] for *_, shown in steps]
        when = [(frame, later) for frame, later, _ in steps]
        places = np.array([one.assembly.motion.translations[one.frame, body] for one in spots])
        turns = np.array([one.assembly.motion.rotations[one.frame, body] for one in spots])
        writer.rows_later(path, when, pose_columns(places, turns))
        colours = np.array([_seen(one, body, colour, ground) for one in spots], dtype=np.uint8)
        writer.rows_later(f"{path}/mesh", when, rr.Mesh3D.columns(albedo_factor=colours))


def _seen(standing: Standing, body: int, colour: Rgba, ground: bool) -> Rgba:
    if not standing.assembly.motion.valid[standing.frame, body] or not (ground or body in standing.bodies):
        return (*colour[:3], 0)
    return colour


def log_labels(writer: RecordingWriter, root: str, steps: Steps, labels: Mapping[Any, Sequence[Label]]) -> None:
    """Send words and the lines from them; nothing for what has none."""

    def columns(some: list[Label]) -> rr.ComponentColumnList:
        places = np.array([one.place for one in some], dtype=np.float32).reshape(-1, 3)
        colours = packed(one.colour for one in some)
        return rr.Points3D.columns(positions=places, labels=[one.text for one in some], colors=colours)

    writer.steps(f"{root}/words", steps, labels, columns)
    dot = rr.Radius.ui_points(0.01)
    writer.static(f"{root}/words", rr.Points3D.from_fields(radii=dot, show_labels=True))
    log_lines(writer, f"{root}/leaders", steps, {
        shown: [(one.line, one.colour) for one in some] for shown, some in labels.items()
    }, 0.8)  # fmt: skip


def log_lines(
    writer: RecordingWriter, path: str, steps: Steps, lines: Mapping[Any, Sequence[tuple[FloatArray, Rgba]]],
    width: float,
) -> None:  # fmt: skip
    """Send lines from point to point (2, 3) and their colours, so wide on the screen."""

    def columns(some: list[tuple[FloatArray, Rgba]]) -> rr.ComponentColumnList:
        strips = np.array([line for line, _ in some], dtype=np.float32).reshape(-1, 2, 3)
        return rr.LineStrips3D.columns(strips=strips, colors=packed(colour for _, colour in some))

    writer.steps(path, steps, lines, columns)
    writer.static(path, rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(width)))


def log_dots(
    writer: RecordingWriter, path: str, steps: Steps, dots: Mapping[Any, Sequence[tuple[FloatArray, Rgba]]], size: float
) -> None:
    """Send points and their colours, so large on the screen."""

    def columns(some: list[tuple[FloatArray, Rgba]]) -> rr.ComponentColumnList:
        places = np.array([place for place, _ in some], dtype=np.float32).reshape(-1, 3)
        return rr.Points3D.columns(positions=places, colors=packed(colour for _, colour in some))

    writer.steps(path, steps, dots, columns)
    writer.static(path, rr.Points3D.from_fields(radii=rr.Radius.ui_points(size)))


def log_notes(writer: RecordingWriter, path: str, steps: Steps, notes: Mapping[Any, str]) -> None:
    """Send Markdown about each moment that is shown."""

    def columns(some: list[str]) -> rr.ComponentColumnList:
        return rr.TextDocument.columns(text=some, media_type=[rr.MediaType.MARKDOWN] * len(some))

    writer.steps(path, steps, {moment: [note] for moment, note in notes.items()}, columns)


def log_eyes(writer: RecordingWriter, path: str, steps: Sequence[tuple[int, int, Eye]]) -> None:
    """Send a camera that stands elsewhere from each step on. A view that tracks it needs no command to follow."""
    rotations = np.array([look_rotation(eye) for *_, eye in steps]).reshape(-1, 3, 3)
    poses = pose_columns(np.array([eye.position for *_, eye in steps]), rotations)
    writer.rows_later(path, [(frame, later) for frame, later, _ in steps], poses)
    shape: dict[str, Any] = {"fov_y": 0.9, "aspect_ratio": 1.3, "image_plane_distance": 0.001, "line_width": 0.0}
    writer.static(path, rr.Pinhole(**shape, camera_xyz=rr.ViewCoordinates.RUB))
