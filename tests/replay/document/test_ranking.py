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
    """The audit of a detector that missed so many of 18 contacts, and reported so many late, or cut them short.

    Of ``reported`` frames of contact ``false`` are false; of 100 frames of true contact it missed ten for each missed
    contact, and one for each late one.
    """
    return audit_of(
        contacts=18, contacts_missed=missed, late_or_cut_short=late, contacts_undecided=undecided,
        time_missed=proportion(10 * missed + late, 100), false_contact=proportion(false, reported), **more,
    )  # fmt: skip


def document_of_audits(**audit):
    """The document of a run with these audits by label, and ``exact``, the reference.

    Detectors take 0.4 ms a frame, and at most 1.1 ms in 99 % of the frames; exact was not timed frame by frame.
    """
    detectors = {label: detector_of(f"{label}[x=1]", seconds=times_of(p99=0.0011)) for label in audit}
    return document_with(oracle="exact", detectors={**detectors, "exact": detector_of("exact")}, audit=audit)


def rank_of(audit):
    """The row of a detector with this audit, beside the reference."""
    rank, _reference = ranking(document_of_audits(it=audit))
    return rank


AUDITS_OF_THREE = {
    "paper": audit_of_18_contacts(missed=0, late=1, false=0),
    "hull50": audit_of_18_contacts(missed=0, late=1, false=967, while_grasped=zeros(GraspedCounts, false_contact=5324)),
    "mesh50": audit_of_18_contacts(missed=1, late=6, false=40),
}
"""Audits of three detectors; the hulls also report 5,324 false frames while a hand holds a body."""


def test_the_largest_loss_comes_first_and_the_reference_last():
    """Loss adds fractions of missed contacts, of missed time and of false time.

    hull50: 0 + 1 % + 96.7 %; mesh50: 1/18 + (10 + 6) % + 4 %; paper: 1 %. The 5,324 false frames of hull50 while a hand
    holds a body stand apart, and count in no loss.
    """
    ranks = ranking(document_of_audits(**AUDITS_OF_THREE))
    assert [(rank.label, round(rank.loss, 3)) for rank in ranks] == [
        ("hull50", 0.977),
        ("mesh50", 0.256),
        ("paper", 0.01),
        ("exact", 0.0),
    ]
    assert {rank.contacts for rank in ranks} == {18}
    hull50, *_ = ranks
    assert hull50.grasped == (5324, 0), "frames of false contact, and missed contacts, while a hand holds a body"


def test_run_without_an_audit_has_no_ranking():
    """The run has exact, the reference, alone."""
    assert ranking(document_of_audits()) == ()


@pytest.mark.parametrize(
    ("missed", "late_or_cut_short", "is_lost"), [(1, 0, True), (0, 1, True), (1, 1, True), (0, 0, False)]
)
def test_a_missed_or_late_contact_counts_as_lost(missed, late_or_cut_short, is_lost):
    """A detector missed so many of 18 contacts, and reported so many late or cut them short."""
    assert rank_of(audit_of_18_contacts(missed, late_or_cut_short, false=0)).lost == is_lost


NOTHING_WRONG = audit_of_18_contacts(missed=0, late=0, false=0)


def audit_of_unconfirmed(unconfirmed):
    """The audit of a detector with 25 % false contact in two pair-frames; in so many only bounding volumes overlap."""
    return audit_of_18_contacts(
        0, 0, false=1, reported=4, unconfirmed=unconfirmed, pair_frames=zeros(PairFrames, false_contact=2)
    )


