"""Names that would be markup, a script or a formula stay text in every page and table of a class."""

import csv
import re
from html.parser import HTMLParser

import pytest
from support import study_samples
from support.study_samples import a_class, codebook, made_class, questionnaire

from replay.studies.class_study import groups
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.folder import write_study
from replay.studies.class_study.page import Heading

HOSTILE = '=cmd|"/c calc"!A1 <script>throw 1</script><img src=x onerror=alert(1)> &amp; \u202e'
STUDENTS = 12
ELEMENTS_OF_THE_PAGE = {
    *("html", "head", "meta", "title", "style", "body", "main", "script", "header", "nav", "section", "footer", "div"),
    *("p", "h1", "h2", "dl", "dt", "dd", "ul", "li", "a", "b", "small", "details", "summary", "figure", "figcaption"),
    *("table", "caption", "thead", "tbody", "tr", "th", "td", "svg", "path", "circle", "text"),
}


class Elements(HTMLParser):
    """Names of all elements and attributes of a page."""

    def __init__(self):
        super().__init__()
        self.names, self.attributes = set(), set()

    def handle_starttag(self, tag, attrs):
        self.names.add(tag)
        self.attributes |= {name for name, _ in attrs}


@pytest.fixture(scope="module")
def study_folder(tmp_path_factory):
    """The written study of runs whose bodies, tasks, stages, devices, causes, detectors and group have that name.

    No figure is looked at, so that a few permutations are enough.
    """
    folder = tmp_path_factory.mktemp("hostile")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_samples, "PAIRS", [(HOSTILE, "beaker"), ("hand", HOSTILE)])
        for name in ("TASKS", "STAGES", "TYPES", "CAUSES"):
            patch.setattr(study_samples, name, (HOSTILE, "other"))
        runs = read_class(made_class(folder / "runs", sessions=STUDENTS, students=STUDENTS, detectors={HOSTILE: 0.3}))
    answers, _ = a_class(STUDENTS, seed=1, slope=0.7)
    answered = questionnaire(answers, [HOSTILE, "second"] * (STUDENTS // 2))
    answered.index = [f"S{k:03d}" for k in range(STUDENTS)]
    questions = (("motivation", "ease of use"), ("motivation", "contacts_per_min"))
    book = codebook(questions, groups=("arm", (HOSTILE, "second")))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(groups, "PERMUTATIONS", 99)
        patch.setattr(groups, "STUDENTISED_DRAWS", 99)
        study = analyse(book, answered, runs.as_metrics())
    return write_study(runs, study, folder / "study", inputs={}, heading=Heading(HOSTILE))


@pytest.mark.slow
def test_hostile_names_are_escaped_in_the_class_page(study_folder):
    """HOSTILE has a script, an image with an event and a sign that turns text around: none becomes an element.

    It stands escaped in the first answers and in the tables; the only script is the page's own.
    """
    page = (study_folder / "study.html").read_text("utf-8")
    escaped_script = "&lt;script&gt;throw 1"
    first_answers = page[page.index("<dl>") : page.index("</dl>")]
    assert first_answers.count(escaped_script) >= 4, "What, When, Why and more name detectors, bodies and causes"
    tables = re.findall(r"<table.*?</table>", page, re.DOTALL)
    assert any(escaped_script in table for table in tables)
    assert page.count("<script") == 1
    assert "<img" not in page and "\u202e" not in page
    parsed = Elements()
    parsed.feed(page)
    assert parsed.names <= ELEMENTS_OF_THE_PAGE
    assert [name for name in parsed.attributes if name.startswith("on")] == []


def test_hostile_names_are_no_formula_in_csv_tables(study_folder):
    """A cell that begins with = or @ would run in a spreadsheet; HOSTILE begins with ``=cmd``."""
    cells = []
    for file in study_folder.glob("*.csv"):
        with file.open(encoding="utf-8-sig", newline="") as stream:
            cells += [cell for row in csv.reader(stream) for cell in row]
    assert any("=cmd" in cell for cell in cells)
    assert [cell for cell in cells if cell.lstrip().startswith(("=", "@"))] == []
