"""A study from answers and metrics: what is found, refused and said, and its page and files."""

import csv
import json
import re
from dataclasses import replace
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from pandas import concat
from rich.console import Console
from support.study_samples import a_class, codebook, made_class, metrics, names, questionnaire

from replay.cli.study_tables import study_tables as study_tables_screen
from replay.errors import OutputError, StudyError
from replay.studies.class_study.analysis import Sensitivity, analyse
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import places
from replay.studies.class_study.folder import as_json, write_study
from replay.studies.class_study.page import Heading, study_html
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.regression import Finding
from replay.studies.class_study.tables import (
    CELL_TEXTS,
    families_text,
    headlines,
    opening_sentence,
    result_name,
    study_tables,
    undecided_text,
)

GROUP_NAMES = ("first", "second")
EASE, CONTACTS = ("motivation", "ease of use"), ("motivation", "contacts_per_min")
REQUESTED = codebook((EASE, CONTACTS))
ARMS = codebook((EASE, CONTACTS), groups=("arm", GROUP_NAMES))
GROUP_OF_EACH_STUDENT = [*GROUP_NAMES] * 20


def study_of_class(count=40, other="hybrid", *, recall=0.9, scattered=False, arms=False):
    """A study of contacts that go with motivation; ``scattered``: not as the other detector sees them."""
    answers, contacts = a_class(count, seed=1, slope=0.0, contacts=0.75)
    table = metrics(contacts, detectors=("exact", other)[: 1 + bool(other)], recall=(1.0, recall)[: 1 + bool(other)])
    others = table["detector"] == other
    if scattered:
        table.loc[others, "contacts_per_min"] = np.random.default_rng(0).permutation(contacts)
    if arms:
        table.loc[~others, "contacts_per_min"] += 9.0 * (np.arange(count) % 2)
    return analyse(ARMS if arms else REQUESTED, questionnaire(answers, GROUP_OF_EACH_STUDENT if arms else ()), table)


def rules_of_refusals(result):
    """Rules by which a study refused something."""
    return {refused.rule for refused in result.refusals}


def test_study_finds_only_the_planted_association():
    """Ease of use goes with motivation in the made-up class, contacts do not."""
    answers, contacts = a_class(count=52, seed=3)
    result = analyse(REQUESTED, questionnaire(answers), metrics(contacts))
    ease, moved = result.coefficients
    assert ease.associated and ease.low < ease.beta < ease.high and ease.beta > 0.3
    assert not moved.associated
    assert (result.students, result.rows, result.detector, result.recall) == (52, 52, "exact", 1.0)
    assert not result.refusals


def finding_of_contacts(low, high, p):
    """Finding of a regression of contacts and motivation, 40 students: an interval of beta, and p."""
    ends = {"beta": (low + high) / 2, "low": low, "high": high, "p": p, "p_holm": p}
    return Finding(name="contacts_per_min", kind="simple", variables=CONTACTS, students=40, **ends)


@pytest.mark.parametrize("sign", [1, -1])
def test_conclusion_needs_both_p_and_interval_from_every_detector(sign):
    """(lower end of beta, p): an association has p below 0.05 and an interval without zero, of either sign."""
    result, *others = (
        finding_of_contacts(*sorted((sign * lower, sign * 1.2)), p)
        for lower, p in ((0.1, 0.04), (-0.1, 0.04), (0.1, 0.06), (0.1, None))
    )
    text = ["undecided: interval holds zero", "not distinguished from chance", "not tested"]
    assert result.conclusion == "associated" and [item.conclusion for item in others] == text
    rotated = finding_of_contacts(*sorted((-sign * 0.1, -sign * 1.2)), 0.04)
    for before, after in ((result, others[0]), (others[0], result), (result, rotated)):
        assert Sensitivity("hybrid", recall=0.9, before=before, after=after).conclusion == "another conclusion"
    assert Sensitivity("hybrid", recall=0.9, before=others[0], after=others[1]).conclusion == "the same"
    assert Sensitivity("hybrid", recall=0.9, before=result, after=None).conclusion == "not tested"


UNKNOWN = "whether the detector changes a conclusion is not known, since"

