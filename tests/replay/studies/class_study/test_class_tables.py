"""The tables of a class in every state: nobody, one student, several, some without a name, runs twice."""

import shutil
from dataclasses import replace
from statistics import fmean

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.study_samples import made_class

from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import (
    NO_NAME,
    NOT_STATED,
    ClassTables,
    class_counts,
    places,
    sessions_table,
)
from replay.studies.class_study.page import study_html
from replay.studies.class_study.refusals import StudyRefusedError


@pytest.fixture(scope="module")
def tables_of(tmp_path_factory):
    """Returns the runs and the tables of a made-up class, which nobody changes; the same class is made once."""
    classes = {}

    def tables(sessions, students, **settings):
        key = repr((sessions, students, settings))
        if key not in classes:
            runs = read_class(
                made_class(tmp_path_factory.mktemp("class"), sessions=sessions, students=students, **settings)
            )
            classes[key] = runs, ClassTables(runs)
        return classes[key]

    return tables


def all_tables(tables):
    """The tables of detectors, pairs, activities and causes of a class."""
    return [make() for make in (tables.detectors, tables.pairs, tables.activity_table, tables.causes)]


def with_students(runs, students):
    """Runs of which each states another of these students."""
    metrics = {
        run: {label: row | {"student": student} for label, row in rows.items()}
        for (run, rows), student in zip(runs.metrics.items(), students, strict=True)
    }
    return replace(runs, metrics=metrics)


SMALL_CLASSES = pytest.mark.parametrize(
    ("students", "nobody", "known"),
    [
        pytest.param(1, 0, 1, id="one student"),
        pytest.param(4, 0, 4, id="four students"),
        pytest.param(5, 0, 5, id="five students"),
        pytest.param(6, 6, 0, id="no session with a pseudonym"),
        pytest.param(6, 1, 5, id="a session without a pseudonym"),
    ],
)
"""Six sessions of so many students in turn; the last ``nobody`` state no pseudonym. ``known``: students with one."""

MANY_MISSES = {"rare": 0, "detectors": {"slow": 0.9}, "contacts": 20}
"""About 20 contacts a session, of which the detector ``slow`` misses nine in ten; no task is of few students alone."""

EIGHT_STUDENTS = {"sessions": 8, "students": 8, "detectors": {"slow": 0.9}, "contacts": 20}
"""A class whose detector ``slow`` never finds nine of ten contacts of exact; three students alone do a task."""


@pytest.mark.sampled(3)
@SMALL_CLASSES
def test_no_table_has_a_figure_of_fewer_than_five_students(tables_of, students, nobody, known):
    """Six sessions of so many students, the last ``nobody`` without a pseudonym: ``known`` students count.

    Column n has the students of a row, else ``fewer than 5``; the figures behind it are then empty. The detector slow
    misses nine in ten contacts, so that every table has rows.
    """
    _, tables = tables_of(sessions=6, students=students, nobody=nobody, **MANY_MISSES)
    for table in all_tables(tables):
        n = table.head.index("n")
        assert table.rows or known == 0
        for row in table.rows:
            is_hidden = row[n] == "fewer than 5"
            assert is_hidden == (set(row[n + 1 :]) == {""})
            assert is_hidden or known >= 5
    assert (known in tables.detectors().column("n")) == (known >= 5)
    assert bool(tables.headlines()) == (known >= 5)


@pytest.mark.sampled(3)
@SMALL_CLASSES
def test_first_words_of_a_class_count_its_known_students(tables_of, students, nobody, known):
    """Six sessions of so many students, the last ``nobody`` without a pseudonym: ``known`` students count.

    Contacts are counted from five known students on; the detectors' table notes sessions without a pseudonym.
    """
    runs, tables = tables_of(sessions=6, students=students, nobody=nobody, **MANY_MISSES)
    counts = class_counts(runs)
    assert counts.startswith(f"{known if known >= 5 else 'fewer than 5'} students, 6 sessions")
    assert ("contacts" in counts) == (known >= 5)
    note = f"{nobody} of 6 sessions state no pseudonym: they are in the list of sessions and in no figure."
    assert (note in " ".join(tables.detectors().notes)) == (nobody > 0)


