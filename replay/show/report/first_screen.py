"""The first screen of a report: what is wrong, why, what mends it and what that costs, a picture, and all detectors."""

import json
from dataclasses import dataclass
from typing import Final

from replay.document.depth import depth_text
from replay.document.ranking import Rank, any_decided, fix_lane, ranks_with_fixes
from replay.document.tables import Table, text_of
from replay.show.accuracy import accuracy_plot, run_dots
from replay.show.plots import PLOT_SIZE, Plot
from replay.show.report.charts import KIND_LABELS, Lane, TimeSpan, lane, ruler
from replay.show.report.run_view import RunView, spans
from replay.show.run_tables import contacts_sentence
from replay.show.sections import SectionName, section_of
from replay.words import duration, plural, safe_text
from replay.words import interval as interval_text

MOST_LANES: Final = 6
"""Detectors with a lane on the first screen; further ones are folded."""


def page_facts(view: RunView) -> str:
    """How long a session is, how many contacts it has, and whether it was made up."""
    session = view.document.session
    fact_texts = [duration(session.duration)]
    if view.ranking and any_decided(view.document):
        fact_texts.append(plural(view.ranking[-1].contacts, "contact"))
    if "synthetic" in session.facts:
        fact_texts.append("made up")
    return ", ".join(fact_texts)


MOST_CONTACTS: Final = 4000
"""Contacts of a lane that the pointer can name."""


@dataclass(frozen=True)
class RankRow:
    """A row of the ranking: the class of the worst detector, its worst column, and cells as (column, words).

    ``interval``: the 95 % interval of the worst figure; ``""``: there is none.
    """

    rank: Rank
    leads: str
    bad: str
    cells: list[tuple[str, str]]
    interval: str = ""


@dataclass(frozen=True)
class Timeline:
    """A lane for each detector: its label, what stands beside it, and the lane.

    ``window``: first second and length; ``contacts``: those of the reference, or of all detectors, as JSON;
    ``note``: on rows of the ranking without a lane.
    """

    lanes: list[tuple[str, str, Lane]]
    window: TimeSpan
    contacts: str
    legend: list[tuple[str, str]]
    ticks: list[tuple[float, str]]
    note: str = ""
    most: int = MOST_LANES


@dataclass(frozen=True)
class Comparison:
    """All detectors, as ``detectors.html`` shows them."""

    title: str
    head: list[str]
    ranking: list[RankRow]
    notes: list[str]
    scatter: Plot | None
    timeline: Timeline


def comparison_of(view: RunView, marked_second: float | None = None) -> Comparison:
    """Ranking, scatter and timeline; ``marked_second``: the second of the picture."""
    section = section_of(view, SectionName.RANKING)
    table = section.table.narrow().values() if view.ranking else Table((), ())
    rank_rows = []
    ranks = ranks_with_fixes(view.ranking, view.document)
    for rank, cells in zip(ranks, table.cells(), strict=True):
        cell_texts = [(name, text_of(cell)) for name, cell in zip(table.head, cells, strict=True)]
        leading_label = bad_column = interval = ""
        if rank is view.ranking[0] and rank.loss:
            leading_label = _leading_kind(rank)
            bad_column = (
                "false contact"
                if rank.leads_false
                else "missed"
                if rank.missed_counts and rank.missed_counts[1]
                else ""
            )
            interval = _interval_label(rank) if bad_column == "false contact" else ""
        # The reference has no faults: one wide cell stands for them.
        first_column = 0 if rank.missed_counts is not None else table.head.index("mean ms")
        rank_rows.append(RankRow(rank, leading_label, bad_column, cell_texts[first_column:], interval))
    title = table.title.rstrip(":") if view.ranking and view.ranking[-1].contacts else contacts_sentence(0)
    if not any_decided(view.document):
        title = "Nothing was compared."
    return Comparison(
        title, table.head, rank_rows, list(section.sentences), _scatter(view), _timeline(view, marked_second)
    )


def _interval_label(rank: Rank) -> str:
    """The 95 % interval of the time that is false; ``""``: none was reported."""
    return "" if rank.false is None else interval_text(rank.false.lower, rank.false.upper)


def _leading_kind(rank: Rank) -> str:
    return "false" if rank.leads_false else "missed"


def _scatter(view: RunView) -> Plot | None:
    """The losses of the ranking against the mean time of a frame."""
    dots = run_dots(view)
    return accuracy_plot(dots, PLOT_SIZE) if dots else None


def _timeline(view: RunView, marked_second: float | None) -> Timeline:
    """A lane for each detector, the reference on top."""
    described_lanes = [(label, "") for label in view.contacts]
    if view.oracle:
        described_lanes = [
            (view.oracle, " (reference)"),
            *((rank.label, f": {rank.what}") for rank in view.ranking[:-1]),
        ]
    fix = fix_lane(view.ranking, view.document)
    if fix is not None:
        described_lanes.insert(2, (fix[0].label, f": {fix[0].what}"))
    start = float(view.document.window.start or 0.0)
    window = start, start + float(view.document.session.duration)
    lanes, kinds = [], set[str]()
    for label, lane_note in described_lanes:
        every_kind = fix[1].spans if fix is not None and label == fix[0].label else spans(view, label)
        intervals_of_kind = {kind: intervals for kind, intervals in every_kind.items() if intervals}
        kinds |= intervals_of_kind.keys()
        counts_text = ", ".join(
            f"{len(intervals)} {KIND_LABELS[kind]}" for kind, intervals in intervals_of_kind.items()
        )
        lanes.append(
            (
                label,
                lane_note,
                lane(intervals_of_kind, window, f"{label}: {counts_text or 'no contact'}", marked_second),
            )
        )
    legend = [(kind, kind_label) for kind, kind_label in KIND_LABELS.items() if kind in kinds]
    if marked_second is not None:
        legend.append(("now", "the picture"))
    return Timeline(
        lanes=lanes,
        window=(start, max(window[1] - start, 1e-6)),
        contacts=_contacts_json(view),
        legend=legend,
        ticks=ruler(*window),
        note=_without_lane(view),
    )


def _without_lane(view: RunView) -> str:
    """Sentence on the measured Fix where a run keeps counts alone; ``""``: it has a lane, or none was measured."""
    if fix_lane(view.ranking, view.document) is not None:
        return ""
    fix_labels = [rank.label for rank in ranks_with_fixes(view.ranking, view.document) if rank not in view.ranking]
    return "".join(f"{label} has no lane: its contacts were counted, not kept." for label in fix_labels)


def _contacts_json(view: RunView) -> str:
    """Contacts as the script of the page reads them: names of pairs, and (pair, start, end, depth) of each contact."""
    labels = [view.oracle] if view.oracle else [*view.contacts]
    pairs: dict[tuple[str, str], int] = {}
    contacts = {
        label: [
            (
                pairs.setdefault(contact.bodies, len(pairs)),
                round(contact.start, 3),
                round(contact.end, 3),
                depth_text(contact.depth, at_least=bool(contact.depth_at_least)),
            )
            for contact in view.contacts.get(label, ())[:MOST_CONTACTS]
        ]
        for label in labels
    }
    pair_names = [safe_text(" and ".join(bodies)) for bodies in pairs]
    return json.dumps(
        {"pairs": pair_names, "contacts": contacts, "reference": view.oracle}, separators=(",", ":"), ensure_ascii=False
    )
