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
    """Run folders of 20 students, a session each, by the reference detector exact and by slow and coarse."""
    return read_class(made_class(tmp_path_factory.mktemp("class") / "runs", sessions=STUDENTS, students=STUDENTS))


@pytest.fixture(scope="module")
def class_tables(class_runs):
    """The tables of these runs."""
    return ClassTables(class_runs)


@pytest.fixture(scope="module")
def study_without_association(class_runs):
    """A regression of motivation on contacts a minute, which do not go together; again with slow and with coarse.

    Answers on both scales are reliable (Cronbach's alpha 0.8), so that only the number of students can hide anything.
    """
    answers, _ = a_class(STUDENTS, seed=1, slope=0.7)
    answered = questionnaire(answers)
    answered.index = [f"S{k:03d}" for k in range(STUDENTS)]
    made = analyse(codebook((("motivation", "contacts_per_min"),)), answered, class_runs.as_metrics())
    return replace(made, reliabilities={name: replace(own, alpha=0.8) for name, own in made.reliabilities.items()})


def as_association(finding):
    """The finding with beta 0.7, which p = 0.001 and an interval from 0.4 to 0.9 make an association."""
    return replace(finding, beta=0.7, low=0.4, high=0.9, p=0.001, p_holm=0.001)


def with_association(study):
    """The study with an association as its first finding by the reference."""
    first, *others = study.coefficients
    return replace(study, coefficients=(as_association(first), *others))


def with_conclusion_changed_by(study, *detectors):
    """The study with these detectors finding an association, which the reference does not find."""
    rows = [
        replace(row, after=as_association(row.after)) if row.detector in detectors else row for row in study.sensitivity
    ]
    return replace(study, sensitivity=tuple(rows))


def with_equal_figures(study):
    """The study with every detector giving the figures of the reference."""
    return replace(study, sensitivity=tuple(replace(row, after=row.before) for row in study.sensitivity))


def answer_rows(tables, study):
    """Heading ("What", "Why", ...) -> its texts, as a page in the folder of the runs answers about a class."""
    links = places(tables.runs, tables.runs.top)
    return {row.name: row for row in class_answer(tables, links, study)}


def whole_text(row):
    """Sentence of a heading, those below it, and those that the page folds."""
    return f"{row.text} {row.figures} {row.details}"


@pytest.mark.parametrize("has_questionnaire", [True, False])
def test_class_page_has_its_seven_headings_in_order(class_runs, study_without_association, tmp_path, has_questionnaire):
    """20 students by exact, the reference, and by slow and coarse, with answers to a questionnaire or without.

    Without a questionnaire no conclusion is tested, so that no other detector can be proposed under Or.
    """
    page = study_html(
        class_runs, places(class_runs, tmp_path), study_without_association if has_questionnaire else None
    )
    headings = ["What", "When", "Why", "Do", "Cost", *(["Or"] if has_questionnaire else []), "Sure"]
    assert re.findall(r"<dt>(\w+)</dt>", page) == headings
    text = unescape(re.sub(r"<[^>]*>", "", page[page.index("<dl>") : page.index("</dl>")]))
    assert ("there is no questionnaire" in text) == (not has_questionnaire)
    assert "Count contacts with the detector exact" in text, "exact is the reference"


def test_class_answer_names_the_most_frequent_cause_per_detector(class_runs, class_tables, study_without_association):
    """Causes of misses of 20 students are counted again from the files of the runs, less those of a body in a hand.

    The count stands beside the cause (CAUSE_CLAUSES: a cause as words of a sentence), or "most" where another cause has
    fewer than 5 students: their count would follow.
    """
    counted, students = Counter(), defaultdict(set)
    for file in class_runs.top.glob("*/misses.parquet"):  # a run is of one student
        for row in pq.read_table(file).to_pylist():
            if not row["held"]:
                counted[row["detector"], row["cause"]] += 1
                students[row["detector"], row["cause"]].add(file.parent.name)
    why = whole_text(answer_rows(class_tables, study_without_association)["Why"])
    assert class_runs.audited_detectors
    for label in class_runs.audited_detectors:
        counts = {cause: count for (own, cause), count in counted.items() if own == label}
        most = {cause for cause, count in counts.items() if count == max(counts.values())}
        printed = re.findall(
            rf"{label} is wrong(?: because|:) (.*?) \((most|\d+ of \d+) missed or late contacts\)", why
        )
        assert {text for text, _ in printed} == {CAUSE_CLAUSES.get(cause, cause) for cause in most}
        has_small_cell = any(len(students[label, cause]) < 5 for cause in counts)
        count_text = "most" if has_small_cell else f"{max(counts.values())} of {sum(counts.values())}"
        assert {count for _, count in printed} == {count_text}


