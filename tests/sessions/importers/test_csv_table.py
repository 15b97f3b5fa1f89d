"""Kinds of CSV that programs write, a table of members each; what is expected is known by how the text is made."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mutants import assert_import_refused, ledger_text

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError

COUNT = 30
TIMES = [f"{k / 90:.6f}" for k in range(COUNT)]
POSITIONS = np.round(np.random.default_rng(3).normal(size=(COUNT, 3)), 4)
NAMES = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")
ROWS = [
    [time, *(f"{number:.4f}" for number in position), "0", "0", "0", "1"]
    for time, position in zip(TIMES, POSITIONS, strict=True)
]
MAPPING_OF_CUP = """
convention = "openxr"
%s
[time]
column = "t"
unit = "s"
[bodies.cup]
position = ["x", "y", "z"]
quaternion_xyzw = ["qx", "qy", "qz", "qw"]
"""


def csv_text(between=",", head=NAMES, rows=ROWS, above=(), below=()):
    """A CSV: lines above, the header, rows with this delimiter, lines below."""
    lines = [between.join(cells) for cells in (head, *rows) if cells]
    return "\n".join([*above, *lines, *below, ""])


def german(between):
    """The CSV with this delimiter, decimal commas in place of points."""
    return csv_text(between).replace(".", ",")


SPACES = f'delimiter = " "\ncolumns = {list(NAMES)}'
TRAJECTORIES = ["", "Trajectories", "100", ",,a,,,b", "f,s,X,Y,Z,X,Y,Z", *["1,0,5,5,5,6,6,6"] * 9]
UNITS = ["s", *["m"] * 3, *[""] * 4]
# Line 1 is the header, 2 to 31 the rows, 32 empty; the table below has its title and 12 more lines.
ANOTHER = "13 of 43 rows dropped: of another table, 'Trajectories', from line 33"
NOTES = "2 of 32 rows dropped: of another table, 'Notes', from line 33"
FORMS = {
    # form: (text of the CSV, keys of its mapping, sentence on the lines that are no poses of the cup)
    "sep= and semicolons": ("sep=;\n" + german(";"), 'delimiter = ";"\ndecimal = ","', ""),
    "sep= and commas": ("sep=,\r\n" + csv_text().replace("\n", "\r\n"), "", ""),
    "sep= in quotes and tabs": ('"sep=\t"\n' + csv_text("\t"), 'delimiter = "\t"'.replace("\t", "\\t"), ""),
    "sep= counted by the mapping": ("SEP=;\n" + csv_text(";"), 'delimiter = ";"\nskip_lines = 1', ""),
    "several spaces": (csv_text("    ", head=()), SPACES, ""),
    "spaces before and behind": (csv_text("  ", head=()).replace("\n", "   \n   "), SPACES, ""),
    "tabs and spaces": (csv_text(" \t ", head=()), SPACES, ""),
    "spaces with a header": (csv_text("   "), 'delimiter = " "', ""),
    "a row of units": (csv_text(rows=[UNITS, *ROWS]), "", ""),
    "units in brackets": (csv_text(rows=[["[s]", *["(m)"] * 3, "", "", "", ""], *ROWS]), "", ""),
    "units below a line of a title": (csv_text(rows=[UNITS, *ROWS], above=["take 3"]), "skip_lines = 1", ""),
    "units and semicolons": (csv_text(";", rows=[UNITS, *ROWS]), 'delimiter = ";"', ""),
    "the header again": (
        csv_text(rows=[*ROWS[:9], NAMES, *ROWS[9:]]),
        "",
        "1 of 31 rows merged: that repeat the header",
    ),
    "another table": (csv_text(below=TRAJECTORIES), "", ANOTHER),
    "another table behind an empty line with spaces": (
        csv_text(below=["  ", *TRAJECTORIES[1:]]),
        "",
        ANOTHER,
    ),
    "another table of one number a line": (csv_text(below=["", "Notes", "7"]), "", NOTES),
    "an empty line in the middle": (csv_text(rows=[*ROWS[:9], [""], *ROWS[9:]]), "", ""),
    "lines of an old Macintosh": (csv_text().replace("\n", "\r"), "", ""),
    "a byte order mark": ("\ufeff" + csv_text(), "", ""),
}


SEGMENTS = ["", "Segments", "100", ",,a,,,,,", csv_text().rstrip("\n")]


@pytest.fixture
def import_csv(tmp_path):
    """Imports a CSV, given as text, by a mapping: TOML that says which column is what."""

    def read(content, mapping):
        (tmp_path / "log.csv").write_bytes(content.encode())
        (tmp_path / "map.toml").write_text(mapping)
        return import_session("csv", tmp_path / "log.csv", mapping=tmp_path / "map.toml")

    return read


@pytest.mark.parametrize("form", FORMS)
def test_every_table_form_gives_written_poses(import_csv, form):
    """A cup has 30 positions at 90 Hz, written in a form of FORMS: delimiters, lines above, units, other tables below.

    They are read as written; lines that are no poses of the cup are counted in the ledger of losses.
    """
    content, keys, losses = FORMS[form]
    session = import_csv(content, MAPPING_OF_CUP % keys)
    cup = session.tracks["cup"]
    np.testing.assert_array_equal(cup.positions, POSITIONS)
    assert cup.times_ns.tolist() == [round(1e9 * float(time)) for time in TIMES]
    assert ledger_text(session) == losses


ROWS_WITHOUT_DECIMALS = [[str(11 * k), "0", "1", "0", "0", "0", "0", "1"] for k in range(COUNT)]


@pytest.mark.parametrize(
    "row",
    [
        pytest.param("2233,0,039,1,0,0,0,0,1", id="x is 0,039"),
        pytest.param("2233,-0,039,1,250,0,0,0,0,1", id="x and y"),
        pytest.param("2233,5,1,0,0,0,0,7,0,7", id="a rotation"),
        pytest.param("22,33,1,0,0,0,0,0,1", id="the time is 22,33"),
    ],
)
@pytest.mark.parametrize("lines_above", [0, 2])
def test_single_row_with_decimal_commas_refuses_the_file(import_csv, row, lines_above):
    """Cells are set apart by commas, and all but the last row are whole numbers; there a comma cuts a number in two.

    The error names its line: those above the header, the header, 30 rows, and then this one.
    """
    content = csv_text(rows=[*ROWS_WITHOUT_DECIMALS, [row]], above=["a note"] * lines_above)
    line, cells = lines_above + 1 + COUNT + 1, row.count(",") + 1
    with pytest.raises(
        ImportFileError, match=f"line {line} has {cells} cells, the header {len(NAMES)}: commas are between"
    ):
        import_csv(content, MAPPING_OF_CUP % (f"skip_lines = {lines_above}" if lines_above else ""))


@pytest.mark.parametrize(
    "row",
    [
        pytest.param("0.5,1,2,3,0,0,0,1,,", id="ten cells"),
        pytest.param("a,b,c,d,e,f,g,h,i", id="nine cells"),
        pytest.param("0,1,2", id="three cells"),
    ],
)
def test_rows_of_wrong_length_are_counted(import_csv, row):
    """The header and 30 rows have eight cells, the row below them more or fewer: it alone is dropped and counted."""
    session = import_csv(csv_text(rows=[*ROWS, [row]]), MAPPING_OF_CUP % "")
    assert ledger_text(session) == "1 of 31 rows dropped: with too few or too many cells"


ROTATIONS = Rotation.random(COUNT, random_state=7)
KINDS = {
    # a key of a mapping (and more): (numbers of each row, further key of the mapping)
    "quaternion_wxyz": (ROTATIONS.as_quat()[:, [3, 0, 1, 2]], ""),
    "rotation_vector": (ROTATIONS.as_rotvec(degrees=True), 'angle_unit = "deg"'),
    "rotation_vector in radians": (ROTATIONS.as_rotvec(), 'angle_unit = "rad"'),
    "rotation_vector beyond a half turn": (
        ROTATIONS.as_rotvec() * (1 + 2 * np.pi / ROTATIONS.magnitude()[:, None]),
        'angle_unit = "rad"',
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_csv_rotations_of_every_notation_agree_with_scipy(import_csv, kind):
    """30 random rotations are written as quaternions or rotation vectors; SciPy gives the numbers.

    What is read back differs from them by no more than 1e-9 rad.
    """
    numbers, further_key = KINDS[kind]
    mapping_key, *_more = kind.split()
    columns = [f"r{k}" for k in range(numbers.shape[1])]
    rows = [[time, "0", "0", "0", *map(repr, row.tolist())] for time, row in zip(TIMES, numbers, strict=True)]
    mapping = MAPPING_OF_CUP.replace(
        'quaternion_xyzw = ["qx", "qy", "qz", "qw"]', f"{mapping_key} = {columns}\n{further_key}"
    )
    cup = import_csv(csv_text(head=("t", "x", "y", "z", *columns), rows=rows), mapping % "").tracks["cup"]
    assert cup.valid.all()
    difference = Rotation.from_quat(cup.quaternions_xyzw) * ROTATIONS.inv()
    assert difference.magnitude().max() < 1e-9


def refusal_with_draft(path, content):
    """The error of a CSV imported without a mapping: ``draft`` is one to complete, ``unknown`` its open questions."""
    path.write_text(content)
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    return refusal.value


UNCLEAR = {
    "undecided": ["0.5", "0.5", "0.5", "0.5"],
    "the first number is too small": ["0.8", "0.6", "0", "0"],
    "the last number is too large": ["0.95", "0", "0", "0.31"],
}
ROTATED = {name: [[*row[:4], *numbers] for row in ROWS] for name, numbers in UNCLEAR.items()}
SCALAR_FIRST = [[*row[:4], "1", "0", "0", "0"] for row in ROWS]


@pytest.mark.parametrize(
    ("content", "likely"),
    [
        (csv_text(" ", head=(), rows=SCALAR_FIRST), "q1 begins near 1, so that scalar first is likely"),
        (csv_text(" ", head=()), "q4 begins near 1, so that scalar last is likely"),
        (csv_text(head=("t", "x", "y", "z", "q0", "q1", "q2", "q3")), "q3 begins near 1"),
        (csv_text(head=("t", "x", "y", "z", "rot_1", "rot_2", "rot_3", "rot_4"), rows=SCALAR_FIRST), "rot_1 begins"),
        *(
            (csv_text(head=("t", "x", "y", "z", "quat0", "quat1", "quat2", "quat3"), rows=rows), "does not tell. Take")
            for rows in ROTATED.values()
        ),
    ],
    ids=["no header", "no header, scalar last", "q0 to q3", "rot_1 to rot_4", *ROTATED],
)
def test_unnamed_quaternion_order_is_a_question(tmp_path, content, likely):
    """Columns q1 to q4 say no order. A scalar near 1, in the first row, makes scalar first or scalar last likely.

    The draft of a mapping says which, and leaves the choice to a person: an import by it is refused.
    """
    refusal = refusal_with_draft(tmp_path / "log.csv", content)
    assert "the order of the quaternion (quaternion_xyzw or quaternion_wxyz)" in refusal.unknown
    assert likely in refusal.draft
    assert not [line for line in refusal.draft.splitlines() if line.startswith("quaternion")]
    (tmp_path / "map.toml").write_text(refusal.draft)
    with pytest.raises(ImportFileError, match=r"map.toml.*give quaternion_xyzw or quaternion_wxyz"):
        import_session("csv", tmp_path / "log.csv", mapping=tmp_path / "map.toml")


X_OF_OBJECT = {"2": 0.5, "1": 1.5, "3": 2.5}
OBJECTS = [[name, time, f"{x}", "1", "0", "0", "0", "0", "1"] for time in TIMES for name, x in X_OF_OBJECT.items()]
"""Three rows for each of 30 times, one for each object: its name, the time, its position and rotation."""
LONG_HEAD = ("object_uid", "timestamp", *NAMES[1:])
LONG = {
    "numbers as names": (LONG_HEAD, OBJECTS),
    "one body after the other": (LONG_HEAD, sorted(OBJECTS)),
    "a word that nobody knows": (("thing", "timestamp", *NAMES[1:]), OBJECTS),
    "names in the last column": (
        ("timestamp", *NAMES[1:], "marker_set"),
        [[*row[1:], f"m{row[0]}"] for row in OBJECTS],
    ),
}


@pytest.mark.parametrize("kind", LONG)
def test_long_table_is_drafted_by_column_of_few_values(tmp_path, kind):
    """A row holds the pose of one of three objects, named by a column: a table with a row for each body and time.

    The draft of a mapping takes that column for names, and by it each object has all its 30 samples, at its own x.
    """
    head, rows = LONG[kind]
    refusal = refusal_with_draft(tmp_path / "log.csv", csv_text(head=head, rows=rows))
    (tmp_path / "map.toml").write_text(refusal.draft.replace("# convention", "convention"))
    session = import_session("csv", tmp_path / "log.csv", mapping=tmp_path / "map.toml")
    assert ledger_text(session) == ""
    x_by_name = {name[-1]: track.positions[:, 0].tolist() for name, track in session.tracks.items()}  # "m2" or "2"
    assert x_by_name == {name: [x] * COUNT for name, x in X_OF_OBJECT.items()}


@pytest.mark.parametrize("kind", LONG)
def test_long_table_mapped_as_a_single_body_is_refused(tmp_path, kind):
    """60 of 90 rows, at 30 times, would repeat a stamp, were they all of one cup; a column tells three bodies apart."""
    head, rows = LONG[kind]
    (tmp_path / "log.csv").write_text(csv_text(head=head, rows=rows))
    (tmp_path / "cup.toml").write_text(MAPPING_OF_CUP.replace('"t"', '"timestamp"') % "")
    assert_import_refused(
        "csv", tmp_path / "log.csv", "60 of 90 rows repeat .* tells 3 bodies apart", mapping=tmp_path / "cup.toml"
    )


def test_long_table_without_body_column_is_drafted_as_comment(tmp_path):
    """30 times with three rows each and no column that tells them apart: 60 of 90 rows would be lost."""
    content = csv_text(head=LONG_HEAD[1:], rows=[row[1:] for row in OBJECTS])
    refusal = refusal_with_draft(tmp_path / "log.csv", content)
    assert "60 of 90 rows are dropped" in " ".join(refusal.unknown)
    assert '\n# [bodies."log"]' in refusal.draft
    assert "\n[bodies" not in refusal.draft


@pytest.mark.parametrize("position", ["first", "last"])
def test_mapping_selects_its_table_of_a_file_with_two(import_csv, position):
    """The mapping names the table of segments, whose header is two lines below its title; the cup's poses are its.

    The other table, of trajectories, is left out by the user's choice, so that it is no loss in the ledger.
    """
    both = [*SEGMENTS[1:], *TRAJECTORIES] if position == "first" else [*TRAJECTORIES[1:], *SEGMENTS]
    session = import_csv("\n".join([*both, ""]), MAPPING_OF_CUP % 'table = "Segments"\nskip_lines = 2')
    cup = session.tracks["cup"]
    np.testing.assert_array_equal(cup.positions, POSITIONS)
    assert cup.valid.all()
    assert (cup.quaternions_xyzw == [0, 0, 0, 1]).all()
    assert ledger_text(session) == ""


def test_missing_table_is_refused_with_all_names(import_csv):
    """The file has the tables 'Segments' and 'Trajectories'; the mapping names 'Segment'."""
    content = "\n".join([*SEGMENTS[1:], *TRAJECTORIES, ""])
    with pytest.raises(ImportFileError, match="no table 'Segment'; there are: 'Segments', 'Trajectories'"):
        import_csv(content, MAPPING_OF_CUP % 'table = "Segment"\nskip_lines = 2')


def test_unnamed_second_table_is_a_loss_with_its_cure(import_csv):
    """Below the cup's 30 rows another table begins, of 13 lines, and the mapping names neither table."""
    session = import_csv(csv_text(below=TRAJECTORIES), MAPPING_OF_CUP % "")
    assert ledger_text(session) == ANOTHER
    assert 'the mapping may name one: table = "TITLE"' in session.facts["conversions"]


