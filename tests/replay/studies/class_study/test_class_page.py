"""The page of a class in a browser: what it says is a recount by SQL, and every session is a click from its miss."""

import json
from typing import NamedTuple
from urllib.parse import unquote

import duckdb
import pytest
from support.study_samples import made_class
from support.viewers import opened, serious_faults

from replay import read
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import places, sessions_table
from replay.studies.class_study.page import study_html

COUNTED = "student <> '' AND NOT held"
"""Rows that count: of a known student, and not of a body in a hand."""


@pytest.fixture(scope="module")
def run_folders(tmp_path_factory):
    """Fifty sessions of 20 students; the last three are of no student."""
    return made_class(tmp_path_factory.mktemp("class") / "runs", sessions=50, students=20, nobody=3)


@pytest.fixture(scope="module")
def page_file(run_folders):
    """The written page of the class, without a questionnaire."""
    runs, page = read_class(run_folders), run_folders.parent / "page" / "study.html"
    page.parent.mkdir()
    page.write_text(study_html(runs, places(runs, page.parent)), "utf-8")
    return page


@pytest.fixture(scope="module")
def db(run_folders):
    """A database whose tables are those of all runs."""
    result = duckdb.connect()
    for name, table in read(run_folders).items():
        result.register(name, table)
    return result


@pytest.fixture(scope="module")
def page(page_file, tmp_path_factory):
    """The page in a browser."""
    with opened(page_file.as_uri(), tmp_path_factory.mktemp("browser")) as page:
        yield page


ROWS_AFTER_CLICKS = """(() => {{
  const part = document.getElementById({part});
  part.open = true;
  const find = (name) => [...part.querySelectorAll("th")].findIndex((th) => th.textContent === name);
  for (const [name, value] of Object.entries({choose})) {{
    const label = [...part.querySelectorAll("label")].find((one) => one.firstChild.textContent.trim() === name);
    label.lastChild.value = value;
    label.lastChild.dispatchEvent(new Event(label.lastChild.type === "search" ? "input" : "change"));
  }}
  const head = part.querySelectorAll("th")[find({by})];
  for (let k = 0; k < 3 && head.ariaSort !== {order}; k++) head.firstChild.click();
  const more = part.querySelector(".wide + button");
  if (more && !more.hidden) more.click();
  return [...part.querySelectorAll("tbody tr")].filter((row) => row.offsetParent)
    .map((row) => [...row.cells].map((cell) => cell.firstChild ? cell.firstChild.textContent.trim() : ""));
}})()"""


def rows_after_clicks(page, part, sort_by, **choices):
    """Text of the cells of each row that is seen when a part of the page is unfolded, filtered and sorted downwards."""
    clicks = {"part": part, "by": sort_by, "order": "descending", "choose": choices}
    return page.ask(ROWS_AFTER_CLICKS.format(**{key: json.dumps(value) for key, value in clicks.items()}))


class Question(NamedTuple):
    """Clicks that answer a question on the page, and the query that counts again."""

    part: str
    """Id of the part of the page that is unfolded."""
    sort_by: str
    """Heading that is clicked until the rows descend."""
    choices: dict[str, str]
    """Heading -> value chosen in the filter above the rows."""
    columns: tuple[int, ...]
    """Indices of the columns that answer the question."""
    recount: str
    """SQL query of the runs' tables with these columns."""


