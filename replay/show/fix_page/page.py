"""The page of ``replay fix``: one sentence, one moment with both colliders, both columns of figures, and all bodies."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isnan
from typing import Any, Final

from markupsafe import Markup

from cdcore import TriangleMesh
from replay import words
from replay.auditing.fault import Fault, worst_first
from replay.document.before_after import change_text, errors_of_row, worse_text
from replay.document.columns import screen_columns
from replay.document.cost import TIMES_SENTENCE, busy_text
from replay.document.headline import notes_of, undecided_lines
from replay.document.run_result import RunResult
from replay.document.tables import Column, text_of
from replay.show.accuracy import LOSS_AXIS
from replay.show.fix_page.pictures import mesh_picture, pieces_picture, reach_picture, scale_gradient
from replay.show.fix_table import front_table
from replay.show.plots import Axis, Dot, Plot, scatter, ticks_of
from replay.show.report.fault_cards import fault_counts
from replay.show.report.first_screen import Comparison, comparison_of
from replay.show.report.page import page_of, view_of
from replay.show.report.run_view import RunView
from replay.show.report.still import CARD_SIZE, paired_stills
from replay.words import plural

Row = Mapping[str, Any]

BEFORE_LABEL: Final = "hulls"
AFTER_LABEL: Final = "pieces"
"""Labels of the two detectors of the run that counts."""

LEAST_CHANGE_FRACTION: Final = 0.01
"""Fraction of a figure by which it must change to be called better or worse."""


@dataclass(frozen=True, eq=False)
class BodyShape:
    """A body's mesh, the solids in its place before, and those after."""

    mesh: TriangleMesh
    before: Sequence[TriangleMesh]
    after: Sequence[TriangleMesh]


@dataclass(frozen=True, eq=False)
class Cure:
    """Colliders of a session, before and after.

    Parameters
    ----------
    result : the run that counted both, with the labels ``BEFORE_LABEL`` and ``AFTER_LABEL``.
    before, after : figures of both, plain data.
    bodies : report cards, plain data, as ``replay.running.collider_files`` has them.
    shapes : name of a body -> its shapes.
    front : what was tried, fewest pieces first.
    notes : sentences about limits that were reached, and about what the search left out.
    engine : what the files are for; ``""``: none were written.
    steps : what to do in the engine, sentences.
    again : the command that counts again.
    """

    result: RunResult
    before: Row
    after: Row
    bodies: Sequence[Row]
    shapes: Mapping[str, BodyShape]
    front: Sequence[Row]
    notes: Sequence[str]
    engine: str
    steps: Sequence[str]
    again: str


@dataclass(frozen=True)
class Figure:
    """A figure before and after, in words; ``change``: ``better``, ``worse`` or ``""``."""

    name: str
    before: str
    after: str
    change: str


@dataclass(frozen=True)
class BodyCard:
    """A body: its pictures with a caption each, its figures, and ``what`` was made of it.

    ``after``: the head of the second column; ``""``: it keeps its hull. ``farthest``: the largest reach in words, where
    the scale of colours ends; ``""``: nothing reaches beyond the mesh. ``seams``: a line a seam of its pieces.
    """

    name: str
    what: str
    pictures: Sequence[tuple[str, str]]
    figures: Sequence[Figure]
    after: str
    farthest: str
    seams: Sequence[str]


def cure_sentences(result: RunResult, row_before: Row, row_after: Row) -> str:
    """Returns both figures in one line, without times on a busy machine, and another one on what becomes worse.

    ``False 86 % -> 8 %, missed 0-1 of 18 as before; 5 pieces in place of 3 hulls; 0.02 ms a frame more.``
    """
    contacts = result.ranking[-1].contacts if result.ranking else 0
    is_idle = not busy_text(result.document)
    errors_before, errors_after = (
        errors_of_row(row, contacts, row["ms"] / 1e3 if is_idle else None) for row in (row_before, row_after)
    )
    pieces = plural(row_after["pieces"], "piece")
    if row_before["pieces"] != row_after["pieces"]:
        pieces += f" in place of {plural(row_before['pieces'], 'hull')}"
    return " ".join(
        [
            f"{change_text(errors_before, errors_after, pieces)}.",
            *filter(None, [worse_text(errors_before, errors_after)]),
        ]
    )


