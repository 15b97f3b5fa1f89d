import json

import pytest
from support.class_folders import made_class
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.errors import OutputError
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.folder import as_json, write_study


@pytest.fixture(scope="module")
def study():
    answers, contacts = a_class(20)
    book = codebook((("motivation", "ease of use"), ("motivation", "contacts_per_min")))
    return analyse(book, questionnaire(answers), metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.8)))


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    return read_class(made_class(tmp_path_factory.mktemp("class"), 6, 6, contacts=3))


def test_a_folder_is_not_replaced_unless_forced_and_only_if_it_is_a_study(runs, study, tmp_path):
    out = write_study(runs, study, tmp_path / "study", title="Class", inputs={})
    with pytest.raises(OutputError, match="--force"):
        write_study(runs, study, out, title="Class", inputs={})
    write_study(runs, study, out, title="Again", inputs={}, force=True)
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("years of work")
    with pytest.raises(OutputError, match="is not a study folder"):
        write_study(runs, study, tmp_path / "thesis", inputs={}, force=True)


def test_refusals_are_in_the_json_with_what_lifts_them(runs):
    answers, contacts = a_class(9)
    book = codebook((("motivation", "contacts_per_min"),))
    told = as_json(runs, analyse(book, questionnaire(answers), metrics(contacts, recall=(None,))))
    assert {row["rule"] for row in told["refused"]} >= {"provenance"} and all(row["lift"] for row in told["refused"])
    json.dumps(told, allow_nan=False)


def test_no_file_holds_a_pseudonym(runs, study, tmp_path):
    out = write_study(runs, study, tmp_path / "study", title="Class", inputs={})
    for file in out.iterdir():
        assert "S07" not in file.read_text("utf-8"), file.name
