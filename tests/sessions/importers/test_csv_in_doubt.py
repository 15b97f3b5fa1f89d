"""Doubts about a CSV are asked or refused, and nothing of it is guessed in silence."""

import numpy as np
import pytest

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.csv_missing import sentinel_size

MAPPING = """
convention = "openxr"
units = "m"
[time]
column = "time"
unit = "s"
[body]
name = "name"
position = ["x", "y", "z"]
quaternion_xyzw = ["qx", "qy", "qz", "qw"]
"""
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


def imported(tmp_path, header, rows, delimiter=",", **options):
    """The session of a CSV with this header and these rows."""
    path = tmp_path / "log.csv"
    lines = [header, *rows]
    path.write_text("\n".join(delimiter.join(map(str, line)) for line in lines) + "\n", encoding="utf-8")
    return import_session("csv", path, **options)


def rows_of(times, *before):
    """A row a time: what stands before, the time, and a pose that goes on by 1 mm on x."""
    return [(*(value[k] for value in before), time, 0.001 * k, 1, 0, 0, 0, 0, 1) for k, time in enumerate(times)]


def test_two_clocks_of_other_rates_are_asked_about(tmp_path):
    """One clock runs 1.5 times as fast as the other: which is it? With equal rates the question is needless."""
    times = np.arange(60) / 60
    header = ("device_time", "time", *(f"cup_{name}" for name in POSE))
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, header, rows_of(times, 100 + 1.5 * times))
    assert "which of the columns 'device_time' and 'time' is the clock" in raised.value.unknown
    assert '# column = "time"' in raised.value.draft
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, header, rows_of(times, 100 + times))
    assert not any("clock" in text for text in raised.value.unknown)


@pytest.mark.parametrize(
    ("absent", "missing"), [("cup_z", "its position has no z"), ("cup_qy", "its quaternion has no y")]
)
def test_pose_that_lacks_a_column_is_asked_about(tmp_path, absent, missing):
    """Rod and cup have seven columns each, but for one of the cup's."""
    header = ("time", *(f"{body}_{name}" for body in ("rod", "cup") for name in POSE))
    rows = [(k / 60, 0.001 * k, 1, 0, 0, 0, 0, 1, 0.002 * k, 1, 0, 0, 0, 0, 1) for k in range(60)]
    column = header.index(absent)
    names, *rest = (line[:column] + line[column + 1 :] for line in (header, *rows))
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, names, rest)
    assert f"the pose of 'cup', for {missing}" in raised.value.unknown


def test_position_and_rotation_of_two_names_are_asked_about(tmp_path):
    """ "rod" has a position alone, "arm" a rotation alone; the cup has both."""
    header = (
        "time",
        *(f"cup_{name}" for name in POSE),
        "rod_x",
        "rod_y",
        "rod_z",
        *(f"arm_q{axis}" for axis in "xyzw"),
    )
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, header, [(k / 60, *2 * (0.001 * k, 1, 0, 0, 0, 0, 1)) for k in range(60)])
    assert "the pose of 'rod', for it has no rotation, and 'arm' has no position" in raised.value.unknown


def test_rows_in_no_order_of_time_are_refused(tmp_path):
    """60 rows in random order: most would be lost as going back in time."""
    times = np.random.default_rng(0).permutation(60) / 60
    rows = [("cup", *row) for row in rows_of(times)]
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(ImportFileError, match=r"'cup' are in no order of time, .* of 60 .*; sort the rows"):
        imported(tmp_path, ("name", "time", *POSE), rows, mapping=tmp_path / "m.toml")


def test_points_of_thousands_beside_decimal_commas_are_refused(tmp_path):
    """5.000 may be five thousand ms or five; 0.010 cannot be thousands."""
    rows = [("cup", f"{5 + k // 1000}.{k % 1000:03d}", "0,1", 1, 0, 0, 0, 0, 1) for k in range(0, 600, 10)]
    mapping = MAPPING.replace('units = "m"', 'units = "m"\ndelimiter = ";"\ndecimal = ","').replace('"s"', '"ms"')
    (tmp_path / "m.toml").write_text(mapping)
    with pytest.raises(ImportFileError, match=r"line 2, column 'time': '5.000' is of two readings where decimals have"):
        imported(tmp_path, ("name", "time", *POSE), rows, ";", mapping=tmp_path / "m.toml")
    seconds = [(name, f"0.{k:03d}", *rest) for k, (name, _, *rest) in enumerate(rows)]  # no thousands begin with 0
    assert imported(tmp_path, ("name", "time", *POSE), seconds, ";", mapping=tmp_path / "m.toml").names == ("cup",)


def test_vectors_in_a_cell_are_refused_by_name(tmp_path):
    """Position and rotation are one cell each, as "(0.000, 1.000, 0.000)"."""
    rows = [(k / 60, f'"({0.001 * k:.3f}, 1.000, 0.000)"', '"(0, 0, 0, 1)"') for k in range(9)]
    with pytest.raises(ImportFileError, match=r"line 2: '\(0.000, 1.000, 0.000\)' is several numbers in one cell"):
        imported(tmp_path, ("time", "cup_position", "cup_rotation"), rows)


