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
    """A session in which an engine reports (frame, phase) of the cubes; frames may be fractions.

    The cubes meet in frame 4 and in frames 8 to 10 of 12, which are 10 ms apart.
    """
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, facts=facts or {})
    contacts = tuple(LiveContact(round(frame * STEP_NS), "b", "a", phase) for frame, phase in reports)
    return replace(session, live_contacts=contacts)


def detection_of_reports(session):
    """The detection of a session by the detector of recorded contacts."""
    assembly = assemble(session)
    clock = {"first_ns": assembly.first_ns, "residual": 0.0}
    detector = recorded_detector(assembly.bodies, assembly.pairs, session.live_contacts, **clock, settings={})
    return detector.detect(assembly.motion)


def audit_of_reports(session):
    """The run in which recorded contacts are a detector, compared with the exact one."""
    return compute(session, detectors=[("recorded", {})], oracle="exact")


@pytest.mark.parametrize(
    ("reports", "frames"),
    [
        ([(4, "enter"), (4, "exit"), (7.5, "enter"), (9.2, "exit")], [4, 8, 9]),
        ([(4, "enter"), (5, "exit"), (8, "enter"), (11, "exit")], [4, 8, 9, 10]),
        ([(4.00009, "enter"), (5.00009, "exit"), (7.99991, "enter"), (10.99991, "exit")], [4, 8, 9, 10]),
        ([(3.2, "enter"), (3.6, "exit"), (11.5, "enter"), (11.6, "exit")], [4]),
    ],
    ids=["at a frame and between frames", "at frames", "within a microsecond of frames", "between two frames"],
)
def test_a_report_is_contact_from_its_begin_until_its_end(reports, frames):
    """An engine reports begin and end of contacts at so many frames; the recorded detector has contact in ``frames``.

    An end at a frame is no contact in it. A contact between two frames, from 3.2 to 3.6, counts in the next, frame 4;
    one after the last frame, 11, in none. A frame is 10 ms: 0.00009 are 0.9 microseconds; up to 1 counts as at it.
    """
    verdict = detection_of_reports(session_of_reports(*reports)).verdict[:, 0]
    assert np.flatnonzero(verdict).tolist() == frames


def test_time_to_search_reports_is_measured():
    """The seconds are a difference of two clock readings: it takes milliseconds, and a single reading would be more."""
    seconds = detection_of_reports(session_of_reports((4, "enter"), (4, "exit"))).seconds
    longest_s = 5.0  # loose, for a busy machine
    assert 0.0 < seconds["lookup"] < longest_s


@pytest.mark.parametrize(
    ("reports", "cause"),
    [
        ([(4, "enter"), (5, "exit"), (9, "enter"), (11, "exit")], "clock"),
        ([(4, "enter"), (4, "exit")], "unexplained"),
    ],
    ids=["one frame late", "no report"],
)
def test_misses_within_the_clock_residual_are_blamed_on_clocks(reports, cause):
    """Cubes meet in frames 4 and 8 to 10, 10 ms apart; the engine reports the second contact from frame 9 on, or not.

    The clocks of engine and recording agree to 11 ms only, which explains a report one frame late, and no missing one.
    """
    result = audit_of_reports(session_of_reports(*reports, facts={RESIDUAL_FACT: "0.011"}))
    assert [miss.cause for miss in result.misses["recorded"]] == [cause]


@pytest.mark.parametrize("block", [1, 3, 5])
def test_recorded_contacts_in_blocks_equal_the_whole_motion(block):
    """Twelve frames are detected in blocks of so many, and at once.

    Reports count in the frames after their begin: 3.2 to 3.6 in frame 4, 4.1 to 4.2 in 5, and one from 7.5 on without
    an exit in 8 up to the last, frame 11.
    """
    session = session_of_reports((3.2, "enter"), (3.6, "exit"), (4.1, "enter"), (4.2, "exit"), (7.5, "enter"))
    assembly = assemble(session)

    def detector_of_reports():
        clock = {"first_ns": 0, "residual": 0.0}
        return recorded_detector(assembly.bodies, assembly.pairs, session.live_contacts, **clock, settings={})

    at_once = detector_of_reports().detect(assembly.motion)
    in_blocks = join(detector_of_reports().stream(assembly.motion.blocks(block)))
    assert np.array_equal(in_blocks.verdict, at_once.verdict)
    assert np.flatnonzero(at_once.verdict[:, 0]).tolist() == [4, 5, 8, 9, 10, 11]


