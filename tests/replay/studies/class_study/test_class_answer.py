"""The first answers about a class: recounted, true with and without a questionnaire, and quiet about few students."""

import re
from collections import Counter, defaultdict
from dataclasses import replace
from html import unescape

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.study_samples import a_class, codebook, made_class, questionnaire

from replay import words
from replay.auditing.fault import FaultKind
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.class_answer import MOST_REFUSED, class_answer
from replay.studies.class_study.class_reasons import CAUSE_CLAUSES
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import ClassTables, places
from replay.studies.class_study.page import study_html
from replay.studies.class_study.power import least_correlation, students_needed
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import ACCEPTABLE_ALPHA

STUDENTS = 20


@pytest.fixture(scope="module")
def class_runs(tmp_path_factory):
    """Run folders of a class, one of each student."""
    return read_class(made_class(tmp_path_factory.mktemp("class") / "runs", sessions=STUDENTS, students=STUDENTS))


@pytest.fixture(scope="module")
def class_study(class_runs):
    """Whether contacts a minute go with motivation in the class, all scales reliable."""
    answers, _ = a_class(STUDENTS, seed=1, slope=0.7)
    answered = questionnaire(answers)
    answered.index = [f"S{k:03d}" for k in range(STUDENTS)]
    made = analyse(codebook((("motivation", "contacts_per_min"),)), answered, class_runs.as_metrics())
    return replace(made, reliabilities={name: replace(own, alpha=0.8) for name, own in made.reliabilities.items()})


def answer_rows(runs, study, folder):
    """Name -> row of the answer of a class."""
    return {row.name: row for row in class_answer(ClassTables(runs), places(runs, folder), study)}


@pytest.mark.parametrize("questioned", [True, False])
def test_class_page_has_its_seven_headings_in_order(class_runs, class_study, tmp_path, questioned):
    """``questioned``: there is a questionnaire; without it nothing can be said under Or."""
    page = study_html(class_runs, places(class_runs, tmp_path), class_study if questioned else None)
    names = ["What", "When", "Why", "Do", "Cost", "Or", "Sure"]
    assert re.findall(r"<dt>(\w+)</dt>", page) == [name for name in names if questioned or name != "Or"]
    text = unescape(re.sub(r"<[^>]*>", "", page[page.index("<dl>") : page.index("</dl>")]))
    assert ("there is no questionnaire" in text) == (not questioned)
    assert "Count contacts with the detector exact" in text


def test_class_answer_names_the_most_frequent_cause_per_detector(class_runs, class_study, tmp_path):
    """Causes are counted again from the files of the runs."""
    counted, students = Counter(), defaultdict(set)
    for file in class_runs.top.glob("*/misses.parquet"):  # a run is of one student
        for row in pq.read_table(file).to_pylist():
            if not row["held"]:
                counted[row["detector"], row["cause"]] += 1
                students[row["detector"], row["cause"]].add(file.parent.name)
    row = answer_rows(class_runs, class_study, tmp_path)["Why"]
    why = f"{row.text} {row.figures} {row.details}"
    for label in class_runs.audited_detectors:
        counts = {cause: count for (own, cause), count in counted.items() if own == label}
        most = {cause for cause, count in counts.items() if count == max(counts.values())}
        printed = re.findall(
            rf"{label} is wrong(?: because|:) (.*?) \((most|\d+ of \d+) missed or late contacts\)", why
        )
        assert {text for text, _ in printed} == {CAUSE_CLAUSES.get(cause, cause) for cause in most}
        has_small_cell = any(len(students[label, cause]) < 5 for cause in counts)
        share = "most" if has_small_cell else f"{max(counts.values())} of {sum(counts.values())}"
        assert {count for _, count in printed} == {share}


def test_first_sessions_lead_to_their_miss(class_runs, class_study, tmp_path):
    """A link has student, pair and second, and leads to a miss in the report of the session."""
    links = answer_rows(class_runs, class_study, tmp_path)["When"].links
    assert 1 <= len(links) <= 3
    for text, address in links:
        assert re.fullmatch(r"S\d{3}: \S+ - \S+ at [\d.]+ s", text) and "report.html#miss-" in address


def test_class_answer_names_the_pair_once_for_all_examples(tmp_path):
    """Only misses of beaker and burette are left of six students."""
    runs = read_class(made_class(tmp_path / "runs", sessions=6, students=6))
    kept = [row["body_a"] == "beaker" for row in runs.tables["misses"].to_pylist()]
    single = replace(runs, tables=runs.tables | {"misses": runs.tables["misses"].filter(pa.array(kept))})
    row = answer_rows(single, study=None, folder=tmp_path)["When"]
    assert row.figures.startswith("All are of the pair beaker - burette. ")
    assert all(re.fullmatch(r"S\d{3} at [\d.]+ s", text) for text, _ in row.links)


