"""False contacts are numbered in order of time, measured where the gap is widest, and none is counted twice."""

import numpy as np
import pytest
from support.shapes import box_mesh
from support.small_worlds import verdict_column

from cdcore import Body, Motion, create_detector
from replay.auditing import false_contacts as module
from replay.auditing.causes import Audited
from replay.auditing.false_contacts import false_contacts
from replay.auditing.fault import Cause, worst_first
from replay.auditing.outcome import Comparison, Outcome
from replay.detection.recorded import recorded_detector
from replay.prepare.assembly import Assembly
from sessions.model.event import LiveContact

NEITHER, BOTH, MISSED, FALSE, GRASPED = map(
    int, (Outcome.NEITHER, Outcome.BOTH, Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.GRASPED)
)


def cubes_and_outcomes(outcomes, gaps=None):
    """Two cubes of 2 m, faces ``gaps`` metres apart frame by frame (else 1 m), and a detector with these outcomes.

    Frames are 10 ms each; cube a is about the origin, with a face at x = 1 m towards b.
    """
    frames = len(outcomes)
    positions = np.zeros((frames, 2, 3))
    positions[:, 1, 0] = 2.0 + (np.ones(frames) if gaps is None else np.array(gaps))
    bodies = (Body("a", box_mesh((2.0, 2.0, 2.0))), Body("b", box_mesh((2.0, 2.0, 2.0))))
    times = np.arange(frames) * 0.01
    motion = Motion(times, positions, np.broadcast_to(np.eye(3), (frames, 2, 3, 3)), np.ones((frames, 2), bool))
    stamps, origin = np.arange(frames) * 10_000_000, np.zeros((frames, 2), np.uint8)
    assembly = Assembly(bodies, motion, np.array([[0, 1]]), np.array([False]), stamps, origin)
    return assembly, Comparison("it", "truth", np.array(outcomes, dtype=np.uint8)[:, None])


def false_of(outcomes, gaps=None, detector=None):
    """False contacts of a detector with these outcomes, frame by frame, of two cubes these ``gaps`` in metres apart.

    ``detector`` may explain them; ``None`` explains nothing.
    """
    assembly, comparison = cubes_and_outcomes(outcomes, gaps)
    subject, oracle = (
        verdict_column(["C" if item in reported else "." for item in outcomes])
        for reported in ((BOTH, FALSE), (BOTH, MISSED))
    )
    return false_contacts(assembly, comparison, Audited(assembly.motion, detector, subject, oracle))


@pytest.mark.parametrize(
    ("outcomes", "kinds"),
    [
        pytest.param([NEITHER, FALSE, FALSE, NEITHER], ["nothing there"], id="alone"),
        pytest.param([FALSE, FALSE], ["nothing there"], id="all frames"),
        pytest.param([NEITHER, FALSE, BOTH, NEITHER], ["starts early"], id="before a contact"),
        pytest.param([NEITHER, BOTH, FALSE, NEITHER], ["ends late"], id="after a contact"),
        pytest.param([BOTH, FALSE, BOTH], ["joins two contacts"], id="between contacts"),
        pytest.param([FALSE, BOTH, FALSE], ["starts early", "ends late"], id="around a contact"),
        pytest.param([BOTH, NEITHER, FALSE, NEITHER, BOTH], ["nothing there"], id="next to no contact"),
        pytest.param([BOTH, MISSED, FALSE, NEITHER], ["nothing there"], id="after a missed frame"),
        pytest.param([NEITHER, BOTH, MISSED], [], id="none false"),
    ],
)
def test_false_contact_kind_follows_from_true_contact_around(outcomes, kinds):
    """False contact before a true contact starts early, after one ends late, and between two joins them.

    Outcomes of detector and reference, frame by frame.
    """
    assert [item.kind for item in false_of(outcomes)] == kinds


def test_interval_is_displayed_at_its_largest_gap():
    """Frames of 10 ms; the gap is 0.7 m in frame 2, and its middle 0.35 m beyond the face at x = 1 m."""
    (item,) = false_of([NEITHER, FALSE, FALSE, FALSE, NEITHER], gaps=[9.0, 0.1, 0.7, 0.2, 9.0])
    assert (item.number, item.bodies) == (1, ("a", "b"))
    assert (item.first, item.last, item.frames) == (1, 3, 3)
    assert (item.start, item.end) == (0.01, 0.04)
    assert item.frame == 2
    assert item.metres == pytest.approx(0.7)
    assert item.point[0] == pytest.approx(1.0 + 0.35)


