from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, STEP_NS, unit_cubes_on_x

from cdcore import join
from replay.detection.recorded import physics_steps, recorded_detector, reported_spans
from replay.engine import compute
from replay.errors import AuditError
from replay.prepare.assemble import RESIDUAL_FACT, assemble
from sessions.model.event import LiveContact


def session_of_reports(*reports, facts=None):
    """A session in which an engine reports (frame, phase) of the cubes; frames may be fractions."""
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, facts=facts or {})
    contacts = tuple(LiveContact(round(frame * STEP_NS), "b", "a", phase) for frame, phase in reports)
    return replace(session, live_contacts=contacts)


def run_and_verdicts(session, **settings):
    """The run of the recorded contacts as a detector, and its verdicts by frame."""
    result = compute(session, detectors=[("recorded", settings)], oracle="exact")
    (label,) = result.comparisons
    assert 0.0 < result.detections[label].seconds["lookup"] < 5.0
    return result, result.detections[label].verdict[:, 0].tolist()


@pytest.mark.parametrize(
    ("reports", "frames"),
    [
        ([(4, "enter"), (4, "exit"), (7.5, "enter"), (9.2, "exit")], [4, 8, 9]),
        ([(4, "enter"), (5, "exit"), (8, "enter"), (11, "exit")], [4, 8, 9, 10]),
        ([(4.00009, "enter"), (5.00009, "exit"), (7.99991, "enter"), (10.99991, "exit")], [4, 8, 9, 10]),
        ([(3.2, "enter"), (3.6, "exit"), (11.5, "enter"), (11.6, "exit")], [4]),
    ],
)
def test_a_report_is_contact_from_its_begin_until_its_end(reports, frames):
    """Reports by frame, or between two: a contact of (3.2, 3.6) counts in frame 4, one of (11.5, 11.6) in none."""
    _, verdict = run_and_verdicts(session_of_reports(*reports))
    assert np.flatnonzero(verdict).tolist() == frames


def test_misses_within_the_clock_residual_are_blamed_on_clocks():
    """Frames are 10 ms apart: a report one frame late is within the residual of 11 ms, a missing report is not."""
    late = session_of_reports((4, "enter"), (5, "exit"), (9, "enter"), (11, "exit"), facts={RESIDUAL_FACT: "0.011"})
    assert [miss.cause for miss in run_and_verdicts(late)[0].misses["recorded"]] == ["clock"]
    blind = session_of_reports((4, "enter"), (4, "exit"), facts={RESIDUAL_FACT: "0.011"})
    assert [miss.cause for miss in run_and_verdicts(blind)[0].misses["recorded"]] == ["unexplained"]


@pytest.mark.parametrize("block", [1, 3, 5])
def test_recorded_contacts_in_blocks_equal_the_whole_motion(block):
    """A short contact between frames counts in the next frame, and one without an exit up to the last, frame 11."""
    session = session_of_reports((3.2, "enter"), (3.6, "exit"), (4.1, "enter"), (4.2, "exit"), (7.5, "enter"))
    assembly = assemble(session)

    def detector_of_reports():
        clock = {"first_ns": 0, "residual": 0.0}
        return recorded_detector(assembly.bodies, assembly.pairs, session.live_contacts, **clock, settings={})

    whole = detector_of_reports().detect(assembly.motion)
    pieces = join(detector_of_reports().stream(assembly.motion.blocks(block)))
    assert np.array_equal(pieces.verdict, whole.verdict)
    assert np.flatnonzero(whole.verdict[:, 0]).tolist() == [4, 5, 8, 9, 10, 11]


def test_window_of_a_session_keeps_its_clock():
    """The engine reports contact in frames 8 to 10; the run begins at 0.05 s, and its seconds count from frame 0."""
    session = session_of_reports((8, "enter"), (11, "exit"))
    result = compute(session, detectors="recorded", oracle="exact", start=0.05)
    (contact,) = result.episodes["recorded"]
    # The frame at 0.1 s is its last, and lasts until the next.
    assert (contact.start, contact.end) == (pytest.approx(0.08), pytest.approx(0.11))


