"""A column of a table is one row of one list: every output shows it, and Parquet holds its number."""

import csv
import re
from dataclasses import replace
from html import unescape
from io import StringIO
from types import SimpleNamespace

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from msgspec import structs
from rich.console import Console
from support.report_states import ABOUT, POSITIONS, SCENE, TWO, price_row, run_with_steady_times, with_steady_times
from support.small_worlds import unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.cli.run_markdown import run_markdown
from replay.cli.run_tables import run_screen
from replay.cli.run_tables import run_tables as verbose_tables
from replay.document import columns
from replay.document.ranking import ranks_with_fixes
from replay.document.result_tables import result_tables, stored_table
from replay.document.run_result import Tradeoff
from replay.document.tables import Column
from replay.engine import compute
from replay.guide.pages import page
from replay.show.column_list import joined_tables
from replay.show.report.page import report_html
from replay.show.rerun_log.documents import answer_text, detector_text, ranking_text
from replay.show.results import run_folder
from replay.show.results.data_set import DATA_SET
from replay.show.results.parquet import COLUMN_TYPES
from replay.show.results.run_folder import read_run_folder, write_run_folder
from replay.show.results.spreadsheets import headings, write_tables
from replay.show.run_tables import stored_tables
from replay.show.sections import SECTIONS, SectionName

OUTPUTS = ("terminal", "Markdown", "report", "notebook", "picture")


def number_of_rank(rank):
    """A number that no other column has: 40 and the letters of the detector's label."""
    return 40.0 + len(rank.label)


def write_empty_report(_result, path):
    """Writes no report, whose drawing takes most of the time of a run folder."""
    path.touch()


NEW_COLUMN = Column("probe", float, of=number_of_rank, show=lambda value: f"probe-{value:.0f}")


def terminal_text(result):
    """The screen of a run as text."""
    console = Console(width=200, file=StringIO())
    console.print(run_screen(result))
    return console.file.getvalue()


def texts_of(result):
    """Output -> its text, of every output of a run."""
    notebook = replay.RunResult.of(result)
    return {
        "terminal": terminal_text(result),
        "Markdown": run_markdown(result, ()),
        "report": unescape(report_html(result)),
        "notebook": repr(notebook) + notebook._repr_html_(),
        "picture": ranking_text(result),
    }


@pytest.fixture(scope="module")
def run_with_new_column(tmp_path_factory):
    """A run, the texts of its outputs before and after ``NEW_COLUMN`` joins its ranking, and the folder written after.

    Nothing else is changed between the two.
    """
    result, folder = run_with_steady_times("several"), tmp_path_factory.mktemp("runs") / "after"
    before = texts_of(result)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(columns.COLUMNS, "ranking", (*columns.COLUMNS["ranking"], NEW_COLUMN))
        patch.setattr(run_folder, "write_report", write_empty_report)
        after = texts_of(result)
        write_run_folder(result, folder)
    return SimpleNamespace(result=result, folder=folder, texts_before=before, texts_after=after)


def test_column_added_to_the_table_appears_in_every_output(run_with_new_column):
    """The column "probe" is added to the list of columns of the ranking, and to nothing else.

    Each output has a cell "probe-N" for each detector of the ranking after that, and no "probe" before.
    """
    run = run_with_new_column
    cells = {NEW_COLUMN.show(number_of_rank(rank)) for rank in run.result.ranking}
    for output in OUTPUTS:
        assert cells <= set(re.findall(r"probe-\d+", run.texts_after[output])), output
        assert "probe" not in run.texts_before[output], output


def test_a_new_column_is_a_column_in_parquet(run_with_new_column):
    """People read text in its cells ("probe-45"); the file has the number, 45.0, for each detector and the fix."""
    result = run_with_new_column.result
    rows = pq.read_table(run_with_new_column.folder / "ranking.parquet").to_pylist()
    assert {row["detector"]: row["probe"] for row in rows} == {
        rank.label: number_of_rank(rank) for rank in ranks_with_fixes(result.ranking, result.document)
    }


def test_parquet_holds_the_numbers_behind_the_cells(run_with_new_column):
    """In memory a rank has fractions of the contacts and seconds; the file has numbers of contacts and milliseconds."""
    result = run_with_new_column.result
    rows = pq.read_table(run_with_new_column.folder / "ranking.parquet").to_pylist()
    row_of_detector = {row["detector"]: row for row in rows}
    *faulty_ranks, reference = ranks_with_fixes(result.ranking, result.document)
    for rank in faulty_ranks:
        row = row_of_detector[rank.label]
        assert row["missed"] == pytest.approx(rank.missed.value * rank.contacts)
        assert row["late_or_cut_short"] == pytest.approx(rank.late_or_cut_short.value * rank.contacts)
        assert row["false_contact"] == rank.false.value
        assert row["mean_ms"] == pytest.approx(1e3 * rank.mean)
        assert row["loss"] == rank.loss
    assert reference.label == result.oracle


