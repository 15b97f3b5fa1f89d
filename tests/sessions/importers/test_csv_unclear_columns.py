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


def csv_row(*cells):
    """A line of a CSV."""
    return ",".join(map(str, cells))


def pose(step, body=0):
    """The cells of a pose of which no two are alike."""
    return csv_row(round(0.01 * step + body, 6), 1 + body, -0.5, 0, 0, 0, 1)


def import_csv(folder, *lines):
    """The session of a CSV by its own draft, in which the axes alone are filled in."""
    mapping = folder / "log.columns.toml"
    mapping.write_text(refused_draft(folder, *lines).draft_with_axes("openvr"))
    return import_session("csv", folder / "log.csv", mapping=mapping)


def refused_draft(folder, *lines):
    """The error of a CSV without a mapping."""
    path = folder / "log.csv"
    path.write_text("\n".join([*lines, ""]))
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    return refusal.value


def time_of_day(step):
    """The time of day of a row."""
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
    """Date and time of day are together the clock of a single body."""
    rows = [csv_row(date_text(step, form), time_of_day(step), pose(step)) for step in range(COUNT)]
    session = import_csv(tmp_path, f"Date,Time,{POSE}", *rows)
    assert session.names == ("log",)
    check_clock(session.tracks["log"])


@pytest.mark.parametrize(
    "form", ["%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f", "%m/%d/%Y %I:%M:%S.%f %p", "%I:%M:%S.%f %p"]
)
def test_day_and_month_are_read_as_rows_follow_each_other(tmp_path, form):
    """40 rows from 0.2 s before midnight of April 3rd: only one order of day and month makes time go on."""
    midnight = datetime(2026, 4, 3, 23, 59, 59, 800_000)
    cells = [(midnight + timedelta(seconds=float(seconds))).strftime(form) for seconds in SECONDS]
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
        (("0;1.500,5", "0;1,5"), "decimal commas; export one of them"),
        (("0;1.500", "0;1,5"), "decimal commas; export one of them"),
        (('0,"1,500.25"', "0,1.5"), "export numbers without separators of thousands"),
        (("0,1_0", "0,1"), "'1_0' is no number; repair the cell"),
        (("0,1", "x,time"), "the line names columns again, in another order; split the file there"),
        (("1e999,1", "0,1"), "'1e999' is no time; remove the row"),
    ],
)
def test_number_of_two_readings_is_refused(tmp_path, cells, text):
    """Two rows begin with ``cells``, time and x; decimals have commas where the delimiter is a semicolon."""
    path, delimiter = tmp_path / "log.csv", ";" if ";" in cells[0] else ","
    rest = delimiter.join(["1", "0", "0", "0", "0", "1"])
    rows = [f"{delimiter.join([cell, rest])}" for cell in cells]
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
    """``in_blocks``: all rows of one body come before those of the other."""
    cells = [(step, body) for step in range(COUNT) for body in range(2)]
    if in_blocks:
        cells.sort(key=lambda cell: cell[1])
    rows = [csv_row(time_of_day(step), ("cup", "rod")[body], pose(step, body)) for step, body in cells]
    session = import_csv(tmp_path, f"time,name,{POSE}", *rows)
    assert session.names == ("cup", "rod")
    for track in session.tracks.values():
        check_clock(track)
    assert session.tracks["cup"].times_ns[0] == session.tracks["rod"].times_ns[0]
    assert "passes midnight" in session.facts["conversions"]


def test_body_recorded_only_after_midnight_is_in_the_next_day(tmp_path):
    """Midnight comes after 18 of 40 rows; the rod is in the last ten alone."""
    rows = [csv_row(time_of_day(step), "cup", pose(step)) for step in range(COUNT)]
    rows += [csv_row(time_of_day(step), "rod", pose(step, body=1)) for step in range(COUNT - 10, COUNT)]
    tracks = import_csv(tmp_path, f"time,name,{POSE}", *rows).tracks
    assert tracks["rod"].times_ns[-1] == tracks["cup"].times_ns[-1]