@pytest.mark.sampled(3)
@SMALL_CLASSES
def test_sessions_are_listed_until_they_are_of_five_students(tables_of, tmp_path, students, nobody, known):
    """Six sessions of so many students, the last ``nobody`` without a pseudonym: up to five ``known`` are listed.

    The page says that tables are empty where no student is known.
    """
    runs, _ = tables_of(sessions=6, students=students, nobody=nobody, **MANY_MISSES)
    links = places(runs, tmp_path)
    student_of = {links[run][0]: runs.shared_value(run, "student") for run in runs.metrics}
    listed = {student_of[session.text] for session, *_ in sessions_table(runs, links).rows} - {""}
    assert len(listed) == min(5, known)
    html = study_html(runs, links)
    assert "is not known, since there is no questionnaire." in html
    assert ("There is none in the sessions with a pseudonym." in html) == (known == 0)


def test_small_cells_cannot_be_derived_from_totals(tables_of):
    """Eight students: 8 misses of a search, 14 of seven of them by a budget, and 9 that came late, of three alone.

    Five students make a figure. The nine are hidden, and the 14 too: else the nine were the total, 31, less the others.
    """
    runs, _ = tables_of(**EIGHT_STUDENTS)
    any_miss = runs.tables["misses"].to_pylist()[0]
    misses_of_each_student = {
        "search": [1, 1, 1, 1, 1, 1, 1, 1],
        "budget ran out": [2, 2, 2, 2, 2, 2, 2, 0],
        "late": [3, 3, 3, 0, 0, 0, 0, 0],
    }
    misses = [
        any_miss | {"place": session, "cause": cause}
        for cause, counts in misses_of_each_student.items()
        for session, count in enumerate(counts)
        for _ in range(count)
    ]
    table = pa.Table.from_pylist(misses, schema=runs.tables["misses"].schema)
    tables = ClassTables(replace(runs, tables=runs.tables | {"misses": table}))
    students_by_cause = {row["cause"]: row["n"] for row in tables.causes().plain() if row["what"] == "miss"}
    assert students_by_cause == {"search": 8, "budget ran out": "not shown", "late": "fewer than 5"}


def missed_of(contacts):
    """Text of a cell: how many of these contacts of exact some detector never finds."""
    return f"{sum(row['missed_by'] != '' for row in contacts)} of {len(contacts)}"


def test_pairs_have_recounts_of_their_misses_and_contacts(tables_of):
    """Misses and contacts of exact in eight sessions are counted again by the pair of their bodies, of four pairs."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    misses, contacts = (runs.tables[name].to_pylist() for name in ("misses", "episodes"))
    rows = tables.pairs().plain()
    assert len(rows) == 4
    for row in rows:
        own_misses, own_contacts = (
            [fault for fault in faults if f"{fault['body_a']} - {fault['body_b']}" == row["pair"]]
            for faults in (misses, contacts)
        )
        sessions, sessions_with_a_miss = ({fault["place"] for fault in faults} for faults in (own_contacts, own_misses))
        assert row["sessions"] == len(sessions), row["pair"]
        assert row["misses"].text == str(len(own_misses)), row["pair"]
        assert row["sessions with a miss"].text == f"{len(sessions_with_a_miss)} of {len(sessions)}", row["pair"]
        assert row["contacts never found"].text == missed_of(own_contacts), row["pair"]


def test_activities_have_recounts_of_their_contacts(tables_of):
    """Contacts of exact in eight sessions are counted again by stage, first or second."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    contacts = runs.tables["episodes"].to_pylist()
    rows = [row for row in tables.activity_table().plain() if row["what"] == "stage"]
    assert {row["which"] for row in rows} == {"first", "second"}
    for row in rows:
        own = [contact for contact in contacts if contact["stage"] == row["which"]]
        assert row["sessions"] == len({contact["place"] for contact in own}), row["which"]
        assert (row["contacts"].text, row["missed by any"].text) == (str(len(own)), missed_of(own)), row["which"]


