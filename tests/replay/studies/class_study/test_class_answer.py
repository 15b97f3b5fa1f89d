"""The first answers about a class: recounted, true with and without a questionnaire, and quiet about few students."""

import re
from collections import Counter
from dataclasses import replace
from html import unescape

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.study_samples import a_class, codebook, made_class, questionnaire

from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.class_answer import CAUSES, class_answer, least_association, students_needed
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import ClassTables, places
from replay.studies.class_study.page import study_html

STUDENTS = 20


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    return read_class(made_class(tmp_path_factory.mktemp("class") / "runs", STUDENTS, STUDENTS))


@pytest.fixture(scope="module")
def study(runs):
    answers, _ = a_class(STUDENTS, seed=1, slope=0.7)
    answered = questionnaire(answers)
    answered.index = [f"S{k:03d}" for k in range(STUDENTS)]
    return analyse(codebook((("motivation", "contacts_per_min"),)), answered, runs.as_metrics())


def rows_of(runs, study, folder):
    return {row.name: row for row in class_answer(ClassTables(runs), places(runs, folder), study)}


@pytest.mark.parametrize("questioned", [True, False])
def test_page_answers_seven_headings_in_their_order(runs, study, tmp_path, questioned):
    page = study_html(runs, places(runs, tmp_path), study if questioned else None)
    names = ["What", "When", "Why", "Do", "Cost", "Or", "Sure"]
    assert re.findall(r"<dt>(\w+)</dt>", page) == [name for name in names if questioned or name != "Or"]
    text = unescape(re.sub(r"<[^>]*>", "", page[page.index("<dl>") : page.index("</dl>")]))
    assert ("there is no questionnaire" in text) == (not questioned)
    assert "Count contacts with exact" in text


def test_cause_of_each_detector_is_its_most_frequent_one(runs, study, tmp_path):
    counted = Counter()
    for file in runs.top.glob("*/misses.parquet"):
        rows = pq.read_table(file).to_pylist()
        counted.update((row["detector"], row["cause"]) for row in rows if not row["held"])
    row = rows_of(runs, study, tmp_path)["Why"]
    why = f"{row.text} {row.figures} {row.details}"
    for label in runs.audited:
        counts = {cause: count for (own, cause), count in counted.items() if own == label}
        most = {cause for cause, count in counts.items() if count == max(counts.values())}
        printed = re.findall(
            rf"{label} is wrong(?: because|:) (.*?) \((most|\d+ of \d+) missed or late contacts\)", why
        )
        assert {text for text, _ in printed} == {CAUSES.get(cause, cause) for cause in most}
        share = f"{max(counts.values())} of {sum(counts.values())}"
        assert {count for _, count in printed} <= {share, "most"}


def test_first_sessions_lead_to_their_miss(runs, study, tmp_path):
    links = rows_of(runs, study, tmp_path)["When"].links
    assert 1 <= len(links) <= 3
    for text, address in links:
        assert re.fullmatch(r"S\d{3}: \S+ - \S+ at [\d.]+ s", text) and "report.html#miss-" in address


def test_a_cause_of_fewer_than_five_students_is_not_named(tmp_path):
    few = read_class(made_class(tmp_path / "runs", 4, 4))
    rows = rows_of(few, None, tmp_path)
    assert "Why" not in rows and "misses" not in rows["What"].details and "fewer than 5 students" in rows["Sure"].text


def test_changing_detectors_are_named_as_such(runs, study, tmp_path):
    changed = [study.sensitivity[0]] + [replace(row, after=associated(row.after)) for row in study.sensitivity[1:]]
    assert [row.changes for row in changed] == [False, True]
    rows = rows_of(runs, replace(study, sensitivity=tuple(changed)), tmp_path)
    detector = changed[1].detector
    counts = ClassTables(runs).mistakes(detector)
    assert rows["Why"].text == (
        f"{detector} leads to another conclusion: it missed {counts.missed} of {counts.contacts} contacts, was late or "
        f"cut short in {counts.late_or_cut_short} and reported {counts.false_contacts} false contacts."
    )
    assert changed[0].detector in rows["Or"].text and detector not in rows["Or"].text
    every = replace(study, sensitivity=tuple(replace(row, after=associated(row.after)) for row in study.sensitivity))
    assert rows_of(runs, every, tmp_path)["Or"].text.startswith("None: every other detector")


def associated(finding):
    return replace(finding, beta=0.7, low=0.4, high=0.9, p=0.001, p_holm=0.001)