def test_a_cause_of_fewer_than_five_students_is_not_named(tmp_path):
    """Four students: no cause, no count of misses, and a sentence that says why."""
    few = read_class(made_class(tmp_path / "runs", sessions=4, students=4))
    rows = answer_rows(few, study=None, folder=tmp_path)
    assert "Why" not in rows and "misses" not in rows["What"].details and "fewer than 5 students" in rows["Sure"].text


def test_changing_detectors_are_named_as_such(class_runs, class_study, tmp_path):
    """The association holds with the second detector alone; at last with every one."""
    changed = [class_study.sensitivity[0]] + [
        replace(row, after=with_association(row.after)) for row in class_study.sensitivity[1:]
    ]
    assert [row.changes for row in changed] == [False, True]
    rows = answer_rows(class_runs, replace(class_study, sensitivity=tuple(changed)), tmp_path)
    detector = changed[1].detector
    counts = ClassTables(class_runs).mistakes(detector)
    assert rows["Why"].text.startswith(f"{detector} is wrong because ")
    assert (
        f"{detector} missed {counts.missed} of {counts.contacts} contacts, was late or cut short in "
        f"{counts.late_or_cut_short} and reported {counts.false_contacts} false contacts"
    ) in rows["Why"].figures
    assert rows["What"].text.startswith(f"{detector} ")
    before = changed[1].before.beta
    assert f" is +0.70 with {detector}, {before:+.2f} with exact." in rows["What"].text
    assert rows["When"].text == f"Mistakes that change it, of {detector}, for example:"
    assert changed[0].detector in rows["Or"].text and detector not in rows["Or"].text
    every = replace(
        class_study,
        sensitivity=tuple(replace(row, after=with_association(row.after)) for row in class_study.sensitivity),
    )
    assert answer_rows(class_runs, every, tmp_path)["Or"].text.startswith("None: every other detector")


def with_association(finding):
    """The finding with a strong association."""
    return replace(finding, beta=0.7, low=0.4, high=0.9, p=0.001, p_holm=0.001)


@pytest.mark.slow
def test_class_answer_counts_mistakes_that_changed_no_conclusion(class_runs, class_study, tmp_path):
    """Mistakes are counted again from the files of the runs."""
    why = answer_rows(class_runs, class_study, tmp_path)["Why"]
    assert why.text == f"An association may be hidden: {STUDENTS} students are few."
    assert why.figures.startswith("The detectors' mistakes changed no conclusion: ")
    same = replace(class_study, sensitivity=tuple(replace(row, after=row.before) for row in class_study.sensitivity))
    unmoved = answer_rows(class_runs, same, tmp_path)["Why"]
    wrong, contacts = Counter(), 0
    for folder in class_runs.top.glob("*/"):
        misses = pq.read_table(folder / "misses.parquet").to_pylist()
        wrong.update(
            detector for detector, _ in {(row["detector"], row["episode"]) for row in misses if not row["held"]}
        )
        contacts += sum(not row["held"] for row in pq.read_table(folder / "episodes.parquet").to_pylist())
    (first, most), (second, fewer) = wrong.most_common()
    counted = f"moved no result: {first} got {most} of {contacts} contacts wrong, {second} {fewer}."
    assert unmoved.figures == f"The detectors' mistakes {counted}"
    first, *others = same.coefficients
    some = answer_rows(class_runs, replace(same, coefficients=(with_association(first), *others)), tmp_path)["Why"]
    assert some.text.startswith("The detectors' mistakes moved no result: ")


def test_class_answer_blames_unreliable_questionnaire_scales(class_runs, class_study, tmp_path):
    """85 students find a correlation of 0.3, so that with 85 only the questions are to blame."""
    assert class_study.unreliable_scales == []
    weak = replace(class_study.reliabilities["motivation"], alpha=0.5712)
    unreliable = replace(class_study, reliabilities=class_study.reliabilities | {"motivation": weak})
    rows = answer_rows(class_runs, unreliable, tmp_path)
    assert rows["Why"].text == (
        "An association may be hidden: the answers on motivation are unreliable (Cronbach's alpha 0.57; "
        f"{ACCEPTABLE_ALPHA:g} is usual) and {STUDENTS} students are few."
    )
    assert rows["Do"].text == (
        "Count contacts with the detector exact, revise the questions on motivation, and study at least 85 students."
    )
    many = answer_rows(class_runs, replace(unreliable, students=85), tmp_path)
    assert many["Do"].text == "Count contacts with the detector exact and revise the questions on motivation."
    assert many["Why"].text.endswith("(Cronbach's alpha 0.57; 0.7 is usual).")
    first, *others = unreliable.coefficients
    some = answer_rows(class_runs, replace(unreliable, coefficients=(with_association(first), *others)), tmp_path)
    assert "unreliable" not in some["Why"].text and "revise" not in some["Do"].text
    other = replace(class_study.reliabilities["motivation"], alpha=float("nan"))
    assert replace(class_study, reliabilities={"unused": weak, "motivation": other}).unreliable_scales == ["motivation"]


