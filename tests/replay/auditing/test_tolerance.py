"""A disagreement about at most tau is within tolerance; a deeper one, or one about being inside, never is."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, random_rotations
from support.small_worlds import unit_cubes_on_x

from cdcore import Body, Motion, Verdict, create_detector
from replay.auditing.compare import compare
from replay.auditing.contact_counts import count_reports
from replay.auditing.outcome import Outcome
from replay.auditing.sampling_offsets import offset_counts
from replay.auditing.tolerance import Reference, Tolerance
from replay.engine import compute
from replay.prepare.assembly import Assembly

GAPS_TO_WALL_M = [-1e-3, -1e-5, -2.3e-6, -1.9e-6, -1e-9, 0.0, 1e-9, 1.9e-6, 2.3e-6, 1e-5, 1e-3]
"""Of a ball's extreme vertex off the wall of a box; below 0 inside."""


def first_body_and_box(positions, first=None, matrix=None):
    """Two bodies, a ball if none is named and a box, the first at each of these places, both in a turned world."""
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
    """A session of a ball at these x beside a box."""
    return first_body_and_box([(position, 0, 0) for position in positions], **more)


def outcomes_of_a_liar(assembly, lie, tau=2e-6, **changed):
    """Outcomes of a subject that says the opposite of the exact detector, in the words of ``lie``."""
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    truth = exact.detect(assembly.motion)
    verdict = np.where(truth.verdict == Verdict.CLEAR, np.uint8(lie), np.uint8(Verdict.CLEAR))
    subject = type(truth)(**{**vars(truth), "verdict": verdict, "detector": "liar", **changed})
    tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), tau)
    return compare(subject, truth, within=tolerance.judge(subject, truth)).outcome[:, 0].tolist()


def test_the_border_is_tau_on_both_sides():
    """Tau is 2 um unless given: gaps from -1.9 to 1.9 um are within it."""
    missed, false, within = Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.WITHIN_TOLERANCE
    assembly = ball_on_x_and_box(*(1.0 + gap for gap in GAPS_TO_WALL_M))
    assert outcomes_of_a_liar(assembly, Verdict.CONTACT) == [missed] * 3 + [within] * 5 + [false] * 3
    assert outcomes_of_a_liar(assembly, Verdict.CONTACT, tau=1.2e-5) == [missed, *[within] * 9, false]
    assert outcomes_of_a_liar(assembly, Verdict.CONTACT, tau=0.0) == [missed] * 6 + [false] * 5


DEPTHS_IN_TAU = [0.5, 0.99, 1.01, 1.5, 2.5]
"""Depths, in tau, of which the first two are at most tau."""


@pytest.mark.sampled(10)
@pytest.mark.parametrize("tau", [2e-6, 1e-4])
@pytest.mark.parametrize("sideways", [[0, 0], [0.3, 0], [0, 1e-6], [0.3, 0.2], [1e-6, 2e-7]])
def test_flush_cubes_are_excused_to_tau_and_no_deeper(sideways, tau):
    """Depths of 0.5 and 0.99 tau are excused; ``sideways``: shift in the other two axes."""
    positions = [[side * (1.0 - depth * tau), *sideways] for depth in DEPTHS_IN_TAU for side in (1, -1)]
    expected = [Outcome.WITHIN_TOLERANCE] * 4 + [Outcome.MISSED] * 6
    assert outcomes_of_a_liar(first_body_and_box(positions, box_mesh()), Verdict.CONTACT, tau) == expected
    rotation = random_rotations(np.random.default_rng(3), 1)[0]
    assert outcomes_of_a_liar(first_body_and_box(positions, box_mesh(), rotation), Verdict.CONTACT, tau) == expected


def test_cubes_that_are_exactly_tau_deep_are_excused():
    """Cubes overlap by exactly tau, a power of two; the second pair is also shifted by 0.25 m along the faces."""
    tau = 2.0**-19  # 1.9 micrometres: the places below are exact
    flush = first_body_and_box([[1.0 - tau, 0, 0], [1.0 - tau, 0.25, 0]], box_mesh())
    assert outcomes_of_a_liar(flush, Verdict.CONTACT, tau) == [Outcome.WITHIN_TOLERANCE] * 2


def test_groups_of_frames_change_nothing(monkeypatch):
    """33 frames, judged at once and four at a time."""
    assembly = ball_on_x_and_box(*(1.0 + gap for gap in GAPS_TO_WALL_M * 3))
    whole = outcomes_of_a_liar(assembly, Verdict.CONTACT)
    monkeypatch.setattr("replay.auditing.tolerance.FRAMES_AT_ONCE", 4)
    assert outcomes_of_a_liar(assembly, Verdict.CONTACT) == whole


def test_containment_candidates_and_intervals_have_no_tolerance():
    """A nanometre from the wall, well within tau, which excuses surfaces in contact only."""
    inside = ball_on_x_and_box(0.0, 0.25 - 1e-9, first=ball_mesh(0.25))  # in the middle, and a nanometre from the wall
    assert outcomes_of_a_liar(inside, Verdict.CONTACT) == [Outcome.MISSED] * 2
    for word in (Verdict.CONTAINED, Verdict.CANDIDATE):
        assert outcomes_of_a_liar(ball_on_x_and_box(1.0 + 1e-9), word) == [Outcome.FALSE_CONTACT]
    assert outcomes_of_a_liar(ball_on_x_and_box(1.0 - 1e-9), Verdict.CONTACT, covers="intervals") == [Outcome.MISSED]


def test_frames_within_tolerance_count_in_no_false_contact():
    """Two frames deep in contact, two a micrometre apart and one 0.5 m apart, all reported: 1 of 3 is false."""
    assembly = ball_on_x_and_box(0.5, 0.5, 1.0 + 1e-6, 1.0 + 1e-6, 1.5)
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    truth = exact.detect(assembly.motion)
    tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), 2e-6)
    reference = Reference.of(truth, assembly, None, tolerance)
    always = replace(truth, verdict=np.full_like(truth.verdict, Verdict.CONTACT))
    once = count_reports(reference.compare(always)).proportion(Outcome.FALSE_CONTACT).value
    assert once == offset_counts(1e4, always, reference).false_contact.value == pytest.approx(1 / 3)


def test_overlap_below_tau_counts_as_within_tolerance():
    """The detector reports nothing; counts are (missed, within tolerance), tau is in metres."""
    # unit cubes: overlapping by half, by a micrometre, touching, apart
    session = unit_cubes_on_x({"a": [0] * 4, "b": [0.5, 1 - 1e-6, 1.0, 1.5]})
    for more, tau, counts in (({}, 2e-6, (1, 2)), ({"tau": 0.0}, 0.0, (3, 0))):
        summary = compute(session, detectors="blind=support.planted_detectors:Blind", oracle="exact", **more).document
        counted = summary.audit["blind"].pair_frames
        assert (counted.missed, counted.within_tolerance) == counts and summary.tau == tau
