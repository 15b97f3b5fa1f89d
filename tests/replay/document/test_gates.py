import pytest
from support.report_states import audit_of, times_of, zeros
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.auditing.wilson import proportion
from replay.document.audit import CountRange, MissedDepth, PairFrames
from replay.document.gates import Gates, percent
from replay.document.scores import pooled_audits
from replay.engine import compute


def audit_with(missed, of, *, contacts_missed=0, contacts=4, false=(0, 0), undecided=0, by_reference=0, compared=10):
    """The audit of a detector: so many pair-frames (a frame of a pair of bodies) missed of those in contact.

    ``false``: pair-frames of false contact, of those reported; ``undecided``, ``by_reference``: pair-frames that the
    detector, or the reference, did not decide; ``compared``: in which both report contact.
    """
    return audit_of(
        time_missed=proportion(missed, of), contacts_missed=contacts_missed, contacts=contacts,
        false_contact=proportion(*false), contacts_undecided=int(undecided > 0), contact_frames_undecided=undecided,
        reference_undecided=by_reference,
        pair_frames=zeros(PairFrames, both=compared, left_out=undecided + by_reference),
    )  # fmt: skip


def session_with_times(**seconds):
    """The file of a session, and the times of its detector x: mean and p99 (99 % of the frames) in seconds."""
    return "s.mcap", {"x": times_of(**seconds)}


def broken_limits(audit, session_times=(), **limits):
    """Sentences on the limits that an audit, or the times of sessions, exceed; ``limits``: fields of Gates."""
    return Gates(**limits).broken_limits(audit, session_times)


def test_gate_breaks_above_its_limit_and_not_at_the_limit():
    """Detector x missed 1 of 4 pair-frames in contact (a frame of a pair of bodies), which are 0.25."""
    audit = {"x": audit_with(missed=1, of=4)}
    assert broken_limits(audit, max_missed=0.25) == []
    (sentence,) = broken_limits(audit, max_missed=0.24)
    assert "x missed 1 of 4 pair-frames in contact (25 %" in sentence


def test_gate_judges_contacts_beside_their_frames():
    """1 of 400 pair-frames in contact missed is little, but 2 of 4 contacts missed are more than 0.25."""
    (sentence,) = broken_limits({"x": audit_with(missed=1, of=400, contacts_missed=2, contacts=4)}, max_missed=0.25)
    assert "x missed 2 of 4 contacts" in sentence


def test_without_a_limit_nothing_breaks():
    """Detector x missed all of 9 pair-frames and all of 4 contacts."""
    assert broken_limits({"x": audit_with(missed=9, of=9, contacts_missed=4, contacts=4)}) == []


def test_audit_of_no_detector_passes_no_gate():
    """Limits that allow everything, or nothing, and no detector that was compared: a sentence for each."""
    assert broken_limits({}, max_missed=1.0, max_false=0.0) == [
        "--max-missed cannot be checked: nothing was audited",
        "--max-false cannot be checked: nothing was audited",
    ]


@pytest.fixture(scope="module")
def audit_over_offsets():
    """Contacts in frame 4 and in frames 8 to 10, of 10 ms each; a detector samples every fourth frame, from frame 0 on.

    Begun at 16 offsets over four frames, it sees the first contact from a quarter of them, the other from three
    quarters: 1 of 2 is missed in the mean, and from 0 to 2.
    """
    run = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=25]")
    return run.document.audit


def test_a_gate_judges_the_mean_over_sampling_offsets(audit_over_offsets):
    """A detector misses 1 of 2 contacts in the mean over 16 start times of its samples, and from 0 to 2.

    A limit of 0.6 holds, 0.4 breaks: for contacts, and for pair-frames (a frame of a pair of bodies).
    """
    assert audit_over_offsets["slow"].counts_over_offsets.contacts_missed == CountRange(smallest=0, largest=2, mean=1.0)
    assert broken_limits(audit_over_offsets, max_missed=0.6) == []
    contacts, pair_frames = broken_limits(audit_over_offsets, max_missed=0.4)
    assert "1.00 of 2, 0-2" in contacts
    assert "16 start times of sampling" in pair_frames


def test_means_over_offsets_of_two_sessions_are_added(audit_over_offsets):
    """In a session a detector misses 1 of 2 contacts in the mean over start times of its samples, and from 0 to 2.

    With the same session twice these are 2 of 4, and from 0 to 4.
    """
    contacts, _pair_frames = broken_limits(pooled_audits([audit_over_offsets] * 2), max_missed=0.4)
    assert "2.00 of 4, 0-4" in contacts


def test_gate_of_the_slowest_frames_is_in_milliseconds():
    """99 % of the frames may take 11.1 ms: 11 ms hold, 12 ms break; the sentence has the mean, too, and the file."""
    audit = {"x": audit_with(missed=0, of=4)}
    slow, fast = session_with_times(p99=0.012, mean=0.002), session_with_times(p99=0.011)
    assert broken_limits(audit, [fast], max_p99_ms=11.1) == []
    (sentence,) = broken_limits(audit, [fast, slow], max_p99_ms=11.1)
    assert "12 ms" in sentence and "2 ms a frame in the mean" in sentence and "s.mcap" in sentence


