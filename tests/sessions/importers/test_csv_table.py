import numpy as np
import pytest

from sessions.errors import ImportFileError
from sessions.importers.csv_table import CsvTable


def table(tmp_path, text, delimiter=",", decimal="."):
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode())
    return CsvTable(path, delimiter, decimal)


def test_empty_cells_are_nan_and_short_rows_are_counted(tmp_path):
    cells = table(tmp_path, "a,b\n1,\n2,nan\n3\n4, 5 \n")
    every = np.ones(len(cells), dtype=bool)
    assert cells.skipped == 1
    assert np.array_equal(cells.numbers(("a", "b"), every), [[1, np.nan], [2, np.nan], [4, 5]], equal_nan=True)


def test_only_the_chosen_rows_are_read_as_numbers(tmp_path):
    cells = table(tmp_path, "a\n1\nx\n3\n")
    assert cells.numbers(("a",), np.array([True, False, True])).tolist() == [[1], [3]]
    with pytest.raises(ImportFileError, match="line 3, column 'a': 'x' is no number"):
        cells.numbers(("a",), np.array([True, True, True]))


def test_windows_lines_and_a_byte_order_mark_are_read(tmp_path):
    cells = table(tmp_path, "\ufeffa;b\r\n1,5;2\r\n", ";", ",")
    assert cells.columns == ("a", "b")
    assert cells.numbers(("a", "b"), np.array([True])).tolist() == [[1.5, 2.0]]


def test_a_time_beyond_the_years_of_nanoseconds_says_check_the_unit(tmp_path):
    cells = table(tmp_path, "t\n1e300\n")
    with pytest.raises(ImportFileError, match="check the unit, which is 's'"):
        cells.stamps("t", "s", np.array([True]))


def test_flags_are_true_for_the_words_of_yes_alone(tmp_path):
    cells = table(tmp_path, "v\n1\ntrue\n0\nFalse\n\nTrue\n")
    words = dict(zip(cells.texts("v"), cells.flags("v", np.ones(len(cells), dtype=bool)).tolist(), strict=True))
    assert [word for word, yes in words.items() if yes] == ["1", "true", "True"]
