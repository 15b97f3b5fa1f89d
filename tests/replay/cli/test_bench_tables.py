"""The tables show the ratio, the digest and the cost per pair-frame."""

from rich.console import Console

from replay.bench.race import Growth, Row
from replay.cli.bench_tables import bench_tables


def test_ratio_digest_and_growth_are_shown():
    rows = [Row("exact", "bool", 5_000, 0.1, 23.4, 77, "00c0ffee", 0)]
    growth = [Growth("frames", 5_400, 1_000, 1e-4, {"skipped": 900}, {"trees": 1.0, "search": 2.0})]
    figures = {"seed": 8, "frames": 60, "machine": {"system": "Linux", "processor": "x", "cores": 2}}
    console = Console(width=120, record=True)
    console.print(bench_tables(rows, growth, figures | {"versions": {"python": "3.11"}}))
    printed = console.export_text()
    for words in ("seed 8", "23.4", "00c0ffee", "100", "90%", "search"):
        assert words in printed
