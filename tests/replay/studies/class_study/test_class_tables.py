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


def all_tables(made):
    """All tables of a class."""
    return [make() for make in (made.detectors, made.pairs, made.activity_table, made.causes)]


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("students", "nobody", "few"), [(1, 0, 1), (4, 0, 1), (5, 0, 0), (6, 6, 1), (6, 1, 0)])
def test_class_below_five_students_lists_sessions_without_figures(tables_of, tmp_path, students, nobody, few):
    """Six sessions of so many students, ``nobody`` of them without a name; ``few``: below five are known."""
    runs, made = tables_of(sessions=6, students=students, nobody=nobody, rare=0, detectors={"slow": 0.9}, contacts=20)
    known = min(students, 6 - nobody)
    tables = all_tables(made)
    for table in tables:
        index = table.head.index("n")
        assert table.rows or not known
        for row in table.rows:
            hidden = row[index] == "fewer than 5"
            assert hidden == all(figure == "" for figure in row[index + 1 :])
            assert hidden >= bool(few)
    table_of_detectors, *_ = tables
    assert (known in table_of_detectors.column("n")) != bool(few)
    notes = " ".join(table_of_detectors.notes)
    output = f"{nobody} of 6 sessions state no pseudonym: they are in the list of sessions and in no figure."
    assert (output in notes) == bool(nobody)
    counts = class_counts(runs)
    assert counts.startswith(f"{'fewer than 5' if few else known} students, 6 sessions")
    assert bool(made.headlines()) == ("contacts" in counts) != bool(few)
    where = places(runs, tmp_path)
    student_of = {where[run][0]: runs.shared_value(run, "student") for run in runs.metrics}
    listed = {student_of[row[0].text] for row in sessions_table(runs, where).rows} - {""}
    assert len(listed) == min(5, known)
    html = study_html(runs, where)
    assert "is not known, since there is no questionnaire." in html
    assert ("There is none in the sessions with a pseudonym." in html) == (not known)


def test_small_cells_cannot_be_derived_from_totals(tables_of, tmp_path):
    """A cell below five students is hidden; so is a second one, which else follows from the total."""
    runs, _ = tables_of(sessions=8, students=8, detectors={"slow": 0.9}, contacts=20)
    item = runs.tables["misses"].to_pylist()[0]
    # Thirty misses: of one cause by all eight students, of one by seven, and of one by three alone.
    counts = {"search": (8, 1), "budget ran out": (7, 2), "late": (3, 3)}
    misses = [
        item | {"place": position, "cause": cause}
        for cause, (students, each) in counts.items()
        for position in [*range(students)] * each
    ]
    misses = pa.Table.from_pylist(misses, schema=runs.tables["misses"].schema)
    made = ClassTables(replace(runs, tables=runs.tables | {"misses": misses}))
    printed = {row["cause"]: row["n"] for row in made.causes().plain() if row["what"] == "miss"}
    assert printed["late"] == "fewer than 5" and printed["search"] == 8
    # Else its nine misses are the total less the two rows that are shown.
    assert printed["budget ran out"] == "not shown"
    sessions = sessions_table(runs, places(runs, tmp_path))
    assert [column.name for column in sessions.columns] == ["session", "look at", "by"] and len(sessions.rows) == 5


def test_class_page_without_an_audit_states_its_absence(tables_of, tmp_path):
    """Runs of the reference alone: neither pairs nor causes of misses, and no sentence about them."""
    runs, made = tables_of(sessions=5, students=5, detectors={})
    assert [(row["detector"], row["is"]) for row in made.detectors().plain()] == [("exact", "trusted")]
    assert not made.pairs().rows and not made.causes().rows and made.headlines() == []
    links = sessions_table(runs, places(runs, tmp_path)).column("look at")
    assert {link.text for link in links} == {"not audited"}
    html = study_html(runs, places(runs, tmp_path))
    assert html.count("There is none in the sessions with a pseudonym.") == 2


