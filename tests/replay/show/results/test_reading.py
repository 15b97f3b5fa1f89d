"""Readers of JSON and of tables take the numbers that a run writes, and no others."""

from pathlib import Path

import pyarrow as pa
import pytest

from replay.document.tables import Column
from replay.errors import RunFolderError
from replay.show.results.reading import checked_table, read_json


@pytest.mark.parametrize("number", [0, 2**63 - 1, -(2**63) + 1])
def test_integers_of_64_bits_are_read(tmp_path, number):
    """A JSON file that is a list of one number: 0, and one of the largest and the smallest of 64 bits with a sign."""
    (tmp_path / "a.json").write_text(f"[{number}]")
    assert read_json(tmp_path / "a.json") == [number]


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(str(2**63), id="over 64 bits"),
        pytest.param(str(-(2**63) - 1), id="under 64 bits"),
        pytest.param("1" * 21, id="21 digits"),
        pytest.param("1e999", id="beyond float64"),
        pytest.param("NaN", id="NaN"),
    ],
)
def test_numbers_that_no_run_writes_are_refused(tmp_path, text):
    """A JSON file that is a list of one number; the error quotes its first 20 characters."""
    (tmp_path / "a.json").write_text(f"[{text}]")
    with pytest.raises(ValueError, match=text[:20]):
        read_json(tmp_path / "a.json")


def test_times_of_over_three_hundred_years_are_refused():
    """A table has one number: 300 years in seconds are read, 320 are refused; as many metres are no time."""
    year_s = 365.25 * 86_400

    def number_read(years, unit):
        table = pa.table({"start": [years * year_s]})
        columns = {"start": Column("start", float, unit=unit)}
        return checked_table(Path("contacts.parquet"), table, columns)["start"][0].as_py()

    assert number_read(300, "s") == 300 * year_s
    assert number_read(320, "m") == 320 * year_s
    with pytest.raises(RunFolderError, match="'start' has a value that no run writes"):
        number_read(320, "s")