def cure_page(cure: Cure) -> str:
    """Returns the page as text, self-contained."""
    result = cure.result
    view = replace(view_of(result), folder="")
    fault, busy_sentence = _drawn_fault(result), busy_text(view.document)
    paired_pictures: list[tuple[str, str]] = []
    if fault is not None:
        captions = _moment_captions(result, fault, _is_reported(result, fault))
        paired_pictures = list(
            zip(paired_stills(result, (BEFORE_LABEL, AFTER_LABEL), fault, CARD_SIZE), captions, strict=True)
        )
    return page_of(
        view,
        notes_of(result)[len(undecided_lines(result)) :],
        "show/fix_page/page.html",
        cure=cure,
        sentence=cure_sentences(result, cure.before, cure.after),
        stills=paired_pictures,
        figures=comparison(screen_columns("before_after"), cure.before, cure.after, is_busy=bool(busy_sentence)),
        contacts=view.ranking[-1].contacts,
        comparison=_compared_lanes(view, None if fault is None else _seconds(result, fault)),
        bodies=[
            body_card(row, cure.shapes[row["body"]], busy=bool(busy_sentence))
            for row in sorted(cure.bodies, key=_card_sort_key)
        ],
        untouched=[row["body"] for row in cure.bodies if row["after"]["missed"] is None],
        front=front_plot(cure),
        front_table=front_table(cure.front),
        counts={label: fault_counts(view, label) for label in (BEFORE_LABEL, AFTER_LABEL)},
        labels=(BEFORE_LABEL, AFTER_LABEL),
        times_are=" ".join(filter(None, [TIMES_SENTENCE, busy_sentence])),
        gradient=Markup(scale_gradient()),
    )


def comparison(columns: Iterable[Column], row_before: Row, row_after: Row, *, is_busy: bool) -> list[Figure]:
    """Returns a figure a column, before and after; times of a ``is_busy`` machine are not compared."""
    figures = []
    for column in columns:
        if column.names_row:
            continue
        numeric_column = column.for_files
        value_before, value_after = numeric_column.value(row_before), numeric_column.value(row_after)
        if value_before is None and value_after is None:
            continue
        text_before, text_after = (text_of(column.cell(column.value(row))) for row in (row_before, row_after))
        change_kind = (
            _change_kind(value_before, value_after)
            if text_before != text_after and column.name not in _unmarked_columns(is_busy)
            else ""
        )
        figures.append(Figure(column.name, text_before, text_after, change_kind))
    return figures


def _unmarked_columns(is_busy: bool) -> set[str]:
    """Names of columns that are never marked: more pieces are a price, times of a busy machine are chance."""
    return {"pieces", "triangles", *(("ms", "mean ms", "p99 ms") if is_busy else ())}


def _change_kind(value_before: float | None, value_after: float | None) -> str:
    """``worse`` or ``better``; ``""``: alike, or not measured."""
    if (
        value_before is None
        or value_after is None
        or abs(value_after - value_before) <= LEAST_CHANGE_FRACTION * max(abs(value_before), abs(value_after))
    ):
        return ""
    return "worse" if value_after > value_before else "better"


def body_card(body_row: Row, shape: BodyShape, *, busy: bool) -> BodyCard:
    """Returns the card of a body: pictures and figures of its hull and of its pieces."""
    name, figures_before, figures_after = body_row["body"], body_row["before"], body_row["after"]
    is_cut = figures_after["pieces"] > 1
    farthest_beyond = max(figures_before["reach_mm"], figures_after["reach_mm"]) / 1e3
    pictures = [(mesh_picture(shape.mesh, f"The mesh of {name}"), "mesh")]
    if is_cut:
        piece_count_text = plural(figures_after["pieces"], "piece")
        pictures.append(
            (pieces_picture(shape.after, f"{name} in {piece_count_text}"), f"{piece_count_text}, by colour")
        )
    for solids, solids_row, shape_word in (
        (shape.before, figures_before, "hull"),
        (shape.after, figures_after, "pieces"),
    )[: 1 + is_cut]:
        if farthest_beyond > 0.0:
            picture_text = f"{shape_word}: up to {words.length(solids_row['reach_mm'] / 1e3)} beyond"
            pictures.append(
                (reach_picture(shape.mesh, solids, farthest_beyond, f"{name}, {picture_text} the mesh"), picture_text)
            )
    method_text = f"{plural(figures_after['pieces'], 'piece')}: {body_row['how']}" if is_cut else "keeps its hull"
    reason = f": {body_row['reason']}" if body_row["reason"] and not is_cut else ""
    figures = comparison(screen_columns("cards"), figures_before, figures_after, is_busy=busy)
    if not is_cut:
        figures = [replace(figure, after="", change="") for figure in figures]
    return BodyCard(
        name=name,
        what=f"{method_text}{reason}",
        pictures=pictures,
        figures=figures,
        after="pieces" if is_cut else "",
        farthest=words.length(farthest_beyond) if farthest_beyond else "",
        seams=[seam_line(seam) for seam in figures_after["seams"]],
    )


