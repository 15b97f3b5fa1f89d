import re

import numpy as np
import pytest
from support.page_cells import Cells

from replay.base.constants import BUDGET_MS
from replay.comparison.outcome import Outcome
from replay.outputs.report.audit_parts import BINS, duration_table, latency_histogram
from replay.pipeline.engine import compute
from replay.pipeline.summary import look_seconds


def test_counts_in_the_page_are_those_of_the_summary(run, page):
    tables = Cells(page).tables
    figures = run.summary["audit"]["slow"]
    frames = dict(tables["Pair-frames"])
    assert int(frames["missed"]) == figures["pair_frames"]["MISSED"] > 0
    assert frames["between frames"] == "not examined"
    contacts = dict(tables["Contacts matched one to one"])
    words = {"truth": "contacts by the oracle", "found": "contacts reported", "missed": "missed whole"}
    words |= {"matched": "matched", "invented": "false", "split": "by the oracle, reported in pieces"}
    for name, told in words.items():
        assert int(contacts[told]) == figures["episodes"][name]
    of_oracle = ("matched", "missed whole", "found only as part of a longer one", "ties, not counted")
    assert sum(int(contacts[told]) for told in of_oracle) == int(contacts["contacts by the oracle"])
    reported = ("matched", "false", "further pieces of one contact", "reported in ties, not counted")
    assert sum(int(contacts[told]) for told in reported) == int(contacts["contacts reported"])


def test_the_map_of_pairs_adds_up_to_the_pair_frames(run, page):
    (rows,) = [rows for caption, rows in Cells(page).tables.items() if caption.startswith("Pair-frames missed of")]
    missed = sum(int(row[1].split(" of ")[0]) for row in rows)
    assert missed == run.comparisons["slow"].count(Outcome.MISSED)
    assert re.search(r'class="heat" style="background:rgba\(255,45,85,0\.\d+\)"', page)


def test_causes_in_the_page_are_those_counted(run, page):
    rows = dict(Cells(page).tables["Causes: misses (pair-frames decided again)"])
    told = run.causes["slow"]
    assert rows["between looks"] == f"{len(run.misses['slow'])} ({told.examined})"
    assert set(rows) == {"between looks", "decided again, of pair-frames missed"}


def check_bars(svg, looks):
    """Bars of one lane stand side by side, one a bin of a log axis, the tallest 10 below its top."""
    edges = np.geomspace(0.9 * looks.min(), 1.1 * max(looks.max(), 1.5 * BUDGET_MS), BINS + 1)
    counts, _ = np.histogram(looks, edges)
    number = r'(\S+)" '
    bars = re.findall(rf'<rect x="{number}y="{number}width="{number}height="{number}[^>]*><title>([^<]*)', svg)
    for (*places, title), k in zip(bars, np.flatnonzero(counts), strict=True):
        x, y, width, height = map(float, places)
        assert (x, width) == (pytest.approx(190 + 910 * k / BINS, abs=0.06), pytest.approx(910 / BINS - 1, abs=0.06))
        assert (y + height, height) == pytest.approx((150, max(2, 140 * counts[k] / counts.max())), rel=1e-4)
        assert title == f"{counts[k]} frames of {edges[k]:.3g} to {edges[k + 1]:.3g} ms"
    assert re.findall(r'y="(\S+)" class="lane"', svg) == ["20"]


def test_every_look_is_in_the_histogram(run, page):
    svg = str(latency_histogram(run))
    counted = [int(count) for count in re.findall(r"<title>(\d+) frames of", svg)]
    assert sum(counted) == len(look_seconds(run.detections["slow"])) and 1 <= len(counted) <= BINS
    assert svg in page
    check_bars(svg, look_seconds(run.detections["slow"]) * 1e3)
    assert not latency_histogram(compute(run.session, detectors="hybrid", offline=True))


def test_step_rates_in_the_page_are_those_of_the_summary(run, page):
    rows = next(rows for caption, rows in Cells(page).tables.items() if "looks at fixed steps miss" in caption)
    told = run.summary["dwell"]
    *rates, (_, _, safe) = rows
    assert [int(now) for _, now, _ in rates] == told["missed_at_this_phase"]
    assert np.allclose([float(mean) for _, _, mean in rates], told["expected_misses"], atol=0.005)
    assert safe == f"{told['none_missed_from_hz']:.1f} Hz"
    assert duration_table(compute(run.session, detectors="hybrid", oracle="none")) is None
