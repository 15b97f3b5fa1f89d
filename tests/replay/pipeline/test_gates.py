import pytest

from replay.base.wilson import share
from replay.pipeline.gates import Gates, percent


def figures(missed, of, contacts=0, total=4):
    return {"missed": share(missed, of), "contacts_missed": contacts, "contacts": total}


def run(**seconds):
    return {"session": {"origin": "s.mcap"}, "detectors": {"x": {"seconds": seconds}}}


def test_nothing_asked_is_nothing_broken():
    assert Gates().broken({"x": figures(9, 9, 4)}, []) == []


def test_missed_frames_or_contacts_beyond_the_share_break_the_gate_and_the_share_itself_does_not():
    assert Gates(max_missed=0.25).broken({"x": figures(1, 4)}, []) == []
    (one,) = Gates(max_missed=0.24).broken({"x": figures(1, 4)}, [])
    assert "x missed 1 of 4 pair-frames in contact (25 %" in one
    (two,) = Gates(max_missed=0.25).broken({"x": figures(1, 400, contacts=2)}, [])
    assert "x missed 2 of 4 contacts" in two


def test_an_audit_of_nothing_cannot_pass():
    assert Gates(max_missed=1.0).broken({}, []) != []


def test_a_session_without_contact_passes_no_gate_about_misses():
    (one,) = Gates(max_missed=0.5).broken({"x": figures(0, 0, total=0)}, [])
    assert "no contact for x to miss" in one


def test_the_slowest_frames_are_held_to_milliseconds():
    audit = {"x": figures(0, 4)}
    slow, fast = run(per_frame={"p99": 0.012}), run(per_frame={"p99": 0.011})
    assert Gates(max_p99_ms=11.1).broken(audit, [fast]) == []
    (one,) = Gates(max_p99_ms=11.1).broken(audit, [fast, slow])
    assert "12 ms" in one and "s.mcap" in one
    (one,) = Gates(max_p99_ms=11.1).broken(audit, [run(detect=1.0)])
    assert "no audited detector decides frame by frame" in one


def test_a_share_is_written_with_its_interval():
    assert percent(share(3, 1000)) == "0.3 % [0.1, 0.88]" and percent(share(0, 0)) == "none"


@pytest.mark.parametrize(
    ("count", "of", "words"),
    [
        (18, 18, "100 % [82, 100]"), (0, 18, "0 % [0, 18]"), (7, 270, "2.6 % [1.3, 5.3]"),
        (9999, 10000, "99.99 % [99.943, 99.9982]"), (10, 10_000_000, "0.0001 % [0.000054, 0.00018]"),
    ],
)  # fmt: skip
def test_a_share_is_written_without_exponents_and_keeps_what_parts_it_from_all_and_nothing(count, of, words):
    assert percent(share(count, of)) == words
