"""A column of a table is one row of one list: every output shows it, and Parquet holds its number."""

import csv
import re
from dataclasses import replace
from html import unescape
from io import StringIO

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
from replay.show.results.data_set import DATA_SET
from replay.show.results.parquet import COLUMN_TYPES
from replay.show.results.run_folder import read_run_folder, write_run_folder
from replay.show.results.spreadsheets import headings, write_tables
from replay.show.run_tables import stored_tables
from replay.show.sections import SECTIONS, SectionName

OUTPUTS = ("terminal", "Markdown", "report", "notebook", "picture")
NEW = Column("probe", float, of=lambda rank: 40.0 + len(rank.label), show=lambda value: f"probe-{value:.0f}")


def terminal_text(result):
    """The screen of a run as text."""
    console = Console(width=200, file=StringIO())
    console.print(run_screen(result))
    return console.file.getvalue()


def texts_of(result, folder):
    """Output -> its text, of every output of a run."""
    notebook = replay.RunResult.of(result)
    return {
        "terminal": terminal_text(result),
        "Markdown": run_markdown(result, ()),
        "report": unescape((folder / "report.html").read_text(encoding="utf-8")),
        "notebook": repr(notebook) + notebook._repr_html_(),
        "picture": ranking_text(result),
    }


@pytest.fixture(scope="module")
def texts(tmp_path_factory):
    """A run, its folder, and its texts, once as they are and once with one more row in the table of columns."""
    result, folder = run_with_steady_times("several"), tmp_path_factory.mktemp("runs")
    before = texts_of(result, write_run_folder(result, folder / "before"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(columns.COLUMNS, "ranking", (*columns.COLUMNS["ranking"], NEW))
        after = texts_of(result, write_run_folder(result, folder / "after"))
    return result, folder / "after", before, after


def test_column_added_to_the_table_appears_in_every_output(texts):
    """A column "probe" is added to the table of columns, and to nothing else, between the texts before and after."""
    result, _, before, after = texts
    cells = {f"probe-{40 + len(rank.label)}" for rank in result.ranking}
    for output in OUTPUTS:
        assert cells <= set(re.findall(r"probe-\d+", after[output])), output
        assert "probe" not in before[output], output


def test_a_new_column_is_a_column_in_parquet(texts):
    """The cell of a column is text (probe-45), the file has its number: 40 and the letters of the label."""
    result, folder, *_ = texts
    rows = pq.read_table(folder / "ranking.parquet").to_pylist()
    assert {row["detector"]: row["probe"] for row in rows} == {
        rank.label: 40.0 + len(rank.label) for rank in ranks_with_fixes(result.ranking, result.document)
    }


def test_parquet_holds_the_numbers_behind_the_cells(texts):
    """Counts are fractions times contacts, seconds are milliseconds; the reference, the last rank, misses nothing."""
    result, folder, *_ = texts
    rows = {row["detector"]: row for row in pq.read_table(folder / "ranking.parquet").to_pylist()}
    for rank in ranks_with_fixes(result.ranking, result.document)[:-1]:
        row = rows[rank.label]
        assert row["missed"] == pytest.approx(rank.missed.value * rank.contacts)
        assert row["late_or_cut_short"] == pytest.approx(rank.late_or_cut_short.value * rank.contacts)
        assert row["false_contact"] == rank.false.value
        assert row["mean_ms"] == pytest.approx(1e3 * rank.mean)
        assert row["loss"] == rank.loss
    assert rows[result.oracle]["missed"] is None


TABLES = ("ranking", "misses", "false", "times", "session", "effects")
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
def faulty():
    """A run with misses, false contacts and an effect."""
    places = POSITIONS | {"b": [3, 0.9, 3, 1.01, 3, 3, 3, 3]}
    box = "box=collider[shape=box,skin_m=0.05]"
    return with_steady_times(compute(unit_cubes_on_x(places, scene=SCENE), detectors=f"{TWO},{box}", oracle="exact"))


def test_new_column_of_any_table_reaches_five_outputs(faulty, monkeypatch):
    """A column with a marker in its cells is added to each table in turn."""
    for table in TABLES:
        marker = replace(MARKER, of=lambda row, table=table: f"marker-cell-of-{table}")
        monkeypatch.setitem(columns.COLUMNS, table, (*columns.COLUMNS[table], marker))
    texts = all_texts(faulty)
    assert texts.keys() == set(OUTPUTS)
    absent = [(table, output) for table in TABLES for output in OUTPUTS if f"-of-{table}" not in texts[output]]
    assert absent == []


FILE_TABLES = (*TABLES, "episodes", "events")
MEASURED = replace(MARKER, dtype=float, unit="m", of=lambda row: 2.5, show=lambda value: "marker-cell")


@pytest.fixture
def folder_with_columns(faulty, tmp_path, monkeypatch):
    """The folder of a run with one more row in the declaration of every table."""
    for name in FILE_TABLES:
        monkeypatch.setitem(columns.COLUMNS, name, (*columns.COLUMNS[name], MEASURED))
    tables = result_tables(faulty)
    document = structs.replace(
        faulty.document, tables={name: stored_table(name, table) for name, table in tables.items()}
    )
    folder = tmp_path / "run"
    write_run_folder(replace(faulty, tables=tables, document=document), folder)
    return folder


def test_new_column_reaches_parquet_csv_and_reader(folder_with_columns):
    """The column has 2.5 in every row of every table of the folder."""
    folder = folder_with_columns
    for name in FILE_TABLES:
        table = pq.read_table(folder / f"{name}.parquet")
        assert set(table["probe"].to_pylist()) == {2.5}, name
        write_tables({name: table}, folder, "csv")
        head, *rows = csv.reader((folder / f"{name}.csv").read_text(encoding="utf-8-sig").splitlines())
        assert {row[head.index("probe")] for row in rows} == {"2.5"}, name
    run = read_run_folder(folder)
    for name in ("episodes", "misses", "false", "events"):
        assert {row["probe"] for row in run.rows(name)} == {2.5}, name


def test_every_column_of_a_run_folder_is_declared(faulty, tmp_path):
    """Each column of each file has the type of its declaration; with a slash, that of the name up to the slash."""
    tried = Tradeoff(
        rows=(price_row("exact", ms=1.0, missed=0, front=True),),
        front=("exact",),
        advice=("No advice.",),
        cut=(),
        about=ABOUT,
    )
    write_run_folder(replace(faulty, tradeoff=tried), tmp_path / "run")
    files = {file.stem: pq.read_table(file) for file in (tmp_path / "run").glob("*.parquet")}
    assert files.keys() == columns.FILE_TABLES.keys()
    for name, table in files.items():
        declared = {column.name: COLUMN_TYPES[column.dtype] for column in columns.FILE_TABLES[name].columns}
        for field in table.schema:
            beginning, slash, _ = field.name.partition("/")
            type_ = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
            assert type_ == declared[beginning + slash], (name, field.name)


def test_a_heading_has_the_unit_that_its_table_declares():
    """Columns without a unit, or that no table has (probe), stay as they are."""
    assert headings(["start", "cut_length", "frames"], "misses") == ["start [s]", "cut_length [m]", "frames"]
    assert headings(["mean_ms", "missed"], "ranking") == ["mean_ms [ms]", "missed"]
    assert headings(["seconds/exact/broad", "frame"], "timing") == ["seconds/exact/broad [s]", "frame"]
    assert headings(["gap", "probe"], "false_contacts") == ["gap [m]", "probe"]


def test_parquet_columns_use_the_unit_in_their_name(faulty):
    """Columns named ``_ms`` and ``percent`` are converted from the seconds and fractions of the document."""
    (times, *_), (effect, *_) = (stored_tables(faulty)[name].plain() for name in ("times", "effects"))
    seconds = faulty.document.detectors[times["detector"]].seconds
    samples = seconds.sample_times
    assert times["mean_ms"] == pytest.approx(1e3 * seconds.per_frame_mean)
    assert times["95_percent_ms"] == pytest.approx(1e3 * samples.p95) and times["worst_ms"] == 1e3 * samples.max
    assert times["whole_s"] == seconds.detect and times["over_11.1_ms"] == samples.over_budget
    record = faulty.document.effects[effect["effect"]]
    assert effect["percent_of_the_run"] == pytest.approx(100 * record.fraction)
    assert effect["ms"] == pytest.approx(1e3 * record.seconds)


def test_every_output_renders_answer_and_ranking_of_the_list(faulty, monkeypatch):
    """Each section gets a sentence with a marker, which every output must hold."""
    sections = {name: SECTIONS[name] for name in (SectionName.ANSWER, SectionName.RANKING)}
    for name, section_of_run in sections.items():

        def with_marker(run, name=name, section_of_run=section_of_run):
            section = section_of_run(run)
            sentences = (f"marker-sentence-of-{name}", *section.sentences[name is SectionName.ANSWER :])
            return replace(section, sentences=sentences)

        monkeypatch.setitem(SECTIONS, name, with_marker)
    texts = all_texts(faulty)
    markers = [f"marker-sentence-of-{name}" for name in sections]
    assert [(output, marker) for output in OUTPUTS for marker in markers if marker not in texts[output]] == []


def test_no_output_shows_a_column_that_no_table_has(faulty):
    """The marker that the tests above add is in none of the outputs as they are."""
    assert not [output for output, text in all_texts(faulty).items() if "marker-cell" in text]


def test_every_column_of_every_table_has_a_meaning():
    """It stands in the guide."""
    tables = columns.COLUMNS.items()
    assert [(table, column.name) for table, some in tables for column in some if not column.meaning] == []


def test_a_new_column_is_in_the_list_of_the_guide(monkeypatch, capsys):
    """A line has name, unit, type and meaning; sections have the columns of their tables, in order."""
    monkeypatch.setitem(columns.COLUMNS, "misses", (*columns.COLUMNS["misses"], replace(MEASURED, meaning="a probe")))
    assert main(["guide", "columns"]) == 0
    listed = capsys.readouterr().out
    assert "| `probe` | m | float64 | a probe |" in listed
    for name, table in columns.FILE_TABLES.items():
        section = listed.partition(f"## {name}.parquet")[2].partition("\n## ")[0]
        assert re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE) == [column.name for column in table.columns]


def test_the_guide_lists_the_tables_over_many_runs():
    """Tables that are joined over runs are those of the data set."""
    assert joined_tables() in page("many-sessions")
    assert [table.joined for table in columns.FILE_TABLES.values() if table.joined] == list(DATA_SET)
