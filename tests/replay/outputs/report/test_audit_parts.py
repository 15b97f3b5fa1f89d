import numpy as np
from support.page_cells import Cells

from replay.outputs.report.audit_parts import duration_table
from replay.pipeline.engine import compute


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


def test_causes_in_the_page_are_those_counted(run, page):
    rows = dict(Cells(page).tables["Causes: misses (pair-frames decided again)"])
    told = run.causes["slow"]
    assert rows["between looks"] == f"{len(run.misses['slow'])} ({told.examined})"
    assert set(rows) == {"between looks", "decided again, of pair-frames missed"}


def test_step_rates_in_the_page_are_those_of_the_summary(run, page):
    rows = next(rows for caption, rows in Cells(page).tables.items() if "looks at fixed steps miss" in caption)
    told = run.summary["dwell"]
    *rates, (_, _, safe) = rows
    assert [int(now) for _, now, _ in rates] == told["missed_at_this_phase"]
    assert np.allclose([float(mean) for _, _, mean in rates], told["expected_misses"], atol=0.005)
    assert safe == f"{told['none_missed_from_hz']:.1f} Hz"
    assert duration_table(compute(run.session, detectors="hybrid", oracle="none")) is None