STATES = {
    "none": (lambda: None, f"{UNKNOWN} there is no questionnaire."),
    "one detector": (
        lambda: study_of_class(other=""),
        f"{UNKNOWN} no result about contacts could be compared between detectors.",
    ),
    "the same": (study_of_class, "the detector changes no conclusion."),
    "another": (
        lambda: study_of_class(scattered=True),
        "the detector changes 1 conclusion: the association of contacts per minute with motivation holds with exact, "
        "not with hybrid.",
    ),
    "groups": (
        lambda: study_of_class(arms=True, recall=1.0),
        "the detector changes 2 conclusions: the association of contacts per minute with motivation holds with hybrid, "
        "not with exact; "
        "the difference in contacts per minute (group second less group first) holds with exact, not with hybrid.",
    ),
    "nobody tested": (
        lambda: study_of_class(count=9),
        f"{UNKNOWN} no result could be tested with another detector.",
    ),
}


@pytest.mark.parametrize("state", STATES)
def test_study_headline_states_whether_a_conclusion_changes(state):
    """A state of STATES is a made-up study and the sentence on it; ``none``: there is no study."""
    make, answer = STATES[state]
    assert opening_sentence(make(), "40 students") == f"40 students: {answer}"


def test_detectors_changing_the_same_conclusion_share_a_sentence():
    """Findings are (lower, upper end of beta, p): ``some`` is an association, ``nothing`` is none."""
    some, nothing = finding_of_contacts(0.1, 1.2, 0.04), finding_of_contacts(-0.1, 0.2, 0.5)
    other_sign = finding_of_contacts(-1.2, -0.1, 0.04)
    result = "the association of contacts per minute with motivation"
    for before, afters, text in (
        (some, {"b": nothing, "c": nothing, "d": nothing}, f"{result} holds with a, not with b, c or d"),
        (nothing, {"b": some, "c": some}, f"{result} holds with b and c, not with a"),
        (
            some,
            {"b": nothing, "c": other_sign},
            f"{result} holds with a, not with b; {result} has another sign with c than with a",
        ),
    ):
        rows = [Sensitivity(label, recall=0.9, before=before, after=after) for label, after in afters.items()]
        made = SimpleNamespace(detector="a", sensitivity=rows, findings=[before])
        assert opening_sentence(made, "9 students") == f"9 students: the detector changes 1 conclusion: {text}."


WHICHEVER = "whichever collision detector counts the contacts"


def test_study_headline_states_where_no_association_was_found():
    """Findings are (lower, upper end of beta, p), by the reference and by ``hybrid``."""
    nothing, some = finding_of_contacts(-0.1, 0.2, 0.5), finding_of_contacts(0.1, 1.2, 0.04)
    same, about = (
        Sensitivity("hybrid", recall=0.9, before=nothing, after=nothing),
        Sensitivity("hybrid", recall=0.9, before=some, after=some),
    )
    answers = {
        "the detector changes no conclusion": ([same, about], [nothing, some]),
        f"no association with behaviour was found, {WHICHEVER}": ([same], [nothing, some]),
        f"no association was found, {WHICHEVER}": ([same], [nothing]),
        f"no clear association was found, {WHICHEVER}": ([same], [nothing, finding_of_contacts(-0.1, 1.2, 0.04)]),
    }
    for answer, (sensitivity, findings) in answers.items():
        made = SimpleNamespace(sensitivity=sensitivity, findings=findings)
        assert opening_sentence(made, "40 students") == f"40 students: {answer}."


def finding_of(kind):
    """An undecided coefficient."""
    about = {"name": "ease of use", "outcome": "motivation", "conclusion": "undecided after Holm"}
    return SimpleNamespace(students=40, p=0.04, kind=kind, **about)


def test_result_states_student_count_once_and_marks_associations():
    """One of two results is undecided, or all of three, of which two are named.

    In tables only an association is marked.
    """
    finding = SimpleNamespace(students=40, p=0.5, conclusion="")
    (line,) = headlines(SimpleNamespace(coefficients=(), groups=(), findings=[finding, finding]))
    assert line == "No association could be distinguished from chance in 40 students"
    undecided = finding_of("multiple")
    named = "ease of use with motivation, others held constant"
    (line,) = headlines(SimpleNamespace(coefficients=(), groups=(), findings=[finding, undecided]))
    assert line == f"1 of 2 results is undecided: {named}. The others may be chance"
    (line,) = headlines(SimpleNamespace(coefficients=(), groups=(), findings=[undecided] * 3))
    assert line == f"3 of 3 results are undecided: among them {named}; {named}"
    assert CELL_TEXTS["conclusion"]("associated").mark and not CELL_TEXTS["conclusion"]("refused").mark


