"""Cells of tables for people and for files, and tables as Markdown."""

from types import SimpleNamespace

import pytest

from replay.document.tables import STRONG, Column, Marked, Table, markdown, table

THREE_ROWS = Table((Column("k", int),), ((1,), (2,), (3,)), notes=("a note",))
"""A table with one column."""


@pytest.mark.parametrize(
    ("column", "value"),
    [
        pytest.param(Column("gap"), 2.0, id="attribute of the column's name"),
        pytest.param(Column("distance", of="gap"), 2.0, id="another attribute"),
        pytest.param(Column("y", of="point.1"), 5.0, id="path"),
        pytest.param(Column("y", of="nowhere.1"), None, id="path through nothing"),
        pytest.param(Column("never"), None, id="NaN"),
        pytest.param(Column("text"), "", id="empty text"),
        pytest.param(Column("text", empty_is_null=True), None, id="empty text as nothing"),
        pytest.param(Column("gap", empty_is_null=True), 2.0, id="number where empty is nothing"),
    ],
)
def test_column_reads_its_value_from_a_row(column, value):
    """``of``: path in the row, else the column's name; NaN, and what is not there, is no value."""
    row = SimpleNamespace(gap=2.0, point=(4.0, 5.0), nowhere=None, never=float("nan"), text="")
    assert column.value(row) == value


@pytest.mark.parametrize(
    ("column", "name", "value"),
    [
        pytest.param(Column("Gap %", float), "gap_percent", 0.25, id="plain name"),
        pytest.param(Column("Gap %", float, stored="gap"), "gap", 0.25, id="name of its own in files"),
        pytest.param(Column("gap", float, scale=1000.0), "gap", 250.0, id="scaled"),
        pytest.param(Column("gap", float, show=".1f"), "gap", 0.25, id="number without its format"),
        pytest.param(Column("gap", str, show=".1f"), "gap", "0.2", id="text in its format"),
        pytest.param(Column("gap", str), "gap", 0.25, id="text without a format"),
        pytest.param(Column("gap", str, show=".1f", number=lambda row: 7.0), "gap", 7.0, id="number for files"),
        pytest.param(Column("missing", float, scale=1000.0), "missing", None, id="no number"),
        pytest.param(Column("missing", str, show=".1f"), "missing", None, id="no text"),
    ],
)
def test_file_column_has_plain_name_number_and_text(column, name, value):
    """A column that people read, and its name and value in a file, of a row whose gap is 0.25.

    ``show`` is a format for people, which files have of a column of text alone: 0.25 in one digit is 0.2, the even one.
    """
    file_column = column.for_files
    assert file_column.name == name
    assert file_column.value({"Gap %": 0.25, "gap": 0.25, "missing": None}) == value


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
    """The first ``most`` of three rows stay; a note on the others, if any, follows the table's own."""
    first = THREE_ROWS.first(most, "{} more")
    assert (first.rows, first.notes) == (rows, notes)


def test_rows_are_chosen_by_all_their_values():
    """Only the first of three rows has both a = x and b = 1."""
    rows = Table((Column("a"), Column("b")), (("x", 1), ("x", 2), ("y", 1)))
    assert rows.where(a="x", b=1).rows == (("x", 1),)


def test_only_the_first_column_of_cells_stays_whole():
    """``words``: columns of text; a whole column is never cut on a narrow terminal."""
    made = table("", ("detector", "what", "ms"), [("exact", "every triangle", 0.1)], words=("detector", "what"))
    assert {column.name: (column.whole, column.words) for column in made.columns} == {
        "detector": (True, True),
        "what": (False, True),
        "ms": (False, False),
    }


def test_markdown_has_a_rule_a_line_a_row_and_notes():
    """Bars and angle brackets of the text are escaped, a strong cell has stars; a level of 2 puts the title above."""
    made = table(
        "Cost", ("detector", "ms"), [(Marked("a|b", STRONG), 1000), ("<b>", None)], notes=("On this machine.",)
    )
    lines = ["| detector | ms |", "|---|---|", r"| **a\|b** | 1,000 |", r"| \<b> |  |", "", "On this machine."]
    assert markdown(made).splitlines() == lines
    assert markdown(made, level=2).splitlines() == ["## Cost", "", *lines]
