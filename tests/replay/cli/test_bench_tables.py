"""The tables show ratios, digests, where the time goes and how cost grows."""

import pytest
from rich.console import Console

from replay.bench.growth import Growth
from replay.bench.race import Row
from replay.bench.stages import STAGES, Stages
from replay.cli.bench_tables import bench_tables


def sized(where, size, seconds, tests):
    work = {"skipped": 900, "span_tests": tests}
    return Growth(where, "frames", size, 1_000, seconds, work, {"check": seconds / 2, "search": seconds / 4})


@pytest.fixture
def printed():
    rows = [Row("exact", "bool", 5_000, 0.3, 0.1, 23.4, 77, "00c0ffee", 0)]
    spent = [Stages("bench", "bool", 5_000, {name: 0.002 for name in STAGES if name != "faces"})]
    growth = [sized("distant", 5_400, 0.1, 45), sized("distant", 54_000, 0.7, 60), sized("near", 5_400, 0.3, 1_000)]
    figures = {"seed": 8, "frames": 60, "machine": {"system": "Linux", "processor": "Z80", "cores": 2}}
    console = Console(width=140, record=True)
    console.print(bench_tables(rows, spent, growth, figures | {"versions": {"python": "3.11"}}))
    return console.export_text()


def test_machine_ratio_digest_and_stages_are_shown(printed):
    for words in ("seed 8", "Z80, 2 cores", "23.40", "00c0ffee", "in trees", "12.00", "90.0%"):
        assert words in printed


def test_a_growth_row_is_compared_with_the_row_above_it_of_the_same_session_only(printed):
    rows = {tuple(line.split()[:3]): line.split() for line in printed.splitlines() if " frames " in line}
    assert rows["distant", "frames", "54,000"][4:] == [
        "0.7000",
        "7.0",
        "0.3500",
        "0.17500",
        "7.0",
        "60",
        "1.3",
        "90.0%",
    ]
    assert len(rows["distant", "frames", "5,400"]) == len(rows["near", "frames", "5,400"]) == 9
