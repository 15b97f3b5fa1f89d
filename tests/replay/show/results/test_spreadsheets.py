"""Tables for other programs hold what Parquet holds, with units, and no cell runs."""

import csv
import sys

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.report_states import run_with_steady_times
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.errors import OutputError
from replay.show.results.spreadsheets import headings, inert_value, require_form, write_run_tables, write_tables
from sessions import write_session

FORMULAS = {
    "=": "=1+1",
    "+": "+1",
    "-": "-2+3",
    "@": "@SUM(A1)",
    "link": '=HYPERLINK("http://x")',
    "wide =": "\uff1d1+1",
    "tab before": "\t=1",
    "blank before": " =1",
    "no-break space before": "\u00a0=1",
    "zero-width space before": "\u200b=1",
    "byte order mark before": "\ufeff+1",
    "control character before": "\x01@SUM(A1)",
    "blank before wide @": " \uff20SUM(A1)",
    "right-to-left override before": "\u202e-2+3",
    "right-to-left override alone": "\u202e",
    "plain text": "plain",
    "empty text": "",
}
"""Texts that spreadsheets take for formulas, or might; the last two are none."""


@pytest.fixture(scope="module")
def run_with_formula_name(tmp_path_factory):
    """A written run of two cubes, one of whose names is a formula to a spreadsheet."""
    session = unit_cubes_on_x({"=cmd|' /C calc'!A0": MEET_IN_4_AND_8_TO_10["a"], "b": MEET_IN_4_AND_8_TO_10["b"]})
    out = tmp_path_factory.mktemp("run") / "run"
    return replay.run(session, detectors="slow=discrete[rate_hz=5]", out=out, picture=False)


