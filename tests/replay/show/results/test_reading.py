"""A reader of JSON takes the numbers that a run writes, and no others."""

import pytest

from replay.show.results.reading import read_json


@pytest.mark.parametrize("number", [0, 2**63 - 1, -(2**63) + 1])
def test_integers_of_64_bits_are_read(tmp_path, number):
    """The file is a list with one number."""
    (tmp_path / "a.json").write_text(f"[{number}]")
    assert read_json(tmp_path / "a.json") == [number]


@pytest.mark.parametrize("text", [str(2**63), str(-(2**63) - 1), "1" * 21, "1e999", "NaN"])
def test_numbers_that_no_run_writes_are_refused(tmp_path, text):
    """Integers beyond 64 bits, a number beyond float64, and NaN, in a list."""
    (tmp_path / "a.json").write_text(f"[{text}]")
    with pytest.raises(ValueError, match=text[:20]):
        read_json(tmp_path / "a.json")