@pytest.mark.parametrize(
    ("audit", "text"),
    [
        pytest.param(
            AUDITS_OF_THREE["hull50"],
            "96.7 % of its contact time is false; 1 of 18 contacts late or cut short",
            id="mostly false",
        ),
        pytest.param(
            AUDITS_OF_THREE["mesh50"],
            "1 of 18 contacts missed, 6 late or cut short; 4 % of its contact time is false",
            id="mostly missed",
        ),
        pytest.param(AUDITS_OF_THREE["paper"], "1 of 18 contacts late or cut short", id="late alone"),
        pytest.param(NOTHING_WRONG, "no contact of 18 missed, none false", id="nothing wrong"),
        pytest.param(
            audit_of_18_contacts(missed=0, late=0, false=0, undecided=2),
            "2 of 18 contacts undecided",
            id="undecided alone",
        ),
        pytest.param(
            audit_of_unconfirmed(2),
            "25 % of its contact time is unconfirmed: only bounding volumes overlap",
            id="all of the false is unconfirmed",
        ),
        pytest.param(
            audit_of_unconfirmed(1), "25 % of its contact time is false", id="half of the false is unconfirmed"
        ),
        pytest.param(
            audit_of_18_contacts(missed=0, late=0, false=1, reported=4, undecided=2),
            "2 of 18 contacts undecided; 25 % of its contact time is false",
            id="undecided, and false",
        ),
    ],
)
def test_fault_sentence_begins_with_the_larger_fault(audit, text):
    """Audits over 18 contacts: undecided ones come first, then the larger of missed contacts (and time) and false time.

    hull50: 967 of 1,000 frames false, 1 late; mesh50: 1 missed, 6 late, 40 frames false; paper: 1 late. With
    ``largest`` the first clause, up to the semicolon, is all.
    """
    rank = rank_of(audit)
    assert fault_text(rank) == text
    assert fault_text(rank, largest=True) == text.partition("; ")[0]


def test_a_rate_is_ranked_by_its_mean_over_offsets():
    """The run itself missed 9 of 18 contacts; over 16 sampling offsets 1 is missed in the mean, and at most 2.

    In the mean 10 % of the contact time is false, more than 1 of 18 contacts and 1 of 50 frames missed.
    """
    of_all_offsets = 16 * 18  # contacts
    means = OffsetProportions(
        contacts_missed=proportion(16, of_all_offsets),
        late_or_cut_short=proportion(0, of_all_offsets),
        time_missed=proportion(1, 50),
        false_contact=proportion(1, 10),
    )
    counts = OffsetRanges(contacts_missed=CountRange(smallest=0, largest=2, mean=1.0), late_or_cut_short=COUNTS)
    rank = rank_of(
        audit_of_18_contacts(missed=9, late=0, false=0, means_over_offsets=means, counts_over_offsets=counts)
    )
    assert rank.phases == OFFSET_COUNT == 16
    assert (rank.missed_counts, rank.late_counts) == ((0, 2), (0, 0))
    assert rank.missed.value == pytest.approx(1 / 18)
    assert fault_text(rank) == "10 % of its contact time is false; up to 2 of 18 contacts missed"


def test_undecided_contacts_come_before_no_report_at_all():
    """``lazy`` left all 18 contacts undecided, ``blind`` reports none, though none is counted as missed."""
    lazy = audit_of_18_contacts(missed=0, late=0, false=0, undecided=18)
    blind = audit_of_18_contacts(missed=0, late=0, false=0, reported=0)
    assert [rank.label for rank in ranking(document_of_audits(blind=blind, lazy=lazy))] == ["lazy", "blind", "exact"]


def test_without_a_contact_nothing_is_lost():
    """The reference has no contact, and the detector reports none."""
    rank = rank_of(structs.replace(audit_of_18_contacts(missed=0, late=0, false=0, reported=0), contacts=0))
    assert rank.loss == 0.0
    assert fault_text(rank) == "no contact to miss, and none false"


def table_of_ranking(document):
    """The table that a terminal prints of a document's detectors."""
    return ranking_table(SimpleNamespace(document=document, ranking=ranking(document), answers=()))


def test_ranking_prints_zeros_and_dashes_for_the_reference():
    """hull50 missed none of 18 contacts and had one late, and 967 of its 1,000 frames are false; mesh50 missed one.

    The late contact is 1 of 100 frames: a loss of 0.01 + 0.967. 0.4 ms are 3.6 % of the 11.1 ms of a frame at 90 Hz.
    The reference is compared with nothing: dashes.
    """
    table = table_of_ranking(document_of_audits(**AUDITS_OF_THREE))
    assert [*table.head] == [
        "detector", "what", "missed", "late or cut short", "false contact", "mean ms", "p99 ms", "loss",
        "of a 90 Hz frame", "settings",
    ]  # fmt: skip
    rows = [dict(zip(table.head, cells, strict=True)) for cells in table.cells()]
    assert [row["detector"] for row in rows] == ["hull50", "mesh50", "paper", "exact"]
    hull50, mesh50, _paper, exact = rows
    assert {heading: text_of(cell) for heading, cell in hull50.items() if heading not in ("detector", "what")} == {
        "missed": "0", "late or cut short": "1", "false contact": "96.7 %", "mean ms": "0.4", "p99 ms": "1.1",
        "loss": "0.98", "of a 90 Hz frame": "3.6 %", "settings": "hull50[x=1]",
    }  # fmt: skip
    assert mesh50["missed"] == Marked("1", IN_RED)
    assert (exact["missed"], exact["late or cut short"], exact["false contact"]) == ("reference", "-", "-")