def test_engine_reports_of_unknown_bodies_are_counted_and_ignored():
    """One contact of a and b, and the begin of another of a with Floor, which is no body of the session."""
    session = session_of_reports((4, "enter"), (4, "exit"))
    extra = LiveContact(0, "a", "Floor", "enter")
    result = compute(replace(session, live_contacts=(*session.live_contacts, extra)), detectors="recorded")
    assert result.detections["recorded"].work == {"reported": 1, "of_other_pairs": 1}


def test_recorded_detector_refuses_an_unknown_setting():
    """The engine reported one contact."""
    session = session_of_reports((4, "enter"), (4, "exit"))
    with pytest.raises(AuditError, match="no setting 'nonsense'"):
        compute(session, detectors="recorded[nonsense=1]")


@pytest.mark.parametrize(
    ("reports", "spans"),
    [
        # (time, first body, second body, phase)
        ("5ba exit, 1ab enter, 9ab enter, 12ba exit", [(1, 5), (9, 12)]),
        ("1ab enter, 2ab enter, 3ab stay, 5ab exit, 6ab exit", [(1, 5)]),
        ("4ab exit", [(None, 4)]),
        ("4ab stay, 6ab exit", [(None, 6)]),
        ("4ab enter, 5ac enter", [(4, None)]),
    ],
)
def test_report_lasts_from_begin_to_end_in_either_order(reports, spans):
    """ "5ba exit": at 5 ns b and a part. ``spans``: begin and end of contacts of a and b; None: not reported."""
    contacts = []
    for report in reports.split(", "):
        where, phase = report.split()
        contacts.append(LiveContact(int(where[:-2]), where[-2], where[-1], phase))
    assert reported_spans(contacts)["a", "b"] == spans


FIRST = [20 * k + start for k, start in enumerate((7, 9, 6, 8, 11, 7, 10, 6, 9, 8))]
TOUCHED = {frame for first in FIRST for frame in range(first, first + 4)} | {201}
TAPS = {"a": [0] * 210, "b": [0.9 if frame in TOUCHED else 3 for frame in range(210)]}
"""Ten taps of four frames, and one of a single odd frame."""


def engine_of(answer, step=2):
    """The session of the taps, of which an engine at 50 Hz reports the ten.

    Frames are 10 ms apart, its steps 20 ms: at the even frames. ``answer`` makes (begin, end) of the first step in a
    tap and the first one after it.
    """
    reports = []
    for first in FIRST:
        begin, end = answer(first + first % step, first + 4 + (first + 4) % step)
        for frame, phase in ((begin, "enter"), (end, "exit")):
            reports.append(LiveContact(round(frame * STEP_NS), "b", "a", phase))
    return replace(unit_cubes_on_x(TAPS), live_contacts=tuple(reports))


@pytest.mark.slow
def test_reports_are_compared_first_without_request():
    """Compared are an engine's reports of the session's bodies, then the default detectors; a request replaces all."""
    session = session_of_reports((4, "enter"), (5, "exit"))
    usual = ["hull50", "mesh50", "paper"]
    assert [*compute(session).comparisons] == ["recorded", *usual]
    assert [*compute(session, detectors="hybrid").comparisons] == ["hybrid"]
    assert [*compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)).comparisons] == usual
    assert compute(session, oracle="recorded").oracle == "recorded"
    elsewhere = tuple(replace(item, body_a="Floor") for item in session.live_contacts)
    assert [*compute(replace(session, live_contacts=elsewhere)).comparisons] == usual


@pytest.mark.parametrize(
    ("begins", "ends", "step", "causes"),
    [
        (0, 0, 2, {"between physics steps": 6}),
        (2, 0, 2, {"late": 10, "between physics steps": 1}),
        (-1, -2, 2, {"early": 10, "unexplained": 1}),
        (6, 6, 1, {"late": 10, "unexplained": 1}),
        (-6, -6, 1, {"early": 10, "unexplained": 1}),
    ],
    ids=["between steps", "begins late", "ends early", "late as a whole", "early as a whole"],
)
def test_misses_of_an_engine_are_blamed_on_steps_or_lateness(begins, ends, step, causes):
    """Its reports are shifted by ``begins`` and ``ends`` frames, and its physics runs every ``step`` frames."""
    session = engine_of(lambda begin, end: (begin + begins, end + ends), step)
    result = compute(session, detectors="recorded", oracle="exact")
    assert Counter(miss.cause for miss in result.misses["recorded"]) == causes