def test_first_sessions_lead_to_their_miss(class_tables, study_without_association):
    """20 students: one to three links read ``S007: hand-left - beaker at 3.14 s`` and open that miss in a report."""
    links = answer_rows(class_tables, study_without_association)["When"].links
    assert 1 <= len(links) <= 3
    for text, address in links:
        assert re.fullmatch(r"S\d{3}: \S+ - \S+ at [\d.]+ s", text) and "report.html#miss-" in address


def test_class_answer_names_the_pair_once_for_all_examples(class_runs):
    """Only the misses of beaker and burette stay: a sentence names the pair, links name student and second alone."""
    is_of_beaker = [row["body_a"] == "beaker" for row in class_runs.tables["misses"].to_pylist()]
    misses_of_beaker = class_runs.tables["misses"].filter(pa.array(is_of_beaker))
    single_pair = replace(class_runs, tables=class_runs.tables | {"misses": misses_of_beaker})
    row = answer_rows(ClassTables(single_pair), study=None)["When"]
    assert row.figures.startswith("All are of the pair beaker - burette. ")
    assert row.links
    assert all(re.fullmatch(r"S\d{3} at [\d.]+ s", text) for text, _ in row.links)


def test_a_cause_of_fewer_than_five_students_is_not_named(tmp_path):
    """Four students: no cause under Why, no count of misses under What, and under Sure a sentence that says why."""
    four_students = read_class(made_class(tmp_path / "runs", sessions=4, students=4))
    rows = answer_rows(ClassTables(four_students), study=None)
    assert "Why" not in rows
    assert "misses" not in rows["What"].details
    assert "fewer than 5 students" in rows["Sure"].text


def test_changing_detectors_are_named_as_such(class_runs, class_tables, study_without_association):
    """Motivation goes with contacts as ``coarse`` counts them (beta 0.7), not as exact and ``slow`` do.

    Every heading blames coarse; slow changes nothing and is the quicker choice under Or.
    """
    study = with_conclusion_changed_by(study_without_association, "coarse")
    assert {row.detector: row.changes for row in study.sensitivity} == {"slow": False, "coarse": True}
    rows = answer_rows(class_tables, study)
    beta_by_exact = study.coefficients[0].beta
    assert rows["What"].text.startswith("coarse changes a conclusion: ")
    assert f" is +0.70 with coarse, {beta_by_exact:+.2f} with exact." in rows["What"].text
    assert rows["When"].text == "Mistakes that change it, of coarse, for example:"
    counts = class_tables.mistakes("coarse")
    assert rows["Why"].text.startswith("coarse is wrong because ")
    assert (
        f"coarse missed {counts.missed} of {counts.contacts} contacts, was late or cut short in "
        f"{counts.late_or_cut_short} and reported {counts.false_contacts} false contacts"
    ) in rows["Why"].figures
    assert "slow" in rows["Or"].text and "coarse" not in rows["Or"].text


def test_no_detector_is_proposed_if_every_other_changes_a_conclusion(class_tables, study_without_association):
    """Motivation goes with contacts as ``slow`` and ``coarse`` count them, not as exact, the reference, does."""
    study = with_conclusion_changed_by(study_without_association, "slow", "coarse")
    rows = answer_rows(class_tables, study)
    assert rows["What"].text.startswith("slow and coarse change a conclusion: ")
    assert rows["Or"].text.startswith("None: every other detector")


@pytest.mark.parametrize(
    ("detectors", "beginning"),
    [
        (["coarse"], "coarse reverses the sign of a result: "),
        (["slow", "coarse"], "slow and coarse reverse the sign of a result: "),
    ],
)
def test_detectors_that_reverse_a_sign_are_named_as_such(class_tables, study_without_association, detectors, beginning):
    """Motivation goes with contacts by exact, beta -0.7, and by these detectors, beta +0.7."""
    changed = with_conclusion_changed_by(study_without_association, *detectors)
    before = replace(as_association(changed.sensitivity[0].before), beta=-0.7, low=-0.9, high=-0.4)
    rows = tuple(replace(row, before=before) for row in changed.sensitivity if row.detector in detectors)
    result = answer_rows(class_tables, replace(changed, sensitivity=rows))["What"].text
    assert result.startswith(beginning) and "is +0.70 with " in result and "-0.70 with exact." in result


