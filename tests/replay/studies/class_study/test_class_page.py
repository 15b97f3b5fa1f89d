"""The page of a class in a browser: what it says is a recount by SQL, and every session is a click from its miss."""

import json
from urllib.parse import unquote

import duckdb
import pytest
from support.study_samples import made_class
from support.viewers import opened, serious_faults

from replay import read
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import places, sessions_table
from replay.studies.class_study.page import study_html

KNOWN = "student <> '' AND NOT held"


@pytest.fixture(scope="module")
def run_folders(tmp_path_factory):
    """Fifty sessions of 20 students; the last three are of no student."""
    return made_class(tmp_path_factory.mktemp("class") / "runs", sessions=50, students=20, nobody=3)


@pytest.fixture(scope="module")
def page_file(run_folders):
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


def rows(page, part, by, order="descending", **choose):
    """Rows that are seen after some clicks, cell by cell, as words."""
    given = {"part": part, "by": by, "order": order, "choose": choose}
    return page.ask(ROWS_AFTER_CLICKS.format(**{key: json.dumps(value) for key, value in given.items()}))


QUESTIONS = {
    "which pair is missed most": (
        ("pairs-missed-most", "misses", {}), (0, 1, 4),
        f"""SELECT body_a || ' - ' || body_b, detector, count(*)::VARCHAR FROM misses WHERE {KNOWN}
        GROUP BY ALL ORDER BY count(*) DESC""",
    ),
    "how many contacts does a detector never find": (
        ("how-detectors-differ", "contacts never found", {}), (0, 5),
        """SELECT m.detector, count(*) FILTER (list_contains(string_split(missed_by, ','), m.detector)) || ' of ' ||
        count(*) FROM episodes e JOIN metrics m USING (run) WHERE e.detector = 'exact' AND m.detector <> 'exact' AND NOT
        held AND e.student <> '' GROUP BY m.detector ORDER BY m.detector DESC""",
    ),
    "in which task are contacts missed": (
        ("task-stage-vr-type", "contacts", {"what": "task"}), (1, 2, 4, 5),
        f"""SELECT coalesce(task, 'none'), count(DISTINCT student)::VARCHAR, count(*)::VARCHAR, count(*) FILTER
        (missed_by <> '') || ' of ' || count(*) FROM episodes WHERE {KNOWN} AND detector = 'exact' GROUP BY task
        HAVING count(DISTINCT student) >= 5 ORDER BY count(*) DESC""",
    ),
    "how do VR types differ": (
        ("task-stage-vr-type", "contacts", {"what": "VR type"}), (1, 3, 4),
        f"""SELECT vr_type, count(DISTINCT run)::VARCHAR, count(*)::VARCHAR FROM episodes e JOIN (SELECT run, vr_type
        FROM metrics WHERE detector = 'exact') USING (run) WHERE {KNOWN} AND detector = 'exact' GROUP BY vr_type
        ORDER BY count(*) DESC""",
    ),
    "how often does a student touch something": (
        ("how-detectors-differ", "contacts a minute", {}), (0, 4),
        """SELECT detector, format('{:.3g}', avg(own)) FROM (SELECT detector, student, avg(contacts_per_min) AS own FROM
        metrics WHERE student <> '' GROUP BY ALL) GROUP BY detector ORDER BY avg(own) DESC""",
    ),
    "what is reported that is no contact": (
        ("causes", "how many", {"what": "false contact"}), (1, 3, 6),
        """SELECT detector, cause, count(*)::VARCHAR FROM false_contacts WHERE student <> '' GROUP BY ALL
        ORDER BY count(*) DESC""",
    ),
    "why are contacts missed": (
        ("causes", "how many", {"what": "miss", "detector": "slow"}), (2, 3, 6),
        f"""SELECT kind, cause, count(*)::VARCHAR FROM misses WHERE {KNOWN} AND detector = 'slow' GROUP BY ALL
        ORDER BY count(*) DESC""",
    ),
}  # fmt: skip
"""Question -> part of the page, heading to sort by, choices; columns that answer it; the recount."""


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
def test_filter_clicks_answer_a_question_as_a_recount_does(question, page, db):
    """The recount is a query of the runs' tables; rows of fewer than 5 students show no figure."""
    (piece, by, choose), columns, recount = QUESTIONS[question]
    printed = [row for row in rows(page, piece, by, **choose) if "fewer than 5" not in row]
    # Less all others, a total would tell what a row of few students may not: one more row shows no figure.
    withheld = {row[columns[0]] for row in printed if "not shown" in row}
    recorded = [[row[k] for k in columns] for row in printed if row[columns[0]] not in withheld]
    recorded = [row for row in recorded if row[-1] not in ("", "0")]
    expected = [list(row) for row in db.sql(recount).fetchall() if row[0] not in withheld]
    assert len(withheld) <= 1
    assert len(expected) > 1 and sorted(recorded) == sorted(expected)
    assert [row[-1] for row in recorded] == [row[-1] for row in expected]


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
    """Five sessions: those with most misses, until they are of five students, so that none of them stands out."""
    runs = read_class(run_folders)
    worst = {run: (number, detector) for run, number, detector in db.sql(WORST_MISS_OF_EACH_RUN).fetchall()}
    rows = sessions_table(runs, places(runs, page_file.parent)).rows
    address_of_run = {row[0].to.split("/")[-2]: unquote(row[1].to.partition("#")[2]) for row in rows}
    assert address_of_run.keys() == {*list(worst)[:5]}
    for run, address in address_of_run.items():
        number, detector = worst[run]
        # The page of a run opens with the first detector of the run, "slow"; another is named in the address.
        assert address == f"miss-{number}" + ("" if detector == "slow" else f"-{detector}")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_fits_a_phone_without_errors_or_requests(page_file, tmp_path, scheme):
    """400 x 800 pixels; the only request is the page itself."""
    with opened(page_file.as_uri(), tmp_path, (400, 800), scheme) as page:
        assert page.ask("document.documentElement.scrollWidth") <= 400
        assert page.errors() == [] and page.requests() == [page_file.as_uri()]


