"""What the tradeoff promises on bench-bumps, recomputed from the written table by code that shares nothing with it."""

import json
from time import process_time

import pyarrow.parquet as pq
import pytest

from replay.outputs.report.tradeoff import write_tradeoff
from replay.tradeoffs.settings import settings_list
from replay.tradeoffs.sweep import TIME_LIMIT, tradeoff
from sessions.synthetic.bench_bumps import make_bench_bumps

pytestmark = pytest.mark.slow

MINUTES = 3.0

HEAD = 42
"""Settings tried, without a limit on the clock: what a busy machine does not get to must not decide."""

AGAIN = 0.4
"""Seconds; whatever takes longer is tried again with one setting of each detector only."""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Rows and JSON of the files, and the seconds that this process was at work: others on the machine cost none."""
    folder = tmp_path_factory.mktemp("costs")
    session, _ = make_bench_bumps()
    began = process_time()
    write_tradeoff(tradeoff(session, settings=settings_list()[:HEAD], repeats=1, time_limit=None), folder)
    seconds = process_time() - began
    told = json.loads((folder / "tradeoff.json").read_text("utf-8"))
    return pq.read_table(folder / "tradeoff.parquet").to_pylist(), told, seconds


def test_there_are_30_points_and_a_front(written):
    rows, told, _ = written
    points = [row for row in rows if row["detector"] != told["oracle"]]
    assert len(points) >= 30 and told["front"] and all(row["passes"] >= 1 for row in rows), len(points)


def test_a_second_run_gives_the_same_recalls_bit_for_bit(written):
    rows, _, _ = written
    session, _ = make_bench_bumps()
    first_of = {row["detector"]: row["label"] for row in reversed(rows)}
    tried = {row["label"] for row in rows if row["seconds"] < AGAIN} | set(first_of.values())
    settings = [one for one in settings_list() if one.label in tried]
    again = tradeoff(session, settings=settings, repeats=1, time_limit=None)
    by_label = {row["label"]: row for row in again.rows}
    assert set(by_label) == tried and not again.cut and {row["detector"] for row in again.rows} == set(first_of)
    for one in (row for row in rows if row["label"] in tried):
        two = by_label[one["label"]]
        for key in ("label", "recall", "precision", "face_recall", "digest"):
            assert one[key] == two[key], (one["label"], key)


def test_points_and_front_are_found_within_a_limit_that_ends_in_three_minutes(written):
    rows, told, seconds = written
    assert seconds < TIME_LIMIT < 60 * MINUTES and len(rows) == HEAD and not told["cut"]