def wrong_contacts_in_files(runs):
    """Counter of detector -> contacts that it missed or cut short, and the contacts of exact; none in a hand."""
    wrong, contacts = Counter(), 0
    for folder in runs.top.glob("*/"):
        misses = pq.read_table(folder / "misses.parquet").to_pylist()
        wrong_contacts = {(row["detector"], row["episode"]) for row in misses if not row["held"]}
        wrong.update(detector for detector, _ in wrong_contacts)
        contacts += sum(not row["held"] for row in pq.read_table(folder / "episodes.parquet").to_pylist())
    return wrong, contacts


@pytest.mark.slow
def test_class_answer_counts_mistakes_that_moved_no_result(class_runs, class_tables, study_without_association):
    """All detectors give the same figures, nothing is associated: mistakes are counted, of slow and coarse.

    Expected are contacts missed or cut short, counted again from the files of the runs.
    """
    why = answer_rows(class_tables, with_equal_figures(study_without_association))["Why"]
    assert why.text == f"An association may be hidden: {STUDENTS} students are few."
    wrong, contacts = wrong_contacts_in_files(class_runs)
    (first, most), (second, fewer) = wrong.most_common()
    assert why.figures == (
        f"The detectors' mistakes moved no result: {first} got {most} of {contacts} contacts wrong, {second} {fewer}."
    )


def test_class_answer_counts_mistakes_that_changed_no_conclusion(class_tables, study_without_association):
    """Nothing is associated, with any detector, though figures differ: mistakes stand below the few students."""
    why = answer_rows(class_tables, study_without_association)["Why"]
    assert why.text == f"An association may be hidden: {STUDENTS} students are few."
    assert why.figures.startswith("The detectors' mistakes changed no conclusion: ")


def test_mistakes_come_first_if_an_association_shows(class_tables, study_without_association):
    """All detectors give the same figures. Where an association shows, none can be hidden, which else comes first."""
    study = with_association(with_equal_figures(study_without_association))
    why = answer_rows(class_tables, study)["Why"]
    assert why.text.startswith("The detectors' mistakes moved no result: ")


MEDIUM_CORRELATION_STUDENTS = 85
"""Students in whom a correlation of 0.3 is found with 80 % power at p < 0.05 (Cohen 1992, A power primer, table 2)."""


def with_alpha_of_motivation(study, alpha):
    """The study with this Cronbach's alpha of the answers on motivation."""
    changed = replace(study.reliabilities["motivation"], alpha=alpha)
    return replace(study, reliabilities=study.reliabilities | {"motivation": changed})


def test_class_answer_blames_unreliable_questionnaire_scales(class_tables, study_without_association):
    """Cronbach's alpha of motivation is 0.57, below the usual 0.7; 20 students are fewer than the 85 needed."""
    assert study_without_association.unreliable_scales == []
    rows = answer_rows(class_tables, with_alpha_of_motivation(study_without_association, alpha=0.5712))
    assert rows["Why"].text == (
        "An association may be hidden: the answers on motivation are unreliable (Cronbach's alpha 0.57; "
        f"{ACCEPTABLE_ALPHA:g} is usual) and {STUDENTS} students are few."
    )
    assert rows["Do"].text == (
        "Count contacts with the detector exact, revise the questions on motivation, and study at least 85 students."
    )


def test_only_the_scale_is_blamed_if_students_are_enough(class_tables, study_without_association):
    """85 students find a correlation of 0.3, so that only the questions are to blame (alpha 0.57)."""
    unreliable = with_alpha_of_motivation(study_without_association, alpha=0.5712)
    rows = answer_rows(class_tables, replace(unreliable, students=MEDIUM_CORRELATION_STUDENTS))
    assert rows["Why"].text == (
        "An association may be hidden: the answers on motivation are unreliable (Cronbach's alpha 0.57; 0.7 is usual)."
    )
    assert rows["Do"].text == "Count contacts with the detector exact and revise the questions on motivation."