def test_undecided_is_defined_by_the_result_that_is():
    """Undecided: p is below 0.05 alone, but above after Holm's correction, or the interval holds zero."""
    wide, corrected = finding_of_contacts(-0.1, 1.2, 0.04), replace(finding_of_contacts(0.1, 1.2, 0.017), p_holm=0.1)
    chance = finding_of_contacts(-0.1, 1.2, 0.5)
    after_holm = (
        "Undecided means here: p is 0.017 alone, which is below 0.05, but 0.100 after correction for 3 associations "
        "tested together."
    )
    holds_zero = "p is 0.040, which is below 0.05, but the 95 % interval holds zero."
    for coefficients, text in (
        ((chance, corrected, chance), after_holm),
        ((chance, wide), f"Undecided means here: {holds_zero}"),
        ((wide, corrected, chance), f"{after_holm} Undecided means also: {holds_zero}"),
        ((chance,), ""),
    ):
        made = SimpleNamespace(coefficients=coefficients, groups=(), findings=coefficients)
        assert undecided_text(made) == text and families_text(made) == ""
    groups = (replace(corrected, kind="groups"),)
    made = SimpleNamespace(coefficients=(chance,), groups=groups, findings=(chance, *groups))
    assert undecided_text(made).endswith("after correction for 1 comparison of groups tested together.")
    assert families_text(made) == "The results are 1 association and 1 comparison of groups."


def test_detector_with_fewest_misses_is_chosen_unless_requested_otherwise():
    """Recalls of 0.5 and 0.8; where both are 1 the exact detector is taken; a misspelt one is refused."""
    answers, contacts = a_class(count=30)
    table = metrics(contacts, detectors=("hull50", "hybrid"), recall=(0.5, 0.8))
    assert analyse(REQUESTED, questionnaire(answers), table).detector == "hybrid"
    assert analyse(REQUESTED, questionnaire(answers), table, detector="hull50").recall == pytest.approx(0.5)
    even = metrics(contacts, detectors=("hull50", "exact"), recall=(1.0, 1.0))
    assert analyse(REQUESTED, questionnaire(answers), even).detector == "exact"
    with pytest.raises(StudyError, match="there are: hull50, hybrid"):
        analyse(REQUESTED, questionnaire(answers), table, detector="exakt")


def test_behaviour_of_unknown_recall_is_not_analysed(class_runs):
    """The detector has no recall, or no recorded student is in the questionnaire: ease of use is analysed alone."""
    answers, contacts = a_class(count=30)
    strangers = metrics(contacts).assign(student=[f"X{number}" for number in range(30)])
    for table, rule in ((metrics(contacts, recall=(None,)), "provenance"), (strangers, "ids")):
        result = analyse(REQUESTED, questionnaire(answers), table)
        assert [item.variables for item in result.coefficients] == [EASE]
        (refused,) = result.refusals
        assert refused.rule == rule and "contacts_per_min" in refused.what
        (plain,) = json.loads(json.dumps(as_json(class_runs, result), allow_nan=False))["refused"]
        assert plain["rule"] == rule and plain["lift"]


def test_misspelt_student_leaves_the_others_in_the_study():
    """S07 of 30 students is s7 in the recordings: 29 count for contacts, 30 for the answers."""
    answers, contacts = a_class(count=30)
    table = metrics(contacts).replace({"student": {"S07": "s7"}})
    result = analyse(REQUESTED, questionnaire(answers), table)
    assert [(finding.variables, finding.students) for finding in result.coefficients] == [(EASE, 30), (CONTACTS, 29)]
    assert result.unmatched == (
        "'S07' of the questionnaire matches no recording; did you mean 's7'?",
        "'s7' of the recordings is not in the questionnaire; did you mean 'S07'?",
    )
    (warning,) = [sentence for sentence in result.warnings if "only one file" in sentence]
    assert "S07" not in warning and warning.startswith("2 students")


