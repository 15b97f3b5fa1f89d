import pytest
from support.report_states import audit_of, times_of, zeros
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.auditing.wilson import proportion
from replay.document.audit import CountRange, MissedDepth, PairFrames
from replay.document.gates import Gates, percent
from replay.document.scores import pooled_audits
from replay.engine import compute


def figures(missed, of, contacts=0, total=4, false=(0, 0), undecided=0, oracle=0, decided=10):
    """Figures of an audited detector: pair-frames missed of those in contact, contacts, and what was left undecided."""
    return audit_of(
        time_missed=proportion(missed, of), contacts_missed=contacts, contacts=total,
        false_contact=proportion(*false), contacts_undecided=int(undecided > 0), contact_frames_undecided=undecided,
        reference_undecided=oracle, pair_frames=zeros(PairFrames, both=decided, left_out=undecided + oracle),
    )  # fmt: skip


def times_of_run(**seconds):
    """The file of a session, and the times of its detector x."""
    return "s.mcap", {"x": times_of(**seconds)}


def broken_limits(audit, session_times=(), **limits):
    """Sentences on the limits that an audit, or the times of sessions, exceed; ``limits``: fields of Gates."""
    return Gates(**limits).broken_limits(audit, session_times)


def test_gate_breaks_above_its_limit_and_not_at_the_limit():
    """1 of 4 pair-frames missed are 0.25. Without a limit nothing breaks; an audit of no detector cannot pass.

    Of 400 pair-frames 1 is little, but 2 of 4 contacts missed are above 0.25 too.
    """
    assert broken_limits({"x": figures(missed=1, of=4)}, max_missed=0.25) == []
    assert broken_limits({"x": figures(missed=9, of=9, contacts=4)}) == []
    assert len(broken_limits({}, max_missed=1.0, max_false=0.0)) == 2, "an audit of nothing cannot pass"
    (item,) = broken_limits({"x": figures(missed=1, of=4)}, max_missed=0.24)
    assert "x missed 1 of 4 pair-frames in contact (25 %" in item
    (two,) = broken_limits({"x": figures(missed=1, of=400, contacts=2)}, max_missed=0.25)
    assert "x missed 2 of 4 contacts" in two


def test_a_gate_judges_the_mean_over_sampling_offsets():
    """A frame each 10 ms, a sample each 40 ms: over 16 offsets 1 of 2 contacts is missed in the mean, at most 2.

    The contact of one frame is seen from a quarter of the offsets, that of three frames from three quarters.
    Pooled twice, 2 of 4 are missed.
    """
    audit = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=25]").document.audit
    assert audit["slow"].contacts_missed == 1
    assert audit["slow"].counts_over_offsets.contacts_missed == CountRange(smallest=0, largest=2, mean=1.0)
    assert broken_limits(audit, max_missed=0.6) == []
    contacts, frames = broken_limits(audit, max_missed=0.4)
    assert "1.00 of 2, 0-2" in contacts and "16 start times of sampling" in frames
    twice = pooled_audits([audit, audit])
    assert "2.00 of 4, 0-4" in broken_limits(twice, max_missed=0.4)[0]


def test_slowest_frames_agree_to_milliseconds():
    """The 99th percentile may be 11.1 ms: 11 ms hold, 12 ms break."""
    audit = {"x": figures(missed=0, of=4)}
    slow, fast = times_of_run(p99=0.012, mean=0.002), times_of_run(p99=0.011)
    assert broken_limits(audit, [fast], max_p99_ms=11.1) == []
    (item,) = broken_limits(audit, [fast, slow], max_p99_ms=11.1)
    assert "12 ms" in item and "2 ms a frame in the mean" in item and "s.mcap" in item
    (item,) = broken_limits(audit, [times_of_run()], max_p99_ms=11.1)
    assert item == "--max-p99-ms cannot be checked: x was not timed frame by frame in s.mcap"
    fast[1]["y"] = times_of()
    (item,) = broken_limits({**audit, "y": figures(missed=0, of=4)}, [fast], max_p99_ms=11.1)
    assert "y was not timed" in item


def test_undecided_contact_breaks_the_gate_about_misses():
    """Every miss is allowed, but what the detector or the reference left undecided might be one."""
    (item,) = broken_limits({"x": figures(missed=0, of=0, total=8, undecided=43_104)}, max_missed=1.0)
    assert item == (
        "--max-missed cannot be checked: x left 43104 pair-frames in contact undecided, 1 of 8 contacts whole"
    )
    (item,) = broken_limits({"x": figures(missed=0, of=4, oracle=3)}, max_missed=1.0)
    assert item == "--max-missed cannot be checked: the reference left 3 pair-frames undecided"


def test_false_contact_beyond_the_limit_breaks_the_gate():
    """3 of 4 pair-frames that the detector reports are false: 0.75 holds, 0.7 breaks."""
    audit = {"x": figures(missed=0, of=4, false=(3, 4))}
    assert broken_limits(audit, max_false=0.75) == []
    (item,) = broken_limits(audit, max_false=0.7)
    assert item.startswith("x reports false contact: 3 of the 4 pair-frames in contact that it reports (75 %")
    assert item.endswith("more than --max-false 0.7")


def test_false_contact_gate_fails_where_nothing_was_compared():
    """Detector or reference left pair-frames undecided; a detector that reports no contact reports no false one."""
    (item,) = broken_limits({"x": figures(missed=0, of=0, decided=0, undecided=5)}, max_false=1.0)
    assert item == "--max-false cannot be checked: x was compared in no pair-frame"
    (item,) = broken_limits({"x": figures(missed=0, of=4, oracle=3)}, max_false=1.0)
    assert "the reference left 3" in item
    assert broken_limits({"x": figures(missed=4, of=4)}, max_false=0.0) == []


@pytest.mark.parametrize(
    ("count", "of", "text"),
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
def test_a_percentage_keeps_its_distance_from_all_and_nothing(count, of, text):
    """Wilson's interval at 95 % is in brackets; near 0 and 100 % it keeps as many digits as tell it from them."""
    assert percent(proportion(count, of)) == text


@pytest.mark.parametrize(
    ("depth", "broken"),
    [
        (MissedDepth(), []),
        (MissedDepth(deepest=0.002), []),
        (MissedDepth(deepest=0.0021), ["deep, more than"]),
        (MissedDepth(at_least=1), ["not every frame"]),
        (MissedDepth(deepest=0.002, at_least=1), ["not every frame"]),
        (MissedDepth(deepest=0.0021, at_least=1), ["deep, more than"]),
        (MissedDepth(deepest=0.001, unknown={"a is open": 2}), ["a is open (2 misses)"]),
    ],
)
def test_too_deep_or_unknown_misses_break_the_gate(depth, broken):
    """2 mm are allowed. A miss that is too deep as far as it was searched needs no search of its other frames."""
    sentences = broken_limits({"x": audit_of(missed_depth=depth)}, max_missed_depth=0.002)
    assert len(sentences) == len(broken) and all(map(str.__contains__, sentences, broken))


@pytest.mark.parametrize(("undecided", "inside", "is_broken"), [(3, 3, False), (3, 1, True), (0, 0, False)])
def test_reference_may_leave_open_what_is_inside_an_open_mesh(undecided, inside, is_broken):
    """Nobody can decide that; other pair-frames must be decided for a gate."""
    audit = audit_of(
        contacts=4, reference_undecided=undecided, reference_inside_undecided=inside, time_missed=proportion(0, 9)
    )
    assert bool(broken_limits({"x": audit}, max_missed=1.0)) == is_broken
