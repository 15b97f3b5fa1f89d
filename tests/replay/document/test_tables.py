"""Cells of tables for people and for files, and tables as Markdown."""

from types import SimpleNamespace

import pytest

from replay.document.tables import STRONG, Column, Marked, Table, markdown, table

THREE_ROWS = Table((Column("k", int),), ((1,), (2,), (3,)), notes=("a note",))


@pytest.mark.parametrize(
    ("column", "value"),
    [
        (Column("gap"), 2.0),
        (Column("distance", of="gap"), 2.0),
        (Column("y", of="point.1"), 5.0),
        (Column("y", of="nowhere.1"), None),
        (Column("never"), None),
        (Column("text"), ""),
        (Column("text", empty_is_null=True), None),
        (Column("gap", empty_is_null=True), 2.0),
    ],
)
def test_column_reads_its_value_from_a_row(column, value):
    """``of``: path in the row, else the column's name; NaN, and what is not there, is no value."""
    row = SimpleNamespace(gap=2.0, point=(4.0, 5.0), nowhere=None, never=float("nan"), text="")
    assert column.value(row) == value


@pytest.mark.parametrize(
    ("column", "name", "value"),
    [
        (Column("Gap %", float), "gap_percent", 0.25),
        (Column("Gap %", float, stored="gap"), "gap", 0.25),
        (Column("gap", float, scale=1000.0), "gap", 250.0),
        (Column("gap", float, show=".1f"), "gap", 0.25),
        (Column("gap", str, show=".1f"), "gap", "0.2"),
        (Column("gap", str), "gap", 0.25),
        (Column("gap", str, show=".1f", number=lambda row: 7.0), "gap", 7.0),
        (Column("missing", float, scale=1000.0), "missing", None),
        (Column("missing", str, show=".1f"), "missing", None),
    ],
)
def test_file_column_has_plain_name_number_and_text(column, name, value):
    """``name`` and ``value`` are those in a file, of a row whose gap is 0.25."""
    file_column = column.for_files
    assert (file_column.name, file_column.value({"Gap %": 0.25, "gap": 0.25, "missing": None})) == (name, value)


@pytest.mark.parametrize(
    ("show", "value", "cell"),
    [("", 3, 3), ("", None, None), ("", 2.5, "2.5"), (".2f", 2.5, "2.50"), (".2f", None, None), (str.upper, "a", "A")],
)
def test_cell_is_an_integer_or_text_or_nothing(show, value, cell):
    """``show``: a format, or a function; integers stay numbers, so that a table can group their digits."""
    assert Column("gap", show=show).cell(value) == cell


@pytest.mark.parametrize(
    ("most", "rows", "notes"),
    [
        (2, ((1,), (2,)), ("a note", "1 more")),
        (3, ((1,), (2,), (3,)), ("a note",)),
        (4, ((1,), (2,), (3,)), ("a note",)),
    ],
)
def test_first_rows_of_a_table_note_how_many_follow(most, rows, notes):
    """The first ``most`` of three rows stay."""
    first = THREE_ROWS.first(most, "{} more")
    assert (first.rows, first.notes) == (rows, notes)


def test_rows_are_chosen_by_all_their_values():
    """Only the first of three rows has both values."""
    rows = Table((Column("a"), Column("b")), (("x", 1), ("x", 2), ("y", 1)))
    assert rows.where(a="x", b=1).rows == (("x", 1),)


def test_only_the_first_column_of_cells_stays_whole():
    """``words``: columns of text; a whole column is never cut on a narrow terminal."""
    made = table("", ("detector", "what", "ms"), [("exact", "every triangle", 0.1)], words=("detector", "what"))
    assert [(column.whole, column.words) for column in made.columns] == [(True, True), (False, True), (False, False)]


def test_markdown_has_a_rule_a_line_a_row_and_notes():
    """Bars and angle brackets of the text are escaped; a level of 2 puts the title above."""
    made = table(
        "Cost", ("detector", "ms"), [(Marked("a|b", STRONG), 1000), ("<b>", None)], notes=("On this machine.",)
    )
    lines = ["| detector | ms |", "|---|---|", r"| **a\|b** | 1,000 |", r"| \<b> |  |", "", "On this machine."]
    assert markdown(made).splitlines() == lines
    assert markdown(made, level=2).splitlines() == ["## Cost", "", *lines]