@pytest.mark.parametrize("count", [4, 5, 9])
def test_below_ten_students_no_p_and_four_are_refused(count):
    """From five students on there is a coefficient, without a p-value and without Bartlett's test."""
    answers, contacts = a_class(count)
    if count == 4:
        with pytest.raises(StudyRefusedError, match="small-cell"):
            analyse(codebook(), questionnaire(answers), metrics(contacts))
        return
    result = analyse(codebook(), questionnaire(answers), metrics(contacts))
    (item,) = result.coefficients
    assert (
        item.students == count
        and item.p is None
        and result.bartlett is None
        and "few-students" in rules_of_refusals(result)
    )
    assert headlines(result) == ["No association was tested"]


@pytest.mark.parametrize(
    ("question", "text"),
    [
        (("motivation", "arm"), r"'arm'.*without a regression"),
        (("motivation", "contact_per_min"), "did you mean 'contacts_per_min'"),
    ],
)
def test_unknown_name_in_a_codebook_is_refused_with_a_suggestion(question, text):
    """``question``: outcome and predictor; arm names groups, and contact_per_min lacks a letter."""
    answers, contacts = a_class(count=40)
    with pytest.raises(StudyError, match=text):
        analyse(
            codebook((question,), groups=("arm", GROUP_NAMES)),
            questionnaire(answers, GROUP_OF_EACH_STUDENT),
            metrics(contacts),
        )


@pytest.mark.parametrize("left", [4, 5])
def test_group_with_fewer_than_five_answers_is_not_compared(left):
    """``left``: students of the second group, of 20, who answered."""
    answers, contacts = a_class(count=40)
    answers[1 : 40 - 2 * left : 2, 3] = np.nan
    result = analyse(
        codebook(groups=("arm", GROUP_NAMES)), questionnaire(answers, GROUP_OF_EACH_STUDENT), metrics(contacts)
    )
    sizes = {two.outcome: (two.first_students, two.second_students) for two in result.groups}
    assert sizes == {"ease of use": (20, 20)} | ({"motivation": (20, 5)} if left == 5 else {})
    assert rules_of_refusals(result) == (set() if left == 5 else {"small-cell"})
    few = ["first"] * (40 - left) + ["second"] * left
    result = analyse(ARMS, questionnaire(answers, few), metrics(contacts))
    assert result.group_sizes["second"] == ("5" if left == 5 else "fewer than 5")


def test_a_construct_that_only_four_students_answered_has_no_figure():
    """All of 20 students but four left out the first item of ease of use."""
    answers, contacts = a_class(count=20)
    answers[4:, 0] = np.nan
    result = analyse(codebook(), questionnaire(answers), metrics(contacts))
    assert "ease of use" not in result.reliabilities and "motivation" in result.reliabilities
    assert result.kmo is None and result.bartlett is None and not result.coefficients
    assert rules_of_refusals(result) == {"small-cell"}


def test_student_with_several_sessions_counts_once_by_mean():
    """30 students with two sessions each, about the same mean, and one student with 18 more: 78 rows."""
    answers, contacts = a_class(count=30)
    plain, table = metrics(contacts), metrics(contacts, sessions=2)
    separate = np.repeat(np.random.default_rng(1).normal(size=30), 2) * np.tile([1.0, -1.0], 30)
    table["contacts_per_min"] += separate
    table = concat([table, *[plain[:1]] * 18])
    result, once = (analyse(REQUESTED, questionnaire(answers), rows) for rows in (table, plain))
    assert (result.rows, result.students) == (78, 30)
    for other, item in zip(result.coefficients, once.coefficients, strict=True):
        assert (other.beta, other.low, other.high, other.p) == pytest.approx((item.beta, item.low, item.high, item.p))


