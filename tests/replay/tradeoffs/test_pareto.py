from hypothesis import given
from hypothesis import strategies as st

from replay.tradeoffs.pareto import advice_of, counts, front_of


def row(label, ms, missed, *, online=False, oracle=False, precision=1.0, p99=None):
    return {
        "label": label, "ms_per_frame": ms, "missed": missed, "missed_low": missed / 2, "missed_high": missed * 2,
        "online": online, "oracle": oracle, "precision": precision, "p99_ms": p99,
        "precision_low": precision and precision - 0.05, "precision_high": precision and min(1.0, precision + 0.05),
    }  # fmt: skip


rows = st.lists(
    st.builds(
        row, st.just(""), st.integers(1, 8), st.integers(0, 6).map(lambda k: k / 10), online=st.booleans(),
        oracle=st.booleans(), precision=st.sampled_from([0.2, 0.8, 1.0, None]), p99=st.integers(1, 5),
    ),
    max_size=12,
).map(lambda found: [{**one, "label": str(k)} for k, one in enumerate(found)])  # fmt: skip


@given(rows)
def test_a_row_is_on_the_front_exactly_when_nothing_that_counts_beats_it(found):
    may = [one for one in found if not one["oracle"] and (one["precision"] or 0.0) > 0.5]
    front = front_of(found)
    for one in found:
        beaten = any(
            (a["ms_per_frame"], a["missed"]) != (one["ms_per_frame"], one["missed"])
            and a["ms_per_frame"] <= one["ms_per_frame"]
            and a["missed"] <= one["missed"]
            for a in may
        )
        alike = [a["label"] for a in may if (a["ms_per_frame"], a["missed"]) == (one["ms_per_frame"], one["missed"])]
        assert (one["label"] in front) == (one in may and not beaten and alike[0] == one["label"])


def test_advice_names_the_best_at_each_price_once():
    told = advice_of([row("coarse", 0.002, 0.2), row("fine", 0.02, 0.003), row("worse", 0.5, 0.1)])
    assert told == [
        "To audit a recording, at 0.003 ms per frame: coarse, misses 20 % [10, 40].",
        "To audit a recording, at 0.03 ms per frame: fine, misses 0.3 % [0.15, 0.6].",
    ]


def test_one_setting_that_is_quickest_misses_least_and_invents_least_dominates():
    told = advice_of([row("best", 0.01, 0.0), row("other", 0.02, 0.0), row("last", 0.03, 0.5, precision=0.9)])
    assert told == [
        "To audit a recording, best dominates 2 others: nothing is quicker, misses less or invents less: "
        "it misses 0 % [0, 0]."
    ]


def test_one_alone_dominates_nobody():
    for others in ([], [row("sphere", 0.001, 0.0, precision=0.1)]):
        (told,) = advice_of([row("best", 0.01, 0.1), *others])
        assert "dominates" not in told and "only best was tried" in told and "misses 10 %" in told


def test_one_that_catches_all_and_invents_does_not_dominate_and_is_named_with_what_it_invents():
    told = advice_of([row("hull", 0.01, 0.0, precision=0.6), row("mesh", 0.02, 0.0), row("late", 0.03, 0.1)])
    assert told == [
        "To audit a recording, nothing is quicker or misses less than hull, misses 0 % [0, 0], "
        "invents 40 % [35, 45]; to invent nothing, mesh, misses 0 % [0, 0]."
    ]


def test_beside_what_invents_stands_what_invents_less_for_the_same_price_and_no_dearer():
    held = row("held", 0.002, 0.3, precision=0.7)
    told = advice_of([held, row("some", 0.0025, 0.6, precision=0.8), row("none", 0.02, 0.1)])
    assert told == [
        "To audit a recording, at 0.003 ms per frame: held, misses 30 % [15, 60], invents 30 % [25, 35]; "
        "to invent less, some, misses 60 % [30, 120], invents 20 % [15, 25].",
        "To audit a recording, at 0.03 ms per frame: none, misses 10 % [5, 20].",
    ]


@given(rows)
def test_whatever_is_said_to_dominate_is_beaten_in_nothing_by_anyone_that_counts(found):
    for sentence in advice_of(found):
        name, dominates, _ = sentence.partition(" dominates")
        if dominates:
            price = "ms_per_frame" if "audit" in sentence else "p99_ms"
            asked = [one for one in found if counts(one) and (one["online"] or price == "ms_per_frame")]
            best = next(one for one in asked if one["label"] == name.rpartition(" ")[2])
            for one in asked:
                assert best[price] <= one[price] and best["missed"] <= one["missed"]
                assert best["precision"] >= one["precision"]


def test_a_live_loop_is_advised_by_its_p99_and_only_on_what_runs_frame_by_frame():
    live = (row("slow", 0.3, 0.0, online=True, p99=9.0), row("quick", 0.1, 0.4, online=True, p99=2.0))
    told = advice_of([row("offline", 0.001, 0.0), *live])
    assert told[1:] == [
        "To ship in a live loop, with p99 under 3 ms per frame: quick, misses 40 % [20, 80].",
        "To ship in a live loop, with p99 under 11.1 ms per frame: slow, misses 0 % [0, 0].",
    ]


def test_neither_the_oracle_nor_who_always_says_contact_is_advised():
    assert advice_of([row("exact", 0.1, 0.0, oracle=True), row("sphere", 0.01, 0.0, precision=0.01)]) == []


@given(st.integers(0, 40), st.integers(1, 10**7))
def test_no_advice_rounds_a_miss_to_none_nor_all_but_one_to_all(lost, of):
    lost = min(lost, of)
    for share in (lost / of, 1 - lost / of):
        (told,) = advice_of([row("it", 0.01, share)])
        said = float(told.partition("misses ")[2].partition(" %")[0])
        assert (said == 0, said == 100) == (share == 0, share == 1)
        (told,) = advice_of([row("it", 0.01, 0.0, precision=1 - 0.4 * share)])
        assert "invents 0 %" not in told and (", invents " in told) == (share > 0)


def test_one_contact_frame_of_many_is_a_miss_in_the_advice():
    (told,) = advice_of([row("it", 0.01, 1 / 4096)])
    assert told.endswith("it misses 0.024 % [0.012, 0.049].")