def test_unreliable_scale_is_not_blamed_if_an_association_shows(class_tables, study_without_association):
    """Unreliable answers (Cronbach's alpha 0.57) hide associations; here motivation and contacts show one."""
    unreliable = with_alpha_of_motivation(study_without_association, alpha=0.5712)
    rows = answer_rows(class_tables, with_association(unreliable))
    assert "unreliable" not in rows["Why"].text and "revise" not in rows["Do"].text


def test_unreliable_scales_are_those_of_regressions(study_without_association):
    """An alpha that is not a number is unreliable; the scale "unused" is in no regression and does not count."""
    study = with_alpha_of_motivation(study_without_association, alpha=float("nan"))
    unused = replace(study.reliabilities["motivation"], alpha=0.5)
    assert replace(study, reliabilities=study.reliabilities | {"unused": unused}).unreliable_scales == ["motivation"]


def test_class_answer_advises_more_students(class_tables, study_without_association):
    """Nothing is associated in 20 students: 85 find a correlation of 0.3 with 80 % power, which Sure leaves to Do."""
    rows = answer_rows(class_tables, study_without_association)
    assert rows["Do"].text == "Count contacts with the detector exact and study at least 85 students."
    assert rows["Do"].figures.startswith(
        "Among 85 students a correlation of 0.3 is found with 80 % power (one test at p <"
    )
    assert "85" not in rows["Sure"].figures


def test_class_answer_advises_no_more_students_if_an_association_shows(class_tables, study_without_association):
    """20 students, in whom an association shows: not Do but Sure says how many a correlation of 0.3 takes."""
    rows = answer_rows(class_tables, with_association(study_without_association))
    assert rows["Do"].text == "Count contacts with the detector exact."
    assert "takes 85 students" in rows["Sure"].figures


def test_class_answer_advises_no_more_students_if_they_are_enough(class_tables, study_without_association):
    """Nothing is associated in 85 students, who find a correlation of 0.3 with 80 % power."""
    enough = replace(study_without_association, students=MEDIUM_CORRELATION_STUDENTS)
    assert "study" not in answer_rows(class_tables, enough)["Do"].text


def test_more_students_are_needed_where_more_tests_are_made(class_tables, study_without_association):
    """Six regressions, corrected for one another: a correlation of 0.3 takes more than the 85 students of one.

    ``students_needed``, tested elsewhere, says how many; Cost counts those beyond the 20.
    """
    six_tests = replace(study_without_association, coefficients=study_without_association.coefficients * 6)
    rows = answer_rows(class_tables, six_tests)
    needed = students_needed(correlation=0.3, tests=6)
    assert needed > MEDIUM_CORRELATION_STUDENTS
    assert rows["Do"].text == f"Count contacts with the detector exact and study at least {needed} students."
    assert "corrected for 6 tests" in rows["Do"].figures and "corrected for 6 tests" in rows["Sure"].figures
    assert rows["Cost"].text.startswith(f"{needed - STUDENTS} more students")


@pytest.fixture
def study_without_test(study_without_association):
    """The study with a coefficient that has no p-value, by the reference alone."""
    untested = tuple(replace(row, p=None, p_holm=None) for row in study_without_association.coefficients)
    return replace(study_without_association, coefficients=untested, sensitivity=())


def test_class_answer_says_that_the_codebook_asks_for_no_test(class_tables, study_without_test):
    """No result of 20 students has a p-value, and none was refused: more students would not help."""
    rows = answer_rows(class_tables, study_without_test)
    assert rows["Why"].text == "No test was possible: the codebook asks for no association that can be tested."
    assert rows["Do"].text == "Count contacts with the detector exact."
    assert "more student" not in rows["Cost"].text
    assert rows["Sure"].text == f"Nothing is known of associations: none was tested in {STUDENTS} students."
    assert "correlation" not in rows["Sure"].figures


def test_class_answer_says_that_a_test_takes_ten_students(class_tables, study_without_test):
    """The p-value of 8 students was refused by the rule few-students, because 10 are needed: 2 more."""
    refused = StudyRefusedError("few-students", "p of the regression of a on b")
    rows = answer_rows(class_tables, replace(study_without_test, students=8, refusals=(refused,)))
    assert rows["Cost"].text.startswith("2 more students")
    assert rows["Why"].text.startswith("No test was possible: a p-value from fewer than 10 students ")
    assert rows["Do"].text == "Count contacts with the detector exact and study at least 10 students."


