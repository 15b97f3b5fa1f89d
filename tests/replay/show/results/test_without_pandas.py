"""Arrow finds no pandas in a run of the command line, and hands out data frames all the same."""

import subprocess
import sys

import pytest

from replay.show.results.without_pandas import WithoutPandas

SCRIPT = """
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


@pytest.mark.slow
def test_pandas_is_imported_only_to_make_a_data_frame():
    """A program of its own, SCRIPT, asserts it."""
    pytest.importorskip("pandas")
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_no_module_but_pandas_is_hidden():
    """A finder that gives None leaves a module to the finders after it."""
    with pytest.raises(ModuleNotFoundError, match="pandas"):
        WithoutPandas().find_spec("pandas")
    assert WithoutPandas().find_spec("numpy") is None