def test_reference_has_no_count_of_missed_contacts_in_parquet(run_with_new_column):
    """Others are compared with the reference (the oracle); of itself it has null, not 0."""
    rows = pq.read_table(run_with_new_column.folder / "ranking.parquet").to_pylist()
    (missed,) = [row["missed"] for row in rows if row["detector"] == run_with_new_column.result.oracle]
    assert missed is None


TABLES = ("ranking", "misses", "false", "times", "session", "effects")
"""Tables that every output shows."""

MARKER = Column("probe", of=lambda row: "marker-cell")


def all_texts(result):
    """Output -> all that it says of a run."""
    console = Console(width=400, file=StringIO())
    console.print(run_screen(result), verbose_tables(result))
    pictured = [answer_text(result), *(detector_text(result, label) for label in result.comparisons)]
    return {
        "terminal": console.file.getvalue(),
        "Markdown": run_markdown(result, ()),
        "report": unescape(report_html(result)),
        "notebook": replay.RunResult.of(result)._repr_html_(),
        "picture": "".join(pictured),
    }


@pytest.fixture(scope="module")
def faulty_run():
    """A run with misses, false contacts and an effect, so that none of its tables is empty."""
    positions = POSITIONS | {"b": [3, 0.9, 3, 1.01, 3, 3, 3, 3]}
    box = "box=collider[shape=box,skin_m=0.05]"
    return with_steady_times(compute(unit_cubes_on_x(positions, scene=SCENE), detectors=f"{TWO},{box}", oracle="exact"))


def test_new_column_of_any_table_reaches_five_outputs(faulty_run, monkeypatch):
    """A column whose cells name their table is added to the list of columns of each of six tables.

    Every output shows all six, without a change of its own.
    """
    for table in TABLES:
        marker = replace(MARKER, of=lambda row, table=table: f"marker-cell-of-{table}")
        monkeypatch.setitem(columns.COLUMNS, table, (*columns.COLUMNS[table], marker))
    texts = all_texts(faulty_run)
    assert texts.keys() == set(OUTPUTS)
    absent = [
        (table, output) for table in TABLES for output in OUTPUTS if f"marker-cell-of-{table}" not in texts[output]
    ]
    assert absent == []


FILE_TABLES = (*TABLES, "episodes", "events")
"""Tables that a run folder has as files."""

MEASURED = replace(MARKER, dtype=float, unit="m", of=lambda row: 2.5, show=lambda value: "marker-cell")
"""A column "probe" of metres, 2.5 in every row."""


@pytest.fixture
def folder_with_new_column(faulty_run, tmp_path, monkeypatch):
    """The folder of a run with the column "probe" (2.5 m in every row) in the declaration of every table."""
    monkeypatch.setattr(run_folder, "write_report", write_empty_report)
    for name in FILE_TABLES:
        monkeypatch.setitem(columns.COLUMNS, name, (*columns.COLUMNS[name], MEASURED))
    tables = result_tables(faulty_run)
    document = structs.replace(
        faulty_run.document, tables={name: stored_table(name, table) for name, table in tables.items()}
    )
    folder = tmp_path / "run"
    write_run_folder(replace(faulty_run, tables=tables, document=document), folder)
    return folder


def test_new_column_reaches_parquet_csv_and_reader(folder_with_new_column):
    """The column "probe" was declared for every table, 2.5 in all rows: in Parquet, in CSV, and read back."""
    for name in FILE_TABLES:
        table = pq.read_table(folder_with_new_column / f"{name}.parquet")
        assert set(table["probe"].to_pylist()) == {2.5}, name
        write_tables({name: table}, folder_with_new_column, form="csv")
        csv_lines = (folder_with_new_column / f"{name}.csv").read_text(encoding="utf-8-sig").splitlines()
        head, *rows = csv.reader(csv_lines)
        assert {row[head.index("probe")] for row in rows} == {"2.5"}, name
    run = read_run_folder(folder_with_new_column)
    for name in ("episodes", "misses", "false", "events"):  # the tables that a folder is read back as rows of
        assert {row["probe"] for row in run.rows(name)} == {2.5}, name


def test_every_column_of_a_run_folder_is_declared(faulty_run, tmp_path, monkeypatch):
    """A run folder has a Parquet file for each declared table; each of its columns has the declared type.

    A name like "seconds/exact/broad" is declared by its beginning, "seconds/".
    """
    tradeoff = Tradeoff(
        rows=(price_row("exact", ms=1.0, missed=0, front=True),),
        front=("exact",),
        advice=("No advice.",),
        cut=(),
        about=ABOUT,
    )  # so that its table is written too
    monkeypatch.setattr(run_folder, "write_report", write_empty_report)
    write_run_folder(replace(faulty_run, tradeoff=tradeoff), tmp_path / "run")
    files = {file.stem: pq.read_table(file) for file in (tmp_path / "run").glob("*.parquet")}
    assert files.keys() == columns.FILE_TABLES.keys()
    for name, table in files.items():
        declared = {column.name: COLUMN_TYPES[column.dtype] for column in columns.FILE_TABLES[name].columns}
        for field in table.schema:
            beginning, slash, _ = field.name.partition("/")
            type_ = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
            assert type_ == declared[beginning + slash], (name, field.name)