def test_listed_miss_is_the_longest_of_its_session(tables_of, tmp_path):
    """Eight sessions of about 20 contacts, of which ``slow`` misses nine in ten; five sessions are listed with a miss.

    It is the miss whose cut, the curve in which the bodies intersect, is the longest (``cut_length``).
    """
    runs, _ = tables_of(**EIGHT_STUDENTS)
    links = places(runs, tmp_path)
    number_of_session = {name: number for number, (name, _address) in enumerate(links.values())}
    misses = runs.tables["misses"].to_pylist()
    rows = sessions_table(runs, links).rows
    assert len(rows) == 5
    for session, example, _detector in rows:
        own = [row for row in misses if row["place"] == number_of_session[session.text]]
        longest = max(own, key=lambda row: row["cut_length"])
        assert example.to.endswith(f"#miss-{longest['number']}"), session.text


def test_recorded_time_is_unknown_if_a_session_states_none(tables_of):
    """Eight sessions state their minutes; it is 0 if the first states none, or if they are of four students alone."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    minutes = sum(next(iter(rows.values()))["valid_minutes"] for rows in runs.metrics.values())
    assert tables.recorded_seconds == pytest.approx(60 * minutes)
    assert ClassTables(with_students(runs, "ABCDDDDD")).recorded_seconds == 0.0
    unknown = with_students(runs, "ABCDEFGH")
    for row in next(iter(unknown.metrics.values())).values():
        row["valid_minutes"] = None
    assert ClassTables(unknown).recorded_seconds == 0.0


def test_list_of_sessions_has_no_figure(tables_of, tmp_path):
    """Five of eight students' sessions are listed, each with a name, a link to look at and a detector: no figures."""
    runs, _ = tables_of(**EIGHT_STUDENTS)
    sessions = sessions_table(runs, places(runs, tmp_path))
    assert [column.name for column in sessions.columns] == ["session", "look at", "by"]
    assert len(sessions.rows) == 5


def test_class_page_without_an_audit_states_its_absence(tables_of, tmp_path):
    """Five runs of exact, the reference, alone: neither pairs nor causes of misses, and no sentence about them."""
    runs, tables = tables_of(sessions=5, students=5, detectors={})
    assert [(row["detector"], row["is"]) for row in tables.detectors().plain()] == [("exact", "trusted")]
    assert not tables.pairs().rows and not tables.causes().rows and tables.headlines() == []
    links = sessions_table(runs, places(runs, tmp_path)).column("look at")
    assert {link.text for link in links} == {"not audited"}
    html = study_html(runs, places(runs, tmp_path))
    empty_tables = 2  # pairs and causes
    assert html.count("There is none in the sessions with a pseudonym.") == empty_tables


