import io

from rich.console import Console
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.cli.study_tables import check_table, study_tables
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.published import Remark


def shown(group, width=120):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(group)
    return console.export_text()


def test_what_contradicts_comes_first_and_is_counted():
    text = shown(check_table([Remark("agrees", "T", "a", "fine"), Remark("inconsistent", "T", "b", "wrong")]))
    assert "1 of 2 checks contradict" in text and text.index("wrong") < text.index("fine")
    assert "every printed figure agrees" in shown(check_table([Remark("agrees", "T", "a", "fine")]))


def test_a_study_shows_associations_questionnaire_and_refusals():
    answers, contacts = a_class(9)
    book = codebook((("motivation", "ease of use"), ("motivation", "contacts_per_min")))
    text = shown(study_tables(analyse(book, questionnaire(answers), metrics(contacts, recall=(None,)))))
    assert all(words in text for words in ("9 students", "not tested", "questionnaire", "not given", "provenance"))


def test_a_narrow_terminal_loses_no_figure():
    answers, contacts = a_class(30, seed=3)
    study = analyse(codebook(), questionnaire(answers), metrics(contacts))
    assert f"{study.regressions[0].coefficients[0].beta:+.3f}" in shown(study_tables(study), 80)
