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


def test_gate_breaks_above_its_limit_and_not_at_the_limit():
    """``figures(1, 4)`` is an audit that missed 1 of 4 pair-frames in contact, a fraction of 0.25."""
    assert Gates(max_missed=0.25).broken_limits({"x": figures(missed=1, of=4)}, []) == []
    assert Gates().broken_limits({"x": figures(missed=9, of=9, contacts=4)}, []) == []
    assert len(Gates(max_missed=1.0, max_false=0.0).broken_limits({}, [])) == 2, "an audit of nothing cannot pass"
    (item,) = Gates(max_missed=0.24).broken_limits({"x": figures(missed=1, of=4)}, [])
    assert "x missed 1 of 4 pair-frames in contact (25 %" in item
    (two,) = Gates(max_missed=0.25).broken_limits({"x": figures(missed=1, of=400, contacts=2)}, [])
    assert "x missed 2 of 4 contacts" in two


def test_a_gate_judges_the_mean_over_sampling_offsets():
    # A frame each 10 ms, a sample each 40 ms: the contact of one frame is seen from a quarter of the offsets, that of
    # three frames from three quarters. The run shows the moments of an offset that misses one, as the mean does.
    audit = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=25]").document.audit
    assert audit["slow"].contacts_missed == 1
    assert audit["slow"].counts_over_offsets.contacts_missed == CountRange(smallest=0, largest=2, mean=1.0)
    assert Gates(max_missed=0.6).broken_limits(audit, []) == []
    contacts, frames = Gates(max_missed=0.4).broken_limits(audit, [])
    assert "1.00 of 2, 0-2" in contacts and "16 start times of sampling" in frames
    twice = pooled_audits([audit, audit])
    assert "2.00 of 4, 0-4" in Gates(max_missed=0.4).broken_limits(twice, [])[0]


def test_slowest_frames_agree_to_milliseconds():
    """The 99th percentile may be 11.1 ms: 11 ms hold, 12 ms break."""
    audit = {"x": figures(missed=0, of=4)}
    slow, fast = times_of_run(p99=0.012, mean=0.002), times_of_run(p99=0.011)
    assert Gates(max_p99_ms=11.1).broken_limits(audit, [fast]) == []
    (item,) = Gates(max_p99_ms=11.1).broken_limits(audit, [fast, slow])
    assert "12 ms" in item and "2 ms a frame in the mean" in item and "s.mcap" in item
    (item,) = Gates(max_p99_ms=11.1).broken_limits(audit, [times_of_run()])
    assert item == "--max-p99-ms cannot be checked: x was not timed frame by frame in s.mcap"
    fast[1]["y"] = times_of()
    (item,) = Gates(max_p99_ms=11.1).broken_limits({**audit, "y": figures(missed=0, of=4)}, [fast])
    assert "y was not timed" in item


def test_undecided_contact_breaks_the_gate_about_misses():
    (item,) = Gates(max_missed=1.0).broken_limits({"x": figures(missed=0, of=0, total=8, undecided=43_104)}, [])
    assert item == (
        "--max-missed cannot be checked: x left 43104 pair-frames in contact undecided, 1 of 8 contacts whole"
    )
    (item,) = Gates(max_missed=1.0).broken_limits({"x": figures(missed=0, of=4, oracle=3)}, [])
    assert item == "--max-missed cannot be checked: the reference left 3 pair-frames undecided"


def test_false_contact_beyond_the_limit_breaks_the_gate():
    audit = {"x": figures(missed=0, of=4, false=(3, 4))}
    assert Gates(max_false=0.75).broken_limits(audit, []) == []
    (item,) = Gates(max_false=0.7).broken_limits(audit, [])
    assert item.startswith("x reports false contact: 3 of the 4 pair-frames in contact that it reports (75 %")
    assert item.endswith("more than --max-false 0.7")


def test_false_contact_gate_fails_where_nothing_was_compared():
    (item,) = Gates(max_false=1.0).broken_limits({"x": figures(missed=0, of=0, decided=0, undecided=5)}, [])
    assert item == "--max-false cannot be checked: x was compared in no pair-frame"
    (item,) = Gates(max_false=1.0).broken_limits({"x": figures(missed=0, of=4, oracle=3)}, [])
    assert "the reference left 3" in item
    assert Gates(max_false=0.0).broken_limits({"x": figures(missed=4, of=4)}, []) == []


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
    sentences = Gates(max_missed_depth=0.002).broken_limits({"x": audit_of(missed_depth=depth)}, [])
    assert len(sentences) == len(broken) and all(map(str.__contains__, sentences, broken))


@pytest.mark.parametrize(("undecided", "inside", "is_broken"), [(3, 3, False), (3, 1, True), (0, 0, False)])
def test_reference_may_leave_open_what_is_inside_an_open_mesh(undecided, inside, is_broken):
    """Nobody can decide that; other pair-frames must be decided for a gate."""
    audit = audit_of(
        contacts=4, reference_undecided=undecided, reference_inside_undecided=inside, time_missed=proportion(0, 9)
    )
    assert bool(Gates(max_missed=1.0).broken_limits({"x": audit}, [])) == is_broken
