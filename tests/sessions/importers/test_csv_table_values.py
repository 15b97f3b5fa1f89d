import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.importers import import_session
from sessions.importers.csv_table import bool_array, bool_values, float_values, text_array, text_scalar

READS_A_TABLE = """
import sys
from pathlib import Path
from sessions.importers import import_session
rows = ["time,x,y,z,qx,qy,qz,qw", "0.0,0,0,0,0,0,0,1", "0.1,0,0,0,0,0,0,1", "0.2,nan,0,0,0,0,0,1"]
Path("take.csv").write_text("\\n".join([*rows, ""]))
Path("map.toml").write_text('convention = "openxr"\\nunits = "m"\\n[time]\\ncolumn = "time"\\nunit = "s"\\n'
    '[bodies.cup]\\nposition = ["x", "y", "z"]\\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\\n')
session = import_session("csv", Path("take.csv"), mapping=Path("map.toml"))
assert len(session.frames) == 3
print(sorted({"pandas", "numba", "scipy", "numpy.ma"} & set(sys.modules)))
"""


@given(st.lists(st.booleans(), max_size=40))
def test_flags_survive_arrow(flags):
    """NumPy's truth values become an array of Arrow with the same ones, and come back from a column of it."""
    values = np.array(flags, dtype=np.bool_)
    array = bool_array(values)
    assert array.to_pylist() == flags
    assert bool_values(pa.chunked_array([array])).tolist() == flags


@given(st.lists(st.text('a"\\\n\0ä\u202e杯🙂', max_size=5), max_size=10))
def test_texts_survive_arrow(texts):
    """Texts with quotes, zeros and signs beyond Latin are the same as an array and one by one; no text is null."""
    assert text_array(texts).to_pylist() == texts
    assert [text_scalar(text).as_py() for text in texts] == texts
    assert text_scalar(text=None).as_py() is None


@pytest.mark.parametrize("chunks", [[[]], [[1.5, None], [], [None, -2.0]], [[0.0] * 9]])
def test_missing_cells_of_a_number_column_become_nan(chunks):
    """Arrow gives a column in ``chunks``, of which any may be empty; the result is one array."""
    cells = pa.chunked_array([pa.array(chunk, pa.float64()) for chunk in chunks])
    expected = [np.nan if value is None else value for chunk in chunks for value in chunk]
    assert np.array_equal(float_values(cells), expected, equal_nan=True)


def test_reading_a_table_imports_no_heavy_library(tmp_path):
    """A new process imports three rows and prints which of pandas, numba, SciPy and masked arrays it loaded: none."""
    process = subprocess.run([sys.executable, "-c", READS_A_TABLE], cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert process.stdout.strip() == "[]"


def test_date_in_iso_8601_keeps_its_nanoseconds(tmp_path):
    """Stamps 500 and 900 ns and 0.5 s after the second: steps of 400 ns and of 0.5 s less 900 ns."""
    stamps = ("2026-03-04T10:00:00.000000500", "2026-03-04T10:00:00.000000900", "2026-03-04T10:00:00.5")
    rows = [f"{stamp},0,0,0,0,0,0,1" for stamp in stamps]
    (tmp_path / "take.csv").write_text("\n".join(["date,x,y,z,qx,qy,qz,qw", *rows, ""]))
    (tmp_path / "map.toml").write_text(
        'convention = "openxr"\n[time]\ncolumn = "date"\nunit = "text"\n[bodies.cup]\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\n'
    )
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml")
    assert np.diff(session.frames.stamp_ns).tolist() == [400, 499_999_100]