@pytest.mark.parametrize(
    ("yes", "no"),
    [("OK", "LOST"), ("Y", "N"), ("tracked", "untracked"), ("1.000", "0.000"), ("TRUE", ""), ("t", "nan")],
)
def test_flags_of_other_spellings_mark_lost_poses(tmp_path, yes, no):
    """``no`` stands in rows 10 to 19, ``yes`` in the others."""
    rows = [csv_row(SECONDS[step], pose(step), no if 10 <= step < 20 else yes) for step in range(COUNT)]
    valid = import_csv(tmp_path, f"time,{POSE},valid", *rows).tracks["log"].valid
    assert np.flatnonzero(~valid).tolist() == [*range(10, 20)]


@pytest.mark.parametrize("cell", ["2", "0.95", "limited", "-1"])
def test_validity_flag_other_than_yes_or_no_is_refused(tmp_path, capsys, cell):
    """Row 7 (from 0) is line 9, after the header."""
    rows = [csv_row(SECONDS[step], pose(step), cell if step == 7 else 1) for step in range(COUNT)]
    (tmp_path / "log.csv").write_text("\n".join([f"time,{POSE},valid", *rows, ""]))
    out = str(tmp_path / "s.mcap")
    assert main(["import", "csv", str(tmp_path / "log.csv"), "--convention", "openvr", "-o", out]) == 1
    assert f"line 9, column 'valid': '{cell}' does not say whether" in " ".join(capsys.readouterr().err.split())


def test_columns_that_are_not_read_are_named(tmp_path):
    """Positions of a rod without rotations are no pose."""
    rows = [csv_row(SECONDS[step], pose(step), 5, 6, 7) for step in range(COUNT)]
    session = import_csv(tmp_path, f"time,{POSE},rod_x,rod_y,rod_z", *rows)
    assert session.names == ("log",)
    assert "columns that are not read: rod_x, rod_y, rod_z" in session.facts["conversions"]


def test_columns_that_are_all_read_are_not_named(tmp_path):
    """A time and a pose."""
    rows = [csv_row(SECONDS[step], pose(step)) for step in range(COUNT)]
    assert "not read" not in import_csv(tmp_path, f"time,{POSE}", *rows).facts["conversions"]


def test_draft_asks_which_of_two_poses_is_meant(tmp_path):
    """A rotation is there once, positions are there twice."""
    names = [f"{frame}{kind}" for frame in ("local", "world") for kind in ("Pos.x", "Pos.y", "Pos.z")]
    names += [f"localRot.{axis}" for axis in "xyzw"]
    rows = [csv_row(SECONDS[step], 0, 0, 0, pose(step)) for step in range(COUNT)]
    assert (
        "which of the columns 'localPos.x' and 'worldPos.x' is meant"
        in refused_draft(tmp_path, csv_row("time", *names), *rows).unknown
    )


@pytest.mark.parametrize(
    ("second", "bodies"),
    [("x{},y{},z{},qx{},qy{},qz{},qw{}", ("1", "2")), ("x.{},y.{},z.{},qx.{},qy.{},qz.{},qw.{}", ("1", "2"))],
)
def test_numbers_behind_axes_are_bodies(tmp_path, second, bodies):
    """Columns x1, y1 ... are of body 1, x2, y2 ... of body 2."""
    head = csv_row("time", *(second.replace("{}", body) for body in bodies))
    session = import_csv(tmp_path, head, *(csv_row(SECONDS[k], pose(k), pose(k, body=1)) for k in range(COUNT)))
    assert session.names == bodies
    assert np.allclose(session.tracks["2"].positions - session.tracks["1"].positions, [1, 1, 0])


def test_columns_named_twice_by_pandas_are_a_second_body(tmp_path):
    """pandas writes a second column "x" as "x.1"."""
    twice = csv_row(POSE, csv_row(*(f"{column}.1" for column in POSE.split(","))))
    session = import_csv(
        tmp_path, f"time,{twice}", *(csv_row(SECONDS[k], pose(k), pose(k, body=1)) for k in range(COUNT))
    )
    assert session.names == ("log", "1")


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-32-le", "utf-32"])
def test_utf16_without_a_byte_order_mark_is_named(tmp_path, encoding):
    """A table in Latin letters has a zero in every second byte, or three of four."""
    path = tmp_path / "log.csv"
    path.write_bytes(
        "\n".join([f"time,{POSE}", *(csv_row(SECONDS[k], pose(k)) for k in range(COUNT))]).encode(encoding)
    )
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
    """The cup's flag is 1 in the first 30 rows, the rod's from row 6."""
    cup, rod = FLAGS[kind]
    rows = [csv_row(SECONDS[k], pose(k), pose(k, body=1), int(k < 30), int(k > 5)) for k in range(COUNT)]
    tracks = import_csv(tmp_path, csv_row("time", headings_of_poses("cup", "rod"), cup, rod), *rows).tracks
    assert np.flatnonzero(~tracks["cup"].valid).tolist() == [*range(30, COUNT)]
    assert np.flatnonzero(~tracks["rod"].valid).tolist() == [*range(6)]


