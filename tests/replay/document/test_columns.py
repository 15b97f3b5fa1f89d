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
    """``fraction``: of the contact time that a detector reports, what is false; None: it reports none."""
    assert reported_false_cell(fraction) == cell


@pytest.mark.parametrize(
    ("false", "unconfirmed", "cell"),
    [
        pytest.param(None, False, "-", id="the reference"),
        pytest.param(proportion(0, 0), False, "0 %", id="nothing reported"),
        pytest.param(proportion(0, 8), False, Marked("0 %"), id="none of 8 frames"),
        pytest.param(proportion(2, 8), False, Marked("25 %", IN_YELLOW), id="2 of 8 frames"),
        pytest.param(proportion(2, 8), True, Marked("25 % unconfirmed", IN_YELLOW), id="only volumes overlap"),
    ],
)
def test_cell_of_false_contact_of_a_detector(false, unconfirmed, cell):
    """``false``: frames of false contact, of those that the detector reports; ``unconfirmed``: by volumes alone."""
    assert false_cell((false, unconfirmed)) == cell


def cells_of_effect(**fields):
    """The row of an effect in 100 frames of a recording, without events: heading -> text."""
    usual = {
        "about": "a", "because": ("declared",), "seconds": 0.1, "fraction": 0.1, "frames": 100, "frames_run": 100,
        "trigger": "", "counters": {}, "events": {}, "digest": "d", "sources": (),
    }  # fmt: skip
    table = Table.of(COLUMNS["effects"], [{"kind": "pour", "effect": convert(usual | fields, EffectRecord)}])
    return dict(zip(table.head, map(text_of, table.cells()[0]), strict=True))


@pytest.mark.parametrize(
    ("fields", "heading", "text"),
    [
        pytest.param({}, "found", "nothing", id="neither events nor curves"),
        pytest.param({"counters": {CURVES: 2}}, "found", "2 curves", id="curves"),
        pytest.param({"events": {"spill": 3}}, "found", "spill: 3", id="events"),
        pytest.param({"events": {"spill": 3}, "counters": {CURVES: 2}}, "found", "spill: 3", id="events and curves"),
        pytest.param({"trigger": "grasp", "frames_run": 25}, "runs only in", "grasp", id="trigger"),
        pytest.param({"trigger": "grasp", "frames_run": 25}, "% skipped", "75", id="25 of 100 frames"),
        pytest.param({}, "runs only in", "always", id="no trigger"),
    ],
)
def test_row_of_an_effect_has_events_or_curves_and_trigger(fields, heading, text):
    """``fields``: of an effect that is else without events or trigger and runs in all of 100 frames."""
    assert cells_of_effect(**fields)[heading] == text


@pytest.mark.parametrize(("uncertainty", "small_print"), [(0.0, ""), (CERTAIN_TOUCH_S, ""), (2e-6, "within 2 µs")])
def test_moment_states_an_uncertainty_above_a_microsecond(uncertainty, small_print):
    """A miss that touches at 1.5 s, give or take ``uncertainty`` seconds; CERTAIN_TOUCH_S is a microsecond."""
    cell = column_called("misses", "at s").cell((1.5, uncertainty))
    assert text_of(cell) == "1.500"
    assert (cell.below if isinstance(cell, Marked) else "") == small_print


@pytest.mark.parametrize(
    ("proportion_of_contacts", "mean"),
    [(None, None), (proportion(0, 0), 0.0), (proportion(0, 8), 0.0), (proportion(2, 8), 0.25 * 10)],
    ids=["not compared", "no contacts", "0 of 8", "a quarter of ten contacts"],
)
@pytest.mark.parametrize("column", ["missed", "late or cut short"])
def test_files_have_the_mean_number_of_faulty_contacts(column, proportion_of_contacts, mean):
    """Ten contacts, of which a proportion is missed, or late or cut short, over the sampling offsets."""
    rank = Rank(
        "hull", "", "", contacts=10, mean=None, p99=None, missed=proportion_of_contacts,
        late_or_cut_short=proportion_of_contacts,
    )  # fmt: skip
    assert column_called("ranking", column).for_files.value(rank) == mean


@pytest.mark.parametrize(("settings", "cell"), [("exact", "exact"), ("", "-")])
def test_missing_settings_are_a_dash_in_a_table(settings, cell):
    """A row of the table of settings that were tried, with a text or without one."""
    assert column_called("tradeoff", "settings").cell(settings) == cell


def test_stored_row_is_read_as_nested_fields():
    """A path in ``of`` gives nested fields; null is left out, and so is what a function made of the row (n)."""
    columns = [Column("k", of="a"), Column("x", of="point.0"), Column("y", of="point.1"), Column("n", of=len)]
    assert field_values(columns, {"k": 1, "x": 2.0, "y": None, "n": 4}) == {"a": 1, "point": {"0": 2.0}}


@pytest.mark.parametrize(
    ("trigger", "frames_run", "runs_in", "skipped"),
    [("grasp", 3, "grasp", 0.75), ("", 12, "always", 0.0), ("grasp", 0, "grasp", 1.0)],
)
def test_effect_runs_always_or_where_its_trigger_lets_it(trigger, frames_run, runs_in, skipped):
    """The recording has twelve frames; ``skipped``: fraction of them in which the effect did not run."""
    row = {"effect": SimpleNamespace(trigger=trigger, frames=12, frames_run=frames_run)}
    assert column_called("effects", "runs only in").of(row) == runs_in
    assert column_called("effects", "% skipped").of(row) == skipped


@pytest.mark.parametrize(
    ("lengths", "cut"), [(SimpleNamespace(cut=2), 2), (None, None)], ids=["lengths known", "lengths not known"]
)
def test_cut_contacts_are_unknown_where_lengths_are(lengths, cut):
    """A pair of bodies; ``lengths``: of its contacts, and how many of them lost poses cut."""
    assert column_called("cut", "cut by lost poses").of({"lengths": lengths}) == cut
