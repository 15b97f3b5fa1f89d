"""The ranking of a run's detectors, from hand-made figures."""

from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import COUNTS, audit_of, detector_of, document_with, times_of, zeros

from replay.auditing.sampling_offsets import OFFSET_COUNT
from replay.auditing.wilson import proportion
from replay.document.audit import CountRange, GraspedCounts, OffsetProportions, OffsetRanges, PairFrames
from replay.document.detector import SampleTimes
from replay.document.detector_labels import detector_label
from replay.document.ranking import all_unconfirmed, fault_text, ranking
from replay.document.tables import IN_RED, Marked, text_of
from replay.show.run_tables import ranking_table


def audit_of_18_contacts(missed, late, false, reported=1000, *, undecided=0, **more):
    """The audit of a detector that missed so many of 18 contacts, with so many late and false frames."""
    return audit_of(
        contacts=18, contacts_missed=missed, late_or_cut_short=late, contacts_undecided=undecided,
        time_missed=proportion(10 * missed + late, 100), false_contact=proportion(false, reported), **more,
    )  # fmt: skip


def document_of_audits(**audit):
    """The document of a run with these audits by label, and ``exact``."""
    detectors = {label: detector_of(f"{label}[x=1]", seconds=times_of(p99=0.0011)) for label in audit}
    return document_with(oracle="exact", detectors={**detectors, "exact": detector_of("exact")}, audit=audit)


AUDITS_OF_BENCH = {
    "paper": audit_of_18_contacts(missed=0, late=1, false=0),
    "hull50": audit_of_18_contacts(missed=0, late=1, false=967, while_grasped=zeros(GraspedCounts, false_contact=5324)),
    "mesh50": audit_of_18_contacts(missed=1, late=6, false=40),
}


def test_the_largest_loss_comes_first_and_the_oracle_last():
    """Loss adds missed contacts, missed time and false time: 1/18 + 16 % + 4 % is 0.256."""
    ranks = ranking(document_of_audits(**AUDITS_OF_BENCH))
    assert [item.label for item in ranks] == ["hull50", "mesh50", "paper", "exact"]
    assert [round(item.loss, 3) for item in ranks] == [0.977, 0.256, 0.01, 0.0]
    assert {item.contacts for item in ranks} == {18} and ranks[0].grasped == (5324, 0)
    assert ranking(document_of_audits()) == ()


@pytest.mark.parametrize(("missed", "late_or_cut_short"), [(1, 0), (0, 1), (1, 1), (0, 0)])
def test_a_missed_or_late_contact_counts_as_lost(missed, late_or_cut_short):
    """So many of 18 contacts are missed, and late or cut short."""
    first, _ = ranking(document_of_audits(mesh50=audit_of_18_contacts(missed, late_or_cut_short, false=0)))
    assert first.lost == (missed + late_or_cut_short > 0)


@pytest.mark.parametrize(
    ("figures", "text"),
    [
        (AUDITS_OF_BENCH["hull50"], "96.7 % of its contact time is false; 1 of 18 contacts late or cut short"),
        (AUDITS_OF_BENCH["mesh50"], "1 of 18 contacts missed, 6 late or cut short; 4 % of its contact time is false"),
        (AUDITS_OF_BENCH["paper"], "1 of 18 contacts late or cut short"),
        (audit_of_18_contacts(missed=0, late=0, false=0), "no contact of 18 missed, none false"),
        (audit_of_18_contacts(missed=0, late=0, false=0, undecided=2), "2 of 18 contacts undecided"),
        (
            audit_of_18_contacts(
                missed=0, late=0, false=1, reported=4, unconfirmed=2, pair_frames=zeros(PairFrames, false_contact=2)
            ),
            "25 % of its contact time is unconfirmed: only bounding volumes overlap",
        ),
        (
            audit_of_18_contacts(
                missed=0, late=0, false=1, reported=4, unconfirmed=1, pair_frames=zeros(PairFrames, false_contact=2)
            ),
            "25 % of its contact time is false",
        ),
        (
            audit_of_18_contacts(missed=0, late=0, false=1, reported=4, undecided=2),
            "2 of 18 contacts undecided; 25 % of its contact time is false",
        ),
    ],
)
def test_fault_sentence_begins_with_the_larger_fault(figures, text):
    """``figures``: the audit of a detector; ``largest`` keeps the first clause alone."""
    rank = ranking(document_of_audits(it=figures))[0]
    assert fault_text(rank) == text and fault_text(rank, largest=True) == text.partition("; ")[0]


def test_a_rate_is_ranked_by_its_mean_over_offsets():
    """The run itself missed 9 of 18 contacts; over 16 sampling offsets 1 is missed in the mean, and at most 2."""
    mean = OffsetProportions(
        contacts_missed=proportion(16, 16 * 18),
        late_or_cut_short=proportion(0, 16 * 18),
        time_missed=proportion(1, 50),
        false_contact=proportion(1, 10),
    )
    counts = OffsetRanges(contacts_missed=CountRange(smallest=0, largest=2, mean=1.0), late_or_cut_short=COUNTS)
    (rank, _reference) = ranking(
        document_of_audits(
            slow=audit_of_18_contacts(missed=9, late=0, false=0, means_over_offsets=mean, counts_over_offsets=counts)
        )
    )
    assert (rank.phases, rank.missed_counts, rank.late_counts) == (OFFSET_COUNT, (0, 2), (0, 0))
    assert rank.missed.value == pytest.approx(1 / 18)
    assert fault_text(rank) == "10 % of its contact time is false; up to 2 of 18 contacts missed"


