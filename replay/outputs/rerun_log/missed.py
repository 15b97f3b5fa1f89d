"""Misses in space: the faces that met, a pin where each miss happened, a flag with words for the current one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Detection, TriangleMesh
from cdcore.numerics import FloatArray
from replay.comparison.clusters import by_depth
from replay.comparison.outcome import Miss
from replay.outputs.palette import MISSED, MISSED_FACES, PARTLY_MISSED
from replay.outputs.rerun_log.columns import RecordingClock, RecordingWriter, packed
from replay.outputs.rerun_log.world import body_path, face_normals
from replay.prepare.assembly import Assembly

PUSHED_OUT: Final = 0.00015
"""Metres that red faces stand off their body, so that the two do not flicker through each other."""

DRAWN_MISSED_FACES: Final = 200_000
"""Red faces per body at most, 7 MB: beyond it the shallowest misses stay without faces; pins and lanes show them."""

LARGE_FACE: Final = 0.002
"""Square metres, a triangle 6 cm wide and high: larger faces are not painted where smaller ones show the place. Two
triangles of a bench top are two hands wide: painted, they drown the contact, and the curve says where on them it is."""

LINGER: Final = 0.6
"""Seconds a flag stands after its miss: nobody sees a flash of 54 ms. Faces and curves never linger."""

POLE: Final = 0.075
"""Metres from a contact up to its words: a label hangs below its point and would cover the contact."""

FLAGS_AT_ONCE: Final = 3
"""Flags that stand at the same time; of more, those of the longest cuts."""

CLUSTER_POLE: Final = 0.07
"""Metres from a cluster of pins up to its numbers; lower than a flag, so that the flag's words stay free."""

CLUSTERS: Final = 12
"""Clusters that carry numbers; of more, the largest. All pins stay."""


def log_missed_faces(
    writer: RecordingWriter, root: str, assembly: Assembly, oracle: Detection, misses: Sequence[Miss]
) -> None:
    """Send ``world/<body>/<root>``: per frame, the faces of the body that met and were missed, in the body's own frame.

    Where the oracle lists no faces, those of each miss's deepest moment, which may lie between frames.
    """
    per_body: dict[int, dict[Moment, list[NDArray[np.int64]]]] = {}
    room = dict.fromkeys(range(len(assembly.bodies)), DRAWN_MISSED_FACES)
    for miss in by_depth(misses):
        for moment, faces in _moments_with_faces(oracle, miss):
            for body, mine in _red_faces(assembly, miss.pair, faces):
                if 0 < len(mine) <= room[body]:
                    room[body] -= len(mine)
                    per_body.setdefault(body, {}).setdefault(moment, []).append(mine)
    for body in sorted({int(k) for miss in misses for k in assembly.pairs[miss.pair]}):
        _log_faces_of(writer, root, assembly, body, per_body.get(body, {}))


Point = tuple[float, float, float]

Moment = tuple[int, int]
"""A frame, and nanoseconds after it."""


def _moments_with_faces(oracle: Detection, miss: Miss) -> Iterator[tuple[Moment, NDArray[np.int64]]]:
    if oracle.face_sets is not None:
        yield from (((frame, 0), oracle.faces(frame, miss.pair)) for frame in range(miss.first, miss.last + 1))
    elif miss.faces is not None:
        yield miss.shown, miss.faces


