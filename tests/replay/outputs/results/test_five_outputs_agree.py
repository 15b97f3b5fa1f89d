"""Tables, summary, report and picture of one run say the same numbers."""

import json
from itertools import pairwise

import pyarrow.parquet as pq
import pytest
from rerun.chunk import RrdReader
from support.page_cells import Cells

from replay.api.auditor import audit
from replay.outputs.rerun_log.overview import read_moments
from sessions.synthetic import make_analytic

LABELS = ("slow", "collider-sphere")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A ball shot through a wall, audited with two detectors in one run folder."""
    out = tmp_path_factory.mktemp("run") / "run"
    session, _ = make_analytic("ball-ball", seconds=6.0)
    audit(session, detectors="slow=discrete[rate_hz=15],collider[shape=sphere]", out=out)
    return out


@pytest.fixture(scope="module")
def summary(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def lanes(folder):
    return lanes_of(folder)


def lanes_of(folder):
    """Entity -> changes (nanoseconds, state) of every lane of the picture."""
    found = {}
    for chunk in RrdReader(folder / "run.rrd").stream().to_chunks():
        batch = chunk.to_record_batch()
        if "StateChange:state" in batch.schema.names and "session" in batch.schema.names:
            times = batch.column("session").cast("int64").to_pylist()
            states = batch.column("StateChange:state").to_pylist()
            rows = [(ns or 0, state[0]) for ns, state in zip(times, states, strict=True) if state]
            found.setdefault(chunk.entity_path, []).extend(rows)
    return {path: sorted(rows) for path, rows in found.items()}


def test_pair_frames_are_the_same_in_frames_summary_report_and_picture(folder, summary, lanes):
    rows = pq.read_table(folder / "frames.parquet").to_pylist()
    page = Cells((folder / "report.html").read_text(encoding="utf-8")).tables
    frames = {row[0]: row[1:] for row in page["Pair-frames"]}
    step = summary["session"]["median_step"]
    for column, label in enumerate(LABELS):
        told = summary["audit"][label]["pair_frames"]
        for word, name in (("both", "BOTH"), ("missed", "MISSED"), ("false", "INVENTED")):
            counted = sum(row[f"outcome/{label}"] == name for row in rows)
            assert counted == told[name] == int(frames[word][column]), (label, name)
            assert _frames_in(lanes, column, name, step) == counted, (label, name)
    assert summary["audit"]["slow"]["pair_frames"]["MISSED"] > 0
    assert summary["audit"]["slow"]["pair_frames"]["INVENTED"] > 0


def _frames_in(lanes, number, name, step):
    """Frames that the audit lanes of the n-th detector show in one state."""
    below = "/audit/collider-sphere/lanes/" if number else "/lanes/"
    lane = [rows for path, rows in lanes.items() if path.startswith(below) and "1_missed" not in path]
    words = {"BOTH": ("both", "found"), "MISSED": ("missed",), "INVENTED": ("false",)}[name]
    total = 0.0
    for rows in lane:
        spans = [(a, b) for a, b in pairwise(rows) if a[1].lower() in words]
        total += sum((b[0] - a[0]) / 1e9 / step for a, b in spans)
    return round(total)


def test_contacts_are_the_same_in_episodes_summary_and_report(folder, summary):
    rows = pq.read_table(folder / "episodes.parquet").to_pylist()
    page = Cells((folder / "report.html").read_text(encoding="utf-8")).tables
    contacts = {row[0]: row[1:] for row in page["Contacts matched one to one"]}
    for column, label in enumerate(LABELS):
        told = summary["audit"][label]["episodes"]
        mine = [row for row in rows if row["detector"] == label]
        truth = [row for row in rows if row["detector"] == "exact"]
        assert len(mine) == told["found"] == summary["detectors"][label]["contacts"]
        assert len(mine) == int(contacts["contacts reported"][column])
        assert len(truth) == told["truth"] == int(contacts["contacts by the oracle"][column])
        for status, name in (("matched", "matched"), ("invented", "invented"), ("piece", "pieces")):
            words = {"pieces": "further pieces of one contact", "invented": "false"}.get(name, name)
            assert sum(row["status"] == status for row in mine) == told[name] == int(contacts[words][column])
        never = sum(label in row["missed_by"].split(",") for row in truth)
        assert never == told["missed"] == int(contacts["missed whole"][column])
        assert never == summary["audit"][label]["contacts_missed"]
        errors = [row["onset_error"] for row in mine if row["status"] == "matched"]
        assert sum(errors) / len(errors) == pytest.approx(told["onset_error"]["mean"])


def test_misses_and_causes_are_the_same_in_the_table_summary_report_and_picture(folder, summary, lanes):
    rows = pq.read_table(folder / "misses.parquet").to_pylist()
    page = Cells((folder / "report.html").read_text(encoding="utf-8")).tables
    for label in LABELS:
        mine = [row for row in rows if row["detector"] == label]
        told = summary["audit"][label]
        assert len(mine) == told["misses"] == sum(told["causes"]["misses"].values())
        shown = page.get(f"What {label} missed", [])
        assert sorted((int(row[0]), row[4]) for row in shown) == [(row["number"], row["cause"]) for row in mine]
    numbers = {state for _, state in lanes["/lanes/1_missed"] if state}
    slow = [row for row in rows if row["detector"] == "slow"]
    assert slow and len(numbers) <= len(slow) and any(str(slow[0]["number"]) in state for state in numbers)


@pytest.fixture(scope="module")
def between(tmp_path_factory):
    """A ball that passes through a wall within a step, audited with the frames against the way between them."""
    out = tmp_path_factory.mktemp("between") / "run"
    session, _ = make_analytic("fast-ball", seconds=6.0)
    audit(session, detectors="exact", oracle="continuous", out=out)
    return out


def test_misses_between_frames_are_the_same_in_all_five(between):
    summary = json.loads((between / "summary.json").read_text(encoding="utf-8"))
    told = summary["audit"]["exact"]
    page = Cells((between / "report.html").read_text(encoding="utf-8")).tables
    misses = pq.read_table(between / "misses.parquet").to_pylist()
    unseen = [row for row in misses if row["touch"] is not None]
    assert len(unseen) == told["causes"]["misses"]["between frames"] > 2

    frames = pq.read_table(between / "frames.parquet").to_pylist()
    lost = [(row["frame"], row["miss/exact"]) for row in frames if row["outcome/exact"] == "MISSED"]
    assert len(lost) == told["pair_frames"]["MISSED"] == int(dict(page["Pair-frames"])["missed"])
    assert lost == [(frame, row["number"]) for row in misses for frame in range(row["first"], row["last"] + 1)]

    episodes = pq.read_table(between / "episodes.parquet").to_pylist()
    truth = {row["number"]: row for row in episodes if row["detector"] == "continuous"}
    never = [row["number"] for row in truth.values() if row["missed_by"] == "exact"]
    assert len(never) == told["contacts_missed"] == int(dict(page["Contacts matched one to one"])["missed whole"])
    assert never == [row["episode"] for row in misses if row["kind"] == "never found"]

    lanes = lanes_of(between)
    (lane,) = [rows for path, rows in lanes.items() if path.startswith("/lanes/") and "1_missed" not in path]
    step = summary["session"]["median_step"]
    assert round(sum((b[0] - a[0]) / 1e9 / step for a, b in pairwise(lane) if a[1] == "MISSED")) == len(lost)

    places = {one.number: one.session_ns for one in read_moments(between / "run.rrd") if one.kind == "miss"}
    rows = {int(row[0]): row for caption in page if caption.startswith("What exact missed") for row in page[caption]}
    assert sorted(places) == sorted(rows) == [row["number"] for row in misses]
    stamps = dict(
        zip(*pq.read_table(between / "frames.parquet", columns=["frame", "time"]).to_pydict().values(), strict=True)
    )
    for row in unseen:
        assert row["cause"] == rows[row["number"]][4] == "between frames" and row["face_pairs"] == 1
        assert stamps[row["first"]] - step < row["touch"] < stamps[row["first"]]
        assert places[row["number"]] == pytest.approx(row["touch"] * 1e9, abs=2)
        assert float(rows[row["number"]][1]) == pytest.approx(row["touch"], abs=5.1e-4)