def csv_rows(path):
    """The cells of a file, row by row."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        return [*csv.reader(file)]


def text_of(value):
    """The text of a value in a CSV, which no program takes for a formula."""
    return "" if value is None else str(inert_value(value))


def test_csv_has_the_rows_of_parquet_and_units_in_headings(run_with_formula_name):
    """Each Parquet table of a run gets a CSV beside it: units in its headings, and no cell that runs as a formula."""
    assert write_run_tables(run_with_formula_name.out, "csv") == []
    files = [*run_with_formula_name.out.glob("*.parquet")]
    assert files
    for file in files:
        table = pq.read_table(file)
        head, *rows = csv_rows(file.with_suffix(".csv"))
        assert head == headings(table.column_names, file.stem)
        assert rows == [[text_of(value) for value in row.values()] for row in table.to_pylist()]
    head, *_rows = csv_rows(run_with_formula_name.out / "misses.csv")
    assert {"start [s]", "cut_length [m]"} <= set(head)


def test_name_like_a_formula_has_an_apostrophe_in_csv(run_with_formula_name):
    """A body is called "=cmd|' /C calc'!A0", which a spreadsheet would run; an apostrophe before makes it text."""
    write_run_tables(run_with_formula_name.out, "csv")
    _head, *rows = csv_rows(run_with_formula_name.out / "misses.csv")
    assert any(cell.startswith("'=cmd") for row in rows for cell in row)


@pytest.mark.slow
def test_workbook_holds_the_rows_of_parquet_as_numbers_and_text(run_with_formula_name):
    """Each Parquet table of a run is a sheet, of which that of misses is compared: headings, values, and no formula.

    A body is called like a formula. Numbers agree to 12 digits, of which Excel keeps 15.
    """
    openpyxl = pytest.importorskip("openpyxl")
    assert write_run_tables(run_with_formula_name.out, "xlsx") == []
    book = openpyxl.load_workbook(run_with_formula_name.out / "tables.xlsx")
    assert set(book.sheetnames) == {file.stem for file in run_with_formula_name.out.glob("*.parquet")}
    table, (head, *rows) = pq.read_table(run_with_formula_name.out / "misses.parquet"), [*book["misses"].rows]
    assert rows
    assert [cell.value for cell in head] == headings(table.column_names, "misses")
    for cells, row in zip(rows, table.to_pylist(), strict=True):
        assert [rounded(cell.value) for cell in cells] == [rounded(value) for value in row.values()]
        assert FORMULA_CELL not in {cell.data_type for cell in cells}


FORMULA_CELL = "f"
"""The type of a cell that is a formula, by openpyxl."""


def rounded(value):
    """A number of twelve digits; text as it is, empty text as none."""
    return float(f"{value:.12g}") if isinstance(value, int | float) else value or None


@pytest.fixture
def table_of_formulas():
    """A table with a column for each of ``FORMULAS``, its heading and its first cell, and a column of numbers."""
    texts = {text or "name": [text, "x"] for text in FORMULAS.values()}
    return pa.table(texts | {"number": [-1.5, 2.0]})


def test_no_text_becomes_a_formula_in_csv(table_of_formulas, tmp_path):
    """Each text is a heading and a cell. Spreadsheets ignore some characters before the sign that begins a formula."""
    assert write_tables({"t": table_of_formulas}, tmp_path, form="csv") == []
    (*head, _), (*cells, number), _ = csv_rows(tmp_path / "t.csv")
    ignored = " \u00a0\u200b\ufeff\x01\u202e"
    begins_formula = ("=", "+", "-", "@", "\t", "\uff1d", "\uff0b", "\uff0d", "\uff20")
    for name, heading, cell in zip(FORMULAS, head, cells, strict=True):
        assert not heading.lstrip(ignored).startswith(begins_formula), name
        assert not cell.lstrip(ignored).startswith(begins_formula), name
    assert number == "-1.5"  # a number is none


def test_no_text_becomes_a_formula_or_link_in_a_workbook(table_of_formulas, tmp_path):
    """Texts that Excel might take for formulas are headings and cells of a sheet: none is a formula or a link."""
    openpyxl = pytest.importorskip("openpyxl")
    assert write_tables({"t": table_of_formulas}, tmp_path, form="xlsx") == []
    cells = [cell for row in openpyxl.load_workbook(tmp_path / "tables.xlsx")["t"].rows for cell in row]
    assert len(cells) == 3 * (len(FORMULAS) + 1)  # a heading and two cells a column
    assert [cell.value for cell in cells if cell.data_type == FORMULA_CELL] == []
    assert [cell.hyperlink for cell in cells if cell.hyperlink] == []


def test_only_a_text_that_begins_like_a_formula_is_changed():
    """An apostrophe before a text tells a spreadsheet that it is text; a tab may begin a formula as "=" does."""
    inert_by_text = {
        "a=1": "a=1",  # sign within
        "a =1": "a =1",  # sign after a blank within
        "\tplain": "'\tplain",
        " plain": " plain",
        "=": "'=",
        " ": " ",
        " =1": "' =1",
        "\u200b=1": "'\u200b=1",  # after a space without width
        "\u00a0-": "'\u00a0-",  # after a no-break space
    }
    assert {text: inert_value(text) for text in inert_by_text} == inert_by_text


def test_missing_package_is_named_for_workbooks_alone(monkeypatch):
    """XlsxWriter, which only Excel workbooks need, is made impossible to import: CSV is no error."""
    monkeypatch.setitem(sys.modules, "xlsxwriter", None)
    require_form("csv")
    with pytest.raises(OutputError, match="XlsxWriter"):
        require_form("xlsx")


def test_only_the_requested_form_of_a_table_is_written(tmp_path):
    """A table as Parquet reads back the same; nothing else is written."""
    table = pa.table({"a": [1, 2]})
    assert write_tables({"t": table}, tmp_path, "parquet") == []
    assert [file.name for file in tmp_path.iterdir()] == ["t.parquet"]
    assert pq.read_table(tmp_path / "t.parquet").equals(table)


def test_large_stamps_stay_exact_in_a_workbook(tmp_path):
    """Excel keeps 15 digits of a number: a stamp of 19 digits is written as text, 5 as a number."""
    openpyxl = pytest.importorskip("openpyxl")
    write_tables({"events": pa.table({"stamp_ns": [1709283600000000001, 5]})}, tmp_path, form="xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "tables.xlsx")["events"]
    assert [cell.value for (cell,) in sheet.rows] == ["stamp_ns [ns]", "1709283600000000001", 5]


def test_table_too_long_for_excel_is_omitted_with_a_sentence(tmp_path, monkeypatch):
    """The limit of rows of a sheet is lowered to 2; of two tables ``long`` has 3 rows, ``short`` has 1."""
    pytest.importorskip("xlsxwriter")
    monkeypatch.setattr("replay.show.results.spreadsheets.MOST_ROWS", 2)
    tables = {"long": pa.table({"a": [1, 2, 3]}), "short": pa.table({"a": [1]})}
    sentences = write_tables(tables, tmp_path, form="xlsx")
    assert sentences == ["long has 3 rows, more than an Excel sheet holds: use its Parquet file"]


def test_missing_package_for_excel_is_a_clear_error(tmp_path, monkeypatch):
    """None in ``sys.modules`` makes the import of a package fail."""
    monkeypatch.setitem(sys.modules, "xlsxwriter", None)
    with pytest.raises(OutputError, match=r'Excel tables need XlsxWriter: pip install "vrlab-replay\[excel\]"'):
        write_tables({"t": pa.table({"a": [1]})}, tmp_path, form="xlsx")


@pytest.mark.parametrize("package", ["pandas", "polars"])
def test_missing_package_for_data_frames_is_a_clear_error(package, monkeypatch, run_with_formula_name):
    """``to_pandas`` and ``to_polars`` of a result; None in ``sys.modules`` makes the import of a package fail."""
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(OutputError, match=f"{package} is not installed; pip install {package}"):
        getattr(run_with_formula_name, f"to_{package}")("misses")


def test_result_gives_pandas_frames_of_its_tables(run_with_formula_name):
    """A row a miss of the detector ``slow``, without a student (""); metrics of it and of the reference (exact)."""
    misses = run_with_formula_name.to_pandas("misses")
    assert misses["student"].tolist() == [""] * len(run_with_formula_name.misses["slow"])
    assert len(misses) > 0
    assert set(run_with_formula_name.to_pandas("metrics")["detector"]) == {"slow", "exact"}


def test_result_gives_polars_frames_of_its_tables(run_with_formula_name):
    """``to_polars`` of a result; skipped where polars is not installed."""
    polars = pytest.importorskip("polars")
    assert isinstance(run_with_formula_name.to_polars("episodes"), polars.DataFrame)


def test_unknown_table_of_a_result_is_refused_with_a_list(run_with_formula_name):
    """The name lacks an s; there is no table ``frame``."""
    with pytest.raises(OutputError, match="no table 'frame'; there are: episodes, misses, false, events, metrics"):
        run_with_formula_name.to_pandas("frame")


def test_replacing_a_run_takes_its_spreadsheets_away(tmp_path):
    """CSV and Excel tables are written into a run folder, which another run replaces: they go, mine.csv stays."""
    result = replay.RunResult.of(run_with_steady_times("no contact")).write(tmp_path / "run", picture=False)
    files_of_run = {file.name for file in result.out.iterdir()}
    for form in ("csv", "xlsx"):
        write_run_tables(result.out, form)
    assert {file.suffix for file in result.out.iterdir()} >= {".csv", ".xlsx"}
    (result.out / "mine.csv").write_text("a")
    result.write(tmp_path / "run", force=True, picture=False)
    assert {file.name for file in (tmp_path / "run").iterdir()} == files_of_run | {"mine.csv"}


@pytest.mark.parametrize("state", ["no contact", "no reference", "effects"])
def test_every_state_has_spreadsheets(state, tmp_path):
    """A run without any contact, without a reference, or with effects alone: each of its tables has a CSV.

    Sentences about tables that are left out would be returned.
    """
    result = replay.RunResult.of(run_with_steady_times(state)).write(tmp_path / "run", picture=False)
    assert write_run_tables(result.out, "csv") == []
    tables = {file.stem for file in result.out.glob("*.parquet")}
    assert tables == {file.stem for file in result.out.glob("*.csv")} != set()


@pytest.fixture
def sessions_like_formulas(tmp_path):
    """Two session files, "first" and "=second", each with a body that is called like a formula."""
    for name in ("first", "=second"):
        session = unit_cubes_on_x({"=cmd|' /C calc'!A0": MEET_IN_4_AND_8_TO_10["a"], "b": MEET_IN_4_AND_8_TO_10["b"]})
        write_session(session, tmp_path / f"{name}.mcap")
    return [str(file) for file in sorted(tmp_path.glob("*.mcap"))]


def run_batch(sessions, form, out):
    """Runs the command ``replay run`` over these sessions with tables over all runs in one form."""
    command = ["run", *sessions, "-o", str(out), "--tables", form, "--detectors", "slow=discrete[rate_hz=5]", "-q"]
    command += ["--no-picture"]
    assert main(command) == 0


def require_same_tables(written, tables):
    """Asserts that rows with their headings, by table, are as many as those of the tables of ``replay.read``."""
    assert set(written) == set(tables)
    for name, table in tables.items():
        head, *rows = written[name]
        assert head == headings(table.column_names, name)
        assert len(rows) == len(table)


def runs_of(misses):
    """Names of runs in rows of misses, whose first row has the headings."""
    head, *rows = misses
    return {row[head.index("run")] for row in rows}


def test_csv_tables_of_a_batch_hold_rows_of_all_runs(sessions_like_formulas, tmp_path):
    """Two sessions, "first" and "=second", run by one command: a CSV a table, as ``replay.read`` joins them.

    Names of a session and of a body begin like a formula; in the files an apostrophe stands before them.
    """
    out = tmp_path / "out"
    run_batch(sessions_like_formulas, "csv", out)
    written = {file.stem: csv_rows(file) for file in out.glob("*.csv")}
    require_same_tables(written, replay.read(out))
    assert runs_of(written["misses"]) == {"first", "'=second"}
    cells = [cell for rows in written.values() for row in rows for cell in row]
    assert any("=cmd" in cell for cell in cells)
    assert [cell for cell in cells if cell.startswith("=")] == []


@pytest.mark.slow
def test_workbook_of_a_batch_holds_rows_of_all_runs(sessions_like_formulas, tmp_path):
    """Two sessions, "first" and "=second", run by one command: a sheet a table, as ``replay.read`` joins them.

    Names of a session and of a body begin like a formula, but no cell is one.
    """
    openpyxl = pytest.importorskip("openpyxl")
    out = tmp_path / "out"
    run_batch(sessions_like_formulas, "xlsx", out)
    book = openpyxl.load_workbook(out / "tables.xlsx")
    cells = [cell for sheet in book for row in sheet.rows for cell in row]
    assert FORMULA_CELL not in {cell.data_type for cell in cells}
    assert any("=cmd" in str(cell.value) for cell in cells)
    written = {sheet.title: [[cell.value for cell in row] for row in sheet.rows] for sheet in book}
    require_same_tables(written, replay.read(out))
    assert runs_of(written["misses"]) == {"first", "=second"}
