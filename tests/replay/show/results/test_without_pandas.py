"""Arrow finds no pandas in a run of the command line, and hands out data frames all the same."""

import subprocess
import sys

import pytest

from replay.show.results.without_pandas import WithoutPandas

PROGRAM = """
import sys
from replay.show.results.without_pandas import leave_pandas_out
leave_pandas_out()
import pyarrow as pa
numbers = pa.table({"a": pa.array([1.5, 2.5])})
assert "pandas" not in sys.modules, "Arrow loaded pandas"
assert numbers.to_pandas()["a"].sum() == 4.0
import pandas as pd
assert pa.array(pd.Series([1.0, float("nan")])).null_count == 1
"""
"""Makes an Arrow table without pandas, then a data frame of it, then an Arrow array of a column of pandas."""


@pytest.mark.slow
def test_pandas_is_imported_only_to_make_a_data_frame():
    """A program of its own calls ``leave_pandas_out``: making an Arrow table imports no pandas, ``to_pandas`` does.

    The program (``PROGRAM``) asserts both, and that Arrow takes NaN in a column of pandas for null, and ends with 0.
    """
    pytest.importorskip("pandas")
    ended = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr


def test_no_module_but_pandas_is_hidden():
    """``WithoutPandas`` is a finder of modules: it refuses pandas, and leaves others (None) to the finders after it."""
    with pytest.raises(ModuleNotFoundError, match="pandas"):
        WithoutPandas().find_spec("pandas")
    assert WithoutPandas().find_spec("numpy") is None