def test_class_answer_advises_more_students_only_without_an_association(class_runs, class_study, tmp_path):
    """85 students detect a correlation of 0.3 with 80 % power."""
    rows = answer_rows(class_runs, class_study, tmp_path)
    assert rows["Do"].text == "Count contacts with the detector exact and study at least 85 students."
    assert rows["Do"].figures.startswith(
        "Among 85 students a correlation of 0.3 is found with 80 % power (one test at p <"
    )
    assert "85" not in rows["Sure"].figures
    first, *others = class_study.coefficients
    some = answer_rows(class_runs, replace(class_study, coefficients=(with_association(first), *others)), tmp_path)
    assert some["Do"].text == "Count contacts with the detector exact." and "takes 85 students" in some["Sure"].figures
    assert "study" not in answer_rows(class_runs, replace(class_study, students=85), tmp_path)["Do"].text


def test_more_students_are_needed_where_more_tests_are_made(class_runs, class_study, tmp_path):
    """A single test of a correlation of 0.3 needs 85 students."""
    six = replace(class_study, coefficients=class_study.coefficients * 6)
    rows = answer_rows(class_runs, six, tmp_path)
    needed = students_needed(correlation=0.3, tests=6)
    assert (
        rows["Do"].text == f"Count contacts with the detector exact and study at least {needed} students."
        and needed > 85
    )
    assert "corrected for 6 tests" in rows["Do"].figures and "corrected for 6 tests" in rows["Sure"].figures
    assert rows["Cost"].text.startswith(f"{needed - STUDENTS} more students")


def test_class_answer_explains_why_no_test_was_possible(class_runs, class_study, tmp_path):
    """The codebook asks for none, or fewer than 10 students took part."""
    untested = replace(
        class_study, coefficients=tuple(replace(row, p=None, p_holm=None) for row in class_study.coefficients)
    )
    rows = answer_rows(class_runs, replace(untested, sensitivity=()), tmp_path)
    assert rows["Why"].text == "No test was possible: the codebook asks for no association that can be tested."
    assert rows["Do"].text == "Count contacts with the detector exact." and "more student" not in rows["Cost"].text
    assert rows["Sure"].text == f"Nothing is known of associations: none was tested in {STUDENTS} students."
    assert "correlation" not in rows["Sure"].figures
    refused = StudyRefusedError("few-students", "p of the regression of a on b")
    few = answer_rows(class_runs, replace(untested, students=8, sensitivity=(), refusals=(refused,)), tmp_path)
    assert few["Cost"].text.startswith("2 more students")
    assert few["Why"].text.startswith("No test was possible: a p-value from fewer than 10 students ")
    assert few["Do"].text == "Count contacts with the detector exact and study at least 10 students."


def test_detectors_are_explained_beside_their_mistakes(class_runs, class_study, tmp_path):
    """A title is known of ``slow`` and not of ``coarse``."""
    titled = replace(class_runs, titles={"slow": "meshes at 5 Hz"})
    why = answer_rows(titled, class_study, tmp_path)["Why"]
    assert "slow (meshes at 5 Hz) got " in why.figures and "coarse (" not in why.figures


def test_recommended_detector_is_the_reference_though_another_counts(class_runs, class_study, tmp_path):
    """The study counted contacts with ``slow``."""
    do = answer_rows(class_runs, replace(class_study, detector="slow"), tmp_path)["Do"]
    assert do.text.startswith("Count contacts with the detector exact") and do.figures.endswith("is counted with slow.")


