"""A class from recordings to its page by one command; its sessions again, killed twice, in two processes and in one."""

import csv
import json
import os
import re

import pytest

from replay import read
from replay.cli.console import EXIT_OK
from replay.cli.main import main

pytestmark = pytest.mark.slow

STUDENTS = 60


@pytest.fixture(scope="module")
def class_and_seconds(tmp_path_factory):
    """The folder of a made-up class of 60 students, made, replayed and analysed by one command.

    Also the seconds of processor time of the command, workers included: the machine may be busy.
    """
    out = tmp_path_factory.mktemp("study") / "class"
    before = sum(os.times()[:4])
    assert main(["demo", "--class", str(STUDENTS), "--out", str(out), "--jobs", "2", "-q"]) == EXIT_OK
    return out, sum(os.times()[:4]) - before


def test_class_becomes_its_page_in_five_seconds_a_student(class_and_seconds):
    """Recording, replay and analysis of 60 made-up students by one command in 300 s of processor time."""
    _, seconds = class_and_seconds
    print(f"{STUDENTS} students: recorded, replayed and analysed in {seconds:.0f} s of processor time")
    assert seconds < 5.0 * STUDENTS


def test_study_compares_the_reference_with_three_detectors(class_and_seconds):
    """60 made-up students: ``exact`` finds all contacts; three detectors find more than half of them.

    They are hulls and meshes at 50 Hz, and "paper", which is hybrid-qaco.
    """
    out, _ = class_and_seconds
    report = json.loads((out / "study" / "study.json").read_text("utf-8"))
    assert report["students"] == STUDENTS
    assert report["detector"] == "exact" and report["recall"] == 1.0
    assert {row["detector"] for row in report["sensitivity"]} == {"hull50", "mesh50", "paper"}
    assert all(0.5 < row["recall"] <= 1.0 for row in report["sensitivity"])


def test_study_finds_the_planted_associations(class_and_seconds):
    """60 made-up students: those who find tasks easy touch less (-0.6 in the model) and are motivated (0.6).

    Near misses go with nothing.
    """
    out, _ = class_and_seconds
    report = json.loads((out / "study" / "study.json").read_text("utf-8"))
    association = {
        (row["predictor"], row["outcome"]): row for row in report["associations"] if row["regression"] == "simple"
    }
    touches = association["ease of use", "unintended_contacts_per_min"]
    assert touches["associated"] and touches["beta"] < 0.0
    assert association["ease of use", "motivation"]["associated"]
    assert not association["near_misses", "motivation"]["associated"]


def test_metrics_count_what_each_student_was_made_to_do(class_and_seconds):
    """``draw_class`` says how often each student of the made-up class touches and nearly touches; each grasps once.

    Contact with a glass that is grasped counts as no contact, and coming near as no near miss where it ends in a touch.
    """
    from replay.studies.class_study.synthetic_class import draw_class

    out, _ = class_and_seconds
    rows = {row["student"]: row for row in read(out / "runs")["metrics"].to_pylist() if row["detector"] == "exact"}
    students = draw_class(STUDENTS)
    assert len(students) == STUDENTS
    for student in students:
        row = rows[student.pseudonym]
        assert round(row["contacts_per_min"] * row["valid_minutes"]) == len(student.touches), student
        assert row["near_misses"] == student.near
        assert row["grasps"] == 1


def test_pages_of_a_study_name_students_only_in_links(class_and_seconds):
    """Pseudonyms are S and two digits. A session is called by its name where a link opens its report, nowhere else."""
    out, _ = class_and_seconds
    names = set(read(out / "runs")["metrics"]["student"].to_pylist())
    assert len(names) == STUDENTS and all(re.fullmatch(r"S\d\d", name) for name in names)
    files = [*(out / "study").iterdir()]
    assert files
    for file in files:
        text = re.sub(r'<a href="[^"]*/report\.html[^"]*">S\d\d\b[^<]*</a>', "", file.read_text("utf-8"))
        assert not re.search(r"\bS\d\d\b(?!/report)", text), file.name


@pytest.mark.parametrize("name", ["associations.csv", "reliability.csv"])
def test_tables_of_a_study_have_five_students_a_row(class_and_seconds, name):
    """A class of 60: every row is of five students at least; of fewer, a figure could lead to one of them."""
    out, _ = class_and_seconds
    with (out / "study" / name).open(newline="") as file:
        students = [int(row["students"]) for row in csv.DictReader(file)]
    assert students and min(students) >= 5
