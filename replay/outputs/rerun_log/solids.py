"""The solids that a detector puts in place of the meshes: edges, while a contact of theirs is false or in focus."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import TriangleMesh
from cdcore.numerics import FloatArray, IntArray
from replay.comparison.outcome import Outcome
from replay.outputs.palette import BUDGET, INVENTED
from replay.outputs.rerun_log.columns import RecordingWriter, entity, packed
from replay.outputs.rerun_log.pipeline import ROOM, changes
from replay.outputs.rerun_log.world import body_path, face_normals
from replay.pipeline.run_result import RunResult

SHARP_COSINE: Final = float(np.cos(np.radians(1.8)))
"""Edges sharper than this are drawn: the triangles of a flat side are the solver's business."""

DRAWN_EDGES: Final = 40_000
"""Edges that one detector draws at most, 1 MB; of more stretches the longest are kept."""

HIDDEN, SEEN, FALSE = range(3)


def solid_path(body: str, label: str) -> str:
    """Entity of the solid, below the body: so it moves with it."""
    return f"{body_path(body)}/{entity(f'solid_of_{label}')}"


def with_solids(result: RunResult) -> list[str]:
    """Audited detectors with solids other than the meshes."""

    def has_solids(label: str) -> bool:
        solids = getattr(result.detectors.get(label), "colliders", ())
        return any(solid.mesh is not result.assembly.bodies[k].mesh for k, solid in enumerate(solids))

    return [label for label in result.comparisons if has_solids(label)]


def log_solids(writer: RecordingWriter, result: RunResult, label: str, pair: IntArray) -> None:
    """Send the solids of one detector; ``pair`` (T,): the pair in focus."""
    detector: Any = result.detectors[label]  # whose solids have one or more convex parts each
    state, left = solid_states(result, label, pair), DRAWN_EDGES
    for column, solid in enumerate(detector.colliders):
        edges = np.concatenate([sharp_edges(part) for part in detector.parts[solid.name]])
        if np.ptp(solid.mesh.vertices, axis=0).max() / 2 > ROOM:
            continue
        left -= _log_solid(writer, solid_path(solid.name, label), edges, state[:, column], left)


def solid_states(result: RunResult, label: str, pair: IntArray) -> NDArray[np.uint8]:
    """(T, N): whether a body's solid is seen, and whether a contact of it is false."""
    assembly, outcome = result.assembly, result.comparisons[label].outcome
    state = np.zeros((len(pair), len(assembly.bodies)), dtype=np.uint8)
    frames = np.arange(len(pair))
    for side in range(2):
        state[frames, assembly.pairs[pair, side]] = SEEN
    for column, ends in enumerate(assembly.pairs.tolist()):
        for body in ends:
            state[outcome[:, column] == Outcome.INVENTED, body] = FALSE
    return state


def _log_solid(
    writer: RecordingWriter, path: str, edges: FloatArray, state: NDArray[np.uint8], left: int
) -> int:  # fmt: skip
    """Send the edges wherever the state changes; returns how many, ``left`` at most."""
    frames = changes(state)
    lasts = np.diff(frames, append=len(state)) * (state[frames] > HIDDEN)
    room = np.argsort(-lasts, kind="stable")[: left // max(1, len(edges))]
    shown = np.isin(np.arange(len(frames)), room) & (state[frames] > HIDDEN)
    count = int(shown.sum())
    strips = np.tile(edges.astype(np.float32), (count, 1, 1))
    colours = np.repeat(packed(INVENTED if one == FALSE else BUDGET for one in state[frames][shown]), len(edges))
    # Wires ignore alpha: an empty row hides them.
    if count:
        columns = rr.LineStrips3D.columns(strips=strips, colors=colours)
        writer.rows(path, frames, columns, shown * len(edges))
        writer.static(path, rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.1)))
    return count * len(edges)


def sharp_edges(mesh: TriangleMesh) -> FloatArray:
    """Edges (k, 2, 3) at which two faces of a mesh meet at an angle, or that only one face has."""
    faces, normals = mesh.merged_faces, face_normals(mesh.triangles)[1]
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    points = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    _, first, number, counts = np.unique(ends, axis=0, return_index=True, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(number.reshape(-1), np.tile(normals[:, k], 3)) for k in range(3)], axis=1)
    # |a + b|^2 = 2 + 2 cos for two unit normals.
    flat = (counts == 2) & ((sums * sums).sum(axis=1) >= 2 + 2 * SHARP_COSINE)
    edges: FloatArray = points[first[~flat]]
    return edges