def test_detectors_are_explained_beside_their_mistakes(class_runs, study_without_association):
    """The runs say what ``slow`` is, meshes at 5 Hz, and nothing of ``coarse``, which stands without brackets."""
    titled = replace(class_runs, titles={"slow": "meshes at 5 Hz"})
    why = answer_rows(ClassTables(titled), study_without_association)["Why"]
    assert "slow (meshes at 5 Hz) got " in why.figures
    assert "coarse" in why.figures and "coarse (" not in why.figures


def test_recommended_detector_is_the_reference_though_another_counts(class_tables, study_without_association):
    """The study counted contacts with the detector ``slow``; exact is the reference, with which to count next time."""
    do = answer_rows(class_tables, replace(study_without_association, detector="slow"))["Do"]
    assert do.text.startswith("Count contacts with the detector exact") and do.figures.endswith("is counted with slow.")


@pytest.fixture
def study_counted_with_slow(study_without_association):
    """The study counted with ``slow``, which finds no association, and tested again with exact, the reference."""
    tested_again = replace(study_without_association.sensitivity[0], detector="exact", recall=1.0)
    return replace(study_without_association, detector="slow", sensitivity=(tested_again,))


def test_change_by_the_reference_is_blamed_on_the_counting_detector(class_tables, study_counted_with_slow):
    """The study counted with ``slow`` and finds no association; with exact, the reference, there is one."""
    changed = with_conclusion_changed_by(study_counted_with_slow, "exact")
    assert answer_rows(class_tables, changed)["Why"].text.startswith("slow, which counts here, missed ")


def test_reference_is_never_proposed_as_the_quicker_detector(class_tables, study_counted_with_slow):
    """Exact and ``slow`` give the same figures; exact stands under Do, and Or has no other detector to name."""
    rows = answer_rows(class_tables, with_equal_figures(study_counted_with_slow))
    assert "Or" not in rows
    assert "exact" in rows["Do"].text


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("students", "tests"), [(20, 1), (24, 6), (100, 1), (100, 6)])
def test_least_correlation_is_found_in_four_of_five_samples(students, tests):
    """20,000 samples of normal pairs with that true correlation; 80 % of the sample correlations are significant.

    Significant: two-sided at 5 % divided by the number of tests (Bonferroni), by Fisher's transformation.
    """
    least = least_correlation(students, tests)
    random = np.random.default_rng(students)
    first, rest = random.normal(size=(2, 20_000, students))
    second = least * first + np.sqrt(1.0 - least**2) * rest
    first, second = (values - values.mean(axis=1, keepdims=True) for values in (first, second))
    products, squares, other_squares = (first * second).sum(axis=1), (first**2).sum(axis=1), (second**2).sum(axis=1)
    correlations = products / np.sqrt(squares * other_squares)
    normal_quantile = {1: 1.959964, 6: 2.638257}[tests]  # of 1 - 0.05 / 2, and of 1 - 0.05 / 12
    significant = np.abs(np.arctanh(correlations)) * np.sqrt(students - 3) > normal_quantile
    # Fisher's transformation is an approximation: 3 % of the samples for that.
    assert significant.mean() == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize("tests", [1, 6])
def test_students_needed_is_the_inverse_of_least_correlation(tests):
    """Found in a class of 100, a correlation takes 100 students, or 101 where rounding up adds a student."""
    assert students_needed(least_correlation(students=100, tests=tests), tests) in (100, 101)


@pytest.mark.parametrize(
    ("state", "sentence"),
    [
        (
            lambda study: study,
            "Sure that the detector changes no conclusion here: 3 detectors lead to the same ones. ",
        ),
        (
            with_equal_figures,
            "Sure that the detector changes nothing here: 3 detectors give the same results. ",
        ),
        (
            lambda study: with_conclusion_changed_by(study, "slow", "coarse"),
            "Sure about the detectors: they are measured against exact, the reference. ",
        ),
    ],
    ids=["figures differ and no conclusion", "figures are equal", "a conclusion changes"],
)
def test_certainty_begins_with_the_detectors(class_tables, study_without_association, state, sentence):
    """``state`` changes what ``slow`` and ``coarse`` find beside exact: three detectors in all."""
    assert answer_rows(class_tables, state(study_without_association))["Sure"].text.startswith(sentence)


