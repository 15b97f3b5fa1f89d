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
    """Two cubes of 2 m, apart by ``gaps`` metres frame by frame, and what was said of them."""
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
    """False contacts of a detector that may explain itself."""
    assembly, note = cubes_and_outcomes(outcomes, gaps)
    subject, oracle = (
        verdict_column(["C" if item in reported else "." for item in outcomes])
        for reported in ((BOTH, FALSE), (BOTH, MISSED))
    )
    return false_contacts(assembly, note, Audited(assembly.motion, detector, subject, oracle))


@pytest.mark.parametrize(
    ("outcomes", "kinds"),
    [
        ([NEITHER, FALSE, FALSE, NEITHER], ["nothing there"]),
        ([FALSE, FALSE], ["nothing there"]),
        ([NEITHER, FALSE, BOTH, NEITHER], ["starts early"]),
        ([NEITHER, BOTH, FALSE, NEITHER], ["ends late"]),
        ([BOTH, FALSE, BOTH], ["joins two contacts"]),
        ([FALSE, BOTH, FALSE], ["starts early", "ends late"]),
        ([BOTH, NEITHER, FALSE, NEITHER, BOTH], ["nothing there"]),
        ([BOTH, MISSED, FALSE, NEITHER], ["nothing there"]),
        ([NEITHER, BOTH, MISSED], []),
    ],
)
def test_false_contact_kind_follows_from_true_contact_around(outcomes, kinds):
    """False contact before a true contact starts early, after one ends late, and between two joins them.

    Outcomes of detector and reference, frame by frame.
    """
    assert [item.kind for item in false_of(outcomes)] == kinds


def test_interval_is_displayed_at_its_largest_gap():
    """Frames of 10 ms; the gap is 0.7 m in frame 2, and its middle 0.35 m beyond the face at x = 1 m."""
    (item,) = false_of([NEITHER, FALSE, FALSE, FALSE, NEITHER], [9.0, 0.1, 0.7, 0.2, 9.0])
    assert (item.number, item.bodies, item.first, item.last, item.frames) == (1, ("a", "b"), 1, 3, 3)
    assert (item.start, item.end, item.frame) == (0.01, 0.04, 2)
    assert item.metres == pytest.approx(0.7) and item.point[0] == pytest.approx(1.0 + 0.35)


def test_false_contacts_are_numbered_by_time_and_not_while_grasped():
    """Pairs are (number, first frame)."""
    assert [(item.number, item.first) for item in false_of([FALSE, NEITHER, FALSE, FALSE])] == [(1, 0), (2, 2)]
    assert false_of([GRASPED, GRASPED]) == ()


def test_false_contacts_are_ordered_by_gap_and_not_by_length():
    """Four false contacts, of three frames at 1 mm and of one at 20, 30 and 20 mm; the widest gap is first.

    The two of 20 mm are equal to a micrometre, so that they are in order of time.
    """
    gaps = [0.001, 0.001, 0.001, 1.0, 0.0200000004, 1.0, 0.03, 1.0, 0.02]
    false = false_of([FALSE, FALSE, FALSE, NEITHER, FALSE, NEITHER, FALSE, NEITHER, FALSE], gaps)
    assert [contact.number for contact in worst_first(false[::-1])] == [3, 2, 4, 1]


def test_of_too_many_the_longest_are_measured(monkeypatch):
    """The gap of one frame may be measured: the contact of two frames gets it, that of one frame does not."""
    monkeypatch.setattr(module, "GAP_FRAMES_TOTAL", 1)
    short, long = false_of([FALSE, NEITHER, FALSE, FALSE], [0.5, 1, 0.5, 0.5])
    assert np.isnan(short.metres) and long.metres == pytest.approx(0.5)


