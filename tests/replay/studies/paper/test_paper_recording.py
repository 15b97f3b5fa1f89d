"""The recording holds both families, accuracies, and for every table its cells and its picture."""

import pytest
from rerun.chunk import RrdReader

from replay.outputs.paper_table import PaperTable
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
