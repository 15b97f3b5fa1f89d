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


def session_with_reports(session, late_ns, digits=9, residual="0"):
    """The session with what an engine reports of it: its exact contacts, late by so much, with so many digits."""
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
    # what was planted: (session, detector, oracle, its only cause)
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
    "a clock": (
        lambda: session_with_reports(corners_first(), late_ns=15_000_000, residual="0.026"), "recorded", "exact",
        Cause.CLOCK),
}  # fmt: skip


def corners_first(nearest=0.42):
    """A unit cube comes at another one along the diagonal, corner first, and goes away, six times, a bit turned."""
    frames = 120
    depth = nearest + 0.3 + 0.3 * np.cos(2 * np.pi * np.arange(frames) / 20)
    positions = np.stack([depth, 0.93 * depth, 1.02 * depth], axis=1)
    still = np.tile(STILL, (frames, 1))
    rotated = np.array([0.1, 0.05, 0.0, 1.0]) / np.linalg.norm([0.1, 0.05, 0.0, 1.0])
    poses = {"a": (np.zeros((frames, 3)), still), "b": (positions, np.tile(rotated, (frames, 1)))}
    return Session.from_arrays(np.arange(frames) * 10_000_000, poses, {"a": cube(), "b": cube()})


def test_the_table_of_planted_and_reported_causes_is_diagonal():
    """The cubes meet six times; every detector misses that by its planted cause, and no other is reported."""
    result = compute(corners_first(), detectors=list(PLANTED.values()), oracle="exact")
    labels = dict(zip(PLANTED, [label for label in result.detections if label != "exact"], strict=True))
    for planted, label in labels.items():
        answer = result.causes[label]
        assert answer.examined_misses > 5, planted  # frames: too many for a cause by chance
        assert {cause for cause, count in answer.pair_frames.items() if count} == {planted}
        assert {miss.cause for miss in result.misses[label]} == {planted.value}
        figures = result.document.audit[label].causes
        assert figures.misses[planted] == len(result.misses[label]) and set(figures.misses) == set(MISS_CAUSES)


@pytest.mark.slow
@pytest.mark.parametrize("planted", ELSEWHERE)
def test_planted_cause_is_the_only_cause_reported(planted):
    """A row of ELSEWHERE: a session, a detector that misses contacts, the reference, and the cause that was planted."""
    session, detector, oracle, cause = ELSEWHERE[planted]
    (answer,) = compute(session(), detectors=detector, oracle=oracle).causes.values()
    assert answer.examined_misses > 0
    assert {item for item, count in answer.pair_frames.items() if count and item != Cause.TOLERANCE} == {cause}


FRAME_OF_90_HZ_NS = 11_111_111


@pytest.mark.sampled(7)
@pytest.mark.parametrize(
    ("late_ns", "digits", "missed_frames", "false_frames"),
    [(0, 9, 0, 0), (300, 9, 0, 0), (-300, 9, 0, 0), (0, 6, 0, 0), (300, 6, 0, 0), (5000, 9, 3, 3), (-5000, 9, 0, 0)],
)
def test_a_stamp_a_microsecond_off_is_at_its_frame(late_ns, digits, missed_frames, false_frames):
    """Three contacts, reported in seconds of so many digits. A report 5 us late belongs to the next frame.

    Then the first frame of each contact is missed and the frame after its last is false; 5 us early changes no frame.
    """
    session = unit_cubes_on_x(
        {"a": [0.0] * 12, "b": [3, 3, 0.9, 0.9, 3, 3, 0.9, 0.8, 3, 0.9, 0.9, 3]}, step_ns=FRAME_OF_90_HZ_NS
    )
    result = compute(session_with_reports(session, late_ns, digits), detectors="recorded", oracle="exact")
    figures = result.document.audit["recorded"]
    assert (figures.time_missed.count, figures.false_contact.count) == (missed_frames, false_frames)


@pytest.mark.slow
def test_misses_under_an_oracle_of_intervals_have_planted_causes():
    """Each planted detector loses contacts by one cause; the oracle tests the way between frames as well.

    The bodies meet at frames too, so no miss is put down to BETWEEN_FRAMES, the cause of contacts that no frame shows.
    """
    planted = (Cause.BUDGET, Cause.SAMPLING, Cause.SPHERE_STAGE, Cause.BETWEEN_SAMPLES)
    result = compute(
        corners_first(), detectors=[PLANTED[cause] for cause in planted], oracle="s=support.planted_detectors:Swept"
    )
    for cause, label in zip(planted, result.causes, strict=True):
        assert result.causes[label].examined_misses > 5  # frames: too many for a cause by chance
        assert {answer for answer, count in result.causes[label].pair_frames.items() if count} == {cause}


def test_a_contact_that_no_instant_shows_is_lost_between_frames():
    """From frame 1 to 2 cube b goes from 3 to -3, through a; the oracle tests the way as well."""
    session = unit_cubes_on_x({"a": [0.0] * 8, "b": [3, 3, -3, -3, -3, 0.9, 0.8, 3]})
    result = compute(session, detectors="exact", oracle="truth=support.planted_detectors:Swept")
    (miss,) = result.misses["exact"]
    assert (miss.first, miss.last, miss.cause) == (2, 2, "between frames")
    assert {cause for cause, count in result.causes["exact"].pair_frames.items() if count} == {Cause.BETWEEN_FRAMES}