def test_why_counts_mistakes_that_changed_no_conclusion(runs, study, tmp_path):
    moved = rows_of(runs, study, tmp_path)["Why"].text
    assert moved.endswith("too few for an association below 0.59; the detectors' mistakes changed no conclusion.")
    same = replace(study, sensitivity=tuple(replace(row, after=row.before) for row in study.sensitivity))
    unmoved = rows_of(runs, same, tmp_path)["Why"]
    assert unmoved.text.startswith(f"{STUDENTS} students are too few ") and unmoved.text.endswith("moved no result.")
    wrong, contacts = Counter(), 0
    for folder in runs.top.glob("*/"):
        misses = pq.read_table(folder / "misses.parquet").to_pylist()
        wrong.update(
            detector for detector, _ in {(row["detector"], row["episode"]) for row in misses if not row["held"]}
        )
        contacts += sum(not row["held"] for row in pq.read_table(folder / "episodes.parquet").to_pylist())
    (first, most), (second, fewer) = wrong.most_common()
    assert f"no result: {first} got {most} of {contacts} contacts wrong, {second} {fewer}. " in unmoved.figures
    first, *others = same.coefficients
    some = rows_of(runs, replace(same, coefficients=(associated(first), *others)), tmp_path)["Why"]
    assert some.text.startswith("The detectors' mistakes moved no result: ")


def test_students_needed_stand_below_do_only_without_an_association(runs, study, tmp_path):
    rows = rows_of(runs, study, tmp_path)
    assert rows["Do"].text == "Count contacts with exact; to find an association of 0.3, take 85 students."
    assert "85" not in rows["Sure"].figures
    first, *others = study.coefficients
    some = rows_of(runs, replace(study, coefficients=(associated(first), *others)), tmp_path)
    assert some["Do"].text == "Count contacts with exact." and "takes 85 students" in some["Sure"].figures
    assert "take" not in rows_of(runs, replace(study, students=85), tmp_path)["Do"].text


def test_recommended_detector_is_the_reference_though_another_counts(runs, study, tmp_path):
    do = rows_of(runs, replace(study, detector="slow"), tmp_path)["Do"]
    assert do.text.startswith("Count contacts with exact") and do.figures.endswith("is counted with slow.")


def test_detector_that_counts_is_not_blamed_for_a_change(runs, study, tmp_path):
    exact = replace(study.sensitivity[0], detector="exact", recall=1.0)
    changed = replace(study, detector="slow", sensitivity=(replace(exact, after=associated(exact.after)),))
    assert rows_of(runs, changed, tmp_path)["Why"].text.startswith("slow, which counts here, missed ")
    same = rows_of(runs, replace(study, detector="slow", sensitivity=(replace(exact, after=exact.before),)), tmp_path)
    assert "Or" not in same, "the reference stands below Do"


@pytest.mark.parametrize("students", [20, 24, 100])
def test_least_association_is_found_in_four_of_five_samples(students):
    """Pearson correlations of drawn students, judged by Fisher's transformation at 5 %, both sides."""
    least = least_association(students)
    random = np.random.default_rng(students)
    first, rest = random.normal(size=(2, 20_000, students))
    second = least * first + np.sqrt(1.0 - least**2) * rest
    first, second = (values - values.mean(axis=1, keepdims=True) for values in (first, second))
    sums = (first * second).sum(axis=1), (first**2).sum(axis=1), (second**2).sum(axis=1)
    correlations = sums[0] / np.sqrt(sums[1] * sums[2])
    significant = np.abs(np.arctanh(correlations)) * np.sqrt(students - 3) > 1.96
    assert significant.mean() == pytest.approx(0.8, abs=0.03)
    assert least_association(19) is None
    assert students_needed(least) == students or students_needed(least) == students + 1


def test_power_is_said_where_a_questionnaire_was_tested(runs, study, tmp_path):
    sure = rows_of(runs, study, tmp_path)["Sure"]
    assert sure.text == f"Not very: {STUDENTS} students show only associations above 0.59 reliably."
    assert rows_of(runs, replace(study, students=100), tmp_path)["Sure"].text.startswith("100 students show only ")
    assert "reliably" not in rows_of(runs, None, tmp_path)["Sure"].text


@pytest.mark.parametrize(("slow_ms", "least"), [(0.02, True), (0.01001, False), (0.005, False)])
def test_cost_calls_the_recommended_detector_least_only_where_measured(runs, study, tmp_path, slow_ms, least):
    times = {"exact": 0.01, "slow": slow_ms, "coarse": 0.03}
    metrics = runs.every_metric
    milliseconds = pa.array([times[label] for label in metrics["detector"].to_pylist()])
    if "mean_ms" in metrics.column_names:
        metrics = metrics.drop_columns(["mean_ms"])
    timed = replace(runs, every_metric=metrics.append_column("mean_ms", milliseconds))
    text = rows_of(timed, study, tmp_path)["Cost"].text
    takes = f"exact takes 0.01 ms a frame{', less than every other detector' if least else ''}."
    assert text == f"{85 - STUDENTS} more students; counting with {takes}"
    enough = rows_of(timed, replace(study, students=85), tmp_path)["Cost"].text
    assert enough == takes
