"""Cost of reading thousands of sessions back, and of their class page: the tables of one run under many names.

``python -m pytest -m bench -s tests/bench/test_thousands_of_runs.py`` asks it of 4,000; ``RUNS=100000`` of more.
"""

import json
import os
import subprocess
import sys
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.processes import environment

import replay
from replay.show.results.data_set import DATA_SET, write_batch_tables

RUNS = int(os.environ.get("RUNS", "4000"))
STUDENTS = 800
MOST_SECONDS, MOST_MEGABYTES = 5.0, 300.0
"""Processor time and memory of a program that reads 4,000 runs."""
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


class Measured(NamedTuple):
    """Seconds by the clock and of the processor, largest memory, and what a program says in ``rows``."""

    wall_s: float
    processor_s: float
    megabytes: float
    rows: int


def measured(work, *arguments):
    """Measurements of a program of its own that runs some lines of code."""
    script = MEASURED.format(work=work)
    ended = subprocess.run(
        [sys.executable, "-c", script, *arguments], env=environment(), capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr[-3000:]
    return Measured(*json.loads(ended.stdout.splitlines()[-1]))


def named(table, number):
    """The rows of a run as those of the session and the student of this number."""
    for column, value in (("session", f"{number:016x}"), ("student", f"S{number % STUDENTS:04d}")):
        values = pa.array([value] * len(table), pa.string())
        table = table.set_column(table.column_names.index(column), column, values)
    return table


@pytest.mark.bench
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="peak memory is read from /proc")  # noqa: PTH110
def test_thousands_of_sessions_are_read_in_seconds_and_little_memory(tmp_path):
    """The tables of one run are written RUNS times, under other names of session and student, 800 of these.

    A program reads all rows, more than 100 a run, another makes the page of the class: each within 5 s of the
    processor and 300 MB (MOST_SECONDS, MOST_MEGABYTES), where there are no more than 4,000 runs.
    """
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

    read = measured(READ, str(tmp_path / "runs"))
    print(f"\n{RUNS:,} runs, {read.rows:,} rows: read in {read.processor_s:.1f} s of the processor", end="")
    print(f" ({read.wall_s:.1f} s), {read.megabytes:.0f} MB")
    page = measured(PAGE, str(tmp_path / "runs"), str(tmp_path / "page"))
    print(f"class page: {page.processor_s:.1f} s of the processor ({page.wall_s:.1f} s), {page.megabytes:.0f} MB")
    exit_code_of_page = page.rows
    assert exit_code_of_page == 0
    assert read.rows > 100 * RUNS
    if RUNS <= 4000:
        assert max(read.processor_s, page.processor_s) < MOST_SECONDS
        assert max(read.megabytes, page.megabytes) < MOST_MEGABYTES
