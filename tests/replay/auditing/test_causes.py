"""One planted fault per cause: what was planted is what is reported, and nothing else."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, STILL, cube, make_analytic, unit_cubes_on_x, verdict_column

from cdcore import Verdict
from cdcore.protocol import REFUSED, Explanation
from cdcore.protocol.detection import FaceSets
from replay.auditing.causes import Audited, ExactAnswer, causes_of_miss, count_causes, first_failed
from replay.auditing.compare import compare
from replay.auditing.episodes import episodes
from replay.auditing.fault import MISS_CAUSES, Cause
from replay.auditing.misses import missed_faults
from replay.auditing.sample_budget import SampleBudget
from replay.engine import compute
from replay.prepare.assemble import RESIDUAL_FACT
from sessions import Session
from sessions.model.event import LiveContact

PLANTED = {
    **{
        cause: f"{stage}=support.planted_detectors:Blamed[stage={stage}]"
        for cause, stage in (
            (Cause.SPHERE_STAGE, "spheres"),
            (Cause.SAMPLING, "sample"),
            (Cause.BUDGET, "budget"),
            (Cause.SEARCH, "search"),
            (Cause.UNEXPLAINED, "nothing"),
        )
    },
    Cause.COLLIDER_SHAPE: "round=collider[shape=sphere]",
    Cause.BETWEEN_SAMPLES: "slow=discrete[rate_hz=20]",
    Cause.LATE: "support.planted_detectors:FiveLate",
}
"""Cause -> a detector that misses contacts by it. ``Blamed`` reports none and explains it by that stage of a search."""


def session_with_reports(session, late_ns, digits=9, residual="0"):
    """The session with what an engine reports of it: its exact contacts, late by so much, with so many digits.

    ``residual``: seconds by which the engine's clock is uncertain, as text.
    """
    result = compute(session, detectors="exact", oracle="none")
    times = result.assembly.motion.times
    written = [
        (float(np.round((seconds * 1e9 + late_ns) / 1e9, digits)), phase)
        for item in result.episodes["exact"]
        for seconds, phase in ((times[item.first], "enter"), (item.end, "exit"))
    ]
    contacts = tuple(LiveContact(round(seconds * 1e9), "a", "b", phase) for seconds, phase in written)
    return replace(session, live_contacts=contacts, facts={RESIDUAL_FACT: residual})


ELSEWHERE = {
    # what was planted: (session, detector, reference, its only cause)
    "a collider that never meets": (
        lambda: corners_first(nearest=0.6), "collider[shape=capsule,rate_hz=20]", "exact", Cause.COLLIDER_SHAPE),
    "a budget": (
        lambda: make_analytic("spinning-rod", seconds=3.0)[0], "hybrid-qaco[budget=100]", "exact", Cause.BUDGET),
    "lateness where bodies are inside others": (
        lambda: make_analytic("ball-in-box", seconds=3.0)[0], "support.planted_detectors:FiveLate", "exact",
        Cause.LATE),
    **{f"containment, by {name}": (
        lambda: make_analytic("ball-in-box", seconds=3.0)[0], name, "exact", Cause.CONTAINMENT,
    ) for name in ("hybrid[containment=false]", "qaco")},
    "an engine five frames late": (
        lambda: session_with_reports(corners_first(), late_ns=50_000_000), "recorded", "exact", Cause.LATE),
    "an engine whose clock is uncertain by more than its reports are late": (
        lambda: session_with_reports(corners_first(), late_ns=15_000_000, residual="0.026"), "recorded", "exact",
        Cause.CLOCK),
}  # fmt: skip


def corners_first(nearest=0.42, frames=120):
    """A unit cube comes at another one along the diagonal, corner first, and goes away, each 20 frames, a bit turned.

    Frames of 10 ms; its middle comes to about (``nearest``, ``nearest``, ``nearest``) metres from the other's.
    """
    offset = nearest + 0.3 + 0.3 * np.cos(2 * np.pi * np.arange(frames) / 20)
    positions = np.stack([offset, 0.93 * offset, 1.02 * offset], axis=1)
    still = np.tile(STILL, (frames, 1))
    rotated = np.array([0.1, 0.05, 0.0, 1.0]) / np.linalg.norm([0.1, 0.05, 0.0, 1.0])
    poses = {"a": (np.zeros((frames, 3)), still), "b": (positions, np.tile(rotated, (frames, 1)))}
    return Session.from_arrays(np.arange(frames) * 10_000_000, poses, {"a": cube(), "b": cube()})


def causes_of_frames(causes_of_detector):
    """The causes that any missed frame of a detector has."""
    return {cause for cause, frames in causes_of_detector.pair_frames.items() if frames}


TOO_MANY_FOR_CHANCE = 5
"""Missed frames: of more than these none has the right cause by chance alone."""


def test_the_table_of_planted_and_reported_causes_is_diagonal():
    """Two cubes meet three times; a detector of PLANTED misses frames by its cause alone, and no other is reported.

    More than five missed frames are examined, too many to be right by chance. The document has a count of every cause.
    """
    result = compute(corners_first(frames=60), detectors=list(PLANTED.values()), oracle="exact")
    labels = dict(zip(PLANTED, [label for label in result.detections if label != "exact"], strict=True))
    for planted, label in labels.items():
        assert result.causes[label].examined_misses > TOO_MANY_FOR_CHANCE, planted
        assert causes_of_frames(result.causes[label]) == {planted}, planted
        assert {miss.cause for miss in result.misses[label]} == {planted.value}, planted
        misses_by_cause = result.document.audit[label].causes.misses
        assert misses_by_cause.keys() == set(MISS_CAUSES), planted
        assert misses_by_cause[planted] == len(result.misses[label]), planted


@pytest.mark.slow
@pytest.mark.parametrize("planted", ELSEWHERE)
def test_planted_cause_is_the_only_cause_reported(planted):
    """A row of ELSEWHERE: a session, a detector that misses contacts, the reference, and the cause that was planted.

    Frames that touch within tolerance have that as their cause, whatever was planted.
    """
    make_session, detector, oracle, cause = ELSEWHERE[planted]
    (causes,) = compute(make_session(), detectors=detector, oracle=oracle).causes.values()
    assert causes.examined_misses > 0
    assert causes_of_frames(causes) - {Cause.TOLERANCE} == {cause}


FRAME_OF_90_HZ_NS = 11_111_111


@pytest.mark.sampled(7)
@pytest.mark.parametrize(
    ("late_ns", "digits", "missed_frames", "false_frames"),
    [
        pytest.param(0, 9, 0, 0, id="in time"),
        pytest.param(300, 9, 0, 0, id="0.3 us late"),
        pytest.param(-300, 9, 0, 0, id="0.3 us early"),
        pytest.param(0, 6, 0, 0, id="rounded to 1 us"),
        pytest.param(300, 6, 0, 0, id="0.3 us late, rounded to 1 us"),
        pytest.param(5000, 9, 3, 3, id="5 us late"),
        pytest.param(-5000, 9, 0, 0, id="5 us early"),
    ],
)
def test_a_stamp_a_microsecond_off_is_at_its_frame(late_ns, digits, missed_frames, false_frames):
    """Three contacts of two frames, reported in seconds of so many digits. A report 5 us late is of the next frame.

    Then the first frame of each contact is missed and the frame after its last is false; 5 us early changes no frame.
    """
    session = unit_cubes_on_x(
        {"a": [0.0] * 12, "b": [3, 3, 0.9, 0.9, 3, 3, 0.9, 0.8, 3, 0.9, 0.9, 3]}, step_ns=FRAME_OF_90_HZ_NS
    )
    result = compute(session_with_reports(session, late_ns, digits), detectors="recorded", oracle="exact")
    audit = result.document.audit["recorded"]
    assert (audit.time_missed.count, audit.false_contact.count) == (missed_frames, false_frames)


@pytest.mark.slow
def test_misses_under_an_oracle_of_intervals_have_planted_causes():
    """Two cubes meet six times. PLANTED has a detector for each of four causes, which loses these contacts by it.

    The oracle, ``Swept``, tests the way between frames as well. The cubes meet at frames too, so no miss is put down to
    BETWEEN_FRAMES, the cause of contacts that no frame shows.
    """
    planted = (Cause.BUDGET, Cause.SAMPLING, Cause.SPHERE_STAGE, Cause.BETWEEN_SAMPLES)
    detectors = [PLANTED[cause] for cause in planted]
    result = compute(corners_first(), detectors=detectors, oracle="intervals=support.planted_detectors:Swept")
    for cause, label in zip(planted, result.causes, strict=True):
        assert result.causes[label].examined_misses > TOO_MANY_FOR_CHANCE
        assert causes_of_frames(result.causes[label]) == {cause}


def test_a_contact_that_no_instant_shows_is_lost_between_frames():
    """Unit cube b goes from x = 3 to -3 m between frames 1 and 2, through a; it touches a again in frames 5 and 6.

    The oracle tests the way as well: ``exact``, which tests frames, misses the contact of the way to frame 2 alone.
    """
    session = unit_cubes_on_x({"a": [0.0] * 8, "b": [3, 3, -3, -3, -3, 0.9, 0.8, 3]})
    result = compute(session, detectors="exact", oracle="intervals=support.planted_detectors:Swept")
    (miss,) = result.misses["exact"]
    assert (miss.first, miss.last, miss.cause) == (2, 2, "between frames")
    assert causes_of_frames(result.causes["exact"]) == {Cause.BETWEEN_FRAMES}


def test_interval_that_begins_in_contact_is_explained_there():
    """Cubes touch in frames 1 and 2, so also on the way that ends with frame 3; the detector reports frame 1 alone.

    Its report covers the ways to frames 1 and 2. The way to frame 3 is missed, and as it begins in contact, in frame 2,
    the cause is what the detector says there, nothing, and not that no frame shows the contact.
    """
    session = unit_cubes_on_x({"a": [0.0] * 5, "b": [3, 0.9, 0.9, 3, 3]})
    contact_in_frame_1 = "support.planted_detectors:Scripted[says=ncnnn]"
    result = compute(
        session, detectors=f"brief={contact_in_frame_1}", oracle="intervals=support.planted_detectors:Swept"
    )
    (miss,) = result.misses["brief"]
    assert (miss.first, miss.last, miss.cause) == (3, 3, Cause.UNEXPLAINED)


def test_frames_within_tolerance_have_tolerance_as_their_cause():
    """The oracle sees contact in frames 1 to 3, the subject in frame 3; frames 1 and 2 are within tolerance."""
    subject, oracle = verdict_column("...C"), verdict_column(".CCC")
    comparison = compare(subject, oracle, within=lambda frames, _: np.isin(frames, [1, 2]))
    causes = count_causes(misses=(), causes_of_misses=(), comparison=comparison, oracle=oracle)
    assert causes.pair_frames == {Cause.TOLERANCE: 2}


def test_tolerance_is_counted_in_a_run_without_misses():
    """Unit cubes 1 um deep in each other, in touch, and apart: the first two are within the tolerance of 2 um.

    The detector ``Blind`` reports no contact, and misses none.
    """
    session = unit_cubes_on_x({"a": [0] * 3, "b": [1 - 1e-6, 1.0, 1.5]})
    result = compute(session, detectors="support.planted_detectors:Blind", oracle="exact")
    assert result.misses["Blind"] == ()
    assert result.causes["Blind"].pair_frames[Cause.TOLERANCE] == 2


@pytest.mark.parametrize(
    ("explanation", "verdict", "cause"),
    [
        pytest.param({}, Verdict.CLEAR, Cause.UNEXPLAINED, id="nothing is known"),
        pytest.param({}, Verdict.NOT_FOUND, Cause.SEARCH, id="the search found nothing"),
        pytest.param({"within_clock": True, "shapes_meet": False}, Verdict.CLEAR, Cause.CLOCK, id="clock first"),
        pytest.param({"shapes_meet": False, "looked": False}, Verdict.CLEAR, Cause.COLLIDER_SHAPE, id="then shape"),
        pytest.param(
            {"shapes_meet": False, "spheres_meet": False}, Verdict.CLEAR, Cause.COLLIDER_SHAPE, id="shape, not spheres"
        ),
        pytest.param({"looked": False, "spheres_meet": False}, Verdict.CLEAR, Cause.BETWEEN_SAMPLES, id="then instant"),
        pytest.param({"spheres_meet": False, "sample_meets": False}, Verdict.CLEAR, Cause.SPHERE_STAGE, id="spheres"),
        pytest.param({"sample_meets": False, "found_with_more": True}, Verdict.CLEAR, Cause.SAMPLING, id="sample"),
        pytest.param({"sample_meets": True, "found_with_more": True}, Verdict.CLEAR, Cause.BUDGET, id="budget"),
        pytest.param({"sample_meets": True, "found_with_more": False}, Verdict.CLEAR, Cause.SEARCH, id="search"),
    ],
)
def test_first_failed_stage_is_the_cause_of_a_miss(explanation, verdict, cause):
    """``explanation``: what the detector says of its stages in the missed frame; ``verdict``: its answer there.

    The order: clock, collider shape, sampling instant (``looked``), spheres, sample of faces, budget, search.
    """
    assert first_failed(Explanation(**explanation), verdict, at_instant=True) == cause


def test_contact_between_frames_has_a_cause_of_its_own():
    """No frame shows the contact: no stage saw it, whatever the detector says of its stages."""
    explanation = Explanation(within_clock=True, shapes_meet=False, looked=False)
    assert first_failed(explanation, Verdict.CLEAR, at_instant=False) == Cause.BETWEEN_FRAMES


NO_FACES = FaceSets(*np.zeros((4, 0), np.int64), faces=np.zeros((0, 2), np.int32))


def causes_at(frame, subject, oracle, exact_codes=None):
    """The causes of the miss that covers a frame, at that frame alone, of a detector that explains nothing.

    ``exact_codes``: the exact answer, a letter a frame; ``None``: that of the oracle.
    """
    misses = missed_faults(compare(subject, oracle), episodes(oracle), [("a", "b")], oracle.times)
    (miss,) = (miss for miss in misses if miss.first <= frame <= miss.last)
    audited = Audited(motion=None, detector=object(), subject=subject, oracle=oracle)
    exact = verdict_column(exact_codes, face_sets=NO_FACES) if exact_codes else replace(oracle, face_sets=NO_FACES)
    return causes_of_miss(miss, [frame], audited, ExactAnswer(exact))


@pytest.mark.parametrize(
    ("containment", "truth", "cause"),
    [
        pytest.param((), ".I.", Cause.UNEXPLAINED, id="nothing is said of containment"),
        pytest.param(("decided",), ".I.", Cause.UNEXPLAINED, id="containment is decided"),
        pytest.param((f"{REFUSED}a body is open",), ".I.", Cause.CONTAINMENT, id="refused, inside"),
        pytest.param((f"{REFUSED}a body is open",), ".C.", Cause.UNEXPLAINED, id="refused, but surfaces meet"),
    ],
)
def test_containment_is_the_cause_only_where_refused(containment, truth, cause):
    """A detector reports nothing in three frames; in frame 1 a body is inside the other (I), or surfaces meet (C).

    ``containment``: what the detector says of its test for bodies inside others.
    """
    subject, oracle = verdict_column("...", containment=containment), verdict_column(truth)
    assert causes_at(frame=1, subject=subject, oracle=oracle) == [cause]


CONTACTS = "".join("." * gap + "CCCC" for gap in (6, 9, 5, 12, 7, 10)) + "." * 40
"""Six contacts of four frames; the first is in frames 6 to 9, the sixth in 69 to 72."""
FIVE_CONTACTS = CONTACTS[:59]
"""All but the sixth contact."""


FIVE_LATE = ".." + FIVE_CONTACTS + "." * 52
FIVE_EARLY = FIVE_CONTACTS[2:] + "." * 56


@pytest.mark.parametrize(
    ("reported", "frame", "cause"),
    [
        pytest.param(FIVE_LATE, 6, Cause.LATE, id="first frame of a contact reported late"),
        pytest.param(FIVE_LATE, 70, Cause.UNEXPLAINED, id="contact never reported, others late"),
        pytest.param(FIVE_EARLY, 9, Cause.EARLY, id="last frame of a contact reported early"),
        pytest.param(FIVE_EARLY, 70, Cause.UNEXPLAINED, id="contact never reported, others early"),
    ],
)
def test_miss_is_late_or_early_where_reported_then(reported, frame, cause):
    """Five contacts are reported two frames late or early, and the sixth not at all; ``frame`` is missed."""
    assert causes_at(frame, verdict_column(reported), verdict_column(CONTACTS)) == [cause]


def test_contact_that_the_exact_answer_denies_is_unexplained():
    """A reference of instants, other than the exact detector, reports a contact that no surfaces have."""
    subject, oracle = verdict_column("..."), verdict_column(".C.")
    assert causes_at(frame=1, subject=subject, oracle=oracle, exact_codes="...") == [Cause.UNEXPLAINED]


def test_samples_are_bounded_and_unsampled_misses_unexamined(monkeypatch):
    """20 misses of two frames each by a detector that reports nothing; only ten frames may be examined, in threes.

    So ten misses have one frame examined each, and ten have none.
    """
    monkeypatch.setattr("replay.auditing.examination.CAUSE_BUDGET", SampleBudget(per_miss=16, total=10))
    monkeypatch.setattr("replay.auditing.examination.FRAMES_AT_ONCE", 3)
    session = unit_cubes_on_x({"a": [0] * 60, "b": [3, 0.9, 0.9] * 20})
    result = compute(session, detectors="support.planted_detectors:Blind")
    causes = Counter(miss.cause for miss in result.misses["Blind"])
    assert causes == {Cause.NOT_EXAMINED: 10, Cause.UNEXPLAINED: 10}
    assert result.causes["Blind"].examined_misses == 10
    assert result.causes["Blind"].missed_contacts == 20 * 2


def test_misses_under_a_reference_without_faces_get_exact_faces():
    """Cubes meet in frame 4 and in 8 to 10, of 10 ms. ``slow`` samples in frames 0, 5 and 10: it misses 4, and 8 and 9.

    The reference, ``Planted``, is exact and reports no faces; each miss has those that meet, for its cause and picture.
    """
    result = compute(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10),
        detectors="slow=discrete[rate_hz=20,sampling_offset_s=0]",
        oracle="support.planted_detectors:Planted",
    )
    first, second = result.misses["slow"]
    assert first.cause == second.cause == "between samples"
    assert first.evidence.face_pairs > 0 and second.evidence.face_pairs > 0
