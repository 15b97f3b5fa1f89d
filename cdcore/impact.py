"""When two moving meshes first meet between two poses: HIT with its interval, FREE by proof, or why neither."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from cdcore.containment.containment_stage import ContainmentStage
from cdcore.errors import InvalidPoseError
from cdcore.mesh import TriangleMesh
from cdcore.narrow.bvh.box_tree import BoxTree, box_trees_of
from cdcore.narrow.bvh.whole_motion import decide_motion
from cdcore.narrow.continuous.interval_search import FREE, HIT
from cdcore.narrow.continuous.segment_stage import DEFAULT_EFFORT, DEFAULT_TOLERANCE, SegmentStage
from cdcore.protocol import Body, Motion, Verdict
from cdcore.protocol.settings import MOST_METRES, MOST_WORK, CheckedSettings, number, whole


class Impact(Enum):
    """Result of a query about the motion between two poses."""

    HIT = "HIT"
    """The surfaces meet; seen on triangles, exactly."""
    FREE = "FREE"
    """Proven: at no time do the surfaces meet."""
    UNRESOLVED = "UNRESOLVED"
    """Neither, with a reason."""


@dataclass(frozen=True, kw_only=True)
class ImpactSettings(CheckedSettings):
    """``tolerance``: metres; what comes no closer is always decided. ``effort``: most tests spent on what is nearer."""

    tolerance: float = number(DEFAULT_TOLERANCE, 0, MOST_METRES, above=True, unit="metres")
    effort: int = whole(DEFAULT_EFFORT, 0, MOST_WORK)


@dataclass(frozen=True)
class TimeOfImpact:
    """The answer of :func:`time_of_impact`.

    Parameters
    ----------
    verdict : HIT, FREE or UNRESOLVED.
    toi : seconds (lower, upper): nothing touches before ``lower``, at ``upper`` a contact was seen; where UNRESOLVED,
        the time within which the question is open; ``None`` where FREE.
    faces : a face of A and one of B that meet at ``upper``; ``None`` unless HIT.
    inside : at the start, whether a part of one mesh is inside the other, without touching; ``None`` where holes of the
        outer one leave that open. Where FREE it stays so throughout, unless a mesh has holes to pass through.
    reason : why UNRESOLVED.
    """

    verdict: Impact
    toi: tuple[float, float] | None
    faces: tuple[int, int] | None
    inside: bool | None
    reason: str = ""


def time_of_impact(
    mesh_a: TriangleMesh,
    poses_a: ArrayLike,
    mesh_b: TriangleMesh,
    poses_b: ArrayLike,
    *,
    times: tuple[float, float] = (0.0, 1.0),
    tolerance: float = DEFAULT_TOLERANCE,
    effort: int = DEFAULT_EFFORT,
) -> TimeOfImpact:
    """When two meshes first meet on their motion from one pose to another.

    Body origins move along lines, rotations turn at a constant rate along the shorter arc, both at once. Choose it for
    one motion of one pair; for a recording the detector ``continuous`` builds its trees once.

    Parameters
    ----------
    mesh_a, mesh_b : surfaces, open or closed, degenerate faces allowed.
    poses_a, poses_b : (2, 4, 4) body to world at both times, column convention.
    times : seconds of both poses.
    tolerance : metres; meshes that come no closer than this are always decided, nearer ones almost always.
    effort : most tests spent on what is nearer.

    Returns
    -------
    TimeOfImpact
        ``toi`` is at most 1e-6 s wide where HIT; wider only where the bodies graze or creep nearer than rounding can
        tell, which far from the origin is more.

    Raises
    ------
    InvalidPoseError
        A pose is not finite or not rigid; body 0 is A, body 1 is B.
    InvalidSettingError
        The tolerance is no distance, or the effort no count.

    Notes
    -----
    Differs: the literature's conservative advancement bounds the speed of the nearest points; here faces are followed
    along their chords, whose error falls with the square of the time, so that sliding surfaces cost little.

    Source: section 2.1 of the project's specification. Cost: 0.01 to 3 ms.

    Examples
    --------
    >>> floor = TriangleMesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> poses = np.tile(np.eye(4), (2, 1, 1))
    >>> fall = poses.copy()
    >>> fall[:, 2, 3] = 0.25, -0.75
    >>> lower, upper = time_of_impact(floor, fall, floor, poses).toi
    >>> lower <= 0.25 <= upper < lower + 1e-6
    True
    """
    ImpactSettings(tolerance=tolerance, effort=effort)
    stacked = np.stack([_two(poses_a, "poses_a"), _two(poses_b, "poses_b")], axis=1)
    motion = Motion.from_matrices(times, stacked, names=("A", "B"))
    trees = box_trees_of([mesh_a, mesh_b])
    touching = _touching_faces(trees, motion)
    if touching is not None:
        start = float(motion.times[0])
        return TimeOfImpact(Impact.HIT, (start, start), touching, False)
    pair, first_frame = np.array([[0, 1]]), np.array([1])
    stage = SegmentStage(trees, pair, tolerance=tolerance, effort=effort)
    answer = stage.decide(motion.times, motion.rotations, motion.translations, first_frame, np.array([0]))
    state, inside = int(answer.states[0]), _inside(mesh_a, mesh_b, motion.frames(0, 1))
    if state == FREE:
        return TimeOfImpact(Impact.FREE, None, None, inside)
    toi = (float(answer.impact[0, 0]), float(answer.impact[0, 1]))
    if state == HIT:
        return TimeOfImpact(Impact.HIT, toi, (int(answer.faces[0, 0]), int(answer.faces[0, 1])), inside)
    return TimeOfImpact(Impact.UNRESOLVED, toi, None, inside, stage.reason(state))


def _two(poses: ArrayLike, what: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    try:
        array = np.asarray(poses, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidPoseError(f"{what} are not an array of numbers ({error}); give (2, 4, 4)") from None
    if array.shape != (2, 4, 4):
        raise InvalidPoseError(f"{what} have shape {array.shape}; give (2, 4, 4): one pose at each of both times")
    return array


def _touching_faces(trees: list[BoxTree], motion: Motion) -> tuple[int, int] | None:
    """The first faces that meet at the start."""
    meeting = decide_motion(trees, np.array([[0, 1]]), motion.frames(0, 1), faces=True).sets.faces
    return (int(meeting[0, 0]), int(meeting[0, 1])) if len(meeting) else None


def _inside(mesh_a: TriangleMesh, mesh_b: TriangleMesh, start: Motion) -> bool | None:
    """Whether one is inside the other at the start; ``None`` where that is undecided."""
    stage = ContainmentStage([Body("A", mesh_a), Body("B", mesh_b)], np.array([[0, 1]]))
    verdict, _ = stage.verdict_now(start, 0)
    return None if verdict == Verdict.UNRESOLVED else verdict == Verdict.CONTAINED
