"""Columns and cells that may mean several things: they are asked, named or refused, and never taken in silence."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from replay.cli.main import main
from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError

COUNT = 40
SECONDS = np.arange(COUNT) / 90
POSE = "x,y,z,qx,qy,qz,qw"
START = datetime(2026, 3, 28, 23, 59, 59, 800_000)
"""0.2 s before midnight: 18 of 40 rows at 90 Hz are before it."""


def csv_row(*cells):
    """A line of a CSV."""
    return ",".join(map(str, cells))


def pose(step, body=0):
    """The cells of a pose: x goes on by 1 cm a step, x and y are 1 m greater for body 1 than for body 0."""
    return csv_row(round(0.01 * step + body, 6), 1 + body, -0.5, 0, 0, 0, 1)


def import_csv(folder, *lines):
    """The session of a CSV by the draft of a mapping that its refusal has, in which the axes alone are filled in."""
    mapping = folder / "log.columns.toml"
    mapping.write_text(refused_draft(folder, *lines).draft_with_axes("openvr"))
    return import_session("csv", folder / "log.csv", mapping=mapping)


def refused_draft(folder, *lines):
    """The error of a CSV without a mapping: ``draft`` is one to complete, ``unknown`` the questions it leaves open."""
    path = folder / "log.csv"
    path.write_text("\n".join([*lines, ""]))
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    return refusal.value


def time_of_day(step):
    """The time of day of a row, as 23:59:59.800000."""
    return (START + timedelta(seconds=float(SECONDS[step]))).strftime("%H:%M:%S.%f")


def date_text(step, form="%Y-%m-%d"):
    """The date of a row, in a form."""
    return (START + timedelta(seconds=float(SECONDS[step]))).strftime(form)


def check_clock(track):
    """Fails unless a track has the times SECONDS and moves by 1 cm a row."""
    assert np.allclose((track.times_ns - track.times_ns[0]) / 1e9, SECONDS, atol=2e-6)
    assert np.allclose(np.diff(track.positions[:, 0]), 0.01)


@pytest.mark.parametrize("form", ["%Y-%m-%d", "%d.%m.%Y", "%m/%d/%Y"])
def test_date_column_beside_times_is_not_read_as_bodies(tmp_path, form):
    """A date of two values, before and after midnight, and a time of day are together the clock of a single body."""
    rows = [csv_row(date_text(step, form), time_of_day(step), pose(step)) for step in range(COUNT)]
    session = import_csv(tmp_path, f"Date,Time,{POSE}", *rows)
    assert session.names == ("log",)
    check_clock(session.tracks["log"])


@pytest.mark.parametrize(
    "form", ["%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f", "%m/%d/%Y %I:%M:%S.%f %p", "%I:%M:%S.%f %p"]
)
def test_day_and_month_are_read_as_rows_follow_each_other(tmp_path, form):
    """40 rows go from 0.2 s before midnight of April 3rd to the 4th: 03/04 and 04/04 follow in one order alone.

    The last form has no date: after 11:59 PM comes 12:00 AM.
    """
    before_midnight = datetime(2026, 4, 3, 23, 59, 59, 800_000)
    cells = [(before_midnight + timedelta(seconds=float(seconds))).strftime(form) for seconds in SECONDS]
    rows = [csv_row(cell, pose(step)) for step, cell in enumerate(cells)]
    check_clock(import_csv(tmp_path, f"time,{POSE}", *rows).tracks["log"])


@pytest.mark.parametrize("change", ["pipes", "ends", "empty lines"])
def test_table_of_loggers_is_drafted_and_read(tmp_path, change):
    """Cells end with "|", rows end with a delimiter, or an empty line follows the header."""
    rows = [csv_row(f"{SECONDS[step]:.6f}", pose(step)) for step in range(COUNT)]
    lines = {
        "pipes": [line.replace(",", "|") for line in (f"time,{POSE}", *rows)],
        "ends": [f"time,{POSE}", *(f"{line}," for line in rows)],
        "empty lines": [f"time,{POSE}", "", *rows],
    }
    check_clock(import_csv(tmp_path, *lines[change]).tracks["log"])


@pytest.mark.parametrize(
    ("cells", "text"),
    [
        pytest.param(("0;1.500,5", "0;1,5"), "decimal commas; export one of them", id="1.500,5"),
        pytest.param(("0;1.500", "0;1,5"), "decimal commas; export one of them", id="1.500"),
        pytest.param(('0,"1,500.25"', "0,1.5"), "export numbers without separators of thousands", id="1,500.25"),
        pytest.param(("0,1_0", "0,1"), "'1_0' is no number; repair the cell", id="1_0"),
        pytest.param(
            ("0,1", "x,time"), "the line names columns again, in another order; split the file there", id="names"
        ),
        pytest.param(("1e999,1", "0,1"), "'1e999' is no time; remove the row", id="1e999"),
    ],
)
def test_number_of_two_readings_is_refused(tmp_path, cells, text):
    """Two rows begin with ``cells``, time and x, of which one has two readings or none.

    The mapping (what each column is) says decimal commas where the delimiter is a semicolon, else decimal points.
    """
    path, delimiter = tmp_path / "log.csv", ";" if ";" in cells[0] else ","
    rest_of_pose = delimiter.join(["1", "0", "0", "0", "0", "1"])
    rows = [delimiter.join([cell, rest_of_pose]) for cell in cells]
    path.write_text("\n".join([delimiter.join(f"time,{POSE}".split(",")), *rows, ""]))
    mapping = tmp_path / "log.columns.toml"
    decimal = "," if delimiter == ";" else "."
    mapping.write_text(
        f"""convention = "openvr"\ndelimiter = "{delimiter}"\ndecimal = "{decimal}"
        [time]\ncolumn = "time"\nunit = "s"\n[bodies.cup]
        position = ["x", "y", "z"]\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\n"""
    )
    with pytest.raises(ImportFileError, match=text):
        import_session("csv", path, mapping=mapping)


@pytest.mark.parametrize("in_blocks", [False, True])
def test_times_of_day_go_on_past_midnight(tmp_path, in_blocks):
    """Cup and rod have 40 rows each from 23:59:59.8 on, in turn or (``in_blocks``) one body after the other.

    Both have the times of SECONDS, from the same start.
    """
    rows = [
        csv_row(time_of_day(step), name, pose(step, body))
        for step in range(COUNT)
        for body, name in enumerate(("cup", "rod"))
    ]
    if in_blocks:
        rows = rows[::2] + rows[1::2]
    session = import_csv(tmp_path, f"time,name,{POSE}", *rows)
    assert session.names == ("cup", "rod")
    for track in session.tracks.values():
        check_clock(track)
    assert session.tracks["cup"].times_ns[0] == session.tracks["rod"].times_ns[0]
    assert "passes midnight" in session.facts["conversions"]


def test_body_recorded_only_after_midnight_is_in_the_next_day(tmp_path):
    """The cup has 40 rows, of which 18 are before midnight; the rod has the times of the last ten alone.

    Its time of day is of the second day, though none of its own rows is before midnight: both end together.
    """
    rows = [csv_row(time_of_day(step), "cup", pose(step)) for step in range(COUNT)]
    rows += [csv_row(time_of_day(step), "rod", pose(step, body=1)) for step in range(COUNT - 10, COUNT)]
    tracks = import_csv(tmp_path, f"time,name,{POSE}", *rows).tracks
    assert tracks["rod"].times_ns[-1] == tracks["cup"].times_ns[-1]


@pytest.mark.parametrize(
    ("yes", "no"),
    [("OK", "LOST"), ("Y", "N"), ("tracked", "untracked"), ("1.000", "0.000"), ("TRUE", ""), ("t", "nan")],
)
def test_flags_of_other_spellings_mark_lost_poses(tmp_path, yes, no):
    """A column "valid" is ``no`` in rows 10 to 19 and ``yes`` in the others: the poses of those ten rows are lost."""
    lost_rows = range(10, 20)
    rows = [csv_row(SECONDS[step], pose(step), no if step in lost_rows else yes) for step in range(COUNT)]
    valid = import_csv(tmp_path, f"time,{POSE},valid", *rows).tracks["log"].valid
    assert np.flatnonzero(~valid).tolist() == [*lost_rows]


@pytest.mark.parametrize("cell", ["2", "0.95", "limited", "-1"])
def test_validity_flag_other_than_yes_or_no_is_refused(tmp_path, capsys, cell):
    """A column "valid" is 1 but for row 7, counted from 0, which is line 9 of the file: the header is line 1."""
    rows = [csv_row(SECONDS[step], pose(step), cell if step == 7 else 1) for step in range(COUNT)]
    (tmp_path / "log.csv").write_text("\n".join([f"time,{POSE},valid", *rows, ""]))
    out = str(tmp_path / "s.mcap")
    assert main(["import", "csv", str(tmp_path / "log.csv"), "--convention", "openvr", "-o", out]) == 1
    assert f"line 9, column 'valid': '{cell}' does not say whether" in " ".join(capsys.readouterr().err.split())


def test_columns_that_are_not_read_are_named(tmp_path):
    """Beside a whole pose, of the body "log", stand positions of a rod without rotations, which are no pose."""
    rows = [csv_row(SECONDS[step], pose(step), 5, 6, 7) for step in range(COUNT)]
    session = import_csv(tmp_path, f"time,{POSE},rod_x,rod_y,rod_z", *rows)
    assert session.names == ("log",)
    assert "columns that are not read: rod_x, rod_y, rod_z" in session.facts["conversions"]


def test_columns_that_are_all_read_are_not_named(tmp_path):
    """The table has a time and a pose, and nothing else: the facts of the session name no column that is not read."""
    rows = [csv_row(SECONDS[step], pose(step)) for step in range(COUNT)]
    assert "not read" not in import_csv(tmp_path, f"time,{POSE}", *rows).facts["conversions"]


def test_draft_asks_which_of_two_poses_is_meant(tmp_path):
    """A table has local and world positions of a body, and one rotation."""
    names = [f"{frame}{kind}" for frame in ("local", "world") for kind in ("Pos.x", "Pos.y", "Pos.z")]
    names += [f"localRot.{axis}" for axis in "xyzw"]
    local_position = (0, 0, 0)
    rows = [csv_row(SECONDS[step], *local_position, pose(step)) for step in range(COUNT)]
    refusal = refused_draft(tmp_path, csv_row("time", *names), *rows)
    assert "which of the columns 'localPos.x' and 'worldPos.x' is meant" in refusal.unknown


@pytest.mark.parametrize(
    "headings",
    [
        pytest.param("x1,y1,z1,qx1,qy1,qz1,qw1,x2,y2,z2,qx2,qy2,qz2,qw2", id="x1"),
        pytest.param("x.1,y.1,z.1,qx.1,qy.1,qz.1,qw.1,x.2,y.2,z.2,qx.2,qy.2,qz.2,qw.2", id="x.1"),
    ],
)
def test_numbers_behind_axes_are_bodies(tmp_path, headings):
    """Columns x1, y1 ... are of body 1, x2, y2 ... of body 2, whose x and y are 1 m greater."""
    rows = [csv_row(SECONDS[step], pose(step), pose(step, body=1)) for step in range(COUNT)]
    session = import_csv(tmp_path, f"time,{headings}", *rows)
    assert session.names == ("1", "2")
    assert np.allclose(session.tracks["2"].positions - session.tracks["1"].positions, [1, 1, 0])


def test_columns_named_twice_by_pandas_are_a_second_body(tmp_path):
    """pandas writes a second column "x" as "x.1"; the first body has the name of the file, log.csv."""
    again = csv_row(*(f"{column}.1" for column in POSE.split(",")))
    rows = [csv_row(SECONDS[step], pose(step), pose(step, body=1)) for step in range(COUNT)]
    session = import_csv(tmp_path, f"time,{POSE},{again}", *rows)
    assert session.names == ("log", "1")


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32"])
def test_utf16_without_a_byte_order_mark_is_named(tmp_path, encoding):
    """A table in Latin letters has a zero in every second byte (UTF-16), or in three of four (UTF-32)."""
    path = tmp_path / "log.csv"
    rows = [csv_row(SECONDS[step], pose(step)) for step in range(COUNT)]
    path.write_bytes("\n".join([f"time,{POSE}", *rows]).encode(encoding))
    with pytest.raises(ImportFileError, match=r"in UTF-(16|32); save it as UTF-8"):
        import_session("csv", path)


FLAGS = {
    "behind each body": ("cup_tracked", "rod_tracked"),
    "before each body": ("tracked_cup", "tracked_rod"),
    "in one word": ("cupIsTracked", "rodIsValid"),
}


def headings_of_poses(*bodies):
    """The headings of the poses of these bodies."""
    return csv_row(*(f"{body}_{column}" for body in bodies for column in POSE.split(",")))


@pytest.mark.parametrize("kind", FLAGS)
def test_tracking_flag_marks_lost_poses_of_its_body_only(tmp_path, kind):
    """Each of two bodies has a flag, 1 where it is tracked: the cup in rows 0 to 29 of 40, the rod in rows 6 to 39."""
    cup_flag, rod_flag = FLAGS[kind]
    cup_rows, rod_rows = range(30), range(6, COUNT)
    rows = [
        csv_row(SECONDS[step], pose(step), pose(step, body=1), int(step in cup_rows), int(step in rod_rows))
        for step in range(COUNT)
    ]
    header = csv_row("time", headings_of_poses("cup", "rod"), cup_flag, rod_flag)
    tracks = import_csv(tmp_path, header, *rows).tracks
    assert np.flatnonzero(tracks["cup"].valid).tolist() == [*cup_rows]
    assert np.flatnonzero(tracks["rod"].valid).tolist() == [*rod_rows]


def test_flag_without_a_name_is_that_of_every_body(tmp_path):
    """Cup and rod share a column "tracked", which is 1 in rows 0 to 29 of 40."""
    tracked_rows = range(30)
    rows = [csv_row(SECONDS[step], pose(step), pose(step, body=1), int(step in tracked_rows)) for step in range(COUNT)]
    tracks = import_csv(tmp_path, csv_row("time", headings_of_poses("cup", "rod"), "tracked"), *rows).tracks
    valid_rows = {name: np.flatnonzero(track.valid).tolist() for name, track in tracks.items()}
    assert valid_rows == {"cup": [*tracked_rows], "rod": [*tracked_rows]}


def test_draft_asks_which_of_two_flags_counts(tmp_path):
    """Each row has a flag for its position, which says 1, and a flag for its rotation, which says 0.

    The import without a mapping is refused with a draft of one, which leaves open which flag is meant.
    """
    rows = [csv_row(SECONDS[k], pose(k), 1, 0) for k in range(COUNT)]
    refusal = refused_draft(tmp_path, f"time,{POSE},pos_valid,rot_valid", *rows)
    assert "which of the columns 'pos_valid' and 'rot_valid' says whether a pose is valid" in refusal.unknown


POSE_MATRIX = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
"""A quarter turn about z at the position (1, 2, 3), which is the last column."""
RIGHT_ANGLE_ABOUT_Z = [0, 0, 0.5**0.5, 0.5**0.5]


def table_of_matrices(matrix):
    """The lines of a CSV with the 16 numbers of a matrix, line by line, in columns m00, m01 ... m33 of every row."""
    names = [f"m{line}{column}" for line in range(4) for column in range(4)]
    return [csv_row("time", *names), *(csv_row(second, *matrix.ravel()) for second in SECONDS)]


def test_matrices_written_line_by_line_are_read_by_their_draft(tmp_path):
    """m03, m13 and m23 are the position, the nine m00 to m22 the rotation."""
    (track,) = import_csv(tmp_path, *table_of_matrices(POSE_MATRIX)).tracks.values()
    assert track.valid.all()
    assert (track.positions == [1, 2, 3]).all()
    assert np.allclose(track.quaternions_xyzw, RIGHT_ANGLE_ABOUT_Z)


def test_matrices_written_column_by_column_are_refused(tmp_path):
    """The position stands in m30, m31 and m32, where a matrix written line by line has zeros.

    A mapping that takes it from there, and the rotation column by column, reads the pose rightly.
    """
    path, mapping = tmp_path / "log.csv", tmp_path / "log.columns.toml"
    refusal = refused_draft(tmp_path, *table_of_matrices(POSE_MATRIX.T))
    mapping.write_text(refusal.draft_with_axes("openvr"))
    with pytest.raises(
        ImportFileError, match=r"m30, m31, m32 hold \[1.0, 2.0, 3.0\] in place of zeros: the matrices are"
    ):
        import_session("csv", path, mapping=mapping)

    rotation = [f"m{line}{column}" for column in range(3) for line in range(3)]
    mapping.write_text(
        f"""convention = "openvr"\n[time]\ncolumn = "time"\nunit = "s"\n[bodies.cup]
        position = ["m30", "m31", "m32"]\nmatrix = {rotation}\n"""
    )
    cup = import_session("csv", path, mapping=mapping).tracks["cup"]
    assert (cup.positions == [1, 2, 3]).all()
    assert np.allclose(cup.quaternions_xyzw, RIGHT_ANGLE_ABOUT_Z)


@pytest.mark.parametrize(
    ("column", "cell", "question"),
    [
        ("parent", lambda step, body: "table" if body == "cup" else "", "in the frame that column 'parent' names"),
        ("space", lambda step, body: "local" if body == "cup" else "world", "in the frame that column 'space' names"),
        ("space", lambda step, body: "world", ""),
        ("unit", lambda step, body: "mm" if body == "cup" else "m", "the unit of lengths, which column 'unit' says"),
        ("unit", lambda step, body: "cm", "the unit of lengths, which column 'unit' says"),
        ("confidence", lambda step, body: step / COUNT, "'confidence' says which poses are lost"),
        ("confidence", lambda step, body: 1.0, ""),
        ("is_lost", lambda step, body: int(step > 9), "'is_lost' says which poses are lost"),
        ("trackingState", lambda step, body: 63 * int(step > 9), "'trackingState' says which poses are lost"),
        ("status", lambda step, body: "OK" if step > 9 else "LOST", "'status' says which poses are lost"),
        ("status", lambda step, body: int(step > 9), "'status' says which poses are lost"),
        ("trigger_state", lambda step, body: int(step > 9), ""),
        ("status", lambda step, body: "pour" if step > 9 else "grasp", ""),
    ],
)
def test_draft_asks_about_columns_whose_meaning_varies_by_row(tmp_path, column, cell, question):
    """Cup and pen have 40 rows each in turn; a further column holds ``cell``, by step and body.

    The draft asks ``question`` where it says of what frame, of what unit or how good a row is. It asks nothing ("")
    where all rows say the same good thing, or the column is about no pose.
    """
    rows = [
        csv_row(SECONDS[step], name, cell(step, name), pose(step, body))
        for step in range(COUNT)
        for body, name in enumerate(("cup", "pen"))
    ]
    unknown = refused_draft(tmp_path, f"time,name,{column},{POSE}", *rows).unknown
    questions = [text for text in unknown if f"column {column!r}" in text]
    assert len(questions) == (question != "")
    assert question in "".join(questions)


@pytest.mark.parametrize(
    ("line", "unit"),
    [
        ("# units: cm", "cm"),
        ("# positions in millimetres", "mm"),
        ('{"unit": "m", "fps": 60}', "m"),
        ("# recorded in min 3 by m. meyer", ""),
    ],
)
def test_draft_asks_for_the_unit_of_a_line_above(tmp_path, line, unit):
    """``line`` stands above the header and may name a unit of lengths; "min" and "m." of the last are none."""
    rows = [csv_row(SECONDS[step], pose(step)) for step in range(COUNT)]
    unknown = refused_draft(tmp_path, line, f"time,{POSE}", *rows).unknown
    questions = [text for text in unknown if "a line above the header" in text]
    assert questions == ([f"the unit of lengths (a line above the header says {unit})"] if unit else [])