def test_flag_without_a_name_is_that_of_every_body(tmp_path):
    """Both bodies are tracked in the first 30 of 40 rows."""
    rows = [csv_row(SECONDS[k], pose(k), pose(k, body=1), int(k < 30)) for k in range(COUNT)]
    tracks = import_csv(tmp_path, csv_row("time", headings_of_poses("cup", "rod"), "tracked"), *rows).tracks
    lost = {name: np.flatnonzero(~track.valid).tolist() for name, track in tracks.items()}
    assert lost == {name: [*range(30, COUNT)] for name in ("cup", "rod")}


def test_draft_asks_which_of_two_flags_counts(tmp_path):
    """A flag for the position says 1, that for the rotation 0."""
    rows = [csv_row(SECONDS[k], pose(k), 1, 0) for k in range(COUNT)]
    refusal = refused_draft(tmp_path, f"time,{POSE},pos_valid,rot_valid", *rows)
    assert "which of the columns 'pos_valid' and 'rot_valid' says whether a pose is valid" in refusal.unknown


def test_matrices_written_column_by_column_are_refused(tmp_path):
    """The translation stands where a row of zeros belongs; a mapping that names the cells reads it rightly."""
    names = [f"m{line}{column}" for line in range(4) for column in range(4)]
    matrix = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    files = {
        by: [csv_row("time", *names), *(csv_row(second, *cells.ravel()) for second in SECONDS)]
        for by, cells in (("row", matrix), ("column", matrix.T))
    }
    (track,) = import_csv(tmp_path, *files["row"]).tracks.values()
    assert track.valid.all() and np.abs(track.positions - [1, 2, 3]).max() == 0.0
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*files["column"], ""]))
    mapping = tmp_path / "log.columns.toml"
    with pytest.raises(
        ImportFileError, match=r"m30, m31, m32 hold \[1.0, 2.0, 3.0\] in place of zeros: the matrices are"
    ):
        import_session("csv", path, mapping=mapping)
    nine = [f"m{line}{column}" for column in range(3) for line in range(3)]
    mapping.write_text(
        f"""convention = "openvr"\n[time]\ncolumn = "time"\nunit = "s"\n[bodies.cup]
        position = ["m30", "m31", "m32"]\nmatrix = {nine}\n"""
    )
    cup = import_session("csv", path, mapping=mapping).tracks["cup"]
    assert (
        np.abs(cup.positions - track.positions).max()
        == np.abs(cup.quaternions_xyzw - track.quaternions_xyzw).max()
        == 0
    )


STEPS_AND_BODIES = [(step, body) for step in range(COUNT) for body in ("cup", "pen")]


@pytest.mark.parametrize(
    ("column", "cell", "text"),
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
def test_draft_asks_about_columns_whose_meaning_varies_by_row(tmp_path, column, cell, text):
    """``cell`` of each step and body; ``text``: the question about the column, none if it says the same in all rows."""
    rows = [
        csv_row(SECONDS[step], body, cell(step, body), pose(step, body == "pen")) for step, body in STEPS_AND_BODIES
    ]
    unknown = refused_draft(tmp_path, f"time,name,{column},{POSE}", *rows).unknown
    asked = [question for question in unknown if f"column {column!r}" in question]
    assert len(asked) == bool(text) and all(text in question for question in asked)


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
    """``line`` stands above the header; "min" and "m." in the last are no units of length."""
    rows = [csv_row(SECONDS[step], pose(step)) for step in range(COUNT)]
    asked = "the unit of lengths (a line above the header says "
    unknown = refused_draft(tmp_path, line, f"time,{POSE}", *rows).unknown
    assert [question for question in unknown if question.startswith(asked)] == [f"{asked}{unit})"] * bool(unit)