def test_interval_of_a_session_has_the_clock_of_the_whole():
    """The engine reports contact in frames 8 to 10, 10 ms apart; the run begins at 0.05 s.

    Seconds count from frame 0 all the same; the frame at 0.1 s is the last of the contact, and lasts until the next.
    """
    session = session_of_reports((8, "enter"), (11, "exit"))
    result = compute(session, detectors="recorded", oracle="exact", start=0.05)
    (contact,) = result.episodes["recorded"]
    assert (contact.start, contact.end) == (pytest.approx(0.08), pytest.approx(0.11))


def test_engine_reports_of_unknown_bodies_are_counted_and_ignored():
    """One contact of a and b is reported, and the begin of another, of a with Floor, which is no body of the session.

    The detector's work counts a contact of each kind.
    """
    session = session_of_reports((4, "enter"), (4, "exit"))
    with_floor = LiveContact(time_ns=0, body_a="a", body_b="Floor", phase="enter")
    detection = detection_of_reports(replace(session, live_contacts=(*session.live_contacts, with_floor)))
    assert detection.work == {"reported": 1, "of_other_pairs": 1}


def test_recorded_detector_refuses_an_unknown_setting():
    """A session with one contact that an engine reported."""
    session = session_of_reports((4, "enter"), (4, "exit"))
    with pytest.raises(AuditError, match="no setting 'nonsense'"):
        compute(session, detectors="recorded[nonsense=1]")


@pytest.mark.parametrize(
    ("reports", "spans"),
    [
        ("5ba exit, 1ab enter, 9ab enter, 12ba exit", [(1, 5), (9, 12)]),
        ("1ab enter, 2ab enter, 3ab stay, 5ab exit, 6ab exit", [(1, 5)]),
        ("4ab exit", [(None, 4)]),
        ("4ab stay, 6ab exit", [(None, 6)]),
        ("4ab enter, 5ac enter", [(4, None)]),
    ],
    ids=["out of order", "repeated", "end only", "stay and end", "begin only"],
)
def test_report_lasts_from_begin_to_end_in_either_order(reports, spans):
    """ "5ba exit": an engine reports that b and a part at 5 ns; reports and bodies may be in any order.

    ``spans``: begin and end of contacts of a and b in ns; None: not reported. Repeated reports do not count again.
    """
    contacts = []
    for report in reports.split(", "):
        time_and_bodies, phase = report.split()
        *digits, first_body, second_body = time_and_bodies
        contacts.append(LiveContact(int("".join(digits)), first_body, second_body, phase))
    assert reported_spans(contacts)["a", "b"] == spans


FIRST_FRAMES_OF_TAPS = [20 * k + start for k, start in enumerate((7, 9, 6, 8, 11, 7, 10, 6, 9, 8))]
TOUCHING = {frame for first in FIRST_FRAMES_OF_TAPS for frame in range(first, first + 4)} | {201}
TAPS = {"a": [0] * 210, "b": [0.9 if frame in TOUCHING else 3 for frame in range(210)]}
"""Ten taps of four frames, and one of a single odd frame."""


def session_of_taps(begins, ends, step):
    """The session of the taps, of which an engine reports the ten, ``begins`` and ``ends`` frames late.

    Its steps are ``step`` frames apart, 2 being 50 Hz: at the even frames. It reports at the first step in a tap and at
    the first one after it.
    """
    reports = []
    for first in FIRST_FRAMES_OF_TAPS:
        after = first + 4
        begin, end = first + first % step + begins, after + after % step + ends
        reports += [LiveContact(begin * STEP_NS, "b", "a", "enter"), LiveContact(end * STEP_NS, "b", "a", "exit")]
    return replace(unit_cubes_on_x(TAPS), live_contacts=tuple(reports))