def test_interval_that_begins_in_contact_is_explained_there():
    """Contact in frames 1 and 2, so in the interval that ends with frame 3; reported in frame 1 alone."""
    session = unit_cubes_on_x({"a": [0.0] * 5, "b": [3, 0.9, 0.9, 3, 3]})
    result = compute(
        session,
        detectors="brief=support.planted_detectors:Scripted[says=ncnnn]",
        oracle="truth=support.planted_detectors:Swept",
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
    """Unit cubes 1 um deep in each other, in touch, and apart: the first two are within the tolerance of 2 um."""
    session = unit_cubes_on_x({"a": [0] * 3, "b": [1 - 1e-6, 1.0, 1.5]})
    result = compute(session, detectors="support.planted_detectors:Blind", oracle="exact")
    assert result.misses["Blind"] == () and result.causes["Blind"].pair_frames[Cause.TOLERANCE] == 2


@pytest.mark.parametrize(
    ("reported", "cause"),
    [
        ({}, Cause.UNEXPLAINED),
        ({"verdict": Verdict.NOT_FOUND}, Cause.SEARCH),
        ({"looked": False, "shapes_meet": False}, Cause.COLLIDER_SHAPE),
        ({"looked": False, "spheres_meet": False}, Cause.BETWEEN_SAMPLES),
        ({"within_clock": True, "shapes_meet": False}, Cause.CLOCK),
        ({"shapes_meet": False, "spheres_meet": False}, Cause.COLLIDER_SHAPE),
        ({"spheres_meet": False, "sample_meets": False}, Cause.SPHERE_STAGE),
        ({"sample_meets": False, "found_with_more": True}, Cause.SAMPLING),
        ({"sample_meets": True, "found_with_more": True}, Cause.BUDGET),
        ({"sample_meets": True, "found_with_more": False}, Cause.SEARCH),
    ],
)
def test_first_failed_stage_is_the_cause_of_a_miss(reported, cause):
    """The order: clock, collider shape, sampling instant (``looked``), spheres, sample of faces, budget, search.

    A contact between two frames, where no stage looks, has a cause of its own.
    """
    answer = reported.pop("verdict", Verdict.CLEAR)
    assert first_failed(Explanation(**reported), answer, at_instant=True) == cause
    assert first_failed(Explanation(**reported), answer, at_instant=False) == Cause.BETWEEN_FRAMES


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
        ((), ".I.", Cause.UNEXPLAINED),
        (("decided",), ".I.", Cause.UNEXPLAINED),
        ((f"{REFUSED}a body is open",), ".I.", Cause.CONTAINMENT),
        ((f"{REFUSED}a body is open",), ".C.", Cause.UNEXPLAINED),
    ],
)
def test_containment_is_the_cause_only_where_refused(containment, truth, cause):
    """One body is inside the other (I) or surfaces meet (C) in frame 1; this is said of containment."""
    subject, oracle = verdict_column("...", containment=containment), verdict_column(truth)
    assert causes_at(frame=1, subject=subject, oracle=oracle) == [cause]


CONTACTS = "".join("." * gap + "CCCC" for gap in (6, 9, 5, 12, 7, 10)) + "." * 40
FIVE_CONTACTS = CONTACTS[:59]
"""All but the sixth contact, which is in frames 69 to 72; the first is in frames 6 to 9."""


@pytest.mark.parametrize(
    ("reported", "frame", "cause"),
    [
        (".." + FIVE_CONTACTS + "." * 52, 6, Cause.LATE),
        (".." + FIVE_CONTACTS + "." * 52, 70, Cause.UNEXPLAINED),
        (FIVE_CONTACTS[2:] + "." * 56, 9, Cause.EARLY),
        (FIVE_CONTACTS[2:] + "." * 56, 70, Cause.UNEXPLAINED),
    ],
)
def test_miss_is_late_or_early_where_reported_then(reported, frame, cause):
    """Five contacts are reported two frames late or early, and the sixth not at all."""
    assert causes_at(frame, verdict_column(reported), verdict_column(CONTACTS)) == [cause]


def test_contact_that_the_exact_answer_denies_is_unexplained():
    """A reference of instants, other than the exact detector, reports a contact that no surfaces have."""
    subject, oracle = verdict_column("..."), verdict_column(".C.")
    assert causes_at(frame=1, subject=subject, oracle=oracle, exact_codes="...") == [Cause.UNEXPLAINED]


def test_samples_are_bounded_and_unsampled_misses_unexamined(monkeypatch):
    """20 misses of two frames each by a detector that sees nothing; only ten frames may be examined."""
    monkeypatch.setattr("replay.auditing.examination.CAUSE_BUDGET", SampleBudget(per_miss=16, total=10))
    monkeypatch.setattr("replay.auditing.examination.FRAMES_AT_ONCE", 3)
    session = unit_cubes_on_x({"a": [0] * 60, "b": [3, 0.9, 0.9] * 20})
    result = compute(session, detectors="support.planted_detectors:Blind")
    causes = Counter(miss.cause for miss in result.misses["Blind"])
    assert causes == {Cause.NOT_EXAMINED: 10, Cause.UNEXPLAINED: 10}
    assert result.causes["Blind"].examined_misses == 10 and result.causes["Blind"].missed_contacts == 40


def test_misses_under_a_reference_without_faces_get_exact_faces():
    """``slow`` samples in frames 0, 5 and 10 and misses 4, 8 and 9; ``Planted`` is exact and reports no faces."""
    result = compute(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10),
        detectors="slow=discrete[rate_hz=20,sampling_offset_s=0]",
        oracle="support.planted_detectors:Planted",
    )
    assert [miss.cause for miss in result.misses["slow"]] == ["between samples"] * 2
    assert all(miss.evidence.face_pairs for miss in result.misses["slow"])
