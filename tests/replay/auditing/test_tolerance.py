"""A disagreement about at most tau is within tolerance; a deeper one, or one about being inside, never is."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, random_rotations
from support.small_worlds import unit_cubes_on_x

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.tolerances import TWO_MICROMETRES
from replay.auditing.compare import compare
from replay.auditing.contact_counts import count_reports
from replay.auditing.outcome import Outcome
from replay.auditing.sampling_offsets import offset_counts
from replay.auditing.tolerance import Reference, Tolerance
from replay.engine import compute
from replay.prepare.assembly import Assembly

GAPS_TO_WALL_M = [-1e-3, -1e-5, -2.3e-6, -1.9e-6, -1e-9, 0.0, 1e-9, 1.9e-6, 2.3e-6, 1e-5, 1e-3]
"""Gaps in metres between a ball and the wall of a box, below 0 their depth in each other; contact up to a gap of 0."""


def first_body_and_box(positions, first=None, matrix=None):
    """A body at these positions, frame by frame, and a box of 1 m at the origin; both turned by ``matrix``.

    The body is a ball of radius 0.5 m unless another mesh is given; the frames are those of 90 Hz.
    """
    count, matrix = len(positions), np.eye(3) if matrix is None else matrix
    move = np.zeros((count, 2, 3))
    move[:, 0] = np.array(positions) @ matrix.T
    motion = Motion(np.arange(count) / 90, move, np.tile(matrix, (count, 2, 1, 1)))
    nothing = np.zeros(count, dtype=np.int64)
    bodies = (Body("first", first or ball_mesh(0.5)), Body("box", box_mesh()))
    return Assembly(
        bodies=bodies,
        motion=motion,
        pairs=np.array([[0, 1]]),
        grasped=np.zeros(1, bool),
        stamp_ns=nothing,
        origin=np.ones((count, 2), np.uint8),
    )


def ball_on_x_and_box(*positions, **more):
    """A ball of radius 0.5 m at these x and a box of 1 m at the origin: they touch at x = 1 m."""
    return first_body_and_box([(position, 0, 0) for position in positions], **more)


def outcomes_of_a_liar(assembly, lie, tau=TWO_MICROMETRES, **changed):
    """Outcomes, frame by frame, of a detector that says the opposite of the exact one: ``lie`` where that is clear.

    ``changed``: fields of its detection that differ from those of the exact detector.
    """
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    truth = exact.detect(assembly.motion)
    verdict = np.where(truth.verdict == Verdict.CLEAR, np.uint8(lie), np.uint8(Verdict.CLEAR))
    subject = replace(truth, verdict=verdict, detector="liar", **changed)
    tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), tau)
    return compare(subject, truth, within=tolerance.judge(subject, truth)).outcome[:, 0].tolist()


@pytest.mark.parametrize("tau", [TWO_MICROMETRES, 12e-6, 0.0], ids=["2 um, the default", "12 um", "none"])
def test_the_border_is_tau_on_both_sides(tau):
    """A ball is so far from a wall in each frame, from 1 mm deep in it to 1 mm off; contact is up to a gap of 0.

    A detector says the opposite: contacts are missed, the others false, but gaps and depths of at most tau are excused.
    With a tau of 0 not even a touch is.
    """
    assembly = ball_on_x_and_box(*(1.0 + gap for gap in GAPS_TO_WALL_M))
    expected = []
    for gap in GAPS_TO_WALL_M:
        if tau > 0.0 and abs(gap) <= tau:
            expected.append(Outcome.WITHIN_TOLERANCE)
        else:
            expected.append(Outcome.MISSED if gap <= 0.0 else Outcome.FALSE_CONTACT)
    assert outcomes_of_a_liar(assembly, Verdict.CONTACT, tau) == expected


def test_usual_tolerance_is_two_micrometres():
    """A ball is 1.9 and 2.3 um deep in a wall; a detector that says the opposite misses only the second, by default."""
    assembly = ball_on_x_and_box(1.0 - 1.9e-6, 1.0 - 2.3e-6)
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    truth = exact.detect(assembly.motion)
    blind = replace(truth, verdict=np.full_like(truth.verdict, Verdict.CLEAR))
    within = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True)).judge(blind, truth)
    outcomes = compare(blind, truth, within=within).outcome[:, 0].tolist()
    assert outcomes == [Outcome.WITHIN_TOLERANCE, Outcome.MISSED]


DEPTHS_IN_TAU = {0.5: True, 0.99: True, 1.01: False, 1.5: False, 2.5: False}
"""Depths of cubes in each other, in units of tau, and whether they are within tolerance."""


@pytest.mark.sampled(10)
@pytest.mark.parametrize("tau", [2e-6, 1e-4], ids=["2 um", "100 um"])
@pytest.mark.parametrize("sideways", [[0, 0], [0.3, 0], [0, 1e-6], [0.3, 0.2], [1e-6, 2e-7]])
def test_flush_cubes_are_excused_to_tau_and_no_deeper(sideways, tau):
    """Cubes of 1 m overlap along x by each of DEPTHS_IN_TAU, on either side; a detector misses all of these contacts.

    ``sideways``: metres by which they are shifted in y and z, so that faces lie in common planes or nearly so. Turning
    the whole world, by any rotation, changes no outcome.
    """
    positions, expected = [], []
    for depth, is_excused in DEPTHS_IN_TAU.items():
        positions += [[side * (1.0 - depth * tau), *sideways] for side in (1, -1)]
        expected += [Outcome.WITHIN_TOLERANCE if is_excused else Outcome.MISSED] * 2
    assert outcomes_of_a_liar(first_body_and_box(positions, box_mesh()), Verdict.CONTACT, tau) == expected
    (rotation,) = random_rotations(np.random.default_rng(3), 1)
    assert outcomes_of_a_liar(first_body_and_box(positions, box_mesh(), rotation), Verdict.CONTACT, tau) == expected


def test_cubes_that_are_exactly_tau_deep_are_excused():
    """Cubes of 1 m overlap by exactly tau; in the second frame they are also shifted by 0.25 m along the faces."""
    tau = 2.0**-19  # 1.9 micrometres, a power of two: 1.0 - tau is a double without rounding
    flush = first_body_and_box([[1.0 - tau, 0, 0], [1.0 - tau, 0.25, 0]], box_mesh())
    assert outcomes_of_a_liar(flush, Verdict.CONTACT, tau) == [Outcome.WITHIN_TOLERANCE] * 2


def test_groups_of_frames_change_nothing(monkeypatch):
    """A ball near a wall, at 11 gaps three times over: 33 frames are judged at once and then four at a time."""
    assembly = ball_on_x_and_box(*(1.0 + gap for gap in GAPS_TO_WALL_M * 3))
    all_at_once = outcomes_of_a_liar(assembly, Verdict.CONTACT)
    monkeypatch.setattr("replay.auditing.tolerance.FRAMES_AT_ONCE", 4)
    assert outcomes_of_a_liar(assembly, Verdict.CONTACT) == all_at_once


NANOMETRE = 1e-9


def test_containment_has_no_tolerance():
    """A ball of radius 0.25 m is inside a box, in its middle and a nanometre from the wall at x = 0.5 m.

    A detector that says that it is outside misses both, for no shift by the tolerance would make that true.
    """
    inside = ball_on_x_and_box(0.0, 0.25 - NANOMETRE, first=ball_mesh(0.25))
    assert outcomes_of_a_liar(inside, Verdict.CONTACT) == [Outcome.MISSED] * 2


@pytest.mark.parametrize("report", [Verdict.CONTAINED, Verdict.CANDIDATE])
def test_report_of_anything_but_contact_has_no_tolerance(report):
    """A ball is a nanometre off a wall: a report of contact would be excused, one of another kind is false."""
    off_the_wall = ball_on_x_and_box(1.0 + NANOMETRE)
    assert outcomes_of_a_liar(off_the_wall, Verdict.CONTACT) == [Outcome.WITHIN_TOLERANCE]
    assert outcomes_of_a_liar(off_the_wall, report) == [Outcome.FALSE_CONTACT]


def test_detector_of_intervals_has_no_tolerance():
    """A ball is a nanometre deep in a wall, and a detector says that it is not: of the frame that would be excused.

    Of the way from the frame before it is a miss.
    """
    in_the_wall = ball_on_x_and_box(1.0 - NANOMETRE)
    assert outcomes_of_a_liar(in_the_wall, Verdict.CONTACT) == [Outcome.WITHIN_TOLERANCE]
    assert outcomes_of_a_liar(in_the_wall, Verdict.CONTACT, covers="intervals") == [Outcome.MISSED]


def test_frames_within_tolerance_count_in_no_false_contact():
    """A detector reports all of five frames: two deep in contact, two a micrometre off the wall, one 0.5 m off.

    Of the three that are not within the tolerance of 2 um one is false, counted of one run or over 16 sampling offsets.
    """
    assembly = ball_on_x_and_box(0.5, 0.5, 1.0 + 1e-6, 1.0 + 1e-6, 1.5)
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    truth = exact.detect(assembly.motion)
    tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), TWO_MICROMETRES)
    reference = Reference.of(truth, assembly, None, tolerance)
    always = replace(truth, verdict=np.full_like(truth.verdict, Verdict.CONTACT))
    false_of_a_run = count_reports(reference.compare(always)).proportion(Outcome.FALSE_CONTACT)
    samples_every_frame_hz = 1e4
    false_over_offsets = offset_counts(samples_every_frame_hz, always, reference).false_contact
    assert false_of_a_run.value == false_over_offsets.value == pytest.approx(1 / 3)


@pytest.mark.parametrize(
    ("settings", "tau", "missed", "within_tolerance"),
    [pytest.param({}, 2e-6, 1, 2, id="2 um by default"), pytest.param({"tau": 0.0}, 0.0, 3, 0, id="none")],
)
def test_overlap_below_tau_counts_as_within_tolerance(settings, tau, missed, within_tolerance):
    """Unit cubes overlap by half, overlap by a micrometre, touch, and are apart; the detector reports nothing."""
    session = unit_cubes_on_x({"a": [0] * 4, "b": [0.5, 1 - 1e-6, 1.0, 1.5]})
    summary = compute(session, detectors="blind=support.planted_detectors:Blind", oracle="exact", **settings).document
    frames = summary.audit["blind"].pair_frames
    assert (frames.missed, frames.within_tolerance) == (missed, within_tolerance)
    assert summary.tau == tau