def test_recordings_in_one_table_are_told_from_bodies(tmp_path):
    """Two students' recordings stand one below the other, with the same times."""
    header = ("participant", "time", *(f"cup_{name}" for name in POSE))
    rows = [(student, *row) for student in ("S01", "S02") for row in rows_of(np.arange(60) / 60)]
    mapping = MAPPING.replace('[body]\nname = "name"', "[bodies.cup]")
    for name in POSE:
        mapping = mapping.replace(f'"{name}"', f'"cup_{name}"')
    (tmp_path / "m.toml").write_text(mapping)
    with pytest.raises(ImportFileError, match="column 'participant' tells 2 recordings apart: keep the rows of one"):
        imported(tmp_path, header, rows, mapping=tmp_path / "m.toml")


def test_names_that_differ_in_case_are_named_as_two_bodies(tmp_path):
    """Rows are of "rod" and "Rod" in turn."""
    rows = [(("rod", "Rod")[k % 2], *row) for k, row in enumerate(rows_of(np.arange(60) / 60))]
    (tmp_path / "m.toml").write_text(MAPPING)
    session = imported(tmp_path, ("name", "time", *POSE), rows, mapping=tmp_path / "m.toml")
    assert "'rod' and 'Rod' are two bodies" in session.facts["assumed"]


@pytest.mark.parametrize("cell", ["None", "n/a", "--", "#NV", "", -9999, "999.0"])
@pytest.mark.parametrize("first", [0, 20])
def test_missing_numbers_are_lost_poses(tmp_path, cell, first):
    """From the row ``first`` three of 60 rows hold a word or a sentinel in place of each number."""
    rows = [[k / 60, 0.001 * k, 1, 0.5, 0, 0, 0, 1] for k in range(60)]
    for row in rows[first : first + 3]:
        row[1:] = 7 * [cell]
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, ("time", *POSE), rows)
    (tmp_path / "m.toml").write_text(raised.value.draft_with_axes("openxr"))
    session = imported(tmp_path, ("time", *POSE), rows, mapping=tmp_path / "m.toml")
    assert np.flatnonzero(~session.tracks["log"].valid).tolist() == [first, first + 1, first + 2]
    is_sentinel = "9" in str(cell)
    assert ("counts as a missing number in x, y, z" in session.facts["conversions"]) == is_sentinel


@pytest.mark.parametrize(
    ("values", "size"),
    [
        ([1, -9999, 2], 9999),
        ([1, -9999, 9999], 9999),
        ([1, 999, 300], 999),
        ([1, 999, 400], np.nan),
        ([999, 999], np.nan),
        ([9999, 9999], 9999),
        ([np.nan, 1], np.nan),
        ([], np.nan),
    ],
)
def test_sentinel_is_far_off_all_other_numbers(values, size):
    """A value of nines is a sentinel where it is far beyond all others: 999 beside 300, and not beside 400.

    999 alone may be a length, 9999 alone may not; nan: there is none.
    """
    assert sentinel_size(np.array(values, dtype=float)) == pytest.approx(size, nan_ok=True)


def test_decimal_commas_beside_missing_numbers_are_read(tmp_path):
    """In the first row the time alone is a number, and has a comma."""
    rows = [[f"{k / 60:.4f}", *(7 * ["NaN"] if k < 4 else (0.5, 1, 0.5, 0, 0, 0, 1))] for k in range(60)]
    cells = [[str(cell).replace(".", ",") for cell in row] for row in rows]
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, ("time", *POSE), cells, delimiter=";")
    assert 'position = ["x", "y", "z"]' in raised.value.draft and 'decimal = ","' in raised.value.draft


def test_sentinels_of_both_signs_are_missing(tmp_path):
    """Of 60 heights of 1 m the first two are 9999 and -9999, and each is named."""
    rows = [[k / 60, 0.001 * k, {0: 9999, 1: -9999}.get(k, 1), 0.5, 0, 0, 0, 1, "cup"] for k in range(60)]
    (tmp_path / "m.toml").write_text(MAPPING)
    session = imported(tmp_path, ("time", *POSE, "name"), rows, mapping=tmp_path / "m.toml")
    conversions = session.facts["conversions"]
    assert conversions.count("9999 counts as a missing number in y") == 2
    assert conversions.count("-9999 counts as a missing number in y") == 1
    assert np.flatnonzero(~session.tracks["cup"].valid).tolist() == [0, 1]


def test_time_of_a_sentinel_is_missing(tmp_path):
    """Row 7 (line 9 of the file) has the time -9999."""
    rows = [[-9999 if k == 7 else k / 60, 0.001 * k, 1, 0.5, 0, 0, 0, 1, "cup"] for k in range(60)]
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(ImportFileError, match="line 9, column 'time': the time is missing, for it is -9999; remove"):
        imported(tmp_path, ("time", *POSE, "name"), rows, mapping=tmp_path / "m.toml")


def test_rows_that_all_begin_without_numbers_are_read(tmp_path):
    """260 of 300 rows say NA; the rest shows that the columns are a pose, so that only the axes are asked for."""
    rows = [[k / 60, *(7 * ["NA"] if k < 260 else (0.001 * k, 1, 0.5, 0, 0, 0, 1))] for k in range(300)]
    with pytest.raises(UnknownColumnsError) as raised:
        imported(tmp_path, ("time", *POSE), rows)
    assert raised.value.unknown[0] == "the axes (convention)" and "which columns are a pose" not in raised.value.unknown
