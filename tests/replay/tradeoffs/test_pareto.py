import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.price_rows import advised, front, price_row

from replay.tradeoffs.pareto import LIVE, WHOLE, advice_of, answer_of, best_of, front_of, tied

rows = st.lists(
    st.builds(
        price_row, st.just(""), st.integers(1, 8), st.integers(0, 6), live=st.none() | st.integers(1, 20),
        spread=st.none() | st.sampled_from([0.01, 0.1, 0.3]), precision=st.sampled_from([0.2, 0.8, 1.0, None]),
        complete=st.booleans(), simplicity=st.integers(0, 3),
    ),
    max_size=12,
).map(lambda found: [{**one, "label": f"r{k}"} for k, one in enumerate(found)])  # fmt: skip


@given(rows)
def test_front_and_advice_are_those_of_an_independent_way(found):
    assert front_of(found, WHOLE) == front(found, "offline") and front_of(found, LIVE) == front(found, "live")
    said = [one for one in advice_of(found) if one.startswith("In a live loop")]
    for rate, label in advised(found).items():
        here = [one for one in said if f"{rate}" in one.partition(" Hz")[0]]
        assert len(here) == any(row["p99_ms"] is not None for row in found)
        assert all((f"take {label}:" in one) == (label is not None) for one in here)


def test_overlapping_intervals_are_a_tie_that_goes_to_the_complete_one_and_then_to_the_simpler():
    quick = price_row("budgeted", 1.0, 0)
    sure = price_row("sure", 1.15, 0, complete=True, simplicity=5)
    plain = price_row("plain", 1.1, 0, complete=True, simplicity=1)
    assert front_of([quick, sure]) == ["sure"] and front_of([quick, sure, plain]) == ["plain"]
    slow = price_row("sure", 1.3, 0, complete=True)
    assert not tied(quick, slow, WHOLE) and front_of([quick, slow]) == ["budgeted"]


def test_what_was_timed_once_has_no_interval_and_wins_nothing():
    once = price_row("once", 0.1, 0, spread=None)
    assert front_of([once, price_row("sure", 5.0, 0, complete=True)]) == ["sure"]
    assert best_of([price_row("once", 1.0, 0, live=1.0, spread=None)], LIVE, 11.1) is None


def test_a_live_loop_is_advised_by_the_whole_interval_of_the_p99():
    found = [price_row("slow", 1.0, 0, live=9.0), price_row("quick", 1.0, 4, live=2.0)]
    assert advice_of(found)[:2] == [
        "In a live loop at 60, 72 and 90 Hz, take slow: it misses none of 18 contacts; it takes 9 ms in the mean; "
        "its p99 is 9 ms [8.1, 9.9], "
        "81 % of a 90 Hz frame.",
        "In a live loop at 120 Hz, take quick: it misses 4 of 18 contacts, whole or in part; it takes 2 ms in the "
        "mean; its p99 is 2 ms "
        "[1.8, 2.2], 18 % of a 90 Hz frame.",
    ]


def test_a_recording_has_the_best_first_and_then_what_takes_less_time():
    rate = price_row("rate", 0.1, 5.5, phases=36, precision=0.9)
    assert advice_of([price_row("mesh", 1.0, 0), rate, price_row("late", 2.0, 0)]) == [
        "To audit a recording, take mesh: it misses none of 18 contacts; it takes 5.4 s for a minute of it.",
        "For less time, take rate: it misses 5.5 of 18 contacts, whole or in part, and 10 % of what it reports is "
        "false; it takes 0.54 s for a minute of it.",
    ]


def test_ties_are_named_and_the_trusted_one_is_not_said_to_miss_nothing():
    found = [price_row("exact", 1.0, 0, oracle=True), price_row("a", 1.1, 0, simplicity=1)]
    (told,) = advice_of(found)
    assert "take exact: it is what the others are compared with;" in told and told.endswith("; a tie with a.")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "Missing nothing costs 0.1 ms a frame in the mean, p99 0.9 % of a 90 Hz frame"),
        ([price_row("rare", 1.0, 5, live=0.05, phases=36)], ": sampling less often saves 0.05 ms a frame at most"),
        # A slow sample gets no quicker where samples are rarer: only the mean does.
        (
            [price_row("rare", 1.0, 5, live=0.2, phases=36, mean_ms=0.06)],
            ": sampling less often saves 0.04 ms a frame at most",
        ),
        ([price_row("rare", 1.0, 5, live=0.15, phases=36)], "sampling less often saves is too small to compare here"),
    ],
)
def test_the_answer_has_two_numbers_and_says_nothing_only_where_nothing_is_seen(more, said):
    assert answer_of([price_row("a", 1.0, 0, live=0.1), *more]).endswith(said)
    assert answer_of([price_row("late", 1.0, 0, live=30.0)]).startswith("For 90 Hz nothing tried live is surely")
    assert answer_of([price_row("a", 1.0, 2, live=0.1)]).startswith("Missing 2 of 18 contacts, whole or in part, costs")


def test_neither_what_always_says_contact_nor_what_left_contact_undecided_is_advised():
    assert advice_of([price_row("sphere", 0.01, 0, precision=0.01)]) == []
    assert advice_of([price_row("a", 0.01, 0, contact_frames_undecided=1)]) == []
