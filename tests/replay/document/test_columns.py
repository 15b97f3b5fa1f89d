"""Cells that people read: counts, shares, moments and effects; and fields read again from stored rows."""

from types import SimpleNamespace

import pytest
from msgspec import convert

from replay.auditing.wilson import proportion
from replay.document.columns import CERTAIN_TOUCH_S, COLUMNS, false_cell, field_values, reported_false_cell
from replay.document.ranking import Rank
from replay.document.session import EffectRecord
from replay.document.tables import IN_YELLOW, Column, Marked, Table, text_of
from replay.effects.effects_runner import CURVES


def column_called(list_name, name):
    """The column of this name in a list of columns."""
    (column,) = (column for column in COLUMNS[list_name] if column.name == name)
    return column


@pytest.mark.parametrize(
    ("fraction", "cell"), [(None, Marked("0 %")), (0.0, Marked("0 %")), (0.25, Marked("25 %", IN_YELLOW))]
)
def test_percentage_of_false_contact_is_yellow_unless_zero(fraction, cell):
    assert reported_false_cell(fraction) == cell


@pytest.mark.parametrize(
    ("false", "unconfirmed", "cell"),
    [
        (None, False, "-"),
        (proportion(0, 0), False, "0 %"),
        (proportion(0, 8), False, Marked("0 %")),
        (proportion(2, 8), False, Marked("25 %", IN_YELLOW)),
        (proportion(2, 8), True, Marked("25 % unconfirmed", IN_YELLOW)),
    ],
)
def test_cell_of_false_contact_of_a_detector(false, unconfirmed, cell):
    """``false``: none of the reference, 0 of 0 where nothing is reported; ``unconfirmed``: only volumes overlap."""
    assert false_cell((false, unconfirmed)) == cell


def effect_cells(**fields):
    """The cells of an effect of 100 frames: column -> text."""
    usual = {
        "about": "a", "because": ("declared",), "seconds": 0.1, "fraction": 0.1, "frames": 100, "frames_run": 100,
        "trigger": "", "counters": {}, "events": {}, "digest": "d", "sources": (),
    }  # fmt: skip
    table = Table.of(COLUMNS["effects"], [{"kind": "pour", "effect": convert(usual | fields, EffectRecord)}])
    return dict(zip(table.head, map(text_of, table.cells()[0]), strict=True))


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({}, "nothing"),
        ({"counters": {CURVES: 2}}, "2 curves"),
        ({"events": {"spill": 3}}, "spill: 3"),
        ({"events": {"spill": 3}, "counters": {CURVES: 2}}, "spill: 3"),
        ({"trigger": "grasp", "frames_run": 25}, "grasp"),
        ({"trigger": "grasp", "frames_run": 25}, "75"),
        ({}, "always"),
    ],
)
def test_row_of_an_effect_has_events_or_curves_and_trigger(fields, text):
    """``fields``: of the effect, other than usual; ``text``: of one of its cells, as 75 where 25 of 100 frames ran."""
    assert text in effect_cells(**fields).values()


@pytest.mark.parametrize(("uncertainty", "below"), [(0.0, ""), (CERTAIN_TOUCH_S, ""), (2e-6, "within 2 µs")])
def test_moment_states_an_uncertainty_above_a_microsecond(uncertainty, below):
    """``uncertainty``: seconds; ``below``: the small print under the cell of a moment at 1.5 s."""
    cell = column_called("misses", "at s").cell((1.5, uncertainty))
    assert text_of(cell) == "1.500" and (cell.below if isinstance(cell, Marked) else "") == below


@pytest.mark.parametrize(
    ("missed", "mean"), [(None, None), (proportion(0, 0), 0.0), (proportion(0, 8), 0.0), (proportion(2, 8), 2.5)]
)
def test_files_have_the_mean_number_of_faulty_contacts(missed, mean):
    """A quarter of ten contacts are 2.5."""
    rank = Rank("hull", "", "", contacts=10, mean=None, p99=None, missed=missed, late_or_cut_short=missed)
    for name in ("missed", "late or cut short"):
        assert column_called("ranking", name).for_files.value(rank) == mean


def test_what_is_absent_has_a_dash_or_no_value():
    """No settings are a dash; without lengths of contacts nobody knows how many were cut."""
    assert [column_called("tradeoff", "settings").cell(text) for text in ("", "exact")] == ["-", "exact"]
    cut = column_called("cut", "cut by lost poses")
    assert [cut.value({"lengths": lengths}) for lengths in (None, SimpleNamespace(cut=3))] == [None, 3]


def test_stored_row_is_read_as_nested_fields():
    """Null is left out, and so is what a function made of the row."""
    columns = [Column("k", of="a"), Column("x", of="point.0"), Column("y", of="point.1"), Column("n", of=len)]
    assert field_values(columns, {"k": 1, "x": 2.0, "y": None, "n": 4}) == {"a": 1, "point": {"0": 2.0}}


@pytest.mark.parametrize(
    ("trigger", "frames_run", "runs_in", "skipped"),
    [("grasp", 3, "grasp", 0.75), ("", 12, "always", 0.0), ("grasp", 0, "grasp", 1.0)],
)
def test_effect_runs_always_or_where_its_trigger_lets_it(trigger, frames_run, runs_in, skipped):
    """The recording has twelve frames."""
    row = {"effect": SimpleNamespace(trigger=trigger, frames=12, frames_run=frames_run)}
    assert column_called("effects", "runs only in").of(row) == runs_in
    assert column_called("effects", "% skipped").of(row) == skipped


@pytest.mark.parametrize(("lengths", "cut"), [(SimpleNamespace(cut=2), 2), (None, None)])
def test_cut_contacts_are_unknown_where_lengths_are(lengths, cut):
    """``lengths``: of the contacts of a pair, with the number that lost poses cut."""
    assert column_called("cut", "cut by lost poses").of({"lengths": lengths}) == cut


def test_missing_text_is_a_dash_in_a_table():
    show = column_called("tradeoff", "settings").show
    assert show("exact") == "exact" and show("") == "-"
