"""Tables for other programs hold what Parquet holds, with units, and no cell runs."""

import csv
import sys

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.report_states import RUN_OF_STATE
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.errors import OutputError
from replay.show.results.spreadsheets import headings, inert_value, write_run_tables, write_tables
from sessions import write_session

HOSTILE = [
    "=1+1",
    "+1",
    "-2+3",
    "@SUM(A1)",
    "\t=1",
    " =1",
    '=HYPERLINK("http://x")',
    "\u202e",
    "plain",
    "",
    "\u00a0=1",
    "\u200b=1",
    "\ufeff+1",
    "\x01@SUM(A1)",
    "\uff1d1+1",
    " \uff20SUM(A1)",
    "\u202e-2+3",
]


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
    """Each table of a run; the name of a body that is a formula has an apostrophe before it."""
    assert write_run_tables(run_with_formula_name.out, "csv") == []
    for file in run_with_formula_name.out.glob("*.parquet"):
        table = pq.read_table(file)
        head, *rows = csv_rows(file.with_suffix(".csv"))
        assert head == headings(table.column_names, file.stem)
        assert rows == [[text_of(value) for value in row.values()] for row in table.to_pylist()]
    assert {"start [s]", "cut_length [m]"} <= {*csv_rows(run_with_formula_name.out / "misses.csv")[0]}
    assert any(cell.startswith("'=cmd") for row in csv_rows(run_with_formula_name.out / "misses.csv") for cell in row)


@pytest.mark.slow
def test_workbook_holds_the_rows_of_parquet_as_numbers_and_text(run_with_formula_name):
    """Each table is a sheet; no cell is a formula, and numbers agree to 12 digits, as Excel keeps 15."""
    openpyxl = pytest.importorskip("openpyxl")
    assert write_run_tables(run_with_formula_name.out, "xlsx") == []
    book = openpyxl.load_workbook(run_with_formula_name.out / "tables.xlsx")
    assert set(book.sheetnames) == {file.stem for file in run_with_formula_name.out.glob("*.parquet")}
    table, (head, *rows) = pq.read_table(run_with_formula_name.out / "misses.parquet"), [*book["misses"].rows]
    assert [cell.value for cell in head] == headings(table.column_names, "misses")
    expected = [list(row.values()) for row in table.to_pylist()]
    for cells, values in zip(rows, expected, strict=True):
        assert [_rounded(cell.value) for cell in cells] == [_rounded(value) for value in values]
        assert all(cell.data_type != "f" for cell in cells)


def _rounded(value):
    """A number of twelve digits; text as it is, empty text as none."""
    return float(f"{value:.12g}") if isinstance(value, int | float) else value or None


@pytest.mark.parametrize("text", HOSTILE)
def test_no_text_becomes_a_formula(text, tmp_path):
    """In a heading and in a cell; characters that spreadsheets ignore may stand before the sign."""
    openpyxl = pytest.importorskip("openpyxl")
    table = {"t": pa.table({text or "name": [text, "x"], "number": [-1.5, 2.0]})}
    for form in ("csv", "xlsx"):
        assert write_tables(table, tmp_path, form) == []
    (head, first, _) = csv_rows(tmp_path / "t.csv")
    blank = " \u00a0\u200b\ufeff\x01\u202e"
    for cell in (head[0], first[0]):
        assert not cell.lstrip(blank).startswith(("=", "+", "-", "@", "\t", "\uff1d", "\uff0b", "\uff0d", "\uff20"))
    assert first[1] == "-1.5"
    for row in openpyxl.load_workbook(tmp_path / "tables.xlsx")["t"].rows:
        assert all(cell.data_type != "f" and cell.hyperlink is None for cell in row)


@pytest.mark.parametrize(
    ("text", "inert"),
    [
        ("a=1", "a=1"),
        ("a =1", "a =1"),
        ("\tplain", "'\tplain"),
        (" plain", " plain"),
        ("=", "'="),
        (" ", " "),
        (" =1", "' =1"),
        ("\u200b=1", "'\u200b=1"),
        ("\u00a0-", "'\u00a0-"),
    ],
)
def test_only_a_text_that_begins_like_a_formula_is_changed(text, inert):
    """An apostrophe before it makes it text; a tab begins one too."""
    assert inert_value(text) == inert


def test_large_stamps_stay_exact_in_a_workbook(tmp_path):
    """Excel keeps 15 digits of a number, so a stamp of 19 is written as text; 5 stays a number."""
    openpyxl = pytest.importorskip("openpyxl")
    write_tables({"events": pa.table({"stamp_ns": [1709283600000000001, 5]})}, tmp_path, "xlsx")
    values = [row[0].value for row in openpyxl.load_workbook(tmp_path / "tables.xlsx")["events"].rows]
    assert values == ["stamp_ns [ns]", "1709283600000000001", 5]