def test_false_contacts_are_numbered_by_time():
    """In four frames, frame 0 is a false contact, and frames 2 and 3 are another."""
    first, second = false_of([FALSE, NEITHER, FALSE, FALSE])
    assert (first.number, first.first) == (1, 0)
    assert (second.number, second.first) == (2, 2)


def test_contact_while_a_hand_holds_the_body_is_not_false():
    """In both frames contact is reported of a hand and the body in it (GRASPED): it is counted elsewhere."""
    assert false_of([GRASPED, GRASPED]) == ()


def test_false_contacts_are_ordered_by_gap_and_not_by_length():
    """Four false contacts, of three frames at 1 mm and of one at 20, 30 and 20 mm; the widest gap is first.

    The two of 20 mm are equal to a micrometre, so that they are in order of time.
    """
    gaps = [0.001, 0.001, 0.001, 1.0, 0.0200000004, 1.0, 0.03, 1.0, 0.02]
    false = false_of([FALSE, FALSE, FALSE, NEITHER, FALSE, NEITHER, FALSE, NEITHER, FALSE], gaps)
    assert [contact.number for contact in worst_first(false[::-1])] == [3, 2, 4, 1]


def test_of_too_many_the_longest_are_measured(monkeypatch):
    """Contacts of one frame and of two, at a gap of 0.5 m; the gap of a single frame may be measured: the longer's."""
    monkeypatch.setattr(module, "GAP_FRAMES_TOTAL", 1)
    short, long = false_of([FALSE, NEITHER, FALSE, FALSE], gaps=[0.5, 1, 0.5, 0.5])
    assert np.isnan(short.metres) and long.metres == pytest.approx(0.5)


BODIES = cubes_and_outcomes([NEITHER])[0].bodies
"""Two cubes of 2 m."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings", "gap_m", "cause"),
    [
        pytest.param("collider", {"shape": "sphere"}, 0.5, Cause.UNEXPLAINED, id="balls 0.5 m apart"),
        pytest.param("discrete", {"rate_hz": 1.0}, 0.5, Cause.LAST_ANSWER, id="a sample a second"),
        pytest.param("collider", {"shape": "box", "rate_hz": 1.0}, -0.01, Cause.COLLIDERS_MEET, id="boxes 1 cm deep"),
    ],
)
def test_the_cause_is_the_solid_before_the_rate(name, settings, gap_m, cause):
    """Cubes of 2 m, 9 m apart, then ``gap_m``: that the last two of three frames are false contact is prescribed.

    At 1 Hz the answer of the only sample, as frames are 10 ms, lasts. Colliders that meet are the cause even where
    such a rate is one too. Spheres 0.5 m apart do not meet: their radius is half an edge, 1 m, and corners stick out.
    """
    detector = create_detector(name, BODIES, pairs=np.array([[0, 1]]), **settings)
    (contact,) = false_of([NEITHER, FALSE, FALSE], gaps=[9.0, gap_m, gap_m], detector=detector)
    assert contact.cause == cause


def test_detector_that_explains_nothing_leaves_a_contact_unexplained():
    """Two frames of false contact of cubes 0.5 m apart, by a detector that says nothing about its reasons."""
    (contact,) = false_of([NEITHER, FALSE, FALSE], gaps=[9.0, 0.5, 0.5], detector=None)
    assert contact.cause == Cause.UNEXPLAINED


@pytest.mark.parametrize(
    ("outcomes", "causes"),
    [
        pytest.param(
            [NEITHER, NEITHER, MISSED, MISSED, BOTH, FALSE, FALSE, *[NEITHER] * 9, FALSE],
            [Cause.LATE, Cause.UNEXPLAINED],
            id="two frames late",
        ),
        pytest.param(
            [FALSE, *[NEITHER] * 9, FALSE, FALSE, BOTH, MISSED, MISSED, NEITHER, NEITHER],
            [Cause.UNEXPLAINED, Cause.EARLY],
            id="two frames early",
        ),
        pytest.param(
            [NEITHER, NEITHER, BOTH, BOTH, FALSE, NEITHER, NEITHER, BOTH, BOTH, NEITHER, NEITHER],
            [Cause.UNEXPLAINED],
            id="in time",
        ),
    ],
)
def test_constant_delay_is_the_cause_only_of_contacts_it_moved(outcomes, causes):
    """A contact of three frames is reported two frames late, or early; a false contact far from it is unexplained.

    Where contacts are reported in time, a false frame after one of them is unexplained too.
    """
    assert [item.cause for item in false_of(outcomes)] == causes


STEP = "between physics steps"
"""Cause of a frame that is false because the engine's next step is still to come."""


