"""The recording holds both families, accuracies, and for every table its cells and its picture."""

import pytest
from rerun.chunk import RrdReader

from replay.outputs.paper_table import PaperTable, shown
from replay.outputs.rerun_log.markdown import markdown
from replay.outputs.rerun_log.paper_recording import entity_of, record


@pytest.mark.slow
def test_fixtures_accuracies_tables_and_pictures_are_there(small, pictures, tmp_path):
    path = tmp_path / "paper.rrd"
    record(small, pictures, path)
    entities = {str(chunk.entity_path) for chunk in RrdReader(str(path)).stream()}
    for part in ("/fixtures/torus-sphere/torus", "/fixtures/beaker-flask/flask", "/accuracy"):
        assert any(entity.startswith(part) for entity in entities)
    for one in small.tables:
        assert {f"/tables/{entity_of(one.key)}", f"/pictures/{entity_of(one.key)}"} <= entities


def test_markdown_has_every_cell_in_its_column():
    text = markdown(PaperTable("T 1", "title", ("who", "n"), (("x", 1234), ("y", None)), "a note").plain, level=1)
    assert text.splitlines()[0] == "# T 1: title" and text.endswith("a note")
    assert text.splitlines()[2:6] == ["| who | n |", "|---|---|", "| x | 1,234 |", "| y | - |"]


@pytest.mark.parametrize(
    ("cell", "text"),
    [(None, "-"), (1234, "1,234"), (0.123456, "0.1235"), (1.0, "1"), ("a", "a"), (2e-9, "2e-09"),
     (21850.4, "21,850"), (999.96, "1000")],
)  # fmt: skip
def test_a_cell_is_shown_as(cell, text):
    assert shown(cell) == text


def test_a_column_is_found_by_its_heading():
    one = PaperTable("T", "title", ("a", "b"), ((1, 2), (3, 4)))
    assert one.column("b") == [2, 4] and vars(one)["rows"] == ((1, 2), (3, 4))
