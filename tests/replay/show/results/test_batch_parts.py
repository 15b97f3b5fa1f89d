"""The tables of a batch in few files say what its run folders say, and nothing of folders that are gone or changed."""

import json
import shutil

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.study_samples import made_class

from replay import read
from replay.show.results.data_set import DATA_SET, write_batch_tables

RUNS = [f"run{k:03d}" for k in range(12)]


@pytest.fixture(scope="module")
def unchanged_batch(tmp_path_factory):
    """Run folders with the tables of their batch, 5 runs a file; no test changes them."""
    folder = tmp_path_factory.mktemp("batch") / "runs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.show.results.batch_parts.RUNS_PER_SHARD", 5)
        made_class(folder, sessions=len(RUNS), students=6)
        write_batch_tables(folder, dict.fromkeys(RUNS, "asked"))
    return folder


@pytest.fixture
def batch(unchanged_batch, tmp_path, monkeypatch):
    """A copy of the batch that a test may change."""
    monkeypatch.setattr("replay.show.results.batch_parts.RUNS_PER_SHARD", 5)
    return shutil.copytree(unchanged_batch, tmp_path / "runs")


def by_folder(top, work):
    """Tables read run by run, as if there were none of the batch."""
    away = top / ".away"
    (top / "batch.tables").rename(away)
    try:
        return work()
    finally:
        away.rename(top / "batch.tables")


def rows_by_table(tables):
    """Table -> its rows."""
    return {name: table.to_pylist() for name, table in tables.items()}


@pytest.mark.slow
def test_batch_tables_hold_all_rows_in_the_same_order(batch):
    """12 runs, 5 a file, make three files of each table."""
    files = sorted(path.relative_to(batch / "batch.tables").as_posix() for path in batch.glob("batch.tables/*/*"))
    assert len(files) == 3 * len(DATA_SET)
    for top in (batch, batch.parent):
        assert rows_by_table(read(top)) == by_folder(batch, lambda top=top: rows_by_table(read(top)))
    whole = pq.read_table(batch / "batch.tables" / "misses").to_pylist()
    assert [row["run"] for row in whole] == [row["run"] for row in read(batch)["misses"].to_pylist()] != []


def test_batch_tables_follow_deleted_and_renewed_run_folders(batch):
    """Run 3 is deleted; run 7 is written again, with one row of metrics instead of all."""
    shutil.rmtree(batch / "run003")
    metrics = pq.read_table(batch / "run007" / "metrics.parquet").slice(0, 1)
    pq.write_table(metrics, batch / "run007" / "metrics.parquet")
    summary = json.loads((batch / "run007" / "summary.json").read_text("utf-8"))
    (batch / "run007" / "summary.json").write_text(json.dumps(summary | {"made": "again"}), "utf-8")
    result = read(batch)["metrics"]["run"].to_pylist()
    assert set(result) == {*RUNS} - {"run003"}
    assert result.count("run007") == 1 < result.count("run006")


def test_batch_tables_of_unchanged_runs_are_not_rewritten(batch):
    """12 runs, 5 a file, are three files of each table; without run 11 only the third is written again."""
    before = {path: path.stat().st_mtime_ns for path in batch.glob("batch.tables/*/*")}
    write_batch_tables(batch, dict.fromkeys(RUNS, "asked"))
    assert {path: path.stat().st_mtime_ns for path in batch.glob("batch.tables/*/*")} == before
    shutil.rmtree(batch / "run011")
    write_batch_tables(batch, dict.fromkeys(RUNS[:-1], "asked"))
    after = {path: path.stat().st_mtime_ns for path in batch.glob("batch.tables/*/*")}
    assert len(before.keys() & after.keys()) == 2 * len(DATA_SET) and len(after) == len(before)


PIECES = '{"schema": "vrlab-replay/parts/1", "parts": [%s]}'
UNREADABLE = [
    "",
    "[]",
    '{"schema": "vrlab-replay/parts/9", "parts": []}',
    PIECES % '{"stem": "../x", "runs": {}}',
    PIECES % '{"stem": 1, "runs": {"a": [1]}}',
]


@pytest.mark.sampled(5)
@pytest.mark.parametrize("text", UNREADABLE)
def test_meaningless_list_of_batch_files_leaves_run_folders(batch, text):
    """``text``: of the list of files: empty, of another form or version, or naming files outside."""
    expected = rows_by_table(read(batch))
    (batch / "batch.tables" / "parts.json").write_text(text, "utf-8")
    assert rows_by_table(read(batch)) == expected


@pytest.mark.parametrize("length", [0, 4, 1000])
def test_damaged_batch_file_leaves_the_run_folders(batch, length):
    """The first file of a table is cut to so many bytes; its runs are read from their folders, after the others."""
    expected = rows_by_table(read(batch))
    file = sorted((batch / "batch.tables" / "misses").iterdir())[0]
    file.write_bytes(file.read_bytes()[:length])
    by_run = {name: sorted(table, key=lambda row: row["run"]) for name, table in rows_by_table(read(batch)).items()}
    assert by_run == expected


def test_batch_rows_naming_a_folder_outside_are_ignored(batch):
    """One row of the first file names a folder above the batch: it is the only one that is not read."""
    file = sorted((batch / "batch.tables" / "misses").iterdir())[0]
    table = pq.read_table(file)
    names = ["../../elsewhere", *table["run"].to_pylist()[1:]]
    index = table.column_names.index("run")
    pq.write_table(table.set_column(index, "run", pa.array(names, pa.string())), file)
    assert read(batch)["misses"].num_rows == by_folder(batch, lambda: read(batch))["misses"].num_rows - 1
