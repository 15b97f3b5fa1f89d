"""``replay paper`` prints tables or JSON, writes two pictures where told, and repeats itself."""

import json
from itertools import count

import pytest

from replay.cli.main import main
from replay.studies.paper import experiment, rows

pytestmark = pytest.mark.slow


@pytest.fixture
def tables_of_tiny_runs(monkeypatch):
    """The tables of each run of `replay paper`, which is small and has a clock that ticks evenly."""
    monkeypatch.setattr(experiment, "QUICK_SIZE", experiment.Size((100,), 2, 40))
    ticks = count(1)
    monkeypatch.setattr(rows, "perf_counter", lambda: next(ticks) / 64)
    tables, run_paper = [], experiment.run_paper
    monkeypatch.setattr(experiment, "run_paper", lambda *arguments: tables.append(run_paper(*arguments)) or tables[-1])
    return tables


def test_equal_wall_times_give_bitwise_equal_paper_tables(tables_of_tiny_runs, capsys, tmp_path):
    """`replay paper` repeats the tables and figures of a paper; it runs twice, small, with a clock that ticks evenly.

    Tables and text are the same; with ``--out`` two pictures are written.
    """
    assert main(["paper", "--quick", "--out", str(tmp_path)]) == 0
    printed, progress = capsys.readouterr()
    for text in ("Table I", "T1a", "F7e", "F8 search", "its hardware, budget", "rapid-style"):
        assert text in printed
    assert progress.count("wrote") == len([*tmp_path.iterdir()]) == 2
    assert main(["paper", "--quick"]) == 0
    first, second = ([json.dumps(table.rows) for table in tables] for tables in tables_of_tiny_runs)
    assert first == second
    assert capsys.readouterr().out == printed


def test_quick_paper_completes_and_complete_detectors_find_every_face(capsys):
    """`replay paper --quick` repeats tables of a paper; its first, T1a, has a row a detector.

    Seven run to completion and find all faces that meet; the searches after them may miss some. No detector reports a
    face that does not meet: its precision is 1, or none where it reports nothing.
    """
    assert main(["paper", "--quick", "--format", "json"]) == 0
    tables = {table["key"]: table for table in json.loads(capsys.readouterr().out)["tables"]}
    rows_of_detectors = [dict(zip(tables["T1a"]["head"], row, strict=True)) for row in tables["T1a"]["rows"]]
    complete_detectors = 7
    assert [row["face recall"] for row in rows_of_detectors[:complete_detectors]] == [1.0] * complete_detectors
    assert all(row["precision"] in (1.0, None) for row in rows_of_detectors)
    assert {"Table I", "F7ab", "F7c", "F7e", "F8 coverage", "F8 search"} < set(tables)
