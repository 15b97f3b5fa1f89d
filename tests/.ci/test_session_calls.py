"""The way of a recording from its file to its first block stays short enough to be followed."""

import pytest
from support.processes import script


@pytest.fixture(scope="module")
def functions_by_format():
    """Format -> the functions, (file, name), that are called when a first block of frames is read from a file of it."""
    return vars(script("session_calls"))["functions_by_format"]()


@pytest.mark.parametrize(("format", "most_files", "most_functions"), [("MCAP", 9, 80), ("CSV", 12, 171)])
def test_reading_a_first_block_enters_few_files_and_functions(functions_by_format, format, most_files, most_functions):
    """So many it takes today; a reader who follows a recording should not have to open more."""
    called = functions_by_format[format]
    assert 0 < len({file for file, _ in called}) <= most_files
    assert len(called) <= most_functions