def test_a_heading_has_the_unit_that_its_table_declares():
    """Headings for spreadsheets end in the unit in brackets; counts, numbers and unknown columns have none.

    "seconds/exact/broad" has the unit of "seconds/..."; ``false_contacts`` is the table ``false`` of many runs.
    """
    assert headings(["start", "cut_length", "frames"], "misses") == ["start [s]", "cut_length [m]", "frames"]
    assert headings(["mean_ms", "missed"], "ranking") == ["mean_ms [ms]", "missed"]
    assert headings(["seconds/exact/broad", "frame"], "timing") == ["seconds/exact/broad [s]", "frame"]
    assert headings(["gap", "no such column"], "false_contacts") == ["gap [m]", "no such column"]


def test_parquet_columns_use_the_unit_in_their_name(faulty_run):
    """The document of a run has seconds and fractions; columns named ms and percent are 1,000 and 100 times these."""
    tables = stored_tables(faulty_run)
    first_times, *_ = tables["times"].plain()
    first_effect, *_ = tables["effects"].plain()
    seconds = faulty_run.document.detectors[first_times["detector"]].seconds
    samples = seconds.sample_times
    assert first_times["mean_ms"] == pytest.approx(1e3 * seconds.per_frame_mean)
    assert first_times["95_percent_ms"] == pytest.approx(1e3 * samples.p95)
    assert first_times["worst_ms"] == 1e3 * samples.max
    assert first_times["whole_s"] == seconds.detect
    assert first_times["over_11.1_ms"] == samples.over_budget  # a fraction; 11.1 ms is the budget, not a unit
    effect = faulty_run.document.effects[first_effect["effect"]]
    assert first_effect["percent_of_the_run"] == pytest.approx(100 * effect.fraction)
    assert first_effect["ms"] == pytest.approx(1e3 * effect.seconds)


def test_every_output_renders_answer_and_ranking_of_the_list(faulty_run, monkeypatch):
    """The functions that make the sections *answer* and *ranking* are wrapped: a sentence with a marker comes first.

    In the answer it takes the place of the headline. All five outputs show both markers.
    """
    sections = {name: SECTIONS[name] for name in (SectionName.ANSWER, SectionName.RANKING)}
    for name, section_of_run in sections.items():

        def with_marker(run, name=name, section_of_run=section_of_run):
            section = section_of_run(run)
            replaced_count = 1 if name is SectionName.ANSWER else 0
            sentences = (f"marker-sentence-of-{name}", *section.sentences[replaced_count:])
            return replace(section, sentences=sentences)

        monkeypatch.setitem(SECTIONS, name, with_marker)
    texts = all_texts(faulty_run)
    markers = [f"marker-sentence-of-{name}" for name in sections]
    assert [(output, marker) for output in OUTPUTS for marker in markers if marker not in texts[output]] == []


def test_every_column_of_every_table_has_a_meaning():
    """The meaning of a column is a text of its declaration, which the guide prints."""
    columns_without_meaning = [
        (table, column.name)
        for table, declared_columns in columns.COLUMNS.items()
        for column in declared_columns
        if not column.meaning
    ]
    assert columns_without_meaning == []


def test_a_new_column_is_in_the_list_of_the_guide(monkeypatch, capsys):
    """The command ``replay guide columns`` prints name, unit, type and meaning of a column added to ``misses``."""
    new_column = Column("probe", float, unit="m", meaning="a probe", of=lambda row: 2.5)
    monkeypatch.setitem(columns.COLUMNS, "misses", (*columns.COLUMNS["misses"], new_column))
    assert main(["guide", "columns"]) == 0
    assert "| `probe` | m | float64 | a probe |" in capsys.readouterr().out


def test_guide_lists_the_columns_of_every_file_in_order(capsys):
    """``replay guide columns`` prints a section a Parquet file, with a line a column in the order of the file."""
    assert main(["guide", "columns"]) == 0
    printed = capsys.readouterr().out
    for name, table in columns.FILE_TABLES.items():
        section = printed.partition(f"## {name}.parquet")[2].partition("\n## ")[0]
        assert re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE) == [column.name for column in table.columns]


def test_the_guide_lists_the_tables_over_many_runs():
    """Some tables of a run are joined over runs under a name of their own: exactly those that ``replay.read`` returns.

    The page *many-sessions* of the guide has the list of them.
    """
    assert joined_tables() in page("many-sessions")
    assert [table.joined for table in columns.FILE_TABLES.values() if table.joined] == list(DATA_SET)
