"""``replay paper`` prints tables or JSON, writes two pictures where told, and repeats itself."""

import json
from itertools import count

import pytest

from replay.cli.main import main
from replay.studies.paper import experiment, rows

pytestmark = pytest.mark.slow


@pytest.fixture
def tiny(monkeypatch):
    """The tables of each run, small, with a clock of its own."""
    monkeypatch.setattr(experiment, "QUICK_SIZE", experiment.Size((100,), 2, 40))
    ticks = count(1)
    monkeypatch.setattr(rows, "perf_counter", lambda: next(ticks) / 64)
    tables, run_paper = [], experiment.run_paper
    monkeypatch.setattr(experiment, "run_paper", lambda *arguments: tables.append(run_paper(*arguments)) or tables[-1])
    return tables


def test_equal_wall_times_give_bitwise_equal_paper_tables(tiny, capsys, tmp_path):
    """The planted clock ticks evenly; two pictures are written."""
    assert main(["paper", "--quick", "--out", str(tmp_path)]) == 0
    printed, output = capsys.readouterr()
    for text in ("Table I", "T1a", "F7e", "F8 search", "its hardware, budget", "rapid-style"):
        assert text in printed
    assert output.count("wrote") == len([*tmp_path.iterdir()]) == 2
    assert main(["paper", "--quick"]) == 0
    first, second = ([json.dumps(table.rows) for table in tables] for tables in tiny)
    assert first == second and capsys.readouterr().out == printed


def test_quick_paper_completes_and_complete_detectors_find_every_face(capsys):
    """The size that ``--quick`` has, with real times."""
    assert main(["paper", "--quick", "--format", "json"]) == 0
    tables = {item["key"]: item for item in json.loads(capsys.readouterr().out)["tables"]}
    headline = [dict(zip(tables["T1a"]["head"], row, strict=True)) for row in tables["T1a"]["rows"]]
    # Seven detectors run to completion; the searches after them may miss faces and invent none.
    assert [row["face recall"] for row in headline[:7]] == [1.0] * 7
    assert all(row["precision"] in (1.0, None) for row in headline)
    assert {"Table I", "F7ab", "F7c", "F7e", "F8 coverage", "F8 search"} < set(tables)
