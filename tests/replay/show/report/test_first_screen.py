"""The first screen of a page: facts about the session, and the window of its lanes."""

from types import SimpleNamespace

from msgspec import structs
from support.report_states import audit_of, detector_of, document_with, zeros

from replay.auditing.wilson import proportion
from replay.document.answer import Answer, Fix, FixFigures
from replay.document.audit import PairFrames
from replay.document.ranking import Rank, ranking
from replay.document.session import Window
from replay.show.report.first_screen import comparison_of, page_facts
from replay.show.report.run_view import RunView

REFERENCE = Rank(label="exact", what="", setting="", contacts=3, mean=1e-4, p99=2e-4)


def test_contacts_are_a_fact_where_any_was_decided():
    """A session of 60 s in which the reference (exact) sees 3 contacts; ``undecided``: of nine pair-frames.

    A recording states by the fact ``synthetic`` that it was made up.
    """
    rows = {
        "all decided": ((REFERENCE,), 0, {}, "60 s, 3 contacts"),
        "nothing decided": ((REFERENCE,), 9, {}, "60 s"),
        "made up, no ranking": ((), 9, {"synthetic": "true"}, "60 s, made up"),
        "made up": ((REFERENCE,), 0, {"synthetic": "true"}, "60 s, 3 contacts, made up"),
    }
    for row, (ranks, undecided, facts, text) in rows.items():
        pair_frames = zeros(PairFrames, neither=9 - undecided, left_out=undecided)
        document = document_with(audit={"slow": audit_of(pair_frames=pair_frames)})
        document = structs.replace(document, session=structs.replace(document.session, duration=60.0, facts=facts))
        assert page_facts(SimpleNamespace(document=document, ranking=ranks)) == text, row


def test_lanes_begin_where_the_replayed_window_does():
    """60 s of a session are replayed, from 2.5 s on; a window of lanes is its first second and its length.

    Nothing was compared.
    """
    session = structs.replace(document_with().session, duration=60.0)
    document = document_with(window=Window(start=2.5, end=None), session=session)
    run = SimpleNamespace(document=document, oracle="", ranking=(), contacts={}, faults={}, answers=())
    assert comparison_of(RunView(run, "s")).timeline.window == (2.5, 60.0)


def run_of(*, answers=(), contacts=3, **audits):
    """A page about a run of 10 s: a reference with so many contacts, and detectors, label -> values of its audit."""
    document = document_with(
        oracle="exact",
        session=structs.replace(document_with().session, duration=10.0),
        detectors={"exact": detector_of("exact"), **{label: detector_of("discrete") for label in audits}},
        audit={label: audit_of(contacts=contacts, **values) for label, values in audits.items()},
        answers=answers,
    )
    ranks = ranking(document)
    return RunView(
        SimpleNamespace(
            document=document, oracle="exact", ranking=ranks, contacts={}, faults={}, answers=answers, flicker={}
        ),
        "s",
    )


def test_worst_figure_of_the_worst_detector_is_marked():
    """Ranking of a detector with this audit, of one that misses nothing, and of the reference, which has 3 contacts.

    The first row has a colour by the kind of its fault (``leads``), its worst column is marked (``bad``), and false
    contact has an interval.
    """
    rows = {
        "nothing wrong": ({}, "", ""),
        "a contact missed": ({"contacts_missed": 1}, "missed", "missed"),
        "a contact late: no column": ({"late_or_cut_short": 1, "time_missed": proportion(1, 10)}, "missed", ""),
        "half of its contact false": ({"false_contact": proportion(5, 10)}, "false", "false contact"),
    }
    for row, (audit, kind, marked_column) in rows.items():
        first, *others = comparison_of(run_of(good={}, bad=audit)).ranking
        assert (first.leads, first.bad) == (kind, marked_column), row
        assert bool(first.interval) == (marked_column == "false contact"), row
        assert [(other.leads, other.bad, other.interval) for other in others] == [("", "", ""), ("", "", "")], row


def test_only_the_worst_of_two_wrong_detectors_is_marked():
    """The reference (exact) has 3 contacts, of which one detector misses 2, the other 1.

    A row that ``leads`` stands in the colour of the error it names; an empty text means no colour.
    """
    rows = comparison_of(run_of(misses_2={"contacts_missed": 2}, misses_1={"contacts_missed": 1})).ranking
    assert [(row.rank.label, row.leads) for row in rows] == [("misses_2", "missed"), ("misses_1", ""), ("exact", "")]


def test_measured_fix_has_a_lane_of_its_own():
    """A run of 10 s in which nothing is reported; the measured Fix of the detector ``slow`` is right from 1 to 2 s.

    Its lane stands below that of the detector, and draws the interval and, as it is short, no more than a box.
    """
    none = proportion(0, 3)
    figures = FixFigures(
        what="every frame", missed=none, late_or_cut_short=none, time_missed=none, false=none, missed_counts=(0, 0),
        late_counts=(0, 0), offsets=1, mean=1e-4, p99=None, spans={"right": ((1.0, 2.0),), "missed": ()},
    )  # fmt: skip
    answer = Answer("slow", "", fix=Fix("", True, setting="discrete", figures=figures))
    lanes = comparison_of(run_of(answers=(answer,), slow={"contacts_missed": 1})).timeline.lanes
    text_of_lane = {label: lane.words for label, _note, lane in lanes}
    kinds_of_lane = {label: [kind for kind, _path in lane.paths] for label, _note, lane in lanes}
    assert [*text_of_lane] == ["exact", "slow", "fix"]
    assert text_of_lane == {"exact": "exact: no contact", "slow": "slow: no contact", "fix": "fix: 1 right"}
    assert kinds_of_lane == {"exact": [], "slow": [], "fix": ["right", "right tick"]}
