"""The page of the guide that lists the columns of all tables of a run folder, made from their declaration."""

from typing import Final

from replay.document.columns import FILE_TABLES, FileTable
from replay.document.tables import ARROW_TYPES, Column, Table, markdown

LIST_COLUMNS: Final = (
    Column("column", of=lambda column: f"`{column.name}`"),
    Column("unit"),
    Column("type", of=lambda column: ARROW_TYPES[column.dtype]),
    Column("it holds", of="meaning"),
)


def columns_page() -> str:
    """Return Markdown: a section for each table, a row for each of its columns."""
    lines = ["# Columns of the tables of a run", ""]
    for table_name, table in FILE_TABLES.items():
        lines += [f"## {table_name}.parquet", "", _introduction(table), ""]
        lines += [markdown(Table.of(LIST_COLUMNS, table.columns)), ""]
    return "\n".join(lines)


def _introduction(table: FileTable) -> str:
    """Say what a row is, and what the table is called where many runs are read."""
    joined_sentence = f" `replay.read` calls the table of many runs `{table.joined}`." if table.joined else ""
    return f"A row is {table.row}.{joined_sentence}"


def joined_tables() -> str:
    """Return Markdown: the tables over many runs, and what a row of each is."""
    joined_file_tables = [table for table in FILE_TABLES.values() if table.joined]
    list_columns = (Column("table", of=lambda table: f"`{table.joined}`"), Column("a row is", of="row"))
    return markdown(Table.of(list_columns, joined_file_tables))
