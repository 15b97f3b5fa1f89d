"""The ranking of a run's detectors, from hand-made figures."""

import pytest

from replay.base.wilson import share
from replay.comparison.contact_duration import PHASES
from replay.outputs.run_tables import ranking_table
from replay.outputs.tables import IN_RED, INVENTED, Marked
from replay.pipeline.ranking import fault_words, ranking


def made(asked, contacts=18, p99=None):
    per_frame = {} if p99 is None else {"per_frame": {"median": p99, "p99": p99, "max": p99}}
    return {"name": asked, "asked": asked, "contacts": contacts, "seconds": {"per_frame_mean": 4e-4, **per_frame}}


def audited(missed, in_part, false, reported=1000, *, undecided=0, **more):
    return {
        "contacts": 18, "contacts_missed": missed, "contacts_in_part": in_part, "contacts_undecided": undecided,
        "invented": share(false, reported), **more,
    }  # fmt: skip


def run(**audit):
    rows = {label: made(f"{label}[x=1]", p99=0.0011) for label in audit}
    return {"oracle": "exact", "detectors": {**rows, "exact": made("exact", 20)}, "audit": audit}


BENCH = {
    "paper": audited(0, 1, 0),
    "hull50": audited(0, 1, 967, held={"invented": 5324, "contacts_missed": 0}),
    "mesh50": audited(1, 6, 40),
}


def test_the_worst_comes_first_by_its_larger_fault_and_the_oracle_last():
    ranks = ranking(run(**BENCH))
    assert [one.label for one in ranks] == ["hull50", "mesh50", "paper", "exact"]
    assert [round(one.fault, 3) for one in ranks] == [0.967, 0.056, 0.0, 0.0]
    assert {one.contacts for one in ranks} == {18} and ranks[0].held == (5324, 0)
    assert ranking({**run(), "oracle": ""}) == ()


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        (BENCH["hull50"], "96.7 % of the contact time it reports is false; misses 0 of 18 contacts, 1 in part"),
        (BENCH["mesh50"], "misses 1 of 18 contacts, 6 in part; 4 % of the contact time it reports is false"),
        (BENCH["paper"], "misses 0 of 18 contacts, 1 in part"),
        (audited(0, 0, 0), "misses none of 18 contacts and says nothing false"),
        (audited(0, 0, 0, undecided=2), "leaves 2 of 18 contacts undecided"),
        (
            audited(0, 0, 1, 4, undecided=2),
            "leaves 2 of 18 contacts undecided; 25 % of the contact time it reports is false",
        ),
    ],
)
def test_the_larger_fault_leads(figures, words):
    assert fault_words(ranking(run(it=figures))[0]) == words


def test_an_audited_rate_is_ranked_by_its_mean_over_look_phases():
    mean = {"contacts_missed": share(16, 16 * 18), "contacts_in_part": share(0, 16 * 18), "invented": share(1, 10)}
    (one, _) = ranking(run(slow=audited(9, 0, 0, phases=mean)))
    assert (one.phases, one.count(one.missed), one.count(one.in_part)) == (PHASES, "1.00", 0)
    assert fault_words(one) == (
        "10 % of the contact time it reports is false; misses 1.00 of 18 contacts, 0 in part (mean over 16 look phases)"
    )


def test_what_is_undecided_or_found_by_nobody_is_ranked_too():
    lazy, blind = audited(0, 0, 0, undecided=18), audited(0, 0, 0, 0)
    assert [one.label for one in ranking(run(blind=blind, lazy=lazy))] == ["lazy", "blind", "exact"]
    nothing = {**audited(0, 0, 0, 0), "contacts": 0}
    (one, _) = ranking(run(it=nothing))
    assert one.fault == 0.0 and fault_words(one) == "has no contact to miss and says nothing false"


def test_the_table_has_a_row_each_and_leaves_out_columns_of_nothing():
    table = ranking_table(run(**BENCH))
    assert [row[0] for row in table.rows] == ["hull50", "mesh50", "paper", "exact"]
    assert [column.name for column in table.columns] == [
        "detector", "missed", "in part", "false", "mean ms", "p99 ms", "of a 90 Hz frame", "held: false frames",
        "asked",
    ]  # fmt: skip
    false = Marked("96.7 % [95.4, 97.6]", INVENTED)
    assert table.rows[0] == ("hull50", "0 [0, 3.2]", 1, false, "0.4", "1.100", "9.9 %", 5324, "hull50[x=1]")
    assert table.rows[1][1] == Marked("1 [0.18, 4.6]", IN_RED) and table.rows[3][:4] == ("exact", "", "", "")
    assert "undecided" in {column.name for column in ranking_table(run(it=audited(0, 0, 0, undecided=1))).columns}