def test_duplicate_sessions_and_runs_without_metrics_are_left_out(tmp_path):
    """A copy of one run, and one of another without its metrics: all figures stay, and notes say why."""
    made_class(tmp_path / "a", sessions=6, students=6)
    before = all_tables(ClassTables(read_class(tmp_path)))
    shutil.copytree(tmp_path / "a" / "run003", tmp_path / "b" / "again")
    shutil.copytree(tmp_path / "a" / "run004", tmp_path / "b" / "bare")
    (tmp_path / "b" / "bare" / "metrics.parquet").unlink()
    after = all_tables(ClassTables(read_class(tmp_path)))
    assert [item.rows for item in after] == [item.rows for item in before]
    output = " ".join(after[0].notes)
    assert "Runs left out because their session is there already: 1." in output
    assert "Runs left out because they have no metrics: 1." in output
    assert "Runs left out" not in " ".join(before[0].notes)


def test_students_file_assigns_sessions_to_students(tmp_path):
    """Six sessions by three detectors are 18 rows."""
    made_class(tmp_path / "runs", sessions=6, students=6, nobody=6, rare=0)
    named = tmp_path / "students.csv"
    named.write_text("session,student\n" + "".join(f"{k:016x},S{k}\n" for k in range(6)))
    assert read_class(tmp_path / "runs", named).students == [f"S{k}" for k in range(6)]
    assert len(read_class(tmp_path / "runs", named).as_metrics()) == 18
    with pytest.raises(StudyRefusedError, match="ids"):
        read_class(tmp_path / "runs").as_metrics()
    made_class(tmp_path / "more", sessions=1, students=1)
    shutil.move(tmp_path / "more" / "run000", tmp_path / "runs" / "run009")
    with pytest.raises(StudyRefusedError, match="belongs to two students"):
        read_class(tmp_path / "runs")


def test_class_headline_explains_students_missing_from_n(tables_of):
    """The contacts of the first five students are removed."""
    runs, made = tables_of(sessions=12, students=12, detectors={"slow": 0.9}, contacts=20)
    assert made.headlines()[0].count(", 12 students) and reports ")
    without = [row for row in runs.tables["episodes"].to_pylist() if row["place"] >= 5]
    schema = runs.tables["episodes"].schema
    fewer = replace(runs, tables=runs.tables | {"episodes": pa.Table.from_pylist(without, schema=schema)})
    sentence = ClassTables(fewer).headlines()[0]
    assert "7 of 12 students; the others had no contact to miss" in sentence