def test_duplicate_sessions_and_runs_without_metrics_are_left_out(tables_of, tmp_path):
    """Beside eight runs a copy of one, and a copy of another without its metrics: figures stay, and notes say why."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    before = all_tables(tables)
    shutil.copytree(runs.top, tmp_path / "class")
    shutil.copytree(tmp_path / "class" / "run003", tmp_path / "copies" / "again")
    shutil.copytree(tmp_path / "class" / "run004", tmp_path / "copies" / "bare")
    (tmp_path / "copies" / "bare" / "metrics.parquet").unlink()
    after = all_tables(ClassTables(read_class(tmp_path)))
    assert [table.rows for table in after] == [table.rows for table in before]
    detectors_before, detectors_after = before[0], after[0]
    notes = " ".join(detectors_after.notes)
    assert "Runs left out because their session is there already: 1." in notes
    assert "Runs left out because they have no metrics: 1." in notes
    assert "Runs left out" not in " ".join(detectors_before.notes)


@pytest.fixture
def nameless_runs(tables_of):
    """Six runs, of sessions 0 to 5, none of which states a student."""
    runs, _ = tables_of(sessions=6, students=6, nobody=6, **MANY_MISSES)
    return runs


def test_students_file_assigns_sessions_to_students(nameless_runs, tmp_path):
    """Six sessions name no student; the file says that session k (16 hexadecimal digits) is of Sk.

    Metrics have a row a session and detector: exact and slow.
    """
    students_file = tmp_path / "students.csv"
    rows = [f"{session:016x},S{session}\n" for session in range(6)]
    students_file.write_text("session,student\n" + "".join(rows))
    runs = read_class(nameless_runs.top, students_file)
    assert runs.students == ["S0", "S1", "S2", "S3", "S4", "S5"]
    assert len(runs.as_metrics()) == 6 * 2


def test_metrics_of_sessions_without_students_are_refused(nameless_runs):
    """Six sessions name no student, by whom a study joins metrics and answers: the rule is called ids."""
    with pytest.raises(StudyRefusedError, match=r"refused \(ids\)"):
        nameless_runs.as_metrics()


def test_session_that_two_runs_give_to_two_students_is_refused(tmp_path):
    """The made-up classes both have a session 0: in one it is of student S000, in the other of nobody."""
    made_class(tmp_path / "nobody", sessions=1, students=1, nobody=1)
    made_class(tmp_path / "named", sessions=1, students=1)
    with pytest.raises(StudyRefusedError, match="belongs to two students"):
        read_class(tmp_path)


def test_class_headline_explains_students_missing_from_n(tables_of):
    """Eight students with a session each; contacts of the first three sessions are removed."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    (headline,) = tables.headlines()
    assert ", 8 students) and reports " in headline
    remaining = [row for row in runs.tables["episodes"].to_pylist() if row["place"] >= 3]  # place: index of session
    episodes = pa.Table.from_pylist(remaining, schema=runs.tables["episodes"].schema)
    (headline,) = ClassTables(replace(runs, tables=runs.tables | {"episodes": episodes})).headlines()
    assert "5 of 8 students; the others had no contact to miss" in headline


def test_class_page_names_the_detector_with_most_deviating_rate(tables_of, tmp_path):
    """``slow`` never finds 90 % of the contacts of exact; ``coarse``, added here, 10 %. Students E and F came twice.

    Contacts a minute: the mean over students, each by the mean of their sessions.
    """
    class_runs, _ = tables_of(**EIGHT_STUDENTS)
    runs = with_students(class_runs, "ABCDEEFF")
    for rows in runs.metrics.values():
        rows["coarse"] = rows["exact"] | {"contacts_per_min": 0.9 * rows["exact"]["contacts_per_min"]}
    rate = {}
    for label in ("exact", "slow", "coarse"):
        rates_of_student = {}
        for rows in runs.metrics.values():
            rates_of_student.setdefault(rows[label]["student"], []).append(rows[label]["contacts_per_min"])
        rate[label] = fmean(map(fmean, rates_of_student.values()))
    assert rate["slow"] < rate["coarse"] < rate["exact"]
    fewer = f"-{100 * (1 - rate['slow'] / rate['exact']):.0f} %"
    sentence = f"slow reports {rate['slow']:.3g} contacts a minute, exact {rate['exact']:.3g} ({fewer})."
    assert ClassTables(runs).rate_difference() == sentence
    assert sentence in study_html(runs, places(runs, tmp_path))


def with_equal_rates(sessions):
    """Metrics of each session, in which ``slow`` finds as many contacts a minute as exact."""
    return [
        rows | {"slow": rows["slow"] | {"contacts_per_min": rows["exact"]["contacts_per_min"]}} for rows in sessions
    ]


def without_slow_in_the_first(sessions):
    """Metrics of each session, the first by exact alone."""
    first, *others = sessions
    return [{label: row for label, row in first.items() if label != "slow"}, *others]


@pytest.mark.parametrize("changed", [with_equal_rates, without_slow_in_the_first])
def test_rate_difference_is_omitted_where_rates_cannot_be_compared(tables_of, changed):
    """Eight students; ``slow`` misses nine of ten contacts, so that its rate differs from that of exact.

    The sentence is omitted where both rates are equal, and where ``slow`` was not measured in the first session.
    """
    runs, tables = tables_of(**EIGHT_STUDENTS)
    assert tables.rate_difference() != ""
    metrics = dict(zip(runs.metrics, changed(runs.metrics.values()), strict=True))
    assert ClassTables(replace(runs, metrics=metrics)).rate_difference() == ""


