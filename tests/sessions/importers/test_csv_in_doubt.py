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
NO_SENTINEL = np.nan


def import_rows(tmp_path, header, rows, delimiter=",", **options):
    """The session of a CSV with this header and these rows."""
    path = tmp_path / "log.csv"
    lines = [header, *rows]
    path.write_text("\n".join(delimiter.join(map(str, line)) for line in lines) + "\n", encoding="utf-8")
    return import_session("csv", path, **options)


def refusal_with_draft(tmp_path, header, rows, delimiter=","):
    """The error of a CSV imported without a mapping, which says what its columns are.

    Its ``draft`` is a mapping to complete, its ``unknown`` the questions that the draft leaves open.
    """
    with pytest.raises(UnknownColumnsError) as raised:
        import_rows(tmp_path, header, rows, delimiter)
    return raised.value


def pose_rows(times, *columns_before):
    """A row for each time: the cells of the columns before it, the time, and a pose that goes on by 1 mm on x."""
    return [
        (*(column[k] for column in columns_before), time, 0.001 * k, 1, 0, 0, 0, 0, 1) for k, time in enumerate(times)
    ]


@pytest.mark.parametrize(("rate_of_device_time", "is_question"), [(1.5, True), (1.0, False)])
def test_two_clocks_of_other_rates_are_asked_about(tmp_path, rate_of_device_time, is_question):
    """A table has the times "time" and "device_time": where that runs 1.5 times as fast, it matters which is meant.

    The draft then has the clock as a comment. Where both run alike, nothing is asked.
    """
    times = np.arange(60) / 60
    header = ("device_time", "time", *(f"cup_{name}" for name in POSE))
    refusal = refusal_with_draft(tmp_path, header, pose_rows(times, 100 + rate_of_device_time * times))
    question = "which of the columns 'device_time' and 'time' is the clock"
    assert [text for text in refusal.unknown if "clock" in text] == [question] * is_question
    assert ('# column = "time"' in refusal.draft) == is_question


@pytest.mark.parametrize(
    ("absent", "reason"), [("cup_z", "its position has no z"), ("cup_qy", "its quaternion has no y")]
)
def test_pose_that_lacks_a_column_becomes_a_question(tmp_path, absent, reason):
    """Rod and cup have seven columns each, but for one of the cup's."""
    header = ("time", *(f"{body}_{name}" for body in ("rod", "cup") for name in POSE))
    rows = [(k / 60, 0.001 * k, 1, 0, 0, 0, 0, 1, 0.002 * k, 1, 0, 0, 0, 0, 1) for k in range(60)]
    column = header.index(absent)
    shorter_header, *shorter_rows = (line[:column] + line[column + 1 :] for line in (header, *rows))
    refusal = refusal_with_draft(tmp_path, shorter_header, shorter_rows)
    assert f"the pose of 'cup', for {reason}" in refusal.unknown


def test_position_and_rotation_of_two_names_are_asked_about(tmp_path):
    """ "rod" has a position alone, "arm" a rotation alone, which may be one body; the cup has both."""
    cup = [f"cup_{name}" for name in POSE]
    header = ("time", *cup, "rod_x", "rod_y", "rod_z", "arm_qx", "arm_qy", "arm_qz", "arm_qw")
    two_poses = [(k / 60, *2 * (0.001 * k, 1, 0, 0, 0, 0, 1)) for k in range(60)]
    refusal = refusal_with_draft(tmp_path, header, two_poses)
    assert "the pose of 'rod', for it has no rotation, and 'arm' has no position" in refusal.unknown


def test_rows_in_no_order_of_time_are_refused(tmp_path):
    """60 rows are in random order, so that most would be lost, as they go back in time: the import refuses them all."""
    times = np.random.default_rng(0).permutation(60) / 60
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(ImportFileError, match=r"'cup' are in no order of time, .* of 60 .*; sort the rows"):
        import_rows(tmp_path, ("name", "time", *POSE), pose_rows(times, ["cup"] * 60), mapping=tmp_path / "m.toml")


@pytest.fixture
def mapping_with_decimal_commas(tmp_path):
    """The path of MAPPING with decimal commas, semicolons between cells, and times in milliseconds."""
    text = MAPPING.replace('units = "m"', 'units = "m"\ndelimiter = ";"\ndecimal = ","').replace('"s"', '"ms"')
    (tmp_path / "m.toml").write_text(text)
    return tmp_path / "m.toml"


