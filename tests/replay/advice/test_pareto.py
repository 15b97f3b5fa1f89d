import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.report_states import front, price_row

from replay.advice.pareto import advice_of, contenders_of, front_of, sorted_rows

rows = st.lists(
    st.builds(
        price_row, st.just(""), st.integers(1, 8), st.integers(0, 6), complete=st.booleans(),
        spread=st.none() | st.sampled_from([0.01, 0.1, 0.3]), contact_frames_undecided=st.sampled_from([0, 0, 0, 1]),
    ),
    max_size=12,
).map(lambda drawn: [{**row, "label": f"r{k}"} for k, row in enumerate(drawn)])  # fmt: skip


@given(rows)
def test_front_equals_that_of_a_second_algorithm(drawn):
    """Up to a dozen settings of any mean time, loss and width of its interval, some complete, some undecided.

    The second algorithm, ``support.report_states.front``, walks from the most accurate setting to the next that is
    quicker beyond doubt.
    """
    assert front_of(drawn) == front(drawn)


@given(rows)
def test_decided_settings_are_sorted_by_loss_then_time(drawn):
    """The table of a tradeoff: up to a dozen settings, some of which left contacts undecided."""
    decided = [row for row in sorted_rows(drawn) if not row["contact_frames_undecided"]]
    loss_and_time = [(row["loss"], row["mean_ms"]) for row in decided]
    assert loss_and_time == sorted(loss_and_time)


def test_setting_with_more_errors_contends_only_if_quicker():
    """A setting contends for the front unless another is as accurate and as quick: ``ms`` a frame, contacts missed.

    "undecided" is the quickest, but left a contact undecided.
    """
    settings = [
        price_row("right", ms=1.0, missed=0),
        price_row("as slow", ms=1.0, missed=1),
        price_row("quicker", ms=0.99, missed=1),
        price_row("undecided", ms=0.1, missed=9, contact_frames_undecided=1),
    ]
    assert contenders_of(settings) == ["right", "quicker"]


def test_setting_of_a_single_pass_never_ties():
    """Two settings that miss nothing: "once" was timed in a single pass (``spread=None``), so has no interval.

    It is complete, which would win a tie; but by the mean "exact" is quicker, 0.04 against 2.5 ms.
    """
    once, exact = price_row("once", ms=2.5, missed=0, spread=None, complete=True), price_row("exact", ms=0.04, missed=0)
    assert front_of([once, exact]) == ["exact"]


def test_setting_of_a_single_pass_is_never_advised():
    """The setting "once" misses nothing, in the shortest time, but was timed in a single pass; others in seven."""
    rows = [
        price_row("exact", ms=0.04, missed=0),
        price_row("a", ms=0.03, missed=1),
        price_row("b", ms=0.02, missed=2),
        price_row("once", ms=0.01, missed=0, spread=None),
    ]
    advice = " ".join(advice_of(rows))
    assert "exact" in advice
    assert "once" not in advice


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        pytest.param([price_row("a", ms=1.0, missed=0), price_row("b", ms=2.0, missed=1)], "advice needs 3", id="two"),
        pytest.param([], "0 settings were", id="none"),
        pytest.param(
            [price_row(name, ms=1.0, missed=0, spread=None) for name in "abcd"],
            "0 settings were",
            id="four, timed once",
        ),
    ],
)
def test_no_advice_from_fewer_than_three_settings(settings, reason):
    """Settings that were timed in a single pass (``spread=None``) have no interval, and count as none."""
    (sentence,) = advice_of(settings, processor_fraction=1.0)
    assert sentence.startswith("No advice")
    assert reason in sentence


EXACT = price_row("exact", ms=0.041, missed=0, p99=0.1)
MESHES_50 = price_row("meshes at 50 Hz", ms=0.026, missed=(0, 1), late=7, false=(9, 10), rate_hz=50, p99=0.2)
MESHES_2 = price_row("meshes at 2 Hz", ms=0.002, missed=12, rate_hz=2)
"""Settings with milliseconds a frame, and contacts missed, late and false, of 18."""


def test_advice_states_cost_of_exactness_and_saving_of_engine_step():
    """``EXACT`` misses nothing at 0.041 ms a frame, 0.37 % of the 11.1 ms of a headset's frame; p99 0.1 ms.

    At the engine's 50 Hz (``MESHES_50``) a frame takes 0.026 ms, p99 0.2 ms: 0 or 1 of 18 contacts missed, 7 late, 9 or
    10 false. ``price_row`` takes false contact time for false contacts by 50: 9.5 / 50 = 19 %.
    """
    assert advice_of([EXACT, MESHES_50, MESHES_2]) == [
        "Missing nothing costs 0.041 ms a frame (exact), 0.37 % of a 90 Hz frame.",
        "At 0.026 ms (meshes at 50 Hz): 0-1 of 18 contacts missed, 7 late or cut short, "
        "19 % of its contact time false; slow samples (p99) get no cheaper.",
    ]


