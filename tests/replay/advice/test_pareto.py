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
    """Up to a dozen rows of any time, loss and spread, some complete, some undecided; the table is sorted by loss."""
    assert front_of(drawn) == front(drawn)
    order = [(row["loss"], row["mean_ms"]) for row in sorted_rows(drawn) if not row["contact_frames_undecided"]]
    assert order == sorted(order)


def test_setting_with_more_errors_contends_only_if_quicker():
    """``price_row(name, mean ms, wrong contacts)``; a setting with undecided frames never contends."""
    undecided = price_row("undecided", ms=0.1, missed=9, contact_frames_undecided=1)
    result = [
        price_row("right", ms=1.0, missed=0),
        price_row("as slow", ms=1.0, missed=1),
        price_row("quicker", ms=0.99, missed=1),
        undecided,
    ]
    assert contenders_of(result) == ["right", "quicker"]


def test_single_pass_never_ties_and_is_never_advised():
    """``spread=None``: one pass, which has no interval. It is complete, and would win a tie."""
    slow, quick = price_row("once", ms=2.5, missed=0, spread=None, complete=True), price_row("exact", ms=0.04, missed=0)
    assert front_of([slow, quick]) == ["exact"]
    some = [quick, price_row("a", ms=0.05, missed=1), price_row("b", ms=0.06, missed=2)]
    assert not any("once" in sentence for sentence in advice_of([*some, slow]))


@pytest.mark.parametrize(
    ("tried", "fraction", "why"),
    [
        ([price_row("a", ms=1.0, missed=0), price_row("b", ms=2.0, missed=1)], 1.0, "advice needs 3"),
        ([], 1.0, "0 settings were"),
        ([price_row(name, ms=1.0, missed=0, spread=None) for name in "abcd"], 1.0, "0 settings were"),
    ],
)
def test_no_advice_from_fewer_than_three_settings(tried, fraction, why):
    """Two settings, none, and four that count as none: each had a single pass."""
    (sentence,) = advice_of(tried, processor_fraction=fraction)
    assert sentence.startswith("No advice") and why in sentence


def test_advice_states_cost_of_exactness_and_saving_of_engine_step():
    """Rows: milliseconds a frame, missed and late of 18 contacts, percent false; 11.1 ms is a frame at 90 Hz."""
    usual = price_row("meshes at 50 Hz", ms=0.026, missed=(0, 1), late=7, false=(9, 10), rate_hz=50, p99=0.2)
    exact = price_row("exact", ms=0.041, missed=0, p99=0.1)
    rare = price_row("meshes at 2 Hz", ms=0.002, missed=12, rate_hz=2)
    assert advice_of([exact, usual, rare]) == [
        "Missing nothing costs 0.041 ms a frame (exact), 0.37 % of a 90 Hz frame.",
        "At 0.026 ms (meshes at 50 Hz): 0-1 of 18 contacts missed, 7 late or cut short, "
        "19 % of its contact time false; slow samples (p99) get no cheaper.",
    ]
    _, saving = advice_of([exact, {**usual, "mean_high": 0.05}, rare])
    assert saving.startswith("With meshes at 50 Hz a frame takes 0.026 ms, not surely less: 0-1 of 18")
    for times, reported in (
        ({"p99_ms": None}, "get no cheaper."),
        ({"p99_ms": 0.08}, "take 0.08 ms in place of 0.1 ms."),
    ):
        _, saving = advice_of([exact, usual | times, rare])
        assert saving.endswith(f"; slow samples (p99) {reported}")
    wrong = [price_row("paper", ms=0.2, missed=1), price_row("a", ms=0.3, missed=2), price_row("b", ms=0.4, missed=3)]
    assert advice_of(wrong)[0].startswith(
        "The smallest loss, 0.056, costs 0.2 ms a frame (paper), 1.8 % of a 90 Hz frame. It gets"
    )
    assert "No other setting is faster beyond doubt" in advice_of(wrong)[1]


@pytest.mark.parametrize(("at_work", "busy"), [(0.5, "50 %"), (0.93, "7 %")])
def test_busy_machine_gives_advice_on_accuracy_without_cost(at_work, busy):
    """``at_work``: of the processor, this program's part. Settings are named by accuracy, and no milliseconds."""
    right = [price_row(name, ms=1.0, missed=0) for name in "abcde"]
    accuracy, cost = advice_of(right, processor_fraction=at_work)
    assert accuracy == "Every contact is right with a, b, c and 2 more."
    assert cost == f"The machine was busy ({busy}): run again for reliable times. No advice about cost until then."
    wrong = [price_row("a", ms=1.0, missed=2), price_row("b", ms=1.0, missed=1), price_row("c", ms=1.0, missed=3)]
    accuracy = advice_of(wrong, processor_fraction=at_work)[0]
    assert accuracy.startswith("The smallest loss, 0.056, has b: 1 of 18 contacts missed") and "ms" not in accuracy


def test_advice_on_a_busy_machine_omits_times_of_the_front():
    """Other work took half of the processor: the front is named, and no milliseconds."""
    rows = [
        price_row("exact", ms=4.0, missed=0),
        price_row("a", ms=2.0, missed=1),
        price_row("b", ms=1.0, missed=3),
        price_row("slow", ms=5.0, missed=2),
    ]
    first, *rest, busy = advice_of(rows, processor_fraction=0.5)
    assert front_of(rows) == ["b", "a", "exact"]
    assert first == "Every contact is right with exact." and busy.startswith("The machine was busy (50 %)")
    assert [text.split(":")[0] for text in rest] == ["With a", "With b"] and not any(" ms" in text for text in rest)