def _red_faces(assembly: Assembly, pair: int, faces: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Both bodies and their faces to paint: large ones only where nothing smaller shows the place."""
    bodies = assembly.pairs[pair].tolist()
    mine = [np.unique(faces[:, side]) for side in range(2)]
    areas = [face_areas(assembly.bodies[body].mesh, one) for body, one in zip(bodies, mine, strict=True)]
    small = [one[area <= LARGE_FACE] for one, area in zip(mine, areas, strict=True)]
    yield from zip(bodies, small if any(map(len, small)) else mine, strict=True)


def face_areas(mesh: TriangleMesh, faces: NDArray[np.int64]) -> FloatArray:
    """Area of each of these faces, square metres."""
    areas: FloatArray = np.linalg.norm(face_normals(mesh.triangles[faces])[0], axis=1) / 2
    return areas


def _log_faces_of(
    writer: RecordingWriter, root: str, assembly: Assembly, body: int, found: dict[Moment, list[NDArray[np.int64]]]
) -> None:
    path = f"{body_path(assembly.bodies[body].name)}/{root}"
    # A row without faces after each stretch, else the patch would stay for ever: the viewer shows the latest row.
    last = len(writer.clock.ns) - 1
    rows = sorted({(0, 0), *found, *((frame + 1, 0) for frame, _ in found if frame < last)})
    triangles = pushed_out(assembly.bodies[body].mesh.triangles)
    per_row = [np.unique(np.concatenate(found[row])) if row in found else NO_FACES for row in rows]
    corners = triangles[np.concatenate(per_row)].reshape(-1, 3).astype(np.float32)
    counts = [3 * len(faces) for faces in per_row]
    writer.rows_later(path, rows, rr.Mesh3D.columns(vertex_positions=corners), counts)
    writer.static(path, rr.Mesh3D.from_fields(albedo_factor=MISSED_FACES))


UP: Final = np.array([0.0, 1.0, 0.0])

NO_FACES: Final = np.zeros(0, dtype=np.int64)


def pushed_out(triangles: FloatArray) -> FloatArray:
    """Triangles (f, 3, 3) moved along their normals by ``PUSHED_OUT``; a face without area stays where it is."""
    moved: FloatArray = triangles + PUSHED_OUT * face_normals(triangles)[1][:, None]
    return moved


def log_pins(writer: RecordingWriter, root: str, misses: Sequence[Miss], reach: float) -> None:
    """Send pins at all times, numbers at clusters of pins, and a flag with words while its miss is current.

    Pins within ``reach`` metres of each other share their numbers: how much that is depends on how far the eye stands.
    """
    points = np.array([miss.point for miss in misses], dtype=np.float32).reshape(-1, 3)
    pins = rr.Points3D(points, colors=packed([MISSED] * len(misses)), radii=rr.Radius.ui_points(4.0))
    writer.static(f"{root}/pins", pins)
    frames, current = current_misses(writer.clock, misses)
    _log_flags(writer, f"{root}/flag", frames, current)
    _log_numbers(writer, f"{root}/numbers", misses, frames, [bool(one) for one in current], reach)


def current_misses(clock: RecordingClock, misses: Sequence[Miss]) -> tuple[list[int], list[list[Miss]]]:
    """Frames at which the set of current misses changes, and the misses current from each on, longest cut first."""
    changes: dict[int, list[tuple[bool, Miss]]] = {0: []}
    begins_at = np.sort([_begin(miss) for miss in misses])
    for miss in misses:
        changes.setdefault(_begin(miss), []).append((True, miss))
        # A flag that lingers makes way for the next miss.
        following = begins_at[np.searchsorted(begins_at, miss.last, side="right") :]
        then = int(following[0]) if len(following) else len(clock.ns)
        after = max(min(clock.frame_at(miss.end + LINGER), then), miss.last + 1)
        if after < len(clock.ns):
            changes.setdefault(after, []).append((False, miss))
    now: dict[int, Miss] = {}
    current = []
    for frame in sorted(changes):
        for begins, miss in changes[frame]:
            if begins:
                now[miss.number] = miss
            else:
                del now[miss.number]
        current.append(by_depth(now.values()))
    return sorted(changes), current


def _begin(miss: Miss) -> int:
    """The frame from which a miss is current: the one before, where it touches on the way to its first."""
    return min(miss.first, miss.shown[0])


def _log_flags(writer: RecordingWriter, path: str, frames: list[int], current: list[list[Miss]]) -> None:
    shown = [misses[:FLAGS_AT_ONCE] for misses in current]
    flat = [(miss, level) for misses in shown for level, miss in enumerate(misses)]
    counts = [len(misses) for misses in shown]
    feet = np.array([miss.point for miss, _ in flat], dtype=np.float32).reshape(-1, 3)
    tops = feet + np.array([[0.0, POLE * (1 + level), 0.0] for _, level in flat], dtype=np.float32).reshape(-1, 3)
    words = [f"{miss.number}  {miss.body_a}-{miss.body_b}" for miss, _ in flat]
    writer.rows(f"{path}/words", frames, rr.Points3D.columns(positions=tops, labels=words), counts)
    poles = np.stack([feet, tops], axis=1)
    writer.rows(f"{path}/pole", frames, rr.LineStrips3D.columns(strips=poles), counts)
    red, radius = packed([MISSED]), rr.Radius.ui_points(1.4)
    writer.static(f"{path}/words", rr.Points3D.from_fields(colors=red, radii=radius, show_labels=True))
    writer.static(f"{path}/pole", rr.LineStrips3D.from_fields(colors=red, radii=radius))


def _log_numbers(
    writer: RecordingWriter, path: str, misses: Sequence[Miss], frames: list[int], busy: list[bool], reach: float
) -> None:
    """Numbers stand at their clusters only while there is no flag: words in space must not overlap."""
    clusters = clustered(misses, reach)[:CLUSTERS]
    rows = [k for k in range(len(frames)) if k == 0 or busy[k] != busy[k - 1]]
    words = [number_ranges(miss.number for miss in cluster) for cluster in clusters]
    tops = [np.mean([m.point for m in cluster], axis=0) + UP * CLUSTER_POLE for cluster in clusters]
    counts = [0 if busy[k] else len(clusters) for k in rows]
    shown = sum(not busy[k] for k in rows)
    positions = np.array(tops * shown, dtype=np.float32).reshape(-1, 3)
    columns = rr.Points3D.columns(positions=positions, labels=words * shown)
    writer.rows(path, [frames[k] for k in rows], columns, counts)
    colour, radius = packed([PARTLY_MISSED]), rr.Radius.ui_points(0.01)
    writer.static(path, rr.Points3D.from_fields(colors=colour, radii=radius, show_labels=True))


def clustered(misses: Sequence[Miss], reach: float) -> list[list[Miss]]:
    """Misses within ``reach`` metres of the first of their cluster, largest cluster first."""
    clusters: dict[Point, list[Miss]] = {}
    for miss in misses:
        near = (one for one in clusters if np.linalg.norm(np.subtract(miss.point, one)) <= reach)
        clusters.setdefault(next(near, miss.point), []).append(miss)
    return sorted(clusters.values(), key=lambda one: -len(one))


def number_ranges(numbers: Iterable[int]) -> str:
    """Numbers in words: ``1-3, 5, 8``."""
    ordered = np.array(sorted(numbers), dtype=np.int64)
    runs = np.split(ordered, np.flatnonzero(np.diff(ordered) > 1) + 1)
    return ", ".join(f"{run[0]}" if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)
