"""What stands in a picture beside the bodies: eyes that a view follows, words, lines and dots of a moment.

Words and lines stand so near to the eye of their moment that nothing hides them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import rerun as rr

from cdcore.numerics import FloatArray
from replay.outputs.camera import Eye, look_rotation
from replay.outputs.palette import Rgba
from replay.outputs.rerun_log.recording_file import RecordingWriter, Steps, packed, pose_columns, times_of

FADED: Final = 110
"""Alpha, at most, of a body that stands before the point of a picture."""

GROUND: Final = frozenset({"bench", "table", "furniture"})
"""Tags of what stays solid."""

IN_FRONT: Final = 0.4
"""Share of the way from the eye at which words stand: nearer than what they speak of, so that nothing hides them."""

HANGING: Final = 0.05
"""Height of words, in distances of the eye from what it looks at."""

UNSEEN: Final = 0.01
LEADER: Final = 0.8
"""Points on the screen: the size of a dot that carries words, and the width of the line from them."""


@dataclass(frozen=True, eq=False)
class Mark:
    """A dot or words (1, 3), or a line (2, 3), at places in the world, metres; ``size``: points on the screen."""

    places: FloatArray
    colour: Rgba
    size: float
    text: str = ""


def words_beside(eye: Eye, about: FloatArray, text: str, colour: Rgba, right: float, up: float) -> list[Mark]:
    """Words and the line from them; ``right`` and ``up`` on the screen in distances of the eye from what it sees."""
    axes = look_rotation(eye)
    distance = float(np.linalg.norm(np.subtract(eye.position, eye.target)))
    place = np.asarray(eye.target) + distance * (right * axes[:, 0] + up * axes[:, 1])
    # Words hang below their place: a line from above begins below them.
    start = place - distance * (HANGING if up > 0 else 0.0) * axes[:, 1]
    places = in_front(eye, np.stack([place, start, about]))
    return [Mark(places[:1], colour, UNSEEN, text), Mark(places[1:], colour, LEADER)]


def in_front(eye: Eye, points: FloatArray) -> FloatArray:
    """The same places on the screen (n, 3), so near to the eye that nothing hides them."""
    nearer: FloatArray = np.asarray(eye.position) + IN_FRONT * (points - eye.position)
    return nearer


def faded(colour: Rgba, tags: Collection[str]) -> Rgba:
    """A colour that one can look through; that of the ground stays."""
    return (*colour[:3], min(colour[3], FADED)) if GROUND.isdisjoint(tags) else colour


def log_marks(writer: RecordingWriter, root: str, steps: Steps, marks: Mapping[Any, Sequence[Mark]]) -> None:
    """Send ``words``, ``lines`` and ``dots`` below a root: the marks of each moment that is shown, and no other."""
    parts: dict[str, dict[Any, list[Mark]]] = {"words": {}, "lines": {}, "dots": {}}
    for moment, some in marks.items():
        for mark in some:
            part = "words" if mark.text else "lines" if len(mark.places) > 1 else "dots"
            parts[part].setdefault(moment, []).append(mark)
    for part, drawn in parts.items():
        if drawn:
            writer.steps(f"{root}/{part}", steps, drawn, _strips if part == "lines" else _points)
    writer.static(f"{root}/words", rr.Points3D.from_fields(show_labels=True))


def _points(marks: Sequence[Mark]) -> rr.ComponentColumnList:
    places = np.array([mark.places for mark in marks], dtype=np.float32).reshape(-1, 3)
    texts = [mark.text for mark in marks]
    return rr.Points3D.columns(positions=places, labels=texts, **_looks(marks))


def _strips(marks: Sequence[Mark]) -> rr.ComponentColumnList:
    places = np.array([mark.places for mark in marks], dtype=np.float32).reshape(-1, 2, 3)
    return rr.LineStrips3D.columns(strips=places, **_looks(marks))


def _looks(marks: Sequence[Mark]) -> dict[str, Any]:
    radii = np.array([rr.Radius.ui_points(mark.size) for mark in marks], dtype=np.float32)
    return {"colors": packed(mark.colour for mark in marks), "radii": radii}


def log_eyes(writer: RecordingWriter, path: str, steps: Sequence[tuple[int, int, Eye]]) -> None:
    """Send a camera that stands elsewhere from each step on. A view that tracks it needs no command to follow."""
    eyes = [eye for *_, eye in steps]
    rotations = np.array([look_rotation(eye) for eye in eyes]).reshape(-1, 3, 3)
    writer.rows(path, times_of(steps), pose_columns(np.array([eye.position for eye in eyes]), rotations))
    shape: dict[str, Any] = {"fov_y": 0.9, "aspect_ratio": 1.3, "image_plane_distance": 0.001, "line_width": 0.0}
    writer.static(path, rr.Pinhole(**shape, camera_xyz=rr.ViewCoordinates.RUB))