@pytest.mark.parametrize(
    ("convention", "order", "axes"),
    [
        ("unity", "", "xyz"),
        ("godot", "", "xyz"),
        ("unreal", "", "yzx"),
        ("ros", "", "yzx"),
        # These have no order of their own.
        ("z-up", 'order = "ZXY"', "xzy"),
        ("z up, left-handed", 'order = "ZXY"', "xzy"),
    ],
)
def test_pitch_yaw_and_roll_use_axes_of_their_convention(import_csv, convention, order, axes):
    """Pitch is about the axis right or left, yaw about up, roll about ahead or back: ``axes``, letters in this order.

    Pitch, yaw and roll of 10, 20, 30 degrees give the rotation that the same angles give by the names of their axes.
    """
    head, rows = ("t", "x", "y", "z", "Pitch", "Yaw", "Roll"), [["0", "1", "2", "3", "10", "20", "30"]]
    content = csv_text(head=head, rows=rows)
    mapping = f"""
convention = "{convention}"
[time]
column = "t"
unit = "s"
[bodies.cup]
position = ["x", "y", "z"]
{order}
"""
    right, up, ahead = axes
    by_role = import_csv(content, mapping + 'euler = {pitch = "Pitch", yaw = "Yaw", roll = "Roll"}')
    by_axis = import_csv(content, mapping + f'euler = {{{right} = "Pitch", {up} = "Yaw", {ahead} = "Roll"}}')
    rotation = by_role.tracks["cup"].quaternions_xyzw[0]
    assert rotation.tolist() == by_axis.tracks["cup"].quaternions_xyzw[0].tolist()
    assert Rotation.from_quat(rotation).magnitude() > np.radians(30)  # the angles were not left out


def test_roll_pitch_yaw_draft_leaves_axes_to_the_convention(tmp_path):
    """Pitch is about another axis in each convention, so the draft of a mapping names roles in place of axes."""
    rows = [[f"{k / 50:.2f}", *"123", "1.5", "2.5", "3.5"] for k in range(9)]
    content = csv_text(head=("Time", "LocX", "LocY", "LocZ", "Roll", "Pitch", "Yaw"), rows=rows)
    refusal = refusal_with_draft(tmp_path / "log.csv", content)
    assert 'euler = {pitch = "Pitch", yaw = "Yaw", roll = "Roll"}' in refusal.draft