def test_points_of_thousands_beside_decimal_commas_are_refused(tmp_path, mapping_with_decimal_commas):
    """Times go from 5.000 to 5.590, which may be five thousand milliseconds or five."""
    rows = [("cup", f"5.{k:03d}", "0,1", 1, 0, 0, 0, 0, 1) for k in range(0, 600, 10)]
    with pytest.raises(ImportFileError, match=r"line 2, column 'time': '5.000' is of two readings where decimals have"):
        import_rows(tmp_path, ("name", "time", *POSE), rows, delimiter=";", mapping=mapping_with_decimal_commas)


def test_points_that_cannot_be_thousands_are_decimals(tmp_path, mapping_with_decimal_commas):
    """Times go from 0.000 to 0.590; no thousands begin with 0, so that these are fractions."""
    rows = [("cup", f"0.{k:03d}", "0,1", 1, 0, 0, 0, 0, 1) for k in range(0, 600, 10)]
    session = import_rows(tmp_path, ("name", "time", *POSE), rows, delimiter=";", mapping=mapping_with_decimal_commas)
    assert session.names == ("cup",)
    assert session.frames.stamp_ns[-1] == 590_000  # 0.59 ms


def test_vectors_in_a_cell_are_refused_by_name(tmp_path):
    """Position and rotation are one cell each, as "(0.000, 1.000, 0.000)"."""
    rows = [(k / 60, f'"({0.001 * k:.3f}, 1.000, 0.000)"', '"(0, 0, 0, 1)"') for k in range(9)]
    with pytest.raises(ImportFileError, match=r"line 2: '\(0.000, 1.000, 0.000\)' is several numbers in one cell"):
        import_rows(tmp_path, ("time", "cup_position", "cup_rotation"), rows)


def test_recordings_in_one_table_are_told_from_bodies(tmp_path):
    """The recordings of two students, 60 rows each with the same times, stand one below the other.

    The mapping takes all rows for one cup. A column called "participant" tells recordings apart, and no bodies.
    """
    header = ("participant", "time", *(f"cup_{name}" for name in POSE))
    times = np.arange(60) / 60
    rows = [*pose_rows(times, ["S01"] * 60), *pose_rows(times, ["S02"] * 60)]
    mapping = MAPPING.replace('[body]\nname = "name"', "[bodies.cup]")
    for name in POSE:
        mapping = mapping.replace(f'"{name}"', f'"cup_{name}"')
    (tmp_path / "m.toml").write_text(mapping)
    with pytest.raises(ImportFileError, match="column 'participant' tells 2 recordings apart: keep the rows of one"):
        import_rows(tmp_path, header, rows, mapping=tmp_path / "m.toml")


def test_names_that_differ_in_case_are_named_as_two_bodies(tmp_path):
    """Rows are of "rod" and "Rod" in turn, which may be meant for one body: the text on assumptions says so."""
    rows = pose_rows(np.arange(60) / 60, ["rod", "Rod"] * 30)
    (tmp_path / "m.toml").write_text(MAPPING)
    session = import_rows(tmp_path, ("name", "time", *POSE), rows, mapping=tmp_path / "m.toml")
    assert "'rod' and 'Rod' are two bodies" in session.facts["assumed"]


@pytest.mark.parametrize(
    ("cell", "is_sentinel"),
    [
        ("None", False),
        ("n/a", False),
        ("--", False),
        ("#NV", False),
        ("", False),
        (-9999, True),
        ("999.0", True),
    ],
)
@pytest.mark.parametrize("first", [0, 20])
def test_missing_numbers_are_lost_poses(tmp_path, cell, is_sentinel, first):
    """Three of 60 rows, from row ``first`` on, hold a word or a sentinel (a number of nines) in place of each number.

    Their poses are lost, and it is said that the sentinel was taken for a missing number.
    """
    rows = [[k / 60, 0.001 * k, 1, 0.5, 0, 0, 0, 1] for k in range(60)]
    for row in rows[first : first + 3]:
        row[1:] = [cell] * len(POSE)
    refusal = refusal_with_draft(tmp_path, ("time", *POSE), rows)
    (tmp_path / "m.toml").write_text(refusal.draft_with_axes("openxr"))
    session = import_rows(tmp_path, ("time", *POSE), rows, mapping=tmp_path / "m.toml")
    assert np.flatnonzero(~session.tracks["log"].valid).tolist() == [first, first + 1, first + 2]
    assert ("counts as a missing number in x, y, z" in session.facts["conversions"]) == is_sentinel