@pytest.mark.parametrize(
    ("students", "sentences"),
    [
        (19, "Not shown: that there is no association. 19 students are very few."),
        (20, "Not shown: that there is no association. 20 students can miss a correlation below 0.59."),
        (100, "Fairly sure that no correlation is above 0.28: 100 students would mostly show it."),
    ],
)
def test_certainty_ends_with_the_correlation_that_students_show(
    class_tables, study_without_association, students, sentences
):
    """By Fisher n students show r = tanh(2.80 / sqrt(n - 3)) with 80 % power: 20 show 0.59, and 100 show 0.28.

    Of fewer than 20 students no such figure is stated.
    """
    study = replace(study_without_association, students=students)
    assert answer_rows(class_tables, study)["Sure"].text.endswith(sentences)


def test_associations_beyond_three_are_counted(class_tables, study_without_association):
    """Five associations, the same by every detector: three are named, and the other two are counted."""
    association = as_association(study_without_association.coefficients[0])
    study = replace(with_equal_figures(study_without_association), coefficients=(association,) * 5)
    text = whole_text(answer_rows(class_tables, study)["What"])
    assert text.count(" is associated with ") == 3
    assert " 2 more below." in text


def test_certainty_of_an_association_is_its_p_and_interval(class_tables, study_without_association):
    """The first finding of 20 students is an association with p = 0.001 and an interval from 0.4 to 0.9."""
    sure = answer_rows(class_tables, with_association(study_without_association))["Sure"]
    assert sure.text.endswith(
        f"Fairly sure of the association in {STUDENTS} students: p = 0.001, 95 % interval +0.40 to +0.90."
    )


def test_nothing_is_known_of_conclusions_without_a_questionnaire(class_tables):
    """20 recorded students and no study of them: Sure says so, and Do names the option that adds one."""
    rows = answer_rows(class_tables, study=None)
    assert rows["Sure"].text == f"Nothing is known of conclusions: none was tested in {STUDENTS} students."
    assert "--questionnaire" in rows["Do"].figures


@pytest.mark.parametrize(
    ("slow_ms", "is_exact_least", "is_slow_quicker"),
    [
        pytest.param(0.02, True, False, id="slow takes twice as long as exact"),
        pytest.param(0.01001, False, False, id="slow takes as long as exact, as printed"),
        pytest.param(0.005, False, True, id="slow takes half as long as exact"),
    ],
)
def test_cost_calls_the_recommended_detector_least_only_where_measured(
    class_runs, study_without_association, slow_ms, is_exact_least, is_slow_quicker
):
    """``exact`` takes 0.01 ms a frame, ``coarse`` 0.03; a class is priced at the 90 frames a second of a headset.

    85 students are needed, so that Cost begins with 65 more, and with the time if 85 took part. Or names a detector
    only if it is quicker than exact.
    """
    milliseconds = {"exact": 0.01, "slow": slow_ms, "coarse": 0.03}
    metrics = class_runs.every_metric.to_pandas()
    metrics["mean_ms"] = metrics["detector"].map(milliseconds)
    timed = ClassTables(replace(class_runs, every_metric=pa.Table.from_pandas(metrics)))
    minutes = sum(next(iter(rows.values()))["valid_minutes"] for rows in class_runs.metrics.values())
    frames = minutes * 60 * 90
    class_time = words.duration(frames * 0.01e-3)
    least = ", less than every other detector" if is_exact_least else ""
    time_text = f"exact takes 0.01 ms a frame ({class_time} for this class){least}."
    recording = words.duration(60 * minutes / STUDENTS)
    rows = answer_rows(timed, study_without_association)
    more = MEDIUM_CORRELATION_STUDENTS - STUDENTS
    assert rows["Cost"].text == f"{more} more students with a recording of about {recording} each; {time_text}"
    assert ("Or" in rows) == is_slow_quicker
    enough_students = replace(study_without_association, students=MEDIUM_CORRELATION_STUDENTS)
    assert answer_rows(timed, enough_students)["Cost"].text == time_text


def with_kinds(runs, table, kinds):
    """Runs whose faults in a table, "misses" or "false_contacts", are of these kinds in turn."""
    rows = runs.tables[table].to_pylist()
    changed = [row | {"kind": kinds[k % len(kinds)]} for k, row in enumerate(rows)]
    changed_table = pa.Table.from_pylist(changed, schema=runs.tables[table].schema)
    return replace(runs, tables=runs.tables | {table: changed_table})


