"""Every stretch of contact that a detector reports and the oracle does not gets one number, in order of time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Detection, Motion, Verdict, create_detector
from cdcore.numerics import FloatArray, place_points
from cdcore.protocol import NO_FACES, REFUSED, Explains, PairDetector, counts_as_contact, is_one_of
from replay.comparison.causes import Audited, Cause, delay_cause
from replay.comparison.contact_counts import REPORTED
from replay.comparison.contact_reach import contact_reach, offset_setting
from replay.comparison.delay import at_frame
from replay.comparison.episodes import column_runs
from replay.comparison.evidence import looks
from replay.comparison.misses import kind_within
from replay.comparison.outcome import Comparison, Outcome, Stretch
from replay.detection.recorded import RecordedDetector
from replay.effects.output import Vector, vector_of
from replay.prepare.assembly import Assembly
from replay.prepare.frame_times import frame_ends
from sessions.doctor.runs import runs

if TYPE_CHECKING:
    from cdcore.narrow.mesh_stage import MeshStage

FALSE_KINDS: Final = ("nothing there", "starts early", "ends late", "joins two contacts")
_, STARTS_EARLY, ENDS_LATE, JOINS_TWO = FALSE_KINDS
"""By whether the report holds true contact after the stretch, and (two places on) before it."""

VOLUMES: Final = "only bounding volumes overlap"
"""Cause of what is *unconfirmed*: a candidate, whose triangles nobody asked."""

OFFSET: Final = "contact offset"
"""The colliders do not meet, and are nearer to each other than the detector's contact offset reaches."""

SOLIDS: Final = "colliders meet, surfaces do not"
HOLLOW: Final = "hull fills a hollow"
"""A part of the other body is in a hull, and outside the mesh that it stands for."""

HELD: Final = "held since its last sample"
UNEXPLAINED: Final = "unexplained"

LOOKS: Final = 9
LOOKS_IN_ALL: Final = 1000
"""Frames in which the gap of a stretch is measured, and of all stretches: a distance of meshes takes milliseconds.
With more stretches than that the longest ones are measured."""


MOST_VERTICES: Final = 500
"""Vertices of a body that are asked whether a hull holds them."""


@dataclass(frozen=True, slots=True)
class FalseContact(Stretch):
    """One numbered false positive: a stretch of reported contact in which the oracle sees none.

    Parameters
    ----------
    kind : one of ``FALSE_KINDS``.
    widest : of the frames looked at, the one in which the meshes are farthest apart.
    gap : metres between the meshes there; nan: not measured.
    point : the middle between their nearest points there, or between the bodies' origins; world metres.
    ends : those nearest points; ``None``: not measured.
    cause : why it was reported, in a word or two; ``why``: the sentence about it.
    hollow : name of the body whose convex hull fills a hollow, where that is the cause; else ``""``.
    """

    widest: int
    gap: float
    point: Vector
    cause: str = ""
    hollow: str = ""
    ends: tuple[Vector, Vector] | None = None
    why: str = ""


class _Shapes:
    """The shapes that a detector puts in place of the meshes, without its contact offset."""

    def __init__(self, detector: object) -> None:
        self._detector = detector

    @cached_property
    def _bare(self) -> Explains | None:
        detector = self._detector
        if not isinstance(detector, PairDetector) or not offset_setting(detector.name):
            return None
        shape = getattr(detector.settings, "shape", "hull")
        made = create_detector("collider", detector.bodies, pairs=detector.pairs, shape=shape)
        return made if isinstance(made, Explains) else None

    def meet(self, motion: Motion, frame: int, pair: int) -> bool:
        """Whether the shapes of a pair meet; of a detector whose shapes are not known, what it says itself."""
        if self._bare is None:
            return True
        return bool(self._bare.explain(motion, frame, pair, NO_FACES.astype(np.int64)).shapes_meet)