CLIPPED = """[...document.querySelectorAll("caption, .rows td:first-child, .narrow-cards td")].filter((cell) => {
  const box = cell.getBoundingClientRect();
  return box.width && (box.left < 0 || box.right > innerWidth || cell.scrollWidth > cell.clientWidth + 1);
}).map((cell) => cell.textContent)"""


@pytest.mark.slow
def test_phone_clips_no_caption_card_or_first_column(page_file, tmp_path):
    """400 x 800 pixels, every fold open: no table has to be moved sideways."""
    with opened(page_file.as_uri(), tmp_path, (400, 800)) as page:
        page.ask("for (const part of document.querySelectorAll('details')) part.open = true")
        assert page.ask("document.querySelectorAll('.narrow-cards td').length") > 0
        assert page.ask(CLIPPED) == []
        scrolled = (
            "[...document.querySelectorAll('.wide')].filter((one) => (one.scrollLeft = 9999, one.scrollLeft > 0))"
        )
        assert page.ask(f"{scrolled}.length") == 0, "every table is a list of cards"


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_accessibility_checker_finds_nothing_serious(page_file, tmp_path, scheme):
    """``scheme``: the browser's preference for light or dark pages."""
    with opened(page_file.as_uri(), tmp_path, scheme=scheme) as page:
        assert serious_faults(page, tmp_path) == []


@pytest.mark.slow
def test_every_column_fits_a_screen_of_1280_pixels(page_file, tmp_path):
    """Every fold is open; the page has one chart."""
    with opened(page_file.as_uri(), tmp_path, (1280, 800)) as page:
        page.ask("for (const part of document.querySelectorAll('details')) part.open = true")
        wide = "[...document.querySelectorAll('.wide')].filter((one) => one.scrollWidth > one.clientWidth + 1)"
        assert (
            page.ask(f"{wide}.map((one) => [one.closest('details, section').id, one.scrollWidth, one.clientWidth])")
            == []
        )
        assert page.ask("document.querySelectorAll('.charts .plot').length") == 1, "the page has one chart"