def test_change_by_the_reference_is_blamed_on_the_counting_detector(class_runs, class_study, tmp_path):
    """``slow`` counts; with the reference a result has an association, or stays as it is."""
    exact = replace(class_study.sensitivity[0], detector="exact", recall=1.0)
    changed = replace(class_study, detector="slow", sensitivity=(replace(exact, after=with_association(exact.after)),))
    assert answer_rows(class_runs, changed, tmp_path)["Why"].text.startswith("slow, which counts here, missed ")
    same = answer_rows(
        class_runs, replace(class_study, detector="slow", sensitivity=(replace(exact, after=exact.before),)), tmp_path
    )
    assert "Or" not in same, "the reference stands below Do"


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("students", "tests"), [(20, 1), (24, 6), (100, 1), (100, 6)])
def test_least_correlation_is_found_in_four_of_five_samples(students, tests):
    """Pearson correlations of drawn students, judged by Fisher's transformation at 5 % by Bonferroni, both sides."""
    least = least_correlation(students, tests)
    random = np.random.default_rng(students)
    first, rest = random.normal(size=(2, 20_000, students))
    second = least * first + np.sqrt(1.0 - least**2) * rest
    first, second = (values - values.mean(axis=1, keepdims=True) for values in (first, second))
    sums = (first * second).sum(axis=1), (first**2).sum(axis=1), (second**2).sum(axis=1)
    correlations = sums[0] / np.sqrt(sums[1] * sums[2])
    quantile = {1: 1.959964, 6: 2.638257}[tests]
    significant = np.abs(np.arctanh(correlations)) * np.sqrt(students - 3) > quantile
    assert significant.mean() == pytest.approx(0.8, abs=0.03)
    assert least_correlation(19, tests) is None
    assert students_needed(least, tests) in (students, students + 1)


def test_certainty_is_of_the_detector_and_of_the_associations(class_runs, class_study, tmp_path):
    """Results differ and no conclusion; results are equal; 100 students; a conclusion changes; 19 students.

    Then an association, and a class without a questionnaire.
    """
    sure = answer_rows(class_runs, class_study, tmp_path)["Sure"]
    assert sure.text == (
        "Sure that the detector changes no conclusion here: 3 detectors lead to the same ones. "
        f"Not shown: that there is no association. {STUDENTS} students can miss a correlation below 0.59."
    )
    same = replace(class_study, sensitivity=tuple(replace(row, after=row.before) for row in class_study.sensitivity))
    equal = answer_rows(class_runs, same, tmp_path)["Sure"].text
    assert equal.startswith("Sure that the detector changes nothing here: 3 detectors give the same results. ")
    many = answer_rows(class_runs, replace(class_study, students=100), tmp_path)["Sure"].text
    assert many.endswith("Fairly sure that no correlation is above 0.28: 100 students would mostly show it.")
    changed = tuple(replace(row, after=with_association(row.after)) for row in class_study.sensitivity)
    another = answer_rows(class_runs, replace(class_study, sensitivity=changed), tmp_path)["Sure"].text
    assert another.startswith("Sure about the detectors: they are measured against exact, the reference. ")
    few = answer_rows(class_runs, replace(class_study, students=19), tmp_path)["Sure"].text
    assert few.endswith("Not shown: that there is no association. 19 students are very few.")
    first, *others = class_study.coefficients
    some = answer_rows(class_runs, replace(class_study, coefficients=(with_association(first), *others)), tmp_path)[
        "Sure"
    ].text
    assert some.endswith(
        f"Fairly sure of the association in {STUDENTS} students: p = 0.001, 95 % interval +0.40 to +0.90."
    )
    without = answer_rows(class_runs, study=None, folder=tmp_path)
    assert without["Sure"].text == f"Nothing is known of conclusions: none was tested in {STUDENTS} students."
    assert "--questionnaire" in without["Do"].figures


@pytest.mark.parametrize(("slow_ms", "least"), [(0.02, True), (0.01001, False), (0.005, False)])
def test_cost_calls_the_recommended_detector_least_only_where_measured(
    class_runs, class_study, tmp_path, slow_ms, least
):
    """``exact`` takes 0.01 ms a frame, ``slow`` so many; 85 students would be enough."""
    times = {"exact": 0.01, "slow": slow_ms, "coarse": 0.03}
    metrics = class_runs.every_metric
    milliseconds = pa.array([times[label] for label in metrics["detector"].to_pylist()])
    if "mean_ms" in metrics.column_names:
        metrics = metrics.drop_columns(["mean_ms"])
    timed = replace(class_runs, every_metric=metrics.append_column("mean_ms", milliseconds))
    cost = answer_rows(timed, class_study, tmp_path)
    minutes = [next(iter(rows.values()))["valid_minutes"] for rows in class_runs.metrics.values()]
    whole = words.duration(sum(minutes) * 60 * 90 * 0.01e-3)
    takes = (
        f"exact takes 0.01 ms a frame ({whole} for this class){', less than every other detector' if least else ''}."
    )
    each = words.duration(60 * sum(minutes) / STUDENTS)
    assert cost["Cost"].text == f"{85 - STUDENTS} more students with a recording of about {each} each; {takes}"
    enough = answer_rows(timed, replace(class_study, students=85), tmp_path)["Cost"].text
    assert enough == takes
    assert ("Or" in cost) == (slow_ms < 0.01), "a detector that is slower than the reference is no other way"