@pytest.mark.parametrize(("undecided", "has_column"), [(1, True), (0, False)])
def test_column_of_undecided_contacts_stands_only_where_there_are_any(undecided, has_column):
    """In the ranking; so many of 18 contacts are undecided by the only detector."""
    audit = audit_of_18_contacts(missed=0, late=0, false=0, undecided=undecided)
    assert ("undecided" in table_of_ranking(document_of_audits(it=audit)).head) == has_column


def test_the_time_of_a_recorded_engine_is_not_measured():
    """The reports of an engine stood in the recording: mean and slowest time are dashes."""
    document = document_of_audits(recorded=audit_of_18_contacts(missed=1, late=0, false=0))
    engine = structs.replace(document.detectors["recorded"], name="recorded")
    document = structs.replace(document, detectors=document.detectors | {"recorded": engine})
    of_engine, _of_reference = table_of_ranking(document).only("mean ms", "p99 ms").cells()
    assert of_engine == ("-", "-")


@pytest.mark.parametrize(
    ("name", "text"),
    [("discrete", "triangle meshes at 50 Hz"), ("recorded", "what the engine reported"), ("my:Own", "my:Own at 50 Hz")],
)
def test_a_label_has_the_rate_but_not_the_engine_rate(name, text):
    """``my:Own``: a class of the user; what an engine reported came at its own steps."""
    assert detector_label(name, {"rate_hz": 50}) == text


@pytest.mark.parametrize(
    ("offline", "notes"),
    [
        pytest.param([], 0, id="none offline"),
        pytest.param(["exact"], 1, id="one offline"),
        pytest.param(["hull50", "mesh50", "paper", "exact"], 0, id="all offline"),
    ],
)
def test_times_measured_offline_are_marked_among_live_times(offline, notes):
    """``offline``: detectors that got all frames at once; nothing is noted where all did, as times compare."""
    document = document_of_audits(**AUDITS_OF_THREE)
    detectors = {
        label: structs.replace(detector, live=label not in offline) for label, detector in document.detectors.items()
    }
    table = table_of_ranking(structs.replace(document, detectors=detectors))
    own_notes = [note for note in table.notes if "all frames at once" in note]
    assert len(own_notes) == notes
    assert all(note.startswith("exact was run") for note in own_notes)


@pytest.mark.parametrize(("mean", "is_noted"), [(0.9, False), (1.1, True)])
def test_a_mean_above_p99_is_explained(mean, is_noted):
    """99 % of the frames of exact take at most 1 s, so that a mean of 1.1 s comes from a few, the longest of 200 s."""
    document = document_of_audits(**AUDITS_OF_THREE)
    exact = document.detectors["exact"]
    samples = SampleTimes(median=0.9, p95=0.9, p99=1.0, max=200.0, samples=100, over_budget=1.0, stages={})
    seconds = structs.replace(exact.seconds, per_frame_mean=mean, sample_times=samples)
    detectors = document.detectors | {"exact": structs.replace(exact, seconds=seconds)}
    notes = table_of_ranking(structs.replace(document, detectors=detectors)).notes
    assert ("The mean of exact is above p99: at most 1 in 100 samples took very long." in notes) is is_noted


@pytest.mark.parametrize(("unconfirmed", "false", "all_are"), [(0, 0, False), (2, 2, True), (2, 3, False)])
def test_false_contact_is_unconfirmed_if_all_of_it_is(unconfirmed, false, all_are):
    """``unconfirmed``, ``false``: pair-frames in which only bounding volumes overlap, and all that are false."""
    pair_frames = zeros(PairFrames, false_contact=false)
    assert all_unconfirmed(audit_of(unconfirmed=unconfirmed, pair_frames=pair_frames)) == all_are