@pytest.mark.slow
def test_class_page_names_the_detector_with_most_deviating_rate(tables_of, tmp_path):
    """The mean over students, each by the mean of their sessions."""
    runs, made = tables_of(sessions=12, students=6, contacts=20)
    by_detector = {}
    for label in ("exact", *runs.audited_detectors):
        of_student = {}
        for rows in runs.metrics.values():
            of_student.setdefault(rows[label]["student"], []).append(rows[label]["contacts_per_min"])
        by_detector[label] = fmean(map(fmean, of_student.values()))
    slow, exact = by_detector["slow"], by_detector["exact"]
    assert slow < by_detector["coarse"] < exact
    fewer = f"-{100 * (1 - slow / exact):.0f} %"
    assert made.rate_difference() == f"slow reports {slow:.3g} contacts a minute, exact {exact:.3g} ({fewer})."
    assert made.rate_difference() in study_html(runs, places(runs, tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("state", ["equal", "few students", "other sessions"])
def test_rate_difference_is_omitted_where_rates_cannot_differ(tables_of, state):
    """Contacts a minute of both detectors are equal, of four students, or of unlike sessions."""
    runs, made = tables_of(
        sessions=8, students=4 if state == "few students" else 8, detectors={"slow": 0.5}, contacts=20
    )
    rows = [dict(own) for own in runs.metrics.values()]
    if state == "equal":
        rows = [own | {"slow": own["slow"] | {"contacts_per_min": own["exact"]["contacts_per_min"]}} for own in rows]
    if state == "other sessions":
        del rows[0]["slow"]
    changed = replace(runs, metrics=dict(zip(runs.metrics, rows, strict=True)))
    assert ClassTables(changed).rate_difference() == ""
    assert bool(made.rate_difference()) == (state != "few students")


@pytest.mark.slow
def test_contact_seconds_are_a_recount_of_contacts_by_minutes(tables_of):
    """Seconds of all contacts by all minutes with poses: of every student, and of some."""
    runs, made = tables_of(sessions=8, students=8)
    members = {"S01", "S02", "S03", "S04", "S05", *runs.students[:2]}
    seconds, minutes = {}, {}
    for run, rows in runs.metrics.items():
        owner = runs.shared_value(run, "student")
        minutes[owner] = minutes.get(owner, 0.0) + (next(iter(rows.values()))["valid_minutes"] or 0.0)
    places_of = [*runs.metrics]
    for row in runs.tables["episodes"].to_pylist():
        owner = runs.shared_value(places_of[row["place"]], "student")
        seconds[owner] = seconds.get(owner, 0.0) + row["end"] - row["start"]
    for chosen in (None, members):
        known = [name for name in runs.students if chosen is None or name in chosen]
        estimate = made.contact_seconds_a_minute(chosen)
        assert estimate.students == len(known)
        assert estimate.value == pytest.approx(
            sum(seconds.get(name, 0.0) for name in known) / sum(minutes[name] for name in known)
        )


def test_head_counts_false_contacts_of_each_detector(tables_of):
    """The only detector's false contacts, by the number of sessions."""
    runs, made = tables_of(sessions=8, students=8, detectors={"slow": 0.9}, contacts=20)
    (line,) = made.headlines()
    false = [row for row in runs.tables["false_contacts"].to_pylist() if row["detector"] == "slow"]
    expected = f"{len(false) / len(runs.metrics):.2g} false contacts a session" if false else "no false contact"
    assert line.startswith("slow misses ") and expected in line


def test_every_class_table_notes_that_n_counts_students(tables_of):
    """Tables of detectors, pairs, activities and causes."""
    _, made = tables_of(sessions=8, students=8)
    assert all("n counts the students" in " ".join(table.notes) for table in all_tables(made))


def test_sessions_are_named_by_code_and_tell_repeats_apart(tables_of, tmp_path):
    """Eight sessions of five students, the last of nobody: it is named by its id; all names differ."""
    runs, _ = tables_of(sessions=8, students=5, nobody=1)
    names = {run: name for run, (name, _) in places(runs, tmp_path).items()}
    assert len({*names.values()}) == len(names)
    for run, name in names.items():
        student = runs.shared_value(run, "student")
        assert name.split(",")[0] == (student or runs.shared_value(run, "session"))


def test_titles_of_detectors_come_from_the_ranking_of_a_run(tmp_path):
    """The ranking has a title of ``slow`` and none of ``bare``."""
    made_class(tmp_path / "runs", sessions=1, students=1)
    rows = [{"detector": "slow", "what": "samples at 20 Hz"}, {"detector": "bare", "what": None}]
    pq.write_table(pa.Table.from_pylist(rows), tmp_path / "runs" / "run000" / "ranking.parquet")
    assert read_class(tmp_path / "runs").titles == {"slow": "samples at 20 Hz"}


def test_contacts_are_grouped_by_every_task_stage_and_vr_type(tables_of):
    """Expected are all that the contacts of the runs have; some are in no task."""
    runs, made = tables_of(sessions=12, students=12, detectors={"slow": 0.9}, contacts=20)
    episodes = runs.tables["episodes"].to_pylist()
    names = {("task", row["task"] or NO_NAME) for row in episodes}
    names |= {("stage", row["stage"] or NO_NAME) for row in episodes}
    names |= {("VR type", row["vr_type"] or NOT_STATED) for row in episodes}
    rows = made.activity_table().plain()
    assert {(row["what"], row["which"]) for row in rows} == names and ("task", NO_NAME) in names