def with_kinds(runs, name, kinds):
    """Runs whose misses or false contacts, the table of this name, are of these kinds in turn."""
    rows = runs.tables[name].to_pylist()
    changed = [row | {"kind": kinds[k % len(kinds)]} for k, row in enumerate(rows)]
    table = pa.Table.from_pylist(changed, schema=runs.tables[name].schema)
    return replace(runs, tables=runs.tables | {name: table})


def test_mistakes_are_recounts_of_misses_and_false_contacts(class_runs):
    """Misses are in turn never found and late, false contacts in turn of three kinds.

    Of these all but ``nothing there`` prolong a true contact.
    """
    late = with_kinds(class_runs, "misses", [FaultKind.NEVER_REPORTED, FaultKind.REPORTED_LATE])
    changed = with_kinds(late, "false_contacts", [FaultKind.NO_CONTACT, FaultKind.ENDS_LATE, FaultKind.STARTS_EARLY])
    for label in class_runs.audited_detectors:
        mistakes = ClassTables(changed).mistakes(label)
        misses = [row for row in changed.tables["misses"].to_pylist() if row["detector"] == label]
        never = {(row["place"], row["episode"]) for row in misses if row["kind"] == "never found"}
        wrong = {(row["place"], row["episode"]) for row in misses}
        kinds = [row["kind"] for row in changed.tables["false_contacts"].to_pylist() if row["detector"] == label]
        late_or_cut_short = wrong - never
        assert (mistakes.missed, mistakes.late_or_cut_short) == (len(never), len(late_or_cut_short))
        assert len(late_or_cut_short) > 2
        prolonging = len(kinds) - kinds.count("nothing there")
        assert (mistakes.false_contacts, mistakes.prolonging) == (len(kinds), prolonging) and prolonging > 5


@pytest.mark.parametrize(
    ("kinds", "which"),
    [(["nothing there"], ""), (["ends late"], "all"), (["nothing there", "ends late"], r"\d+")],
    ids=["none", "all", "some"],
)
def test_prolonged_contacts_are_counted_among_false_contacts(class_runs, class_study, tmp_path, kinds, which):
    """``kinds``: of the false contacts, in turn; ``which``: how many of them only prolong a contact, as printed."""
    changed = with_kinds(class_runs, "false_contacts", kinds)
    text = answer_rows(changed, class_study, tmp_path)["Why"]
    printed = re.findall(r"\((\w+) only prolong a true contact\)", f"{text.text} {text.figures} {text.details}")
    assert bool(printed) == bool(which) and all(re.fullmatch(which, word) for word in printed)


def test_page_lists_eight_unmatched_codes_and_counts_the_rest(class_runs, class_study, tmp_path):
    """Codes X0 to X9 match nothing; X8 and X9 are counted."""
    codes = tuple(f"'X{number}' matches no recording" for number in range(10))
    page = unescape(study_html(class_runs, places(class_runs, tmp_path), replace(class_study, unmatched=codes)))
    assert "Code 'X7' matches no recording." in page and "'X8'" not in page
    assert "2 more codes match nothing." in page


@pytest.mark.parametrize("emptied", ["misses", "false_contacts"])
def test_mistakes_of_a_single_kind_are_reported(class_runs, class_study, tmp_path, emptied):
    """``emptied``: the table without rows, so that there are only false contacts, or only misses."""
    fewer = replace(class_runs, tables=class_runs.tables | {emptied: class_runs.tables[emptied].slice(0, 0)})
    why = answer_rows(fewer, class_study, tmp_path)["Why"]
    assert "slow missed " in f"{why.text} {why.figures} {why.details}"


@pytest.mark.parametrize("more", [0, 2])
def test_refused_results_are_listed_up_to_a_few(class_runs, class_study, tmp_path, more):
    """``more``: refusals beyond MOST_REFUSED, which are counted and listed under Method."""
    refusals = (StudyRefusedError("small-cell", "the comparison of ease"),) * (MOST_REFUSED + more)
    sure = answer_rows(class_runs, replace(class_study, refusals=refusals), tmp_path)["Sure"]
    text = f"{sure.text} {sure.figures} {sure.details}"
    assert text.count("the comparison of ease (") == MOST_REFUSED
    assert (f"; {more} more under Method" in text) == bool(more) == ("under Method" in text)
