"""A class from recordings to its page by one command; its sessions again, killed twice, in two processes and in one."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time

import pyarrow.parquet as pq
import pytest

from replay.api.batch import run_batch
from replay.cli.main import main

pytestmark = pytest.mark.slow

STUDENTS = 60
SETTINGS = {"detectors": "hybrid", "oracle": "none", "picture": False}

SCRIPT = f"""
import sys
from pathlib import Path
from replay.api.batch import run_batch
if __name__ == "__main__":
    batch = run_batch(sorted(Path(sys.argv[1]).glob("*.mcap")), Path(sys.argv[2]), jobs=2, settings={SETTINGS!r})
    print(batch.digest, len(batch.kept), len(batch.failed))
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The class, and the seconds that the one command took."""
    out = tmp_path_factory.mktemp("study") / "class"
    begun = time.monotonic()
    assert main(["demo", "--class", str(STUDENTS), "--out", str(out), "--jobs", "2", "-q"]) == 0
    return out, time.monotonic() - begun


def test_a_class_of_sixty_becomes_its_page_in_under_five_minutes(made):
    out, seconds = made
    print(f"{STUDENTS} students: recorded, replayed and analysed in {seconds:.0f} s")
    assert seconds < 300.0
    report = json.loads((out / "study" / "study.json").read_text("utf-8"))
    assert report["students"] == STUDENTS and report["detector"] == "exact" and report["recall"] == 1.0
    assert {row["detector"] for row in report["sensitivity"]} == {"22.5Hz"}
    assert all(0.5 < row["recall"] < 1.0 for row in report["sensitivity"])
    found = {(row["predictor"], row["outcome"]): row for row in report["associations"] if row["regression"] == "simple"}
    touches = found["ease of use", "unintended_contacts_per_min"]
    assert touches["associated"] and touches["beta"] < 0.0
    assert found["ease of use", "motivation"]["associated"]
    assert not found["near_misses", "motivation"]["associated"]


def test_metrics_count_what_each_student_was_made_to_do(made):
    from replay.studies.class_study.synthetic_class import draw_class

    out, _ = made
    rows = {
        row["student"]: row for row in pq.read_table(out / "metrics.parquet").to_pylist() if row["detector"] == "exact"
    }
    for student in draw_class(STUDENTS):
        row = rows[student.pseudonym]
        assert round(row["contacts_per_min"] * row["valid_minutes"]) == len(student.touches), student
        assert row["near_misses"] == student.near and row["grasps"] == 1


def test_outputs_hold_pseudonyms_and_no_cell_of_fewer_than_five(made):
    out, _ = made
    names = set(pq.read_table(out / "metrics.parquet")["student"].to_pylist())
    assert all(re.fullmatch(r"S\d\d", name) for name in names)
    for file in (out / "study").iterdir():
        text = re.sub(r'<td class="word"><a href="[^"]*/report.html">S\d\d</a></td>', "", file.read_text("utf-8"))
        assert not re.search(r"\bS\d\d\b(?!/report)", text), file.name
    for name in ("associations.csv", "reliability.csv"):
        with (out / "study" / name).open(newline="") as file:
            assert all(int(row["students"]) >= 5 for row in csv.DictReader(file))
    assert not re.search(r"LHR-", (out / "runs" / "S01" / "summary.json").read_text("utf-8"))


def finished(runs):
    return len([path for path in runs.glob("*/summary.json") if not path.parent.name.startswith(".")])


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")
def test_sixty_sessions_killed_twice_end_with_the_digest_of_one_process(made, tmp_path):
    sessions, runs = made[0] / "sessions", tmp_path / "runs"
    script = tmp_path / "go.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), str(sessions), str(runs)]
    for least in (10, 30):
        batch = subprocess.Popen(command)
        limit = time.monotonic() + 300
        while finished(runs) < least and time.monotonic() < limit:
            assert batch.poll() is None, "the batch ended before it could be killed"
            time.sleep(0.05)
        os.kill(batch.pid, signal.SIGKILL)
        batch.wait()
        assert finished(runs) < STUDENTS
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    digest, kept, failed = done.stdout.split()
    assert int(kept) >= 30 and failed == "0"
    assert not list(runs.glob(".*.partial"))
    alone = run_batch(sorted(sessions.glob("*.mcap")), tmp_path / "alone", settings=SETTINGS)
    assert alone.digest == digest != ""