def seam_line(seam: Row) -> str:
    """Returns a seam in words: ``overlap of 0.4 mm: pieces 3 and 7, at 12, 40, -3 mm``."""
    first_number, second_number = (number + 1 for number in seam["pieces"])
    width, position_text = (
        words.length(seam["width_mm"] / 1e3),
        ", ".join(words.decimal(coordinate_mm, 1) for coordinate_mm in seam["at_mm"]),
    )
    return f"{seam['kind']} of {width}: pieces {first_number} and {second_number}, at {position_text} mm"


def front_plot(cure: Cure) -> Plot | None:
    """Returns the loss of each choice on the front over its pieces, the chosen one named; ``None``: only one exists."""
    if len(cure.front) < 2:
        return None
    dots = []
    for choice in cure.front:
        is_chosen = choice["pieces"] == cure.after["pieces"]
        dot_name = f"{choice['pieces']}: {words.loss_number(choice['loss'])}{', chosen' if is_chosen else ''}"
        dots.append(Dot(dot_name, choice["pieces"], choice["loss"], "front" if is_chosen else ""))
    alternative_text = "Loss over pieces of all choices that were tried: " + ", ".join(dot.name for dot in dots)
    loss_axis = Axis(f"{LOSS_AXIS}; green: chosen", ticks_of(max(dot.y for dot in dots), 3))
    return scatter(dots, alternative_text, "pieces of all bodies", loss_axis)


def _card_sort_key(body_row: Row) -> tuple[bool, float, str]:
    """Bodies that are cut first, then those with most false contact."""
    return body_row["after"]["pieces"] == 1, -(body_row["after"]["false"] or 0.0), body_row["body"]


def _compared_lanes(view: RunView, mark: float | None) -> Comparison:
    """The lanes of both, each with what it is."""
    comparison_of_lanes = comparison_of(view, mark)
    lane_notes = {BEFORE_LABEL: ": one a body", AFTER_LABEL: ": those of this page"}
    lanes = [(label, lane_notes.get(label, text), lane) for label, text, lane in comparison_of_lanes.timeline.lanes]
    label_order = [view.oracle, BEFORE_LABEL, AFTER_LABEL]
    lanes.sort(key=lambda named: label_order.index(named[0]))
    return replace(comparison_of_lanes, timeline=replace(comparison_of_lanes.timeline, lanes=lanes))


def _drawn_fault(result: RunResult) -> Fault | None:
    """The worst false contact of the hulls that the pieces do not report at its moment, else the worst of all."""
    faults = worst_first(result.false[BEFORE_LABEL])
    return next((fault for fault in faults if not _is_reported(result, fault)), faults[0] if faults else None)


def _is_reported(result: RunResult, fault: Fault) -> bool:
    """Whether the pieces report contact of the same bodies at the moment that is drawn."""
    seconds = _seconds(result, fault)
    contacts = (contact for contact in result.contacts[AFTER_LABEL] if contact.bodies == fault.bodies)
    return any(contact.start <= seconds <= contact.end for contact in contacts)


def _seconds(result: RunResult, fault: Fault) -> float:
    return float(result.assembly.motion.times[fault.frame])


def _moment_captions(result: RunResult, fault: Fault, is_reported: bool) -> tuple[str, str]:
    """Returns what the two pictures of one moment show, a caption each."""
    bodies = " and ".join(fault.bodies)
    gap = "" if isnan(fault.metres) else f" They are {words.length(fault.metres)} apart."
    moment_text = words.moment(_seconds(result, fault))
    pieces_clause = "report it too" if is_reported else "report none"
    return (
        f"Before: hulls report contact of {bodies} at {moment_text}.{gap}",
        f"After: the same moment; the pieces {pieces_clause}. Yellow: colliders.",
    )
