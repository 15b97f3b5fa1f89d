"""Every column of every table: what it holds and how people read it is declared once, in ``columns.toml``."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from replay import words
from replay.auditing.wilson import Proportion
from replay.document.detector import LongestStage
from replay.document.gates import percent
from replay.document.ranking import CountBounds
from replay.document.session import EffectRecord
from replay.document.tables import IN_RED, IN_YELLOW, PARTLY, Cell, Column, Marked, Output, columns_of, package_toml
from replay.effects.effects_runner import CURVES
from replay.words import plural, tally_text

COLUMNS_TOML: Final = "document/columns.toml"

REFERENCE: Final = "reference"
NOT_APPLICABLE: Final = "-"

CERTAIN_TOUCH_S: Final = 1e-6
"""Uncertainty of a first touch up to which none is stated."""


def _count(counts: CountBounds | None, mark: str, otherwise: str) -> Cell:
    return otherwise if counts is None else Marked(words.count_range(counts), mark if counts[1] else "")


def reported_false_cell(fraction: float | None) -> Cell:
    """Return the cell of a share of false contact; ``None``: no contact was reported, so none of it is false."""
    return Marked(words.as_percentage(fraction or 0.0), IN_YELLOW if fraction else "")


def count_text(row: Mapping[str, Any], name: str) -> str:
    """``0-1``, the smallest and the largest count over the sampling offsets; one number where they are equal."""
    return words.count_range((row[f"{name}_smallest"], row[f"{name}_largest"]))


def _range_cell(name: str, mark: str) -> Callable[[Mapping[str, Any]], Cell]:
    """How often a setting is wrong in one way, over the sampling offsets."""
    return lambda row: Marked(count_text(row, name), mark if row[name] else "")


def _percent_or_dash(fraction: float | None) -> str:
    return NOT_APPLICABLE if fraction is None else words.as_percentage(fraction)


def _reported_false_or_dash(fraction: float | None) -> Cell:
    return NOT_APPLICABLE if fraction is None else reported_false_cell(fraction)


def false_cell(false_proportion_and_unconfirmed: tuple[Proportion | None, bool], *, intervals: bool = False) -> Cell:
    """Return the cell of a share of false contact; ``intervals``: with its interval."""
    false, unconfirmed = false_proportion_and_unconfirmed
    if false is None:
        return NOT_APPLICABLE
    if false.value is None:
        return "0 %"
    word = " unconfirmed" if unconfirmed else ""
    text = percent(false, word.strip()) if intervals else f"{words.as_percentage(false.value)}{word}"
    return Marked(text, IN_YELLOW if false.count else "")


def _mean_count(proportion: Proportion | None, contacts: int) -> float | None:
    """Contacts with a fault, the mean over the sampling offsets; ``None`` of the reference."""
    return None if proportion is None else (proportion.value or 0.0) * contacts


def _milliseconds(seconds: float | None) -> str:
    return NOT_APPLICABLE if seconds is None else words.milliseconds(seconds)


def _moment(begin_within: tuple[float, float]) -> Cell:
    """When a miss begins; a first touch between frames says how far it is uncertain, if by more than a microsecond."""
    begin_second, uncertainty = begin_within
    text = words.timestamp(begin_second)
    return text if uncertainty <= CERTAIN_TOUCH_S else Marked(text, "", f"within {words.duration(uncertainty)}")


def _quick_ms(seconds: float | None) -> str:
    return "" if seconds is None else words.milliseconds(seconds)


def _stage(longest: LongestStage | None) -> str:
    return f"{longest.stage} {words.decimal(100 * longest.fraction, 0)} %" if longest else ""


def _reported_count(effect: EffectRecord) -> str:
    """Events of an effect, or its curves."""
    curves = int(effect.counters.get(CURVES, 0))
    return tally_text(effect.events) or (plural(curves, "curve") if curves else "nothing")


COLUMNS: Final = columns_of(
    COLUMNS_TOML,
    {
        "count_in_red": lambda counts: _count(counts, IN_RED, REFERENCE),
        "count_in_part": lambda counts: _count(counts, PARTLY, NOT_APPLICABLE),
        "mean_missed": lambda rank: _mean_count(rank.missed, rank.contacts),
        "mean_late": lambda rank: _mean_count(rank.late_or_cut_short, rank.contacts),
        "false_fraction": lambda rank: None if rank.false is None else rank.false.value,
        "undecided_of": lambda rank: None if rank.missed_counts is None else rank.undecided,
        "or_dash": lambda count: NOT_APPLICABLE if count is None else count,
        "false_of": lambda rank: (rank.false, rank.unconfirmed),
        "false_share": false_cell,
        "ms": _milliseconds,
        "loss": words.loss_number,
        "quick_ms": _quick_ms,
        "percent_or_dash": _percent_or_dash,
        "percent": lambda fraction: "" if fraction is None else words.as_percentage(fraction),
        "stage": _stage,
        "cut_of": lambda row: row["lengths"] and row["lengths"].cut,
        "pair": " - ".join,
        "plain_text": str,
        "moment": _moment,
        "timestamp": words.timestamp,
        "millimetres": lambda metres: None if metres is None else words.number(1e3 * metres),
        "reasons_of": lambda row: "; ".join(row["effect"].because),
        "reported_of": lambda row: _reported_count(row["effect"]),
        "trigger_of": lambda row: row["effect"].trigger or "always",
        "work_of": lambda row: ", ".join(f"{name} {count:,}" for name, count in row["effect"].counters.items()),
        "skipped_of": lambda row: 1.0 - row["effect"].frames_run / max(1, row["effect"].frames),
        "percent_number": lambda fraction: None if fraction is None else words.percentage(100.0 * fraction),
        "row_of": lambda row: row,
        "missed_range": _range_cell("missed", IN_RED),
        "late_range": _range_cell("late", PARTLY),
        "false_contacts_range": _range_cell("false_contacts", IN_YELLOW),
        "reported_false": reported_false_cell,
        "reported_false_or_dash": _reported_false_or_dash,
        "ms_or_dash": lambda ms: NOT_APPLICABLE if ms is None else words.milliseconds(ms / 1e3),
        "length_mm": lambda length: NOT_APPLICABLE if length is None else words.millimetres(length / 1e3),
        "front": lambda on_front: "front" if on_front else "",
        "text_or_dash": lambda text: text or NOT_APPLICABLE,
    },
)


def screen_columns(list_name: str) -> tuple[Column, ...]:
    """Return the columns of a table that terminal, Markdown, report, notebook and picture show."""
    return tuple(column for column in COLUMNS[list_name] if column.only is not Output.FILES)


def file_columns(*list_names: str) -> tuple[Column, ...]:
    """Return the columns of one or several lists as Parquet, CSV, Excel and JSON have them."""
    columns = (column for name in list_names for column in COLUMNS[name])
    return tuple(column.for_files for column in columns if column.only is not Output.SCREENS)


@dataclass(frozen=True)
class FileTable:
    """A table of a run folder: the lists that hold its columns, what a row is, its name over many runs."""

    lists: tuple[str, ...]
    row: str
    joined: str = ""  # ``""``: it is not read over many runs

    @property
    def columns(self) -> tuple[Column, ...]:
        """Its columns as files have them."""
        return file_columns(*self.lists)


FILE_TABLES: Final[Mapping[str, FileTable]] = {
    name: FileTable(tuple(table["lists"]), table["row"], table.get("joined", ""))
    for name, table in package_toml(COLUMNS_TOML)["tables"].items()
}
"""Tables of a run folder by the name of their file."""


def checked_column_names(table_name: str, *column_names: str) -> tuple[str, ...]:
    """Return names of columns of a table of a run folder; ``KeyError``: it has no such column."""
    declared_names = {column.name for column in (*FILE_TABLES[table_name].columns, *file_columns("run"))}
    unknown_columns = [name for name in column_names if name not in declared_names]
    if unknown_columns:
        raise KeyError(f"the table {table_name} has no column {', '.join(unknown_columns)}")
    return column_names


def field_values(columns: Iterable[Column], stored_row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that a row of a file was made of, nested as the paths of its columns say; null is left out."""
    fields: dict[str, Any] = {}
    for column in columns:
        value = stored_row.get(column.name)
        if value is None or not isinstance(column.of, str):
            continue
        *parents, last = column.of.split(".")
        nested_fields = fields
        for parent in parents:
            nested_fields = nested_fields.setdefault(parent, {})
        nested_fields[last] = value
    return fields