DEFAULT_DETECTORS = ["hull50", "mesh50", "paper"]
"""Convex hulls and meshes at 50 Hz, and the pipeline of a paper."""


@pytest.mark.slow
def test_reports_are_compared_first_without_request():
    """A session with an engine's reports: they are compared with the reference, before the default detectors.

    Where detectors are requested only these are compared; the reports may be the reference themselves.
    """
    session = session_of_reports((4, "enter"), (5, "exit"))
    assert [*compute(session).comparisons] == ["recorded", *DEFAULT_DETECTORS]
    assert [*compute(session, detectors="hybrid").comparisons] == ["hybrid"]
    assert compute(session, oracle="recorded").oracle == "recorded"


@pytest.mark.slow
def test_without_reports_of_its_bodies_default_detectors_are_compared():
    """A session without an engine's reports, and one whose reports are of a body Floor that it does not have."""
    assert [*compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)).comparisons] == DEFAULT_DETECTORS
    session = session_of_reports((4, "enter"), (5, "exit"))
    of_floor = tuple(replace(report, body_a="Floor") for report in session.live_contacts)
    assert [*compute(replace(session, live_contacts=of_floor)).comparisons] == DEFAULT_DETECTORS


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
    """Two cubes tap ten times for four frames, which an engine reports, and once for a single one, which it does not.

    Its reports are ``begins`` and ``ends`` frames late, its physics runs every ``step`` frames, 2 being the even ones.
    The single frame is odd, and so are the first of five taps; where reports are at odd frames too, physics may have
    run in every frame, which does not explain the single one. ``causes``: of the misses, with their number.
    """
    result = compute(session_of_taps(begins, ends, step), detectors="recorded", oracle="exact")
    assert Counter(miss.cause for miss in result.misses["recorded"]) == causes


def stamps_on_a_grid(rate_hz, phase):
    """Seconds (12, 2) at random ticks of a clock of this rate, ``phase`` of a tick late, rounded to microseconds."""
    ticks = np.sort(np.random.default_rng(0).choice(2000, 24, replace=False))
    return np.round((ticks + phase) / rate_hz, 6).reshape(-1, 2)


@pytest.mark.parametrize(("rate_hz", "phase"), [(50.0, 0.3), (72.0, 0.0), (90.0, 0.9)])
def test_engine_steps_are_read_from_stamps_on_a_grid(rate_hz, phase):
    """Begin and end of twelve contacts are at steps of an engine; of one more the begin was not reported.

    ``phase``: fraction of a step by which the first is after 0 s.
    """
    stamps = stamps_on_a_grid(rate_hz, phase)
    contact_without_begin = np.array([-np.inf, stamps[0, 0]])
    recognised_hz, recognised_phase = physics_steps([*stamps, contact_without_begin], rate_hz=None)
    assert recognised_hz == rate_hz
    # A phase of 0 is one of 1: they are compared on the circle.
    assert np.exp(2j * np.pi * recognised_phase) == pytest.approx(np.exp(2j * np.pi * phase), abs=0.01)


@pytest.mark.parametrize(
    "stamps",
    [[*stamps_on_a_grid(50.0, 0.3)[:3]], [*np.sort(np.random.default_rng(0).uniform(0, 60, 24)).reshape(-1, 2)], []],
    ids=["three contacts", "random times", "no contacts"],
)
def test_no_engine_steps_are_read_from_few_or_random_stamps(stamps):
    """``stamps``: begin and end of contacts, seconds. Six stamps are fewer than the eight that it takes.

    Random ones lie on the grid of no rate.
    """
    assert physics_steps(stamps, rate_hz=None) is None