@pytest.mark.parametrize(
    ("column", "size"),
    [
        pytest.param([1, -9999, 2], 9999, id="far off"),
        pytest.param([1, -9999, 9999], 9999, id="of both signs"),
        pytest.param([1, 999, 300], 999, id="999 and 300"),
        pytest.param([1, 999, 400], NO_SENTINEL, id="999 and 400"),
        pytest.param([999, 999], NO_SENTINEL, id="999 alone"),
        pytest.param([9999, 9999], 9999, id="9999 alone"),
        pytest.param([np.nan, 1], NO_SENTINEL, id="no nines"),
        pytest.param([], NO_SENTINEL, id="no numbers"),
    ],
)
def test_sentinel_is_far_off_all_other_numbers(column, size):
    """A value of nines stands for a missing number where it is over three times as large as all others in its column.

    999 alone may be a length, 9999 alone may not.
    """
    assert sentinel_size(np.array(column, dtype=float)) == pytest.approx(size, nan_ok=True)


def test_decimal_commas_beside_missing_numbers_are_read(tmp_path):
    """In each of the first four rows the time alone is a number, and has a comma; the poses are NaN.

    The draft of a mapping has the columns of a pose and the decimal comma all the same.
    """
    whole_pose = (0.5, 1, 0.5, 0, 0, 0, 1)
    rows = [[f"{k / 60:.4f}", *(["NaN"] * len(POSE) if k < 4 else whole_pose)] for k in range(60)]
    cells = [[str(cell).replace(".", ",") for cell in row] for row in rows]
    refusal = refusal_with_draft(tmp_path, ("time", *POSE), cells, delimiter=";")
    assert 'position = ["x", "y", "z"]' in refusal.draft
    assert 'decimal = ","' in refusal.draft


def test_sentinels_of_both_signs_are_missing(tmp_path):
    """60 heights are 1 m, but the first two 9999 and -9999: both poses are lost, and each number is named."""
    rows = [[k / 60, 0.001 * k, {0: 9999, 1: -9999}.get(k, 1), 0.5, 0, 0, 0, 1, "cup"] for k in range(60)]
    (tmp_path / "m.toml").write_text(MAPPING)
    session = import_rows(tmp_path, ("time", *POSE, "name"), rows, mapping=tmp_path / "m.toml")
    conversions = session.facts["conversions"]
    # The second text is contained in the first, so that it is counted twice.
    assert conversions.count("-9999 counts as a missing number in y") == 1
    assert conversions.count("9999 counts as a missing number in y") == 2
    assert np.flatnonzero(~session.tracks["cup"].valid).tolist() == [0, 1]


def test_time_of_a_sentinel_is_missing(tmp_path):
    """Row 7 of 60, counted from 0, has the time -9999; it is line 9 of the file, below the header in line 1."""
    rows = [[-9999 if k == 7 else k / 60, 0.001 * k, 1, 0.5, 0, 0, 0, 1, "cup"] for k in range(60)]
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(ImportFileError, match="line 9, column 'time': the time is missing, for it is -9999; remove"):
        import_rows(tmp_path, ("time", *POSE, "name"), rows, mapping=tmp_path / "m.toml")


def test_rows_that_all_begin_without_numbers_are_read(tmp_path):
    """The first 260 of 300 rows say NA; the other 40 show that the columns are a pose.

    So the axes are the first question of the draft of a mapping, and which columns are a pose is none.
    """
    rows = [[k / 60, *(["NA"] * len(POSE) if k < 260 else (0.001 * k, 1, 0.5, 0, 0, 0, 1))] for k in range(300)]
    first_question, *others = refusal_with_draft(tmp_path, ("time", *POSE), rows).unknown
    assert first_question == "the axes (convention)"
    assert "which columns are a pose" not in others