@pytest.mark.parametrize("label", ["slow", "coarse"])
def test_mistakes_are_recounts_of_misses_and_false_contacts(class_runs, label):
    """Misses are in turn never reported and late, false contacts in turn of three kinds.

    Of these ``ends late`` and ``starts early`` prolong a true contact; ``nothing there`` is a contact more.
    """
    changed = with_kinds(class_runs, "misses", [FaultKind.NEVER_REPORTED, FaultKind.REPORTED_LATE])
    changed = with_kinds(changed, "false_contacts", [FaultKind.NO_CONTACT, FaultKind.ENDS_LATE, FaultKind.STARTS_EARLY])
    misses = [row for row in changed.tables["misses"].to_pylist() if row["detector"] == label]
    # "place": number of the run; "episode": number of the contact in it
    wrong = {(row["place"], row["episode"]) for row in misses}
    never = {(row["place"], row["episode"]) for row in misses if row["kind"] == "never found"}
    kinds = [row["kind"] for row in changed.tables["false_contacts"].to_pylist() if row["detector"] == label]
    prolonging = [kind for kind in kinds if kind != "nothing there"]
    assert never and wrong - never and prolonging
    mistakes = ClassTables(changed).mistakes(label)
    assert (mistakes.missed, mistakes.late_or_cut_short) == (len(never), len(wrong - never))
    assert (mistakes.false_contacts, mistakes.prolonging) == (len(kinds), len(prolonging))


@pytest.mark.parametrize(
    ("kinds", "printed_count"),
    [(["nothing there"], None), (["ends late"], "all"), (["nothing there", "ends late"], r"\d+")],
    ids=["none", "all", "some"],
)
def test_prolonged_contacts_are_counted_among_false_contacts(
    class_runs, study_without_association, kinds, printed_count
):
    """False contacts are of these kinds in turn; ``ends late`` only prolongs a true contact.

    ``printed_count``: how many of them only prolong; None: no word on it.
    """
    changed = with_kinds(class_runs, "false_contacts", kinds)
    text = whole_text(answer_rows(ClassTables(changed), study_without_association)["Why"])
    counts = re.findall(r"\((\w+) only prolong a true contact\)", text)
    assert bool(counts) == (printed_count is not None)
    assert all(re.fullmatch(printed_count, count) for count in counts)


def test_page_lists_eight_unmatched_codes_and_counts_the_rest(class_runs, study_without_association, tmp_path):
    """The ten codes X0 to X9 of the questionnaire match no recording: X8 and X9 are counted."""
    codes = tuple(f"'X{number}' matches no recording" for number in range(10))
    study = replace(study_without_association, unmatched=codes)
    page = unescape(study_html(class_runs, places(class_runs, tmp_path), study))
    assert "Code 'X7' matches no recording." in page and "'X8'" not in page
    assert "2 more codes match nothing." in page


@pytest.mark.parametrize("emptied", ["misses", "false_contacts"])
def test_mistakes_of_a_single_kind_are_reported(class_runs, study_without_association, emptied):
    """One of the two tables of mistakes has no rows; those of the other are reported, a count of 0 beside them."""
    no_rows = class_runs.tables[emptied].slice(0, 0)
    fewer = replace(class_runs, tables=class_runs.tables | {emptied: no_rows})
    text = whole_text(answer_rows(ClassTables(fewer), study_without_association)["Why"])
    sentence = re.search(r"slow missed (\d+) of \d+ contacts?, .*? and reported (\d+) false contacts?", text)
    missed, false_contacts = map(int, sentence.groups())
    assert (missed == 0) == (emptied == "misses")
    assert (false_contacts == 0) == (emptied == "false_contacts")


@pytest.mark.parametrize("more", [0, 2])
def test_refused_results_are_listed_up_to_a_few(class_tables, study_without_association, more):
    """MOST_REFUSED refused results are listed; of ``more`` beyond them only the number is here, a list under Method."""
    refusals = (StudyRefusedError("small-cell", "the comparison of ease"),) * (MOST_REFUSED + more)
    study = replace(study_without_association, refusals=refusals)
    text = whole_text(answer_rows(class_tables, study)["Sure"])
    assert text.count("the comparison of ease (") == MOST_REFUSED
    assert (f"; {more} more under Method" in text) == bool(more) == ("under Method" in text)
