"""The bench as a picture, drawn without a graphics card: every triangle from far to near, glass translucent."""

import io
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, IntArray, place_points
from replay.outputs.camera import FIELD_OF_VIEW, Eye, look_rotation
from replay.outputs.palette import MISSED, albedo, is_ghost, tags_of
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

SIZE: Final = (9.0, 5.2)
"""Inches at 100 dots each."""

NEAREST: Final = 0.01
"""Metres in front of the eye where drawing begins."""

LARGE: Final = 0.12
"""Metres: triangles with a longer edge are drawn before all others."""

PAPER: Final = 0.4
"""Share of white mixed into opaque colours: they were chosen for a dark screen."""

GLASS_ALPHA: Final = 0.22
GHOST_ALPHA: Final = 0.30

Faces = Mapping[int, IntArray]
"""Body -> numbers of the faces to mark."""


def bench_picture(assembly: Assembly, scene: Scene, frame: int, eye: Eye, marked: Faces | None = None) -> bytes:
    """A PNG of all bodies that have a pose in this frame; marked faces in the red of missed contacts, in front.

    Choose it for a page; the recording for Rerun shows the same in motion.
    """
    corners, colours, red = _triangles(assembly, scene, frame, marked or {})
    axes = look_rotation(eye)
    local = (corners - np.array(eye.position)) @ axes
    depth = -local[..., 2]
    seen = (depth > NEAREST).all(axis=1)
    local, depth, colours, red = local[seen], depth[seen], colours[seen], red[seen]
    flat = local[..., :2] / depth[..., None] / np.tan(FIELD_OF_VIEW / 2)
    half = SIZE[0] / SIZE[1]
    inside = (flat[..., 0].max(axis=1) > -half) & (flat[..., 0].min(axis=1) < half)
    inside &= (flat[..., 1].max(axis=1) > -1) & (flat[..., 1].min(axis=1) < 1)
    # A bench top is one triangle as long as the room. Sorted by its middle, it would cover what stands on it.
    edge = np.linalg.norm(local - np.roll(local, 1, axis=1), axis=2).max(axis=1)
    order = np.lexsort((-depth.mean(axis=1), edge < LARGE, red))
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    # Nor must its underside shine through its top.
    front = (normal * local.mean(axis=1)).sum(axis=1) < 0.0
    order = order[(inside & ((edge < LARGE) | front))[order]]
    return _drawn(flat[order], _shaded(normal, colours)[order], half)


def _triangles(assembly: Assembly, scene: Scene, frame: int, marked: Faces) -> tuple[FloatArray, FloatArray, BoolArray]:
    corners, colours, red = [np.zeros((0, 3, 3))], [np.zeros((0, 4))], [np.zeros(0, dtype=np.bool_)]
    motion = assembly.motion
    for body, thing in enumerate(assembly.bodies):
        if not motion.valid[frame, body]:
            continue
        points = place_points(thing.mesh.vertices, motion.rotations[frame, body], motion.translations[frame, body])
        faces = points[thing.mesh.faces]
        tags = tags_of(thing.name, scene)
        colour = np.tile(np.array(albedo(tags)) / 255.0, (len(faces), 1))
        if is_ghost(tags) or colour[0, 3] < 1.0:
            colour[:, 3] = GHOST_ALPHA if is_ghost(tags) else GLASS_ALPHA
        else:
            colour[:, :3] += PAPER * (1.0 - colour[:, :3])
        mark = np.zeros(len(faces), dtype=np.bool_)
        mark[marked.get(body, np.zeros(0, dtype=np.int64))] = True
        colour[mark] = np.array(MISSED) / 255.0
        corners.append(faces)
        colours.append(colour)
        red.append(mark)
    return np.concatenate(corners), np.concatenate(colours), np.concatenate(red)


def _shaded(normal: FloatArray, colours: FloatArray) -> FloatArray:
    """Light comes from the eye and a little from above."""
    length = np.linalg.norm(normal, axis=1)
    facing = np.abs(normal @ np.array([0.15, 0.45, 0.88])) / np.where(length > 0, length, 1.0)
    shaded = colours.copy()
    shaded[:, :3] *= (0.45 + 0.55 * facing)[:, None]
    return shaded


def _drawn(flat: FloatArray, colours: FloatArray, half: float) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import Collection
    from matplotlib.figure import Figure
    from matplotlib.path import Path
    from matplotlib.transforms import IdentityTransform

    class Triangles(Collection):
        """Triangles as images of one path: a path of its own for each took two thirds of the time (2026-11)."""

        def get_paths(self) -> list[Path]:
            return [Path([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], closed=True)]

        def get_transforms(self) -> Any:
            images = np.tile(np.eye(3), (len(flat), 1, 1))
            images[:, :2] = np.stack([flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0], flat[:, 0]], axis=2)
            return images

    figure = Figure(figsize=SIZE, dpi=100, facecolor=(0.93, 0.945, 0.96))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(-half, half)
    axes.set_ylim(-1.0, 1.0)
    # as many are drawn as there are offsets
    plain: dict[str, Any] = {"edgecolors": "none", "antialiaseds": False, "facecolors": colours}
    plain["offsets"] = np.zeros((len(flat), 2))
    drawn = Triangles(offset_transform=IdentityTransform(), **plain)
    axes.add_collection(drawn, autolim=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
