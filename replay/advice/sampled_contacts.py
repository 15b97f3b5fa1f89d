"""Whether the alternatives of an assumption change the contacts of a recording, by a few frames and without kernels.

An import in a pipe asks this before it tries every alternative in full: starting the kernels takes as long as a short
import. Bodies that never come within reach have no contact under any alternative; one frame with a contact under one
alternative and without one under another decides too. Neither is decided by the rest.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions import MeshData, Session
from sessions.errors import SessionError
from sessions.geometry.rotations import rotated
from sessions.model.assumption import Assumption, Subject
from sessions.model.frames import Status
from sessions.model.scene import Pose, candidate_pairs
from sessions.scene_files.answers import answered
from sessions.scene_files.pose_axes import follows_its_poses

MOST_FRAMES: Final = 12_000
"""Frames whose distances are looked up; of more, evenly chosen ones, as many as are replayed."""

FRAMES_OF_A_PAIR: Final = 64
"""Frames within reach in which the boxes of a pair are compared."""

TESTS_OF_A_PAIR: Final = 16
"""Frames of each of these in which its triangles may be tested."""

BLOCK: Final = 1000
"""Frames in which boxes are compared at once."""

MOST_TESTS: Final = 64
"""Frames of all pairs in which triangles are tested; a test takes some milliseconds."""

MOST_FACE_PAIRS: Final = 200_000
"""Pairs of faces with overlapping boxes that a test looks at; more are left undecided."""

CLEARLY_BETTER_M: Final = 0.005
"""Metres by which the bounds of colliders fit their meshes better in other axes before these are asked for."""

USABLE: Final = (Status.VALID, Status.HELD, Status.INTERPOLATED)

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


_NearPair = tuple[tuple[str, str], tuple[int, int], Rows]
"""Two bodies, their columns, and the rows in which they are within reach of each other."""


@dataclass(frozen=True, eq=False)
class _Scene:
    """A recording under one alternative in k chosen frames: positions (k, N, 3) and quaternions xyzw (k, N, 4)."""

    meshes: Mapping[str, MeshData]
    positions: Array
    quaternions: Array


@dataclass(frozen=True)
class _Candidate:
    """A pair in a chosen frame; ``depths``: metres that its boxes overlap under each alternative."""

    pair: tuple[str, str]
    columns: tuple[int, int]
    row: int
    rank: int
    depths: tuple[float, ...]

    @property
    def order(self) -> tuple[int, bool, float]:
        """Smaller where contacts likelier differ: boxes are disjoint under an alternative, deep under another."""
        return self.rank, min(self.depths) >= 0.0, -max(self.depths)


def alternatives_differ(session: Session, assumption: Assumption) -> bool | None:
    """Returns whether the alternatives of an assumption change contacts; ``None``: a few frames do not decide it.

    Colliders have no contacts of their own here; theirs differ where others than those assumed fit their meshes better.
    """
    if assumption.subject is Subject.COLLIDER_AXES:
        return best_fitting_axes(session, assumption) != assumption.value
    if not is_plain(session):
        return None
    if assumption.subject is Subject.POSE_AXES and _all_follow(session, assumption):
        return False
    frames = session.frames
    rows = evenly(len(frames), MOST_FRAMES)
    values = (assumption.value, *assumption.alternatives)
    try:
        scenes = _scenes(session, assumption, dict.fromkeys(values), rows)
    except SessionError:
        return None
    usable = np.isin(frames.status[rows], USABLE)
    candidates, near_pairs, is_known = list[_Candidate](), list[_NearPair](), True
    for pair in candidate_pairs(session.scene, [name for name in session.names if name in session.meshes]):
        columns = frames.names.index(pair[0]), frames.names.index(pair[1])
        both = np.flatnonzero(usable[:, columns[0]] & usable[:, columns[1]])
        near = both[_is_within_reach(scenes, pair, columns, both)]
        candidates += _candidates(scenes, pair, columns, near)
        near_pairs.append((pair, columns, near))
        # Of bodies with clocks of their own no frame holds both: nothing is known of their distance.
        is_known &= len(both) > 0
    if _contacts_differ(scenes, candidates):
        return True
    return False if is_known and _are_apart(scenes, near_pairs) else None


def _are_apart(scenes: Sequence[_Scene], near_pairs: Sequence[_NearPair]) -> bool:
    """Whether the boxes of all pairs are disjoint under every alternative, in every frame within reach."""
    return all(
        bool((_box_depths(scene, pair, columns, rows[start : start + BLOCK]) < 0.0).all())
        for pair, columns, rows in near_pairs
        for start in range(0, len(rows), BLOCK)
        for scene in scenes
    )


def _all_follow(session: Session, row: Assumption) -> bool:
    """Whether all meshes turn with the poses under every alternative."""
    others = (value for value in row.alternatives if value != row.value)
    return all(follows_its_poses(session, answered(session, row, value)) for value in others)


def _scenes(session: Session, assumption: Assumption, values: Iterable[str], rows: Rows) -> list[_Scene]:
    """The recording under each value; those that differ in their meshes alone share their poses."""
    own = session.frames
    positions, quaternions = own.position[rows], own.quaternion_xyzw[rows]
    scenes = []
    for value in values:
        changed = session if value == assumption.value else answered(session, assumption, value)
        if changed.source is session.source:
            scenes.append(_Scene(changed.meshes, positions, quaternions))
        else:
            moved = changed.frames
            scenes.append(_Scene(changed.meshes, moved.position[rows], moved.quaternion_xyzw[rows]))
    return scenes


def is_plain(session: Session) -> bool:
    """Returns whether every body stands where its track says."""
    return all(body.fixed is None and not body.parent and body.offset == Pose() for body in session.scene.bodies)


def _is_within_reach(
    scenes: Sequence[_Scene], pair: tuple[str, str], columns: tuple[int, int], rows: Rows
) -> NDArray[np.bool_]:
    """Whether spheres about the origins of two bodies overlap under any alternative, for each row."""
    within = np.zeros(len(rows), dtype=np.bool_)
    reach = max(
        sum(float(np.linalg.norm(scene.meshes[name].vertices, axis=1).max()) for name in pair) for scene in scenes
    )
    for positions in {id(scene.positions): scene.positions for scene in scenes}.values():
        between = positions[rows, columns[0]] - positions[rows, columns[1]]
        within |= (between * between).sum(axis=1) <= reach**2
    return within


def _candidates(
    scenes: Sequence[_Scene], pair: tuple[str, str], columns: tuple[int, int], rows: Rows
) -> Iterator[_Candidate]:
    """Frames in which the boxes of a pair overlap, the deepest first; those with a separated alternative come first."""
    if not len(rows):
        return
    chosen = rows[evenly(len(rows), FRAMES_OF_A_PAIR)]
    depths = np.stack([_box_depths(scene, pair, columns, chosen) for scene in scenes])
    deepest, is_separated = depths.max(axis=0), depths.min(axis=0) < 0.0
    for mask in (is_separated, ~is_separated):
        overlapping = np.flatnonzero(mask & (deepest > 0.0))
        if len(overlapping):
            best = overlapping[deepest[overlapping].argmax()]
            others = overlapping[evenly(len(overlapping), TESTS_OF_A_PAIR)]
            for rank, column in enumerate(dict.fromkeys([best, *others])):
                yield _Candidate(pair, columns, int(chosen[column]), rank, tuple(depths[:, column].tolist()))


def evenly(count: int, most: int) -> Rows:
    """Returns at most so many of the numbers below a count, evenly chosen."""
    if not count:
        return np.zeros(0, dtype=np.intp)
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _box_depths(scene: _Scene, pair: tuple[str, str], columns: tuple[int, int], rows: Rows) -> Array:
    """Metres by which the boxes of two bodies overlap along the axes of both, (k,); below 0 they are disjoint."""
    bounds = [scene.meshes[name].bounds for name in pair]
    half = [0.5 * (box[1] - box[0]) for box in bounds]
    rotations = [rotated(scene.quaternions[rows, column][:, None], np.eye(3)).transpose(0, 2, 1) for column in columns]
    middles = [
        scene.positions[rows, column] + rotation @ box.mean(axis=0)
        for column, rotation, box in zip(columns, rotations, bounds, strict=True)
    ]
    between = middles[1] - middles[0]
    relative = np.abs(np.einsum("kji,kjl->kil", rotations[0], rotations[1]))
    along_first = half[0] + relative @ half[1] - np.abs(np.einsum("kji,kj->ki", rotations[0], between))
    along_second = half[1] + half[0] @ relative - np.abs(np.einsum("kji,kj->ki", rotations[1], between))
    depths: Array = np.minimum(along_first, along_second).min(axis=1)
    return depths


def _contacts_differ(scenes: Sequence[_Scene], candidates: Sequence[_Candidate]) -> bool:
    """Whether in one of the tested frames two alternatives have different contacts."""
    likely = sorted(candidates, key=lambda candidate: candidate.order)
    for candidate in likely[:MOST_TESTS]:
        contacts = [
            depth >= 0.0 and _in_contact(scene, candidate)
            for scene, depth in zip(scenes, candidate.depths, strict=True)
        ]
        known = [contact for contact in contacts if contact is not None]
        if any(before != after for before, after in pairwise(known)):
            return True
    return False


def _in_contact(scene: _Scene, candidate: _Candidate) -> bool | None:
    """Whether faces of two bodies cross in a frame; ``None``: it is not tested, or a body may be inside the other."""
    corners = []
    for name, column in zip(candidate.pair, candidate.columns, strict=True):
        mesh = scene.meshes[name]
        world = rotated(scene.quaternions[candidate.row, column], mesh.vertices)
        world += scene.positions[candidate.row, column]
        corners.append(world[mesh.faces])
    crosses = faces_cross(corners[0], corners[1])
    return None if crosses is False and _may_contain(corners[0], corners[1]) else crosses


def _may_contain(first: Array, second: Array) -> bool:
    """Whether the bounds of the faces (n, 3, 3) of a body lie within those of the other."""
    (lower_a, upper_a), (lower_b, upper_b) = (
        (faces.min(axis=(0, 1)), faces.max(axis=(0, 1))) for faces in (first, second)
    )
    is_first_inside = (lower_b <= lower_a).all() and (upper_a <= upper_b).all()
    return bool(is_first_inside or ((lower_a <= lower_b).all() and (upper_b <= upper_a).all()))


def faces_cross(first: Array, second: Array) -> bool | None:
    """Returns whether an edge of a face (n, 3, 3) crosses a face (m, 3, 3); ``None``: too many faces are near.

    In float64 without bounds of error: two surfaces that only touch may be taken for either.
    """
    for _ in range(2):
        first = _near(first, second)
        second = _near(second, first)
    if not len(first) or not len(second):
        return False
    if len(first) * len(second) > 100 * MOST_FACE_PAIRS:
        return None
    overlap = np.ones((len(first), len(second)), dtype=np.bool_)
    for axis in range(3):
        lower_a, upper_a = first[:, :, axis].min(axis=1), first[:, :, axis].max(axis=1)
        lower_b, upper_b = second[:, :, axis].min(axis=1), second[:, :, axis].max(axis=1)
        overlap &= (lower_a[:, None] <= upper_b) & (lower_b <= upper_a[:, None])
    a, b = np.nonzero(overlap)
    if len(a) > MOST_FACE_PAIRS:
        return None
    return bool(_edges_cross(first[a], second[b]) or _edges_cross(second[b], first[a]))


def _near(faces: Array, others: Array) -> Array:
    """The faces whose bounds overlap those of all the others."""
    if not len(others):
        return faces[:0]
    lower, upper = others.min(axis=(0, 1)), others.max(axis=(0, 1))
    return faces[((faces.min(axis=1) <= upper) & (faces.max(axis=1) >= lower)).all(axis=1)]


def _edges_cross(faces: Array, others: Array) -> bool:
    """Whether an edge of a face (k, 3, 3) crosses the other face beside it (k, 3, 3).

    Source: Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    """
    base, along, across = others[:, 0], others[:, 1] - others[:, 0], others[:, 2] - others[:, 0]
    for corner in range(3):
        start = faces[:, corner]
        edge = faces[:, (corner + 1) % 3] - start
        normal = np.cross(edge, across)
        determinant = (along * normal).sum(axis=1)
        offset = start - base
        second_normal = np.cross(offset, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (offset * normal).sum(axis=1) / determinant
            v = (edge * second_normal).sum(axis=1) / determinant
            t = (across * second_normal).sum(axis=1) / determinant
            is_crossed = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
        if is_crossed.any():
            return True
    return False


def best_fitting_axes(session: Session, row: Assumption) -> str:
    """Returns the axes of colliders whose bounds are clearly nearer to those of their meshes, else those assumed."""
    values = tuple(dict.fromkeys((row.value, *row.alternatives)))
    misfits = {
        value: collider_misfit(session if value == row.value else answered(session, row, value), row.bodies)
        for value in values
    }
    best = min(values, key=lambda value: misfits[value])
    return best if misfits[row.value] - misfits[best] > CLEARLY_BETTER_M else row.value


def collider_misfit(session: Session, names: Sequence[str]) -> float:
    """Returns the metres by which the bounds of colliders and of their meshes differ at most; 0 without a mesh."""
    misfit = 0.0
    for name in names:
        solids: Sequence[MeshData] = session.colliders.get(name, ())
        if name in session.meshes and solids:
            bounds = np.stack([solid.bounds for solid in solids])
            whole = np.stack([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)])
            misfit = max(misfit, float(np.abs(whole - session.meshes[name].bounds).max()))
    return misfit
