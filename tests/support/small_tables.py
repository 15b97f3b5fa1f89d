"""A small table with every kind of cell, for the tests of the renderers."""

from replay.outputs import tables
from replay.outputs.tables import Marked, table

ROWS = [("cup|lid", 1234, Marked("7", tables.STRONG)), ("rod", 0, Marked("x", tables.FAINT, "why"))]


def made(**more):
    return table("a title", ("body", "count", "mark"), ROWS, notes=["a note"], **more)