def test_undecided_or_undetected_contacts_are_ranked():
    """``lazy`` left all 18 contacts undecided, ``blind`` reports none; where there is no contact nothing is lost."""
    lazy, blind = (
        audit_of_18_contacts(missed=0, late=0, false=0, undecided=18),
        audit_of_18_contacts(missed=0, late=0, false=0, reported=0),
    )
    assert [rank.label for rank in ranking(document_of_audits(blind=blind, lazy=lazy))] == ["lazy", "blind", "exact"]
    nothing = structs.replace(audit_of_18_contacts(missed=0, late=0, false=0, reported=0), contacts=0)
    (rank, _) = ranking(document_of_audits(it=nothing))
    assert rank.loss == 0.0 and fault_text(rank) == "no contact to miss, and none false"


def table_of_ranking(document):
    """The table that a terminal prints of a document's detectors."""
    return ranking_table(SimpleNamespace(document=document, ranking=ranking(document), answers=()))


def test_ranking_prints_zeros_and_dashes_for_the_reference():
    """Compared with itself the reference is never late: dashes; a detector that missed nothing: 0."""
    table = table_of_ranking(document_of_audits(**AUDITS_OF_BENCH))
    cells = table.cells()
    assert [row[0] for row in cells] == ["hull50", "mesh50", "paper", "exact"]
    assert [column.name for column in table.columns] == [
        "detector", "what", "missed", "late or cut short", "false contact", "mean ms", "p99 ms", "loss",
        "of a 90 Hz frame", "settings",
    ]  # fmt: skip
    hull50, mesh50, _paper, exact = cells
    _detector, _what, *figures = (text_of(cell) for cell in hull50)
    assert figures == ["0", "1", "96.7 %", "0.4", "1.1", "0.98", "3.6 %", "hull50[x=1]"]
    missed, late, false = 2, 3, 4  # columns
    assert mesh50[missed] == Marked("1", IN_RED)
    assert (exact[missed], exact[late], exact[false]) == ("reference", "-", "-")
    assert "undecided" in {
        column.name
        for column in table_of_ranking(
            document_of_audits(it=audit_of_18_contacts(missed=0, late=0, false=0, undecided=1))
        ).columns
    }


def test_the_time_of_a_recorded_engine_is_not_measured():
    """The reports of an engine stood in the recording: mean and slowest time are dashes."""
    document = document_of_audits(recorded=audit_of_18_contacts(missed=1, late=0, false=0))
    engine = structs.replace(document.detectors["recorded"], name="recorded")
    document = structs.replace(document, detectors=document.detectors | {"recorded": engine})
    assert table_of_ranking(document).only("mean ms", "p99 ms").cells()[0] == ("-", "-")


@pytest.mark.parametrize(
    ("name", "text"),
    [("discrete", "triangle meshes at 50 Hz"), ("recorded", "what the engine reported"), ("my:Own", "my:Own at 50 Hz")],
)
def test_a_label_has_the_rate_but_not_the_engine_rate(name, text):
    """``my:Own``: a class of the user; what an engine reported came at its own steps."""
    assert detector_label(name, {"rate_hz": 50}) == text


@pytest.mark.parametrize(("at_once", "noted"), [((), 0), (("exact",), 1), (("hull50", "mesh50", "paper", "exact"), 0)])
def test_times_measured_offline_are_marked_among_live_times(at_once, noted):
    """``at_once``: detectors that got all frames at once; nothing is noted where all did."""
    document = document_of_audits(**AUDITS_OF_BENCH)
    detectors = {
        label: structs.replace(detector, live=label not in at_once) for label, detector in document.detectors.items()
    }
    notes = [
        note
        for note in table_of_ranking(structs.replace(document, detectors=detectors)).notes
        if "all frames at once" in note
    ]
    assert len(notes) == noted and all(note.startswith("exact was run") for note in notes)


@pytest.mark.parametrize(("mean", "noted"), [(0.9, False), (1.1, True)])
def test_a_mean_above_p99_is_explained(mean, noted):
    """99 % of the samples take at most 1 ms, so that a mean of 1.1 ms comes from a few."""
    document = document_of_audits(**AUDITS_OF_BENCH)
    exact = document.detectors["exact"]
    samples = SampleTimes(median=0.9, p95=0.9, p99=1.0, max=200.0, samples=100, over_budget=1.0, stages={})
    seconds = structs.replace(exact.seconds, per_frame_mean=mean, sample_times=samples)
    detectors = document.detectors | {"exact": structs.replace(exact, seconds=seconds)}
    notes = table_of_ranking(structs.replace(document, detectors=detectors)).notes
    assert ("The mean of exact is above p99: at most 1 in 100 samples took very long." in notes) is noted


@pytest.mark.parametrize(("unconfirmed", "false", "all_are"), [(0, 0, False), (2, 2, True), (2, 3, False)])
def test_false_contact_is_unconfirmed_if_all_of_it_is(unconfirmed, false, all_are):
    """``unconfirmed``, ``false``: pair-frames in which only bounding volumes overlap, and all that are false."""
    pair_frames = zeros(PairFrames, false_contact=false)
    assert all_unconfirmed(audit_of(unconfirmed=unconfirmed, pair_frames=pair_frames)) == all_are
