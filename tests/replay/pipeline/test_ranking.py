"""The ranking of a run's detectors, from hand-made figures."""

from types import SimpleNamespace

import pytest

from replay.auditing.look_phases import PHASES
from replay.base.tables import IN_RED, Marked, text_of
from replay.base.wilson import share
from replay.outputs.run_tables import ranking_table
from replay.pipeline.ranking import fault_words, ranking
from replay.pipeline.sentences import detector_words


def made(asked, contacts=18, p99=None, live=True):
    per_frame = {} if p99 is None else {"per_frame": {"median": p99, "p99": p99, "max": p99}}
    return {
        "name": asked,
        "asked": asked,
        "live": live,
        "contacts": contacts,
        "seconds": {"per_frame_mean": 4e-4, **per_frame},
    }


def audited(missed, in_part, false, reported=1000, *, undecided=0, **more):
    return {
        "contacts": 18, "contacts_missed": missed, "contacts_in_part": in_part, "contacts_undecided": undecided,
        "missed": share(10 * missed + in_part, 100), "invented": share(false, reported), **more,
    }  # fmt: skip


def run(**audit):
    rows = {label: made(f"{label}[x=1]", p99=0.0011) for label in audit}
    return {"oracle": "exact", "detectors": {**rows, "exact": made("exact", 20)}, "audit": audit}


BENCH = {
    "paper": audited(0, 1, 0),
    "hull50": audited(0, 1, 967, held={"invented": 5324, "contacts_missed": 0}),
    "mesh50": audited(1, 6, 40),
}


def test_the_largest_loss_comes_first_and_the_oracle_last():
    ranks = ranking(run(**BENCH))
    assert [one.label for one in ranks] == ["hull50", "mesh50", "paper", "exact"]
    assert [round(one.loss, 3) for one in ranks] == [0.977, 0.256, 0.01, 0.0]
    assert {one.contacts for one in ranks} == {18} and ranks[0].held == (5324, 0)
    assert ranking({**run(), "oracle": ""}) == ()


@pytest.mark.parametrize(("missed", "in_part"), [(1, 0), (0, 1), (1, 1), (0, 0)])
def test_a_contact_is_lost_that_is_missed_or_found_in_part(missed, in_part):
    first, _ = ranking(run(mesh50=audited(missed, in_part, 0)))
    assert first.lost == (missed + in_part > 0)


@pytest.mark.parametrize(
    ("figures", "words"),
    [
        (BENCH["hull50"], "96.7 % of its contact time is false; 1 of 18 contacts late or cut short"),
        (BENCH["mesh50"], "1 of 18 contacts missed, 6 late or cut short; 4 % of its contact time is false"),
        (BENCH["paper"], "1 of 18 contacts late or cut short"),
        (audited(0, 0, 0), "no contact of 18 missed, none false"),
        (audited(0, 0, 0, undecided=2), "2 of 18 contacts undecided"),
        (
            audited(0, 0, 1, 4, unconfirmed=2, pair_frames={"INVENTED": 2}),
            "25 % of its contact time is unconfirmed: only bounding volumes overlap",
        ),
        (audited(0, 0, 1, 4, unconfirmed=1, pair_frames={"INVENTED": 2}), "25 % of its contact time is false"),
        (audited(0, 0, 1, 4, undecided=2), "2 of 18 contacts undecided; 25 % of its contact time is false"),
    ],
)
def test_the_larger_fault_leads(figures, words):
    rank = ranking(run(it=figures))[0]
    assert fault_words(rank) == words and fault_words(rank, largest=True) == words.partition("; ")[0]


def test_a_rate_is_ranked_by_its_mean_over_the_offsets_and_shown_from_smallest_to_largest():
    mean = {
        "contacts_missed": share(16, 16 * 18),
        "contacts_in_part": share(0, 16 * 18),
        "missed": share(1, 50),
        "invented": share(1, 10),
    }
    offsets = {
        "contacts_missed": {"smallest": 0, "largest": 2, "mean": 1.0},
        "contacts_in_part": {"smallest": 0, "largest": 0, "mean": 0.0},
    }
    (rank, _) = ranking(run(slow=audited(9, 0, 0, phases=mean, offsets=offsets)))
    assert (rank.phases, rank.missed_counts, rank.late_counts) == (PHASES, (0, 2), (0, 0))
    assert rank.missed["share"] == pytest.approx(1 / 18)
    assert fault_words(rank) == "10 % of its contact time is false; 0-2 of 18 contacts missed"


def test_what_is_undecided_or_found_by_nobody_is_ranked_too():
    lazy, blind = audited(0, 0, 0, undecided=18), audited(0, 0, 0, 0)
    assert [rank.label for rank in ranking(run(blind=blind, lazy=lazy))] == ["lazy", "blind", "exact"]
    nothing = {**audited(0, 0, 0, 0), "contacts": 0}
    (rank, _) = ranking(run(it=nothing))
    assert rank.loss == 0.0 and fault_words(rank) == "no contact to miss, and none false"


def tabled(summary):
    return ranking_table(SimpleNamespace(summary=summary, ranking=ranking(summary)))


def test_the_table_has_a_row_each_zero_is_zero_and_the_reference_has_dashes():
    table = tabled(run(**BENCH))
    cells = table.cells()
    assert [row[0] for row in cells] == ["hull50", "mesh50", "paper", "exact"]
    assert [column.name for column in table.columns] == [
        "detector", "what", "missed", "late or cut short", "false contact", "mean ms", "p99 ms", "loss",
        "of a 90 Hz frame", "settings",
    ]  # fmt: skip
    first = [text_of(cell) for cell in cells[0]]
    assert first[2:] == ["0", "1", "96.7 %", "0.4", "1.1", "0.98", "3.6 %", "hull50[x=1]"]
    assert cells[1][2] == Marked("1", IN_RED) and cells[3][2:5] == ("reference", "-", "-")
    assert "undecided" in {column.name for column in tabled(run(it=audited(0, 0, 0, undecided=1))).columns}


def test_the_time_of_an_engine_that_was_not_measured_is_not_that_of_looking_it_up():
    summary = run(recorded=audited(1, 0, 0))
    summary["detectors"]["recorded"]["name"] = "recorded"
    assert tabled(summary).only("mean ms", "p99 ms").cells()[0] == ("-", "-")


@pytest.mark.parametrize(
    ("name", "words"),
    [("discrete", "triangle meshes at 50 Hz"), ("recorded", "what the engine reported"), ("my:Own", "my:Own at 50 Hz")],
)
def test_a_detector_is_named_with_its_rate_and_the_engine_without_its_own(name, words):
    assert detector_words(name, {"rate_hz": 50}) == words


@pytest.mark.parametrize(("at_once", "noted"), [((), 0), (("exact",), 1), (("hull50", "mesh50", "paper", "exact"), 0)])
def test_times_taken_another_way_are_marked_among_live_ones(at_once, noted):
    summary = run(**BENCH)
    for label in at_once:
        summary["detectors"][label]["live"] = False
    notes = [note for note in tabled(summary).notes if "all frames at once" in note]
    assert len(notes) == noted and all(note.startswith("exact was asked") for note in notes)
