"""False contacts of a detector as faults, numbered in order of time."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Detection, Motion, Verdict, create_detector
from cdcore.detectors.detector_table import detector_row
from cdcore.numerics import FloatArray
from cdcore.poses import place_points
from cdcore.protocol import NO_FACES, REFUSED, Explains, PairDetector, counts_as_contact, is_one_of
from replay.auditing.causes import Audited, delay_cause
from replay.auditing.contact_counts import REPORTED_OUTCOMES
from replay.auditing.delay import at_frame
from replay.auditing.episodes import column_runs
from replay.auditing.fault import Cause, Evidence, Fault, FaultKind
from replay.auditing.misses import reported_around
from replay.auditing.outcome import Comparison, Outcome
from replay.auditing.sample_budget import spread_frames
from replay.detection.recorded import RecordedDetector
from replay.effects.output import vector_of
from replay.prepare.assembly import Assembly
from replay.prepare.frame_times import frame_ends
from sessions.doctor.runs import runs

if TYPE_CHECKING:
    from cdcore.narrow.mesh_stage import MeshStage

GAP_FRAMES: Final = 9
GAP_FRAMES_TOTAL: Final = 1000
"""Frames in which the gap of a stretch is measured, and of all stretches: a distance of meshes takes milliseconds.
With more stretches than that the longest ones are measured."""


MOST_VERTICES: Final = 500
"""Vertices of a body that are asked whether a hull holds them."""


class _Shapes:
    """The shapes that a detector puts in place of the meshes, without its contact offset."""

    def __init__(self, detector: object) -> None:
        self._detector = detector

    @cached_property
    def _bare(self) -> Explains | None:
        detector = self._detector
        if not isinstance(detector, PairDetector) or not detector_row(detector.name).contact_offset:
            return None
        shape = getattr(detector.settings, "shape", "hull")
        collider = create_detector("collider", detector.bodies, pairs=detector.pairs, shape=shape)
        return collider if isinstance(collider, Explains) else None

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
        """Name of the body, or of its group, into whose convex hull the other reaches, at a frame without contact.

        Of two such bodies the one into whose hull more vertices reach; ``""``: neither.
        """
        pair_bodies = self._assembly.pairs[pair].tolist()
        vertices_inside = [
            self._vertices_inside(frame, body, other) for body, other in (pair_bodies, pair_bodies[::-1])
        ]
        deeper_side = int(vertices_inside[1] > vertices_inside[0])
        return self._assembly.fault_names(pair)[deeper_side] if vertices_inside[deeper_side] else ""

    def _vertices_inside(self, frame: int, body: int, other_body: int) -> int:
        """How many vertices of another body, of some spread over it, are in the convex hull of a body."""
        motion, bodies = self._assembly.motion, self._assembly.bodies
        vertices = bodies[other_body].mesh.vertices
        sampled_vertices = vertices[:: 1 + len(vertices) // MOST_VERTICES]
        world_points = place_points(
            sampled_vertices, motion.rotations[frame, other_body], motion.translations[frame, other_body]
        )
        local_points = (world_points - motion.translations[frame, body]) @ motion.rotations[frame, body]
        # Few vertices are in the box around the hull, and a hull has thousands of planes.
        hull_vertices = bodies[body].mesh.vertices
        vertices_in_box = local_points[
            ((local_points >= hull_vertices.min(axis=0)) & (local_points <= hull_vertices.max(axis=0))).all(axis=1)
        ]
        hull_planes = self._hull_planes(body, hull_vertices)
        return (
            int((vertices_in_box @ hull_planes[:, :3].T + hull_planes[:, 3] < 0.0).all(axis=1).sum())
            if len(hull_planes)
            else 0
        )

    def _hull_planes(self, body: int, vertices: FloatArray) -> FloatArray:
        """Planes (n, 4) of the convex hull of a body, normals outwards, in its own frame; none of a flat mesh."""
        from scipy.spatial import ConvexHull, QhullError

        if body not in self._planes:
            try:
                self._planes[body] = ConvexHull(vertices).equations
            except QhullError:
                self._planes[body] = np.zeros((0, 4))
        return self._planes[body]


def false_contacts(assembly: Assembly, comparison: Comparison, audited: Audited) -> tuple[Fault, ...]:
    """Return the false contacts of a comparison, in order of time, then pair; what a hand holds is none.

    ``audited``: who reports them.
    """
    outcome, times = comparison.outcome, assembly.motion.times
    end_times = frame_ends(times)
    segments = column_runs(column == Outcome.FALSE_CONTACT for column in outcome.T)
    if not len(segments):
        return ()
    # Here, since a run without a detection loads no collision engine.
    from cdcore.narrow.mesh_stage import MeshStage

    longest = np.argsort([first - last for _, first, last in segments.tolist()], kind="stable")[:GAP_FRAMES_TOTAL]
    most_frames = min(GAP_FRAMES, GAP_FRAMES_TOTAL // len(longest))
    reports_of_pair = cache(lambda pair: runs(is_one_of(outcome[:, pair], REPORTED_OUTCOMES)))
    measured_indices, meshes, faults = set(longest.tolist()), MeshStage(assembly.bodies, assembly.pairs), list[Fault]()
    shapes = _Shapes(audited.detector)
    hulls = _Hulls(assembly) if getattr(getattr(audited.detector, "settings", None), "shape", None) == "hull" else None
    for number, (pair, first, last) in enumerate(segments.tolist(), 1):
        # Not its ends: there the pair is about to part, and the next moment is near.
        quarter_frames = (last - first) // 4
        frames = spread_frames(
            first + quarter_frames, last - quarter_frames, most_frames if number - 1 in measured_indices else 1
        ).tolist()
        report_frames = reports_of_pair(pair)[np.searchsorted(reports_of_pair(pair)[:, 0], first, side="right") - 1]
        contact_before, contact_after = reported_around(
            outcome[:, pair], int(report_frames[0]), int(report_frames[1]), first, last
        )
        fault = Fault(
            number=number,
            detector=comparison.subject,
            pair=pair,
            bodies=assembly.things_of(pair),
            labels=assembly.fault_names(pair),
            kind=_false_kind(contact_before=contact_before, contact_after=contact_after),
            first=first,
            last=last,
            start=float(times[first]),
            end=float(end_times[last]),
            frame=frames[0],
        )
        fault = _with_largest_gap(fault, assembly, meshes if number - 1 in measured_indices else None, frames)
        faults.append(_with_cause(fault, audited, shapes, hulls))
    return tuple(faults)


def _false_kind(*, contact_before: bool, contact_after: bool) -> FaultKind:
    if contact_before and contact_after:
        return FaultKind.JOINS_TWO
    if contact_before:
        return FaultKind.ENDS_LATE
    return FaultKind.STARTS_EARLY if contact_after else FaultKind.NO_CONTACT


def _side_is_known(oracle: Detection, pair: int) -> bool:
    """Whether CLEAR of a pair says that neither body is inside the other: else a hollow was not measured."""
    answer = oracle.containment[pair] if oracle.containment else REFUSED
    return not answer.startswith(REFUSED)


def _with_largest_gap(fault: Fault, assembly: Assembly, meshes: "MeshStage | None", frames: Sequence[int]) -> Fault:
    """Return a false contact with its largest gap, the frame of it, its middle and its ends."""
    if meshes is None:
        origins = assembly.motion.translations[frames[0], assembly.pairs[fault.pair]]
        return replace(fault, point=vector_of(origins.mean(axis=0)))
    gaps = [(meshes.gap(assembly.motion, frame, fault.pair), frame) for frame in frames]
    (gap, nearest_points), frame = max(gaps, key=lambda measured: measured[0][0])
    evidence = Evidence(nearest=(vector_of(nearest_points[0]), vector_of(nearest_points[1])))
    return replace(fault, frame=frame, point=vector_of(nearest_points.mean(axis=0)), metres=gap, evidence=evidence)


def _with_cause(fault: Fault, audited: Audited, shapes: _Shapes, hulls: _Hulls | None) -> Fault:
    """Return a false contact with its cause."""
    cause = _cause(audited, fault)
    if cause is not Cause.COLLIDERS_MEET:
        return replace(fault, cause=cause)
    if not shapes.meet(audited.motion, fault.frame, fault.pair):
        in_reach = audited.contact_reach(fault.pair) > 0.0
        return replace(fault, cause=Cause.CONTACT_OFFSET if in_reach else Cause.UNEXPLAINED)
    if hulls is not None and _side_is_known(audited.oracle, fault.pair):
        hollow_body = hulls.hollow_at(fault.pair, fault.frame)
        if hollow_body:
            evidence = replace(fault.evidence, hollow=hollow_body)
            return replace(fault, cause=Cause.HULL_FILLS_HOLLOW, evidence=evidence)
    return replace(fault, cause=cause)


def _cause(audited: Audited, fault: Fault) -> Cause:
    if audited.subject.verdict[fault.frame, fault.pair] == Verdict.CANDIDATE:
        return Cause.BOUNDING_VOLUMES
    if audited.prolonged is not None and audited.prolonged[fault.frame, fault.pair]:
        return Cause.RELEASE_DISTANCE
    stages = audited.stages(fault.frame, fault.pair, NO_FACES.astype(np.int64))
    if stages.within_clock:
        return Cause.CLOCK
    # Shape before rate: a sample of solids that meet there would have said the same.
    if stages.shapes_meet:
        return Cause.COLLIDERS_MEET
    if isinstance(audited.detector, RecordedDetector):
        return _engine_cause(audited.detector, fault, float(audited.motion.times[fault.last]))
    if stages.looked is False:
        return Cause.LAST_ANSWER
    # Late or early where all answers about the pair are so by a constant number of frames, as here. Without a delay
    # this is the frame itself, in which there is no contact.
    delay = audited.delay(fault.pair)
    is_delayed_contact = at_frame(counts_as_contact(audited.oracle.verdict[:, fault.pair]), fault.frame - delay)
    return delay_cause(delay) if is_delayed_contact else Cause.UNEXPLAINED


def _engine_cause(detector: RecordedDetector, fault: Fault, last_moment: float) -> Cause:
    """Return why an engine reported a false contact: no step came at its end, or the report is late or early.

    ``last_moment``: second of its last frame.
    """
    joins_without_step = (
        fault.kind is FaultKind.JOINS_TWO and detector.has_step_between(fault.start, last_moment) is False
    )
    ends_late = fault.kind is FaultKind.ENDS_LATE
    if joins_without_step or (ends_late and detector.ended_at_next_step(fault.pair, fault.start)):
        return Cause.BETWEEN_STEPS
    if ends_late:
        return Cause.LATE
    return Cause.EARLY if fault.kind is FaultKind.STARTS_EARLY else Cause.UNEXPLAINED