QUESTIONS = {
    "which pair is missed most": Question(
        "pairs-missed-most", "misses", {}, (0, 1, 4),
        f"""SELECT body_a || ' - ' || body_b, detector, count(*)::VARCHAR FROM misses WHERE {COUNTED}
        GROUP BY ALL ORDER BY count(*) DESC""",
    ),
    "how many contacts does a detector never find": Question(
        "how-detectors-differ", "contacts never found", {}, (0, 5),
        """SELECT m.detector, count(*) FILTER (list_contains(string_split(missed_by, ','), m.detector)) || ' of ' ||
        count(*) FROM episodes e JOIN metrics m USING (run) WHERE e.detector = 'exact' AND m.detector <> 'exact' AND NOT
        held AND e.student <> '' GROUP BY m.detector ORDER BY m.detector DESC""",
    ),
    "in which task are contacts missed": Question(
        "task-stage-vr-type", "contacts", {"what": "task"}, (1, 2, 4, 5),
        f"""SELECT coalesce(task, 'none'), count(DISTINCT student)::VARCHAR, count(*)::VARCHAR, count(*) FILTER
        (missed_by <> '') || ' of ' || count(*) FROM episodes WHERE {COUNTED} AND detector = 'exact' GROUP BY task
        HAVING count(DISTINCT student) >= 5 ORDER BY count(*) DESC""",
    ),
    "how do VR types differ": Question(
        "task-stage-vr-type", "contacts", {"what": "VR type"}, (1, 3, 4),
        f"""SELECT vr_type, count(DISTINCT run)::VARCHAR, count(*)::VARCHAR FROM episodes e JOIN (SELECT run, vr_type
        FROM metrics WHERE detector = 'exact') USING (run) WHERE {COUNTED} AND detector = 'exact' GROUP BY vr_type
        ORDER BY count(*) DESC""",
    ),
    "how often does a student touch something": Question(
        "how-detectors-differ", "contacts a minute", {}, (0, 4),
        """SELECT detector, format('{:.3g}', avg(own)) FROM (SELECT detector, student, avg(contacts_per_min) AS own FROM
        metrics WHERE student <> '' GROUP BY ALL) GROUP BY detector ORDER BY avg(own) DESC""",
    ),
    "what is reported that is no contact": Question(
        "causes", "how many", {"what": "false contact"}, (1, 3, 6),
        """SELECT detector, cause, count(*)::VARCHAR FROM false_contacts WHERE student <> '' GROUP BY ALL
        ORDER BY count(*) DESC""",
    ),
    "why are contacts missed": Question(
        "causes", "how many", {"what": "miss", "detector": "slow"}, (2, 3, 6),
        f"""SELECT kind, cause, count(*)::VARCHAR FROM misses WHERE {COUNTED} AND detector = 'slow' GROUP BY ALL
        ORDER BY count(*) DESC""",
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS.values(), ids=QUESTIONS)
def test_filter_clicks_answer_a_question_as_a_recount_does(question, page, db):
    """A question has the clicks on headings and filters that answer it, and an SQL query that counts again.

    Rows of fewer than 5 students print no figure and are left out on both sides. So is one row more of a total: less
    all others, the total would tell the figure of the row of few students.
    """
    rows = rows_after_clicks(page, question.part, question.sort_by, **question.choices)
    rows = [row for row in rows if "fewer than 5" not in row]
    name_column = question.columns[0]
    withheld = {row[name_column] for row in rows if "not shown" in row}
    assert len(withheld) <= 1
    printed = [[row[k] for k in question.columns] for row in rows if row[name_column] not in withheld]
    printed = [row for row in printed if row[-1] not in ("", "0")]  # the recount has no row where nothing happened
    expected = [list(row) for row in db.sql(question.recount).fetchall() if row[0] not in withheld]
    assert len(expected) > 1
    assert sorted(printed) == sorted(expected)
    assert [row[-1] for row in printed] == [row[-1] for row in expected], "in another order"


# Of each run the detector that missed most, of equal ones the first, which is "slow"; of its misses the one that cut
# most off the contact. Runs with most misses come first.
WORST_MISS_OF_EACH_RUN = """WITH counts AS (SELECT run, detector, count(*) AS n FROM misses WHERE NOT held
GROUP BY ALL),
worst AS (SELECT run, detector, n FROM counts QUALIFY row_number() OVER (PARTITION BY run ORDER BY n DESC,
detector = 'coarse') = 1)
SELECT run, number, detector FROM worst JOIN metrics
USING (run, detector) JOIN misses m USING (run, detector)
WHERE NOT held QUALIFY row_number() OVER (PARTITION BY run ORDER BY cut_length
DESC) = 1 ORDER BY n DESC, run"""


@pytest.mark.slow
def test_the_sessions_with_most_misses_lead_to_their_worst_miss(run_folders, page_file, db):
    """Five sessions are linked, those with most misses: they are of five students, so that none stands out.

    A link ends in ``#miss-NUMBER``, for the detector with which the page of a run opens, "slow", else in
    ``#miss-NUMBER-DETECTOR``.
    """
    runs = read_class(run_folders)
    worst = {run: (number, detector) for run, number, detector in db.sql(WORST_MISS_OF_EACH_RUN).fetchall()}
    fragment_of_run = {}
    for session, example, _by in sessions_table(runs, places(runs, page_file.parent)).rows:
        _, run, _file = session.to.rsplit("/", 2)
        fragment_of_run[run] = unquote(example.to.partition("#")[2])
    assert fragment_of_run.keys() == {*list(worst)[:5]}
    for run, fragment in fragment_of_run.items():
        number, detector = worst[run]
        assert fragment == f"miss-{number}" + ("" if detector == "slow" else f"-{detector}")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_a_phone_without_errors_or_requests(page_file, tmp_path, scheme):
    """A phone has 400 x 800 pixels, and prefers a colour scheme; the only request is the page itself."""
    with opened(page_file.as_uri(), tmp_path, size=(400, 800), scheme=scheme) as page:
        assert page.ask("document.documentElement.scrollWidth") <= 400
        assert page.errors() == []
        assert page.requests() == [page_file.as_uri()]


CLIPPED = """[...document.querySelectorAll("caption, .rows td:first-child, .narrow-cards td")].filter((cell) => {
  const box = cell.getBoundingClientRect();
  return box.width && (box.left < 0 || box.right > innerWidth || cell.scrollWidth > cell.clientWidth + 1);
}).map((cell) => cell.textContent)"""


@pytest.mark.slow
def test_phone_clips_no_caption_card_or_first_column(page_file, tmp_path):
    """400 x 800 pixels, every fold open: a wide table is a list of cards, and none has to be moved sideways."""
    with opened(page_file.as_uri(), tmp_path, size=(400, 800)) as page:
        page.ask("for (const part of document.querySelectorAll('details')) part.open = true")
        assert page.ask("document.querySelectorAll('.narrow-cards td').length") > 0
        assert page.ask(CLIPPED) == []
        tables_moved_sideways = (
            "[...document.querySelectorAll('.wide')].filter((one) => (one.scrollLeft = 9999, one.scrollLeft > 0))"
        )
        assert page.ask(f"{tables_moved_sideways}.length") == 0


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_accessibility_checker_finds_nothing_serious(page_file, tmp_path, scheme):
    """axe-core checks the page of a class in a browser that prefers light, or dark, pages."""
    with opened(page_file.as_uri(), tmp_path, scheme=scheme) as page:
        assert serious_faults(page, tmp_path) == []


@pytest.mark.slow
def test_every_column_fits_a_screen_of_1280_pixels(page_file, tmp_path):
    """Every fold of the page of a class is open, and no table is wider than its frame."""
    with opened(page_file.as_uri(), tmp_path, size=(1280, 800)) as page:
        page.ask("for (const part of document.querySelectorAll('details')) part.open = true")
        assert page.ask("document.querySelectorAll('.wide').length") > 0
        too_wide = "[...document.querySelectorAll('.wide')].filter((one) => one.scrollWidth > one.clientWidth + 1)"
        assert page.ask(f"{too_wide}.map((one) => one.closest('details, section').id)") == []


@pytest.mark.slow
def test_page_of_a_class_without_questionnaire_has_a_single_chart(page):
    """Without answers of students nothing but their time in contact can be drawn."""
    assert page.ask("document.querySelectorAll('.charts .plot').length") == 1