@pytest.mark.slow
def test_the_cause_is_the_solid_before_the_rate():
    """Boxes 0.5 m apart, or 0.01 m deep in each other; at 1 Hz the answer of frame 0 is kept over all three frames.

    Colliders that meet are named as the cause even where a rate of 1 Hz would explain the report too.
    """
    bodies, pairs = cubes_and_outcomes([NEITHER])[0].bodies, np.array([[0, 1]])
    ball = create_detector("collider", bodies, pairs=pairs, shape="sphere")
    slow = create_detector("discrete", bodies, pairs=pairs, rate_hz=1.0)
    box = create_detector("collider", bodies, pairs=pairs, shape="box", rate_hz=1.0)
    for gap, detector, cause in (
        (0.5, ball, Cause.UNEXPLAINED),
        (0.5, slow, Cause.LAST_ANSWER),
        (0.5, None, Cause.UNEXPLAINED),
        (-0.01, box, Cause.COLLIDERS_MEET),
    ):
        assert false_of([NEITHER, FALSE, FALSE], [9.0, gap, gap], detector)[0].cause == cause


@pytest.mark.parametrize(
    ("outcomes", "causes"),
    [
        (
            [NEITHER, NEITHER, MISSED, MISSED, BOTH, FALSE, FALSE, *[NEITHER] * 9, FALSE],
            [Cause.LATE, Cause.UNEXPLAINED],
        ),
        (
            [FALSE, *[NEITHER] * 9, FALSE, FALSE, BOTH, MISSED, MISSED, NEITHER, NEITHER],
            [Cause.UNEXPLAINED, Cause.EARLY],
        ),
        ([NEITHER, NEITHER, BOTH, BOTH, FALSE, NEITHER, NEITHER, BOTH, BOTH, NEITHER, NEITHER], [Cause.UNEXPLAINED]),
    ],
)
def test_constant_delay_is_the_cause_only_of_contacts_it_moved(outcomes, causes):
    """Two frames late, two frames early, each with a false contact far from any true contact; and no delay."""
    assert [item.cause for item in false_of(outcomes)] == causes


STEP = "between physics steps"
REPORTS = [
    # What frames of 10 ms are: true, or false; when an engine of 50 steps a second says begin and end; and why.
    ("...FFBBBBF...", (0.02, 0.10), ["early", STEP]),
    ("....BBBBFFFF.", (0.04, 0.12), ["late"]),
    ("....BFFB.....", (0.04, 0.08), ["unexplained"]),
    ("....BFBBB....", (0.04, 0.08), [STEP]),
    ("....FFF......", (0.04, 0.06), ["unexplained"]),
    ("....BBBFFF...", (0.04, None), ["late"]),
]


@pytest.mark.parametrize(("frames", "report", "causes"), REPORTS)
@pytest.mark.parametrize("steps", [50.0, None])
def test_an_engine_reports_early_late_or_at_its_next_step(frames, report, causes, steps):
    """Frames: both touch (B), a false contact (F) or none (.); only a known step rate can explain one of its steps."""
    outcomes = [{".": NEITHER, "B": BOTH, "F": FALSE}[item] for item in frames]
    assembly, _ = cubes_and_outcomes(outcomes)
    stamps = zip(("enter", "exit"), report, strict=True)
    contacts = [LiveContact(round(at * 1e9), "a", "b", phase) for phase, at in stamps if at is not None]
    known = {} if steps is None else {"rate_hz": steps}
    engine = recorded_detector(assembly.bodies, assembly.pairs, contacts, first_ns=0, residual=0.0, settings=known)
    late = [item if steps else item.replace(STEP, "late" if "F." in frames else "unexplained") for item in causes]
    assert [item.cause for item in false_of(outcomes, gaps=None, detector=engine)] == late


def test_false_contact_is_blamed_on_clock_before_late_report():
    """``residual``: s by which the engine's clock is uncertain; ``gap``: m between its colliders, below 0 they meet."""
    assembly, _ = cubes_and_outcomes([NEITHER])
    contacts = [LiveContact(10_000_000, "a", "b", "enter"), LiveContact(20_000_000, "a", "b", "exit")]

    def cause(residual, gap=0.5, **known):
        engine = recorded_detector(assembly.bodies, assembly.pairs, contacts, 0, residual, known)
        return false_of([NEITHER, BOTH, FALSE, NEITHER], [gap] * 4, engine)[0].cause

    assert [cause(0.0), cause(0.001), cause(0.0, shape="box")] == ["late", "clock", "late"]
    assert cause(0.0, -0.1, shape="box") == Cause.COLLIDERS_MEET
