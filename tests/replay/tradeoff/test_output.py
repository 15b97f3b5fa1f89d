import json

import pyarrow.parquet as pq

from replay.tradeoff.output import title_of, tradeoff_files, write_tradeoff
from replay.tradeoff.settings import Setting
from replay.tradeoff.trading import tradeoff


def test_table_and_json_say_the_same(bumped, tmp_path):
    done = tradeoff(bumped, settings=[Setting(name, "as it comes", "") for name in ("hybrid", "static")])
    write_tradeoff(done, tmp_path)
    names = ["tradeoff-dark.png", "tradeoff.json", "tradeoff.parquet", "tradeoff.png", "tradeoff.svg"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    told = json.loads((tmp_path / "tradeoff.json").read_text("utf-8"))
    table = pq.read_table(tmp_path / "tradeoff.parquet").to_pylist()
    assert [{**row, "work": json.loads(row["work"])} for row in table] == told["rows"] == list(done.rows)
    assert told["machine"]["cores"] >= 1 and "2 contacts" in title_of(done)
    with tradeoff_files(done) as files:
        assert sorted(files) == names and all(path.is_file() for path in files.values())
    assert not any(path.exists() for path in files.values())