@pytest.mark.parametrize(
    ("frames", "begin_s", "end_s", "causes", "causes_of_unknown_rate"),
    [
        pytest.param(
            "...FFBBBBF...", 0.02, 0.10, ["early", STEP], ["early", "late"], id="two frames early, ends a frame late"
        ),
        pytest.param("....BBBBFFFF.", 0.04, 0.12, ["late"], ["late"], id="four frames late"),
        pytest.param("....BFFB.....", 0.04, 0.08, ["unexplained"], ["unexplained"], id="two false frames within"),
        pytest.param("....BFBBB....", 0.04, 0.08, [STEP], ["unexplained"], id="one false frame within"),
        pytest.param("....FFF......", 0.04, 0.06, ["unexplained"], ["unexplained"], id="nothing there"),
        pytest.param("....BBBFFF...", 0.04, None, ["late"], ["late"], id="never ends"),
    ],
)
@pytest.mark.parametrize("rate_hz", [50.0, None], ids=["50 steps a second", "rate unknown"])
def test_an_engine_reports_early_late_or_at_its_next_step(
    frames, begin_s, end_s, causes, causes_of_unknown_rate, rate_hz
):
    """Frames of 10 ms: both touch (B), a false contact (F) or none (.); the engine reports a begin and an end.

    A false frame that its next step, up to 20 ms later, ends is between steps; only a known rate can say so.
    """
    outcomes = [{".": NEITHER, "B": BOTH, "F": FALSE}[item] for item in frames]
    assembly, _ = cubes_and_outcomes(outcomes)
    contacts = [LiveContact(round(begin_s * 1e9), "a", "b", "enter")]
    if end_s is not None:
        contacts.append(LiveContact(round(end_s * 1e9), "a", "b", "exit"))
    settings = {} if rate_hz is None else {"rate_hz": rate_hz}
    engine = recorded_detector(assembly.bodies, assembly.pairs, contacts, first_ns=0, residual=0.0, settings=settings)
    expected = causes_of_unknown_rate if rate_hz is None else causes
    assert [item.cause for item in false_of(outcomes, detector=engine)] == expected


@pytest.mark.parametrize(
    ("clock_uncertainty_s", "gap_m", "settings", "cause"),
    [
        pytest.param(0.0, 0.5, {}, "late", id="exact clock"),
        pytest.param(0.001, 0.5, {}, "clock", id="uncertain clock"),
        pytest.param(0.0, 0.5, {"shape": "box"}, "late", id="colliders apart"),
        pytest.param(0.0, -0.1, {"shape": "box"}, Cause.COLLIDERS_MEET, id="colliders meet"),
    ],
)
def test_false_contact_is_blamed_on_clock_before_late_report(clock_uncertainty_s, gap_m, settings, cause):
    """Frames of 10 ms: a true contact in frame 1, reported from 10 to 20 ms, and a false one in frame 2.

    ``gap_m``: metres between the colliders, below 0 they meet.
    """
    assembly, _ = cubes_and_outcomes([NEITHER])
    reports = [LiveContact(10_000_000, "a", "b", "enter"), LiveContact(20_000_000, "a", "b", "exit")]
    engine = recorded_detector(
        assembly.bodies, assembly.pairs, reports, first_ns=0, residual=clock_uncertainty_s, settings=settings
    )
    (contact,) = false_of([NEITHER, BOTH, FALSE, NEITHER], gaps=[gap_m] * 4, detector=engine)
    assert contact.cause == cause