def test_engine_steps_are_read_from_stamps_on_a_grid():
    """Stamps at random ticks of a clock of ``rate``, ``phase`` of a tick late, rounded to microseconds."""
    rng = np.random.default_rng(0)
    ticks = np.sort(rng.choice(2000, 24, replace=False))
    for rate, phase in ((50.0, 0.3), (72.0, 0.0), (90.0, 0.9)):
        stamps = np.round((ticks + phase) / rate, 6).reshape(-1, 2)
        recognised_hz, recognised_phase = physics_steps([*stamps, np.array([-np.inf, stamps[0, 0]])], rate_hz=None)
        assert recognised_hz == rate
        # A phase of 0 is one of 1: they are compared on the circle.
        assert np.exp(2j * np.pi * recognised_phase) == pytest.approx(np.exp(2j * np.pi * phase), abs=0.01)
        assert physics_steps([*stamps[:3]], rate_hz=None) is None  # too few to tell
    assert physics_steps([*np.sort(rng.uniform(0, 60, 24)).reshape(-1, 2)], rate_hz=None) is None
    assert physics_steps([], 25.0) == (25.0, 0.0) and physics_steps([], rate_hz=None) is None


def engine(*reports, rate_hz=50.0):
    """The detector of an engine with these reports, whose steps are at multiples of 20 ms."""
    session = session_of_reports(*reports)
    made = assemble(session)
    settings = {"rate_hz": rate_hz}
    return recorded_detector(made.bodies, made.pairs, session.live_contacts, made.first_ns, 0.0, settings)


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        (0.041, 0.059, False), (0.041, 0.061, True), (0.039, 0.041, True), (0.04, 0.04, True),
        (0.0400005, 0.05, True), (0.05, 0.0599995, True), (0.04001, 0.05, False), (0.05, 0.05999, False),
    ],
)  # fmt: skip
def test_physics_step_between_moments_counts_to_a_microsecond(start, end, expected):
    """Seconds; steps at multiples of 0.02 s."""
    assert engine((4, "enter"), (6, "exit")).has_step_between(start, end) is expected
    assert engine((4, "enter"), (6, "exit"), rate_hz=None).has_step_between(start, end) is None


@pytest.mark.parametrize(("moment", "expected"), [(0.045, False), (0.065, True), (0.03, False), (0.09, False)])
def test_report_ends_at_the_next_physics_step(moment, expected):
    """The report lasts from 0.04 to 0.08 s; of its steps only 0.08 s is after 0.065 s.

    Without a known rate of steps, or without an end of the report, no step can be its end.
    """
    assert engine((4, "enter"), (8, "exit")).ended_at_next_step(0, moment) is expected
    assert engine((4, "enter"), (8, "exit"), rate_hz=None).ended_at_next_step(0, moment) is False
    assert engine((4, "enter")).ended_at_next_step(0, moment) is False


@pytest.mark.parametrize(
    ("start", "end", "expected"), [(0.026, 0.044, False), (0.026, 0.046, True), (0.0449, 0.0451, True)]
)
def test_physics_steps_between_frames_count(start, end, expected):
    """Reports at 5 and 25 ms: a step every 20 ms, of which the third is at 45 ms."""
    assert engine((0.5, "enter"), (2.5, "exit")).has_step_between(start, end) is expected


def test_reports_count_from_the_first_frame_on():
    """Both clocks begin at 1 s, and the report lasts from 40 to 60 ms after it: frames 4 and 5."""
    first_ns = 100 * STEP_NS
    made = assemble(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, first_ns=first_ns))
    contacts = [
        LiveContact(first_ns + 4 * STEP_NS, "a", "b", "enter"),
        LiveContact(first_ns + 6 * STEP_NS, "a", "b", "exit"),
    ]
    detector = recorded_detector(made.bodies, made.pairs, contacts, made.first_ns, 0.0, {})
    assert np.flatnonzero(detector.detect(made.motion).verdict).tolist() == [4, 5]