def test_stated_rate_of_engine_steps_needs_no_stamps():
    """Steps of 25 Hz are stated, and no contact is reported: a step is at 0 s."""
    rate_hz, phase = physics_steps([], rate_hz=25.0)
    assert (rate_hz, phase) == (25.0, 0.0)


def detector_of_engine(*reports, rate_hz=50.0):
    """The detector of an engine's reports, (frame of 10 ms, phase); its steps, 50 Hz, are at multiples of 20 ms."""
    session = session_of_reports(*reports)
    assembly = assemble(session)
    settings = {"rate_hz": rate_hz}
    return recorded_detector(
        assembly.bodies, assembly.pairs, session.live_contacts, assembly.first_ns, residual=0.0, settings=settings
    )


def test_physics_step_between_moments_counts_to_a_microsecond():
    """An engine's steps are at multiples of 0.02 s, as its reports at 0.04 and 0.06 s: is there a step between moments?

    Moments are in seconds; one that is half a microsecond beyond a step is at it, one that is 10 beyond is not. Where
    the rate of steps is not known, which two reports do not reveal, there is no answer (None).
    """
    has_step = {
        (0.041, 0.059): False, (0.041, 0.061): True, (0.039, 0.041): True, (0.04, 0.04): True,
        (0.0400005, 0.05): True, (0.05, 0.0599995): True, (0.04001, 0.05): False, (0.05, 0.05999): False,
    }  # fmt: skip
    detector = detector_of_engine((4, "enter"), (6, "exit"))
    assert {moments: detector.has_step_between(*moments) for moments in has_step} == has_step
    without_rate = detector_of_engine((4, "enter"), (6, "exit"), rate_hz=None)
    assert {without_rate.has_step_between(*moments) for moments in has_step} == {None}


def test_report_ends_at_the_next_physics_step():
    """A report of the only pair lasts from 0.04 to 0.08 s: does it end at the first step after a moment?

    Steps are at multiples of 0.02 s: after 0.045 s comes 0.06 s, after 0.065 s the end; at the other moments there is
    no report. Without a known rate of steps, or without an end of the report, no step can be its end.
    """
    only_pair, ends_next = 0, {0.045: False, 0.065: True, 0.03: False, 0.09: False}
    detector = detector_of_engine((4, "enter"), (8, "exit"))
    assert {moment: detector.ended_at_next_step(only_pair, moment) for moment in ends_next} == ends_next
    without_rate = detector_of_engine((4, "enter"), (8, "exit"), rate_hz=None)
    without_end = detector_of_engine((4, "enter"))
    for other in (without_rate, without_end):
        assert {other.ended_at_next_step(only_pair, moment) for moment in ends_next} == {False}


def test_physics_steps_between_frames_count():
    """An engine of 50 Hz, a step every 20 ms, reports at 5 and 25 ms, between frames of 10 ms: its third is at 45 ms.

    ``has_step``: a start and an end in seconds, and whether a step is between them.
    """
    has_step = {(0.026, 0.044): False, (0.026, 0.046): True, (0.0449, 0.0451): True}
    detector = detector_of_engine((0.5, "enter"), (2.5, "exit"))
    assert {moments: detector.has_step_between(*moments) for moments in has_step} == has_step


def test_reports_count_from_the_first_frame_on():
    """Both clocks begin at 1 s, and the report lasts from 40 to 60 ms after it: frames 4 and 5."""
    first_ns = 100 * STEP_NS
    assembly = assemble(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, first_ns=first_ns))
    contacts = [
        LiveContact(first_ns + 4 * STEP_NS, "a", "b", "enter"),
        LiveContact(first_ns + 6 * STEP_NS, "a", "b", "exit"),
    ]
    detector = recorded_detector(
        assembly.bodies, assembly.pairs, contacts, assembly.first_ns, residual=0.0, settings={}
    )
    assert np.flatnonzero(detector.detect(assembly.motion).verdict).tolist() == [4, 5]
