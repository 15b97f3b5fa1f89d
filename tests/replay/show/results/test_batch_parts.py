"""The tables of a batch in few files say what its run folders say, and nothing of folders that are gone or changed."""

import json
import shutil

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.study_samples import made_class

from replay import read
from replay.show.results.data_set import DATA_SET, write_batch_tables

RUNS = [f"run{k:03d}" for k in range(6)]


@pytest.fixture(scope="module")
def unchanged_batch(tmp_path_factory):
    """A batch of 6 run folders with its tables in few files, 2 runs a file; no test changes it."""
    folder = tmp_path_factory.mktemp("batch") / "runs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.show.results.batch_parts.RUNS_PER_SHARD", 2)
        made_class(folder, sessions=len(RUNS), students=3)
        write_batch_tables(folder, dict.fromkeys(RUNS, "settings"))
    return folder


@pytest.fixture
def batch(unchanged_batch, tmp_path, monkeypatch):
    """A copy of the batch that a test may change."""
    monkeypatch.setattr("replay.show.results.batch_parts.RUNS_PER_SHARD", 2)
    return shutil.copytree(unchanged_batch, tmp_path / "runs")


def read_without_batch_tables(top, batch):
    """Tables read from the run folders below ``top``, as if the batch among them had no tables of its own."""
    away = batch / ".away"
    (batch / "batch.tables").rename(away)
    try:
        return read(top)
    finally:
        away.rename(batch / "batch.tables")


def first_file_of_misses(batch):
    """The file with the misses of the first two runs of a batch."""
    return min((batch / "batch.tables" / "misses").iterdir())


def times_of_files(batch):
    """Each file of the tables of a batch, and when it was written."""
    return {path: path.stat().st_mtime_ns for path in batch.glob("batch.tables/*/*")}


def rows_by_table(tables):
    """Table -> its rows."""
    return {name: table.to_pylist() for name, table in tables.items()}


@pytest.mark.slow
def test_batch_tables_hold_all_rows_in_the_same_order(batch):
    """Tables of a batch, 6 runs, are read from few files: the same rows as from each run folder, in the same order.

    That holds for the folder of the batch, and for the one above. 2 runs a file make three files of each table.
    """
    assert len(times_of_files(batch)) == 3 * len(DATA_SET)
    for top in (batch, batch.parent):
        assert rows_by_table(read(top)) == rows_by_table(read_without_batch_tables(top, batch))


@pytest.mark.slow
def test_folder_of_a_batch_table_is_readable_by_any_engine(batch):
    """Arrow reads ``batch.tables/misses`` as one table, with the rows of all runs in the order of ``replay.read``."""
    runs_of_misses = pq.read_table(batch / "batch.tables" / "misses")["run"].to_pylist()
    assert runs_of_misses
    assert runs_of_misses == read(batch)["misses"]["run"].to_pylist()


def test_rows_of_a_deleted_run_folder_are_left_out(batch):
    """A batch of 6 runs has its tables in few files too.

    The folder of run 3 is deleted, these files still have its rows.
    """
    shutil.rmtree(batch / "run003")
    assert set(read(batch)["metrics"]["run"].to_pylist()) == {*RUNS} - {"run003"}


def test_rows_of_a_renewed_run_folder_are_read_from_it(batch):
    """Run 2 is written again, with one row of metrics instead of all; the tables of the batch still have all.

    A summary of another size or time shows that a run was written again.
    """
    run_folder = batch / "run002"
    pq.write_table(pq.read_table(run_folder / "metrics.parquet").slice(0, 1), run_folder / "metrics.parquet")
    summary = json.loads((run_folder / "summary.json").read_text("utf-8"))
    (run_folder / "summary.json").write_text(json.dumps(summary | {"made": "again"}), "utf-8")
    runs = read(batch)["metrics"]["run"].to_pylist()
    assert set(runs) == {*RUNS}
    assert runs.count("run002") == 1 < runs.count("run003")


def test_batch_tables_of_unchanged_runs_are_not_rewritten(batch):
    """A batch of 6 runs has its tables in few files, 2 runs a file; they are written again, with the same settings.

    No file is touched.
    """
    before = times_of_files(batch)
    write_batch_tables(batch, dict.fromkeys(RUNS, "settings"))
    assert before
    assert times_of_files(batch) == before


def test_only_files_of_changed_runs_of_a_batch_are_rewritten(batch):
    """The tables of a batch of 6 runs, 2 runs a file, are three files of each table.

    Without run 5, the last, they are written again: the third file of each table gets another name, others stay.
    """
    before = times_of_files(batch)
    shutil.rmtree(batch / "run005")
    write_batch_tables(batch, dict.fromkeys(RUNS[:-1], "settings"))
    after = times_of_files(batch)
    assert len(before.keys() & after.keys()) == 2 * len(DATA_SET)
    assert len(after) == len(before) == 3 * len(DATA_SET)


PIECES = '{"schema": "vrlab-replay/parts/1", "parts": [%s]}'
UNREADABLE_LISTS = [
    pytest.param("", id="empty"),
    pytest.param("[]", id="another form"),
    pytest.param('{"schema": "vrlab-replay/parts/9", "parts": []}', id="another version"),
    pytest.param(PIECES % '{"stem": "../x", "runs": {}}', id="file outside"),
    pytest.param(PIECES % '{"stem": 1, "runs": {"a": [1]}}', id="number for a name"),
]


@pytest.mark.sampled(5)
@pytest.mark.parametrize("text", UNREADABLE_LISTS)
def test_meaningless_list_of_batch_files_leaves_run_folders(batch, text):
    """``parts.json`` lists the files of a batch's tables; with this text in it, rows are read from the run folders."""
    expected = rows_by_table(read(batch))
    (batch / "batch.tables" / "parts.json").write_text(text, "utf-8")
    assert any(expected.values())
    assert rows_by_table(read(batch)) == expected


def test_damaged_batch_file_leaves_the_run_folders(batch):
    """The file with misses of the first two of 6 runs is cut to 0, 4 or 1000 bytes: they are read from their folders.

    Runs in whole files come first then, so rows are compared in order of runs.
    """
    expected = rows_by_table(read(batch))
    file = first_file_of_misses(batch)
    content = file.read_bytes()
    assert len(content) > 1000
    for length in (0, 4, 1000):
        file.write_bytes(content[:length])
        rows = {name: sorted(table, key=lambda row: row["run"]) for name, table in rows_by_table(read(batch)).items()}
        assert rows == expected, length


def test_batch_rows_naming_a_folder_outside_are_ignored(batch):
    """The first row of a file of the batch's tables says that its run is a folder above: just that row is left out."""
    count_before = read(batch)["misses"].num_rows
    file = first_file_of_misses(batch)
    table = pq.read_table(file)
    runs = pa.array(["../../elsewhere", *table["run"].to_pylist()[1:]], pa.string())
    pq.write_table(table.set_column(table.column_names.index("run"), "run", runs), file)
    assert read(batch)["misses"].num_rows == count_before - 1