def test_advice_doubts_a_saving_whose_intervals_overlap():
    """The mean of meshes at 50 Hz is 0.026 ms, but its interval reaches 0.05 ms, beyond the 0.041 ms of ``EXACT``.

    They miss 0 or 1 of 18 contacts.
    """
    _cost, saving = advice_of([EXACT, {**MESHES_50, "mean_high": 0.05}, MESHES_2])
    assert saving.startswith("With meshes at 50 Hz a frame takes 0.026 ms, not surely less: 0-1 of 18")


@pytest.mark.parametrize(
    ("p99_ms", "clause"),
    [
        pytest.param(None, "get no cheaper.", id="not measured"),
        pytest.param(0.08, "take 0.08 ms in place of 0.1 ms.", id="less than that of exact"),
    ],
)
def test_advice_ends_in_what_slow_samples_take(p99_ms, clause):
    """99 of 100 samples of ``EXACT`` take at most 0.1 ms; ``p99_ms``: that of meshes at 50 Hz."""
    _cost, saving = advice_of([EXACT, MESHES_50 | {"p99_ms": p99_ms}, MESHES_2])
    assert saving.endswith(f"; slow samples (p99) {clause}")


def test_advice_without_an_exact_setting_names_the_smallest_loss():
    """Three settings that miss 1, 2 and 3 of 18 contacts; the best is the quickest: 0.2 ms, 1.8 % of 11.1 ms.

    1 of 18 is a loss of 0.056.
    """
    wrong = [price_row("paper", ms=0.2, missed=1), price_row("a", ms=0.3, missed=2), price_row("b", ms=0.4, missed=3)]
    cost, saving = advice_of(wrong)
    assert cost.startswith("The smallest loss, 0.056, costs 0.2 ms a frame (paper), 1.8 % of a 90 Hz frame. It gets")
    assert "No other setting is faster beyond doubt" in saving


@pytest.mark.parametrize(
    ("processor_fraction", "busy"), [pytest.param(0.5, "50 %", id="half"), pytest.param(0.93, "7 %", id="a little")]
)
def test_busy_machine_gives_advice_on_accuracy_without_cost(processor_fraction, busy):
    """Other programs had the rest of the processor. Five settings miss nothing, of which three are named.

    A second sentence says why there are no times.
    """
    right = [price_row(name, ms=1.0, missed=0) for name in "abcde"]
    accuracy, cost = advice_of(right, processor_fraction=processor_fraction)
    assert accuracy == "Every contact is right with a, b, c and 2 more."
    assert cost == f"The machine was busy ({busy}): run again for reliable times. No advice about cost until then."


def test_busy_machine_names_the_smallest_loss_without_milliseconds():
    """Other programs had half of the processor; three settings miss 2, 1 and 3 of 18 contacts: 1 is a loss of 0.056."""
    wrong = [price_row("a", ms=1.0, missed=2), price_row("b", ms=1.0, missed=1), price_row("c", ms=1.0, missed=3)]
    accuracy, *_ = advice_of(wrong, processor_fraction=0.5)
    assert accuracy.startswith("The smallest loss, 0.056, has b: 1 of 18 contacts missed")
    assert "ms" not in accuracy


def test_advice_on_a_busy_machine_omits_times_of_the_front():
    """The front, the quickest first, is b, a and exact (0, 1 and 3 contacts missed); "slow" is worse than exact.

    Other programs had half of the processor: each setting of the front has a sentence, without milliseconds.
    """
    rows = [
        price_row("exact", ms=4.0, missed=0),
        price_row("a", ms=2.0, missed=1),
        price_row("b", ms=1.0, missed=3),
        price_row("slow", ms=5.0, missed=2),
    ]
    assert front_of(rows) == ["b", "a", "exact"]
    accuracy, with_a, with_b, busy = advice_of(rows, processor_fraction=0.5)
    assert accuracy == "Every contact is right with exact."
    assert with_a.startswith("With a:")
    assert with_b.startswith("With b:")
    assert " ms" not in with_a + with_b
    assert busy.startswith("The machine was busy (50 %)")