def test_gate_of_the_slowest_frames_needs_their_times():
    """Detector x was not timed frame by frame; then it was, and y beside it was not."""
    audit = {"x": audit_with(missed=0, of=4)}
    (sentence,) = broken_limits(audit, [session_with_times()], max_p99_ms=11.1)
    assert sentence == "--max-p99-ms cannot be checked: x was not timed frame by frame in s.mcap"
    file, times = session_with_times(p99=0.011)
    both = {**audit, "y": audit_with(missed=0, of=4)}
    (sentence,) = broken_limits(both, [(file, {**times, "y": times_of()})], max_p99_ms=11.1)
    assert "y was not timed" in sentence


def test_undecided_contact_breaks_the_gate_about_misses():
    """Every miss is allowed, but what the detector or the reference left undecided might be one.

    First x left many pair-frames undecided, which ``audit_with`` counts as one contact of eight; then the reference
    left three.
    """
    by_detector = audit_with(missed=0, of=0, contacts=8, undecided=43_104)  # any number
    assert broken_limits({"x": by_detector}, max_missed=1.0) == [
        "--max-missed cannot be checked: x left 43104 pair-frames in contact undecided, 1 of 8 contacts whole"
    ]
    by_reference = audit_with(missed=0, of=4, by_reference=3)
    assert broken_limits({"x": by_reference}, max_missed=1.0) == [
        "--max-missed cannot be checked: the reference left 3 pair-frames undecided"
    ]


def test_false_contact_beyond_the_limit_breaks_the_gate():
    """3 of 4 pair-frames that detector x reports are false: 0.75 holds, 0.7 breaks."""
    audit = {"x": audit_with(missed=0, of=4, false=(3, 4))}
    assert broken_limits(audit, max_false=0.75) == []
    (sentence,) = broken_limits(audit, max_false=0.7)
    assert sentence.startswith("x reports false contact: 3 of the 4 pair-frames in contact that it reports (75 %")
    assert sentence.endswith("more than --max-false 0.7")


def test_false_contact_gate_fails_where_nothing_was_compared():
    """All false contact is allowed, but the detector decided no pair-frame, or the reference left three undecided."""
    by_detector = audit_with(missed=0, of=0, compared=0, undecided=5)
    assert broken_limits({"x": by_detector}, max_false=1.0) == [
        "--max-false cannot be checked: x was compared in no pair-frame"
    ]
    (sentence,) = broken_limits({"x": audit_with(missed=0, of=4, by_reference=3)}, max_false=1.0)
    assert "the reference left 3" in sentence


def test_detector_that_reports_no_contact_reports_no_false_one():
    """Detector x missed all 4 pair-frames in contact; no false contact is allowed."""
    assert broken_limits({"x": audit_with(missed=4, of=4)}, max_false=0.0) == []


@pytest.mark.parametrize(
    ("count", "whole", "text"),
    [
        (0, 0, "none"),
        (3, 1000, "0.3 % [0.1, 0.88]"),
        (18, 18, "100 % [82, 100]"),
        (0, 18, "0 % [0, 18]"),
        (7, 270, "2.6 % [1.3, 5.3]"),
        (9999, 10000, "99.99 % [99.943, 99.9982]"),
        (10, 10_000_000, "0.0001 % [0.000054, 0.00018]"),
    ],
)
def test_a_percentage_keeps_its_distance_from_all_and_nothing(count, whole, text):
    """Wilson's interval at 95 % is in brackets; near 0 and 100 % it keeps as many digits as tell it from them."""
    assert percent(proportion(count, whole)) == text


@pytest.mark.parametrize(
    ("depth", "text"),
    [
        pytest.param(MissedDepth(), None, id="nothing missed"),
        pytest.param(MissedDepth(deepest=0.002), None, id="2 mm"),
        pytest.param(MissedDepth(deepest=0.0021), "deep, more than", id="2.1 mm"),
        pytest.param(MissedDepth(at_least=1), "not every frame", id="searched in part"),
        pytest.param(MissedDepth(deepest=0.002, at_least=1), "not every frame", id="2 mm where it was searched"),
        pytest.param(MissedDepth(deepest=0.0021, at_least=1), "deep, more than", id="2.1 mm where it was searched"),
        pytest.param(
            MissedDepth(deepest=0.001, unknown={"a is open": 2}), "a is open (2 misses)", id="depth not known"
        ),
    ],
)
def test_too_deep_or_unknown_misses_break_the_gate(depth, text):
    """Missed contacts may be 2 mm deep; ``at_least``: misses of which not every frame was searched for its depth.

    One that is too deep as far as it was searched needs no search of its other frames. None: the gate holds.
    """
    sentences = broken_limits({"x": audit_of(missed_depth=depth)}, max_missed_depth=0.002)
    assert len(sentences) == (0 if text is None else 1)
    assert all(text in sentence for sentence in sentences)


@pytest.mark.parametrize(
    ("undecided", "in_open_meshes", "is_broken"),
    [(3, 3, False), (3, 1, True), (0, 0, False)],
    ids=["all in open meshes", "two elsewhere", "none"],
)
def test_reference_may_leave_open_what_is_inside_an_open_mesh(undecided, in_open_meshes, is_broken):
    """Pair-frames that the reference left undecided: nobody can decide whether a body is inside an open mesh.

    Others must be decided for a gate; nothing was missed in the 9 that were.
    """
    audit = audit_of(
        contacts=4,
        reference_undecided=undecided,
        reference_inside_undecided=in_open_meshes,
        time_missed=proportion(0, 9),
    )
    assert bool(broken_limits({"x": audit}, max_missed=1.0)) == is_broken