class _Hulls:
    """The convex hulls of the bodies of an assembly, each made when it is first asked for."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly, self._planes = assembly, dict[int, FloatArray]()

    def hollow_at(self, pair: int, frame: int) -> str:
        """Name of the body of a pair into whose convex hull the other reaches, at a frame without contact.

        Of two such bodies the one into whose hull more vertices reach; ``""``: neither.
        """
        ends = self._assembly.pairs[pair].tolist()
        inside = [self._inside(frame, body, other) for body, other in (ends, ends[::-1])]
        most = int(inside[1] > inside[0])
        return self._assembly.names[ends[most]] if inside[most] else ""

    def _inside(self, frame: int, body: int, other: int) -> int:
        """How many vertices of another body, of some spread over it, are in the convex hull of a body."""
        motion, bodies = self._assembly.motion, self._assembly.bodies
        vertices = bodies[other].mesh.vertices
        some = vertices[:: 1 + len(vertices) // MOST_VERTICES]
        world = place_points(some, motion.rotations[frame, other], motion.translations[frame, other])
        local = (world - motion.translations[frame, body]) @ motion.rotations[frame, body]
        # Few vertices are in the box around the hull, and a hull has thousands of planes.
        hollowed = bodies[body].mesh.vertices
        near = local[((local >= hollowed.min(axis=0)) & (local <= hollowed.max(axis=0))).all(axis=1)]
        planes = self._hull_planes(body, hollowed)
        return int((near @ planes[:, :3].T + planes[:, 3] < 0.0).all(axis=1).sum()) if len(planes) else 0

    def _hull_planes(self, body: int, vertices: FloatArray) -> FloatArray:
        """Planes (n, 4) of the convex hull of a body, normals outwards, in its own frame; none of a flat mesh."""
        from scipy.spatial import ConvexHull, QhullError

        if body not in self._planes:
            try:
                self._planes[body] = ConvexHull(vertices).equations
            except QhullError:
                self._planes[body] = np.zeros((0, 4))
        return self._planes[body]


def false_contacts(assembly: Assembly, comparison: Comparison, by: Audited) -> tuple[FalseContact, ...]:
    """Number the false stretches of a comparison, in order of time, then pair; what a hand holds is none.

    ``by``: who reports them.
    """
    outcome, times = comparison.outcome, assembly.motion.times
    ends = frame_ends(times)
    found = column_runs(column == Outcome.INVENTED for column in outcome.T)
    if not len(found):
        return ()
    # Here, since a run without a detection loads no collision engine.
    from cdcore.narrow.mesh_stage import MeshStage

    longest = np.argsort([first - last for _, first, last in found.tolist()], kind="stable")[:LOOKS_IN_ALL]
    most = min(LOOKS, LOOKS_IN_ALL // len(longest))
    reports = cache(lambda pair: runs(is_one_of(outcome[:, pair], REPORTED)))
    measured, meshes, made = set(longest.tolist()), MeshStage(assembly.bodies, assembly.pairs), list[FalseContact]()
    shapes = _Shapes(by.detector)
    hulls = _Hulls(assembly) if getattr(getattr(by.detector, "settings", None), "shape", None) == "hull" else None
    for number, (pair, first, last) in enumerate(found.tolist(), 1):
        # Not its ends: there the pair is about to part, and the next moment is near.
        inner = (last - first) // 4
        frames = looks(first + inner, last - inner, most if number - 1 in measured else 1).tolist()
        gap, frame, point, between = _widest(meshes if number - 1 in measured else None, assembly, pair, frames)
        begin, end = reports(pair)[np.searchsorted(reports(pair)[:, 0], first, side="right") - 1].tolist()
        one = FalseContact(
            number, pair, *assembly.bodies_of(pair), first, last, float(times[first]), float(ends[last]),
            kind_within(FALSE_KINDS, outcome[:, pair], (begin, end), first, last), frame, gap, point, ends=between,
        )  # fmt: skip
        cause = _cause(by, one)
        if cause == SOLIDS and not shapes.meet(by.motion, frame, pair):
            cause = OFFSET if contact_reach(by.detector, pair) > 0.0 else UNEXPLAINED
        hollow = ""
        if cause == SOLIDS and hulls is not None and _side_is_known(by.oracle, pair):
            hollow = hulls.hollow_at(pair, frame)
        made.append(replace(one, cause=HOLLOW if hollow else cause, hollow=hollow))
    return tuple(made)


def _side_is_known(oracle: Detection, pair: int) -> bool:
    """Whether CLEAR of a pair says that neither body is inside the other: else a hollow was not measured."""
    words = oracle.containment[pair] if oracle.containment else REFUSED
    return not words.startswith(REFUSED)


def _widest(
    meshes: "MeshStage | None", assembly: Assembly, pair: int, frames: Sequence[int]
) -> tuple[float, int, Vector, tuple[Vector, Vector] | None]:
    """The largest gap, the frame that shows it, and the middle and the ends of the gap."""
    if meshes is None:
        ends = assembly.motion.translations[frames[0], assembly.pairs[pair]]
        return float("nan"), frames[0], vector_of(ends.mean(axis=0)), None
    gaps = [(meshes.gap(assembly.motion, frame, pair), frame) for frame in frames]
    (gap, ends), frame = max(gaps, key=lambda one: one[0][0])
    return gap, frame, vector_of(ends.mean(axis=0)), (vector_of(ends[0]), vector_of(ends[1]))


def _cause(by: Audited, one: FalseContact) -> str:
    if by.subject.verdict[one.widest, one.pair] == Verdict.CANDIDATE:
        return VOLUMES
    stages = by.stages(one.widest, one.pair, NO_FACES.astype(np.int64))
    if stages.within_clock:
        return Cause.CLOCK.value
    # Shape before rate: a look at solids that meet there would have said the same.
    if stages.shapes_meet:
        return SOLIDS
    if isinstance(by.detector, RecordedDetector):
        return _reported(by.detector, one, float(by.motion.times[one.last]))
    if stages.looked is False:
        return HELD
    # Late or early where all that is said of the pair is so by a constant number of frames, as here.
    delay = by.delay(one.pair)
    moved = delay != 0 and at_frame(counts_as_contact(by.oracle.verdict[:, one.pair]), one.widest - delay)
    return delay_cause(delay).value if moved else UNEXPLAINED


def _reported(detector: RecordedDetector, one: FalseContact, last: float) -> str:
    """Why an engine's reports hold a stretch: no step came that could see its end, or they are late or early.

    ``last``: second of its last frame.
    """
    joins = one.kind == JOINS_TWO and detector.stepped(one.start, last) is False
    if joins or (one.kind == ENDS_LATE and detector.ended_at_next_step(one.pair, one.start)):
        return Cause.BETWEEN_STEPS.value
    return {ENDS_LATE: Cause.LATE.value, STARTS_EARLY: Cause.EARLY.value}.get(one.kind, UNEXPLAINED)