def test_table_too_long_for_excel_is_omitted_with_a_sentence(tmp_path, monkeypatch):
    """A sheet is made to hold 2 rows: t has 3, u has 1."""
    pytest.importorskip("xlsxwriter")
    monkeypatch.setattr("replay.show.results.spreadsheets.MOST_ROWS", 2)
    (sentence,) = write_tables({"t": pa.table({"a": [1, 2, 3]}), "u": pa.table({"a": [1]})}, tmp_path, "xlsx")
    assert sentence == "t has 3 rows, more than an Excel sheet holds: use its Parquet file"


def test_missing_package_is_one_clear_error(tmp_path, monkeypatch, run_with_formula_name):
    """None in ``sys.modules`` lets an import fail."""
    for name in ("xlsxwriter", "pandas", "polars"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(OutputError, match=r'Excel tables need XlsxWriter: pip install "vrlab-replay\[excel\]"'):
        write_tables({"t": pa.table({"a": [1]})}, tmp_path, "xlsx")
    for method, name in ((run_with_formula_name.to_pandas, "pandas"), (run_with_formula_name.to_polars, "polars")):
        with pytest.raises(OutputError, match=f"{name} is not installed; pip install {name}"):
            method("misses")


def test_result_gives_data_frames_of_its_tables(run_with_formula_name):
    """Rows of misses are the run's misses; an unknown table is refused with the names of those there are."""
    frame = run_with_formula_name.to_pandas("misses")
    assert len(frame) == len(run_with_formula_name.misses["slow"]) and frame["student"].tolist() == [""] * len(frame)
    assert set(run_with_formula_name.to_pandas("metrics")["detector"]) == {"slow", "exact"}
    with pytest.raises(OutputError, match="no table 'frame'; there are: episodes, misses, false, events, metrics"):
        run_with_formula_name.to_pandas("frame")
    polars = pytest.importorskip("polars")
    assert isinstance(run_with_formula_name.to_polars("episodes"), polars.DataFrame)


@pytest.mark.parametrize("form", ["csv", "xlsx"])
def test_replacing_a_run_takes_its_spreadsheets_away(tmp_path, form):
    """A file of the user's own, mine.csv, stays."""
    result = replay.RunResult.of(RUN_OF_STATE["no contact"]()).write(tmp_path / "run", picture=False)
    before = {file.name for file in result.out.iterdir()}
    write_run_tables(result.out, form)
    (result.out / "mine.csv").write_text("a")
    assert {file.name for file in result.out.iterdir()} > before | {"mine.csv"}
    result.write(tmp_path / "run", force=True, picture=False)
    assert {file.name for file in (tmp_path / "run").iterdir()} == before | {"mine.csv"}


def test_every_state_has_spreadsheets(tmp_path):
    """No table is left out, which is what the function returns."""
    for state in ("no contact", "no reference", "effects"):
        result = replay.RunResult.of(RUN_OF_STATE[state]()).write(tmp_path / state.replace(" ", "-"), picture=False)
        assert write_run_tables(result.out, "csv") == []


@pytest.mark.parametrize("form", ["csv", pytest.param("xlsx", marks=pytest.mark.slow)])
def test_tables_of_a_batch_hold_rows_of_all_runs(tmp_path, form):
    """Two sessions, one with a name that is a formula, and a body with such a name; no cell is a formula."""
    for name in ("first", "=second"):
        session = unit_cubes_on_x({"=cmd|' /C calc'!A0": MEET_IN_4_AND_8_TO_10["a"], "b": MEET_IN_4_AND_8_TO_10["b"]})
        write_session(session, tmp_path / f"{name}.mcap")
    out = tmp_path / "out"
    files = [str(file) for file in sorted(tmp_path.glob("*.mcap"))]
    command = ["run", *files, "-o", str(out), "--tables", form, "--detectors", "slow=discrete[rate_hz=5]", "-q"]
    if form == "xlsx":
        openpyxl = pytest.importorskip("openpyxl")
        assert main(command) == 0
        book = openpyxl.load_workbook(out / "tables.xlsx")
        written = {sheet.title: [[cell.value for cell in row] for row in sheet.rows] for sheet in book}
        assert all(cell.data_type != "f" for sheet in book for row in sheet.rows for cell in row)
    else:
        assert main(command) == 0
        written = {file.stem: csv_rows(file) for file in out.glob("*.csv")}
    tables = replay.read(out)
    assert set(written) == set(tables)
    for name, table in tables.items():
        head, *rows = written[name]
        assert head == headings(table.column_names, name) and len(rows) == len(table)
    runs = {row[written["misses"][0].index("run")] for row in written["misses"][1:]}
    assert runs == ({"first", "=second"} if form == "xlsx" else {"first", "'=second"})
    cells = [cell for rows in written.values() for row in rows for cell in row if isinstance(cell, str)]
    assert any("=cmd" in cell for cell in cells)
    assert form == "xlsx" or not [cell for cell in cells if cell.startswith("=")]
