import json

import pyarrow.parquet as pq
import pytest

from replay.errors import OutputError
from replay.tradeoff.output import check_tradeoff_target, title_of, write_tradeoff_folder
from replay.tradeoff.settings import Setting
from replay.tradeoff.trading import tradeoff


@pytest.fixture(scope="module")
def done(bumped):
    return tradeoff(bumped, settings=[Setting("hybrid", "as it comes", ""), Setting("static", "as it comes", "")])


def test_table_and_json_say_the_same(done, tmp_path):
    out = write_tradeoff_folder(done, tmp_path / "costs")
    assert sorted(path.name for path in out.iterdir()) == [
        "tradeoff.json", "tradeoff.parquet", "tradeoff.png", "tradeoff.svg",
    ]  # fmt: skip
    told = json.loads((out / "tradeoff.json").read_text("utf-8"))
    rows = [{**row, "work": json.loads(row["work"])} for row in pq.read_table(out / "tradeoff.parquet").to_pylist()]
    assert rows == told["rows"] == list(done.rows)
    assert told["machine"]["cores"] >= 1 and "contacts" in title_of(done)


def test_a_folder_is_replaced_only_when_it_is_ours_and_asked_for(done, tmp_path):
    out = write_tradeoff_folder(done, tmp_path / "costs")
    with pytest.raises(OutputError, match="--force"):
        check_tradeoff_target(out)
    write_tradeoff_folder(done, out, force=True)
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="something else"):
        check_tradeoff_target(other, force=True)
    with pytest.raises(OutputError, match="is a file"):
        check_tradeoff_target(other / "thesis.txt")
    assert [path.name for path in tmp_path.iterdir() if "partial" in path.name] == []
