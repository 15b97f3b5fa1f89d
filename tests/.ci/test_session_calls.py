"""The way of a recording from its file to its first block stays short enough to be followed."""

import pytest
from support.processes import script


@pytest.fixture(scope="module")
def functions_by_format():
    return vars(script("session_calls"))["functions_by_format"]()


@pytest.mark.parametrize(("format", "most_files", "most_functions"), [("MCAP", 9, 80), ("CSV", 12, 169)])
def test_reading_a_first_block_enters_few_files_and_functions(functions_by_format, format, most_files, most_functions):
    called = functions_by_format[format]
    assert len({file for file, _ in called}) <= most_files
    assert len(called) <= most_functions