def test_detector_of_constant_contacts_counts_as_not_tested():
    """``blind`` has a recall of 0, and so no contact at all; of grasps both detectors have the same numbers."""
    answers, contacts = a_class(count=40, seed=1)
    table = metrics(contacts, detectors=("exact", "blind"), recall=(1.0, 0.0))
    table["grasps"] = np.arange(80) // 2 % 7
    result = analyse(codebook((EASE, CONTACTS, ("motivation", "grasps"))), questionnaire(answers), table)
    text = {row.before.name: row.conclusion for row in result.sensitivity}
    assert text == {"contacts_per_min": "not tested", "grasps": "the same"}
    assert [row is None for row in study_tables(result)["sensitivity"].column("beta")] == [True, False]


@pytest.fixture(scope="module")
def class_runs(tmp_path_factory):
    """Run folders of six students, one of which used other settings."""
    result = read_class(made_class(tmp_path_factory.mktemp("class"), sessions=6, students=6, contacts=3))
    result.metrics["run002"]["slow"]["settings"] = "other"
    return result


def test_the_page_of_a_study_reads_so(class_runs, snapshot):
    """With the n of the rows used, not of the questionnaire; with what is refused, and warned of."""
    answers, contacts = a_class(count=40, seed=3)
    answers[:5, 3] = np.nan
    table = metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.9), sessions=2)
    requested = codebook((EASE, (*CONTACTS, "grasps"), ("ease of use", "stirs")), groups=("arm", GROUP_NAMES))
    group = ["first"] * 31 + ["second"] * 9
    table["stirs"] = 1.0
    result = analyse(requested, questionnaire(answers, group), table)
    page = study_html(class_runs, places(class_runs, class_runs.top), result, Heading("Class of 2026"))
    page = re.sub(r"<(style|script|svg)\b.*?</\1>", "", page, flags=re.S)
    page = re.sub(r"</(td|th)>", " | ", re.sub(r"</(p|tr|h[1-6]|li|summary|caption)>", "\n", page))
    assert re.sub(r"[ \n]*\n[ \n]*", "\n", re.sub("<[^>]+>", "", page)) == snapshot
    few_students = study_html(
        class_runs, places(class_runs, class_runs.top), replace(result, bartlett=None), Heading("Class of 2026")
    )
    assert "All items together" in page and "All items together" not in few_students


def test_verbose_terminal_lists_associated_results_first(class_runs, tmp_path):
    """Two results are planted; only that of contacts is an association; the codebook names it second."""
    study = study_of_class()
    assert [finding.conclusion == "associated" for finding in study.findings] == [False, True]
    short, long = (Console(width=200, file=StringIO()) for _ in range(2))
    short.print(study_tables_screen(study, class_runs, tmp_path, verbose=False))
    long.print(study_tables_screen(study, class_runs, tmp_path, verbose=True))
    heading = r"result +figure +conclusion"
    _, table = re.split(heading, long.file.getvalue())
    assert table.index(result_name(study.findings[1])) < table.index(result_name(study.findings[0]))
    assert not re.search(heading, short.file.getvalue())


def test_counts_of_students_are_integers_in_the_files(class_runs, tmp_path):
    """In associations.csv, which has a row for each result."""
    out = write_study(class_runs, study_of_class(), tmp_path / "study", inputs={})
    with (out / "associations.csv").open(newline="", encoding="utf-8-sig") as file:
        rows = [*csv.DictReader(file)]
    assert rows and all(row["students"].isdigit() for row in rows)
    assert {row["associated"] for row in rows} <= {"True", "False"}


def test_study_folder_needs_force_and_holds_no_pseudonym(class_runs, tmp_path):
    """The last of eight codes is in no file; a folder of other files is not replaced even by force."""
    result = study_of_class()
    pseudonym = names(count=8)[-1]
    out = write_study(class_runs, result, tmp_path / "study", inputs={})
    for file in out.iterdir():
        assert pseudonym not in file.read_text("utf-8"), file.name
    heading, *rows = (out / "associations.csv").read_text("utf-8-sig").splitlines()
    assert heading.startswith("outcome,predictor,") and len(rows) == len(REQUESTED.questions)
    with pytest.raises(OutputError, match="--force"):
        write_study(class_runs, result, out, inputs={})
    write_study(class_runs, result, out, inputs={}, force=True)
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("years of work")
    with pytest.raises(OutputError, match="is not a study folder"):
        write_study(class_runs, result, tmp_path / "thesis", inputs={}, force=True)
