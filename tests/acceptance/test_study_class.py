"""A class from recordings to its page by one command; its sessions again, killed twice, in two processes and in one."""

import csv
import json
import os
import re

import pytest

from replay import read
from replay.cli.main import main

pytestmark = pytest.mark.slow

STUDENTS = 60


@pytest.fixture(scope="module")
def class_and_seconds(tmp_path_factory):
    """The class, and the processor time of the one command, workers included: the machine may be busy."""
    out = tmp_path_factory.mktemp("study") / "class"
    begun = sum(os.times()[:4])
    assert main(["demo", "--class", str(STUDENTS), "--out", str(out), "--jobs", "2", "-q"]) == 0
    return out, sum(os.times()[:4]) - begun


def test_class_becomes_its_page_in_five_seconds_a_student(class_and_seconds):
    """Students who find tasks easy touch less (planted), and are motivated; near misses go with nothing."""
    out, seconds = class_and_seconds
    print(f"{STUDENTS} students: recorded, replayed and analysed in {seconds:.0f} s of processor time")
    assert seconds < 5.0 * STUDENTS
    report = json.loads((out / "study" / "study.json").read_text("utf-8"))
    assert report["students"] == STUDENTS and report["detector"] == "exact" and report["recall"] == 1.0
    assert {row["detector"] for row in report["sensitivity"]} == {"hull50", "mesh50", "paper"}
    assert all(0.5 < row["recall"] <= 1.0 for row in report["sensitivity"])
    result = {
        (row["predictor"], row["outcome"]): row for row in report["associations"] if row["regression"] == "simple"
    }
    touches = result["ease of use", "unintended_contacts_per_min"]
    assert touches["associated"] and touches["beta"] < 0.0
    assert result["ease of use", "motivation"]["associated"]
    assert not result["near_misses", "motivation"]["associated"]


def test_metrics_count_what_each_student_was_made_to_do(class_and_seconds):
    """``draw_class`` says how often each student touches, nearly touches and grasps."""
    from replay.studies.class_study.synthetic_class import draw_class

    out, _ = class_and_seconds
    rows = {row["student"]: row for row in read(out / "runs")["metrics"].to_pylist() if row["detector"] == "exact"}
    for student in draw_class(STUDENTS):
        row = rows[student.pseudonym]
        assert round(row["contacts_per_min"] * row["valid_minutes"]) == len(student.touches), student
        assert row["near_misses"] == student.near and row["grasps"] == 1


def test_outputs_hold_pseudonyms_and_no_cell_of_fewer_than_five(class_and_seconds):
    """Only links to reports name a student; a summary has no serial number of a tracker (LHR-)."""
    out, _ = class_and_seconds
    names = set(read(out / "runs")["metrics"]["student"].to_pylist())
    assert all(re.fullmatch(r"S\d\d", name) for name in names)
    for file in (out / "study").iterdir():
        # A session is called by its name where a link opens its report, and nowhere else.
        text = re.sub(r'<a href="[^"]*/report\.html[^"]*">S\d\d\b[^<]*</a>', "", file.read_text("utf-8"))
        assert not re.search(r"\bS\d\d\b(?!/report)", text), file.name
    for name in ("associations.csv", "reliability.csv"):
        with (out / "study" / name).open(newline="") as file:
            assert all(int(row["students"]) >= 5 for row in csv.DictReader(file))
    assert not re.search(r"LHR-", (out / "runs" / "S01" / "summary.json").read_text("utf-8"))
