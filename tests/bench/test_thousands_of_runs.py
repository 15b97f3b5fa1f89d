"""Cost of reading thousands of sessions back, and of their class page: the tables of one run under many names.

``python -m pytest -m bench -s tests/bench/test_thousands_of_runs.py`` asks it of 4,000; ``RUNS=100000`` of more.
"""

import json
import os
import subprocess
import sys

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.processes import environment

import replay
from replay.show.results.data_set import DATA_SET, write_batch_tables

RUNS = int(os.environ.get("RUNS", "4000"))
STUDENTS = 800
SECONDS, MEGABYTES = 5.0, 300.0
LINEUP = ["hull50=collider[shape=hull,rate_hz=50]", "mesh50=collider[shape=mesh,rate_hz=50]", "paper=hybrid-qaco"]

MEASURED = """
import json, sys, time
begun, worked = time.monotonic(), time.process_time()
{work}
with open("/proc/self/status") as status:
    peak = next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1024
print(json.dumps([time.monotonic() - begun, time.process_time() - worked, peak, rows]))
"""
READ = "import replay; rows = sum(table.num_rows for table in replay.read(sys.argv[1]).values())"
PAGE = """
from replay.cli.main import main
rows = main(["study", "page", sys.argv[1], "-o", sys.argv[2], "-q", "--format", "json"])
"""


def measured(work, *words):
    """Seconds by the clock and of the processor, and the largest memory (MB) of a program, with what it says."""
    script = MEASURED.format(work=work)
    done = subprocess.run([sys.executable, "-c", script, *words], env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


def named(table, number):
    """The rows of a run as those of the session and the student of this number."""
    for column, value in (("session", f"{number:016x}"), ("student", f"S{number % STUDENTS:04d}")):
        values = pa.array([value] * len(table), pa.string())
        table = table.set_column(table.column_names.index(column), column, values)
    return table


@pytest.mark.bench
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="peak memory is read from /proc")  # noqa: PTH110
def test_thousands_of_sessions_are_read_in_seconds_and_little_memory(tmp_path):
    """Copies of one run under other names; reading the data set, and the page of the class."""
    session, _ = replay.synthetic_session("bench-bumps")
    run = tmp_path / "run"
    replay.run(session, detectors=LINEUP, out=run, picture=False)
    tables = {file: pq.read_table(run / file) for file, *_ in DATA_SET.values()}
    summary = json.loads((run / "summary.json").read_text("utf-8"))
    names = [f"s{number:06d}" for number in range(RUNS)]
    for number, name in enumerate(names):
        folder = tmp_path / "runs" / name
        folder.mkdir(parents=True)
        for file, table in tables.items():
            pq.write_table(named(table, number), folder / file, compression="zstd")
        (folder / "summary.json").write_text(json.dumps(summary | {"request": name}), "utf-8")
    write_batch_tables(tmp_path / "runs", {name: name for name in names})
    wall, seconds, peak, rows = measured(READ, str(tmp_path / "runs"))
    print(f"\n{RUNS:,} runs, {rows:,} rows: read in {seconds:.1f} s of the processor ({wall:.1f} s), {peak:.0f} MB")
    page_wall, page_seconds, page_peak, code = measured(PAGE, str(tmp_path / "runs"), str(tmp_path / "page"))
    print(f"class page: {page_seconds:.1f} s of the processor ({page_wall:.1f} s), {page_peak:.0f} MB")
    assert code == 0 and rows > 100 * RUNS
    if RUNS <= 4000:
        assert max(seconds, page_seconds) < SECONDS and max(peak, page_peak) < MEGABYTES