@pytest.mark.parametrize(("students", "is_stated"), [("ABCDDDDD", False), ("ABCDEEEE", True)])
def test_rate_difference_needs_five_students(tables_of, students, is_stated):
    """The detector slow misses nine of ten contacts in eight sessions of four students, or of five."""
    class_runs, _ = tables_of(**EIGHT_STUDENTS)
    assert (ClassTables(with_students(class_runs, students)).rate_difference() != "") == is_stated


@pytest.mark.parametrize(
    ("members", "expected_students"),
    [
        pytest.param(None, 8, id="every student"),
        pytest.param({"S000", "S001", "stranger"}, 2, id="two students, and a stranger to the class"),
    ],
)
def test_contact_seconds_are_a_recount_of_contacts_by_minutes(tables_of, members, expected_students):
    """Seconds of all contacts of exact, divided by all minutes with known poses ("valid minutes")."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    session_names = [*runs.metrics]
    seconds = minutes = 0.0
    for session, rows in runs.metrics.items():
        if members is None or runs.shared_value(session, "student") in members:
            minutes += rows["exact"]["valid_minutes"]
    for row in runs.tables["episodes"].to_pylist():
        if members is None or runs.shared_value(session_names[row["place"]], "student") in members:
            seconds += row["end"] - row["start"]
    estimate = tables.contact_seconds_a_minute(members)
    assert estimate.students == expected_students
    assert estimate.value == pytest.approx(seconds / minutes)


def test_head_counts_false_contacts_of_each_detector(tables_of):
    """The false contacts of ``slow``, the only detector beside exact, are divided by the eight sessions."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    (headline,) = tables.headlines()
    false_contacts = [row for row in runs.tables["false_contacts"].to_pylist() if row["detector"] == "slow"]
    assert false_contacts
    assert headline.startswith("slow misses ")
    assert f"{len(false_contacts) / 8:.2g} false contacts a session" in headline


def test_every_class_table_notes_that_n_counts_students(tables_of):
    """Tables of detectors, pairs, activities and causes of a class of eight students have a column n."""
    _, tables = tables_of(**EIGHT_STUDENTS)
    notes = [" ".join(table.notes) for table in all_tables(tables)]
    assert ["n counts the students" in text for text in notes] == [True] * 4


def test_sessions_are_named_by_code_and_tell_repeats_apart(tables_of, tmp_path):
    """Sessions of students A to E, two of F and one of nobody: all names differ.

    A name is the student's code, and goes on behind a comma if there are several; that of nobody is the session's id.
    """
    class_runs, _ = tables_of(**EIGHT_STUDENTS)
    runs = with_students(class_runs, [*"ABCDEFF", ""])
    ids = [runs.shared_value(run, "session") for run in runs.metrics]
    names = [name for name, _address in places(runs, tmp_path).values()]
    assert names == [*"ABCDE", f"F, session {ids[5]}", f"F, session {ids[6]}", ids[7]]


def test_titles_of_detectors_come_from_the_ranking_of_a_run(tmp_path):
    """The table ``ranking`` of a run says what ``slow`` is, and nothing of ``bare``."""
    made_class(tmp_path / "runs", sessions=1, students=1)
    rows = [{"detector": "slow", "what": "samples at 20 Hz"}, {"detector": "bare", "what": None}]
    pq.write_table(pa.Table.from_pylist(rows), tmp_path / "runs" / "run000" / "ranking.parquet")
    assert read_class(tmp_path / "runs").titles == {"slow": "samples at 20 Hz"}


def test_contacts_are_grouped_by_every_task_stage_and_vr_type(tables_of):
    """The groups are all tasks, stages and VR types that contacts of the runs have; some contacts have no task."""
    runs, tables = tables_of(**EIGHT_STUDENTS)
    episodes = runs.tables["episodes"].to_pylist()
    names = {("task", row["task"] or NO_NAME) for row in episodes}
    names |= {("stage", row["stage"] or NO_NAME) for row in episodes}
    names |= {("VR type", row["vr_type"] or NOT_STATED) for row in episodes}
    assert ("task", NO_NAME) in names
    assert {(row["what"], row["which"]) for row in tables.activity_table().plain()} == names
