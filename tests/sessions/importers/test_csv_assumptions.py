"""Who says what the numbers of a CSV mean: its file, a convention, the draft that guessed, or the user."""

import pytest

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.model.assumption import Confidence, Origin, Subject, assumptions_of

QUATERNION = "qx,qy,qz,qw"


def assumptions_by_draft(folder, header, row, *changes, count=20):
    """Subject -> assumption of a CSV of ``count`` rows 11 ms apart, imported by the draft that its refusal has.

    The draft is a mapping, which says what each column is; its axes are set to OpenXR's. ``row``: of the CSV, with
    {step} (0, 1, 2 ...) or {ms} (0, 11, 22 ...) for its time; ``changes``: (text of the draft, text instead).
    """
    source, mapping = folder / "log.csv", folder / "map.toml"
    rows = [row.format(step=k, ms=11 * k) for k in range(count)]
    source.write_text("\n".join([*filter(None, [header]), *rows, ""]))
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", source)
    text = refusal.value.draft
    for before, after in (('# convention = "unity"', 'convention = "openxr"'), *changes):
        assert before in text
        text = text.replace(before, after)
    mapping.write_text(text)
    session = import_session("csv", source, mapping=mapping)
    return {row.subject: row for row in assumptions_of(session.facts)}


@pytest.mark.parametrize(
    ("header", "time", "expected"),
    [
        ("t_ms,x,y,z", "{ms}", {Subject.TIME_UNIT: ("ms", Origin.FILE)}),
        ("t [ms],x,y,z", "{ms}", {Subject.TIME_UNIT: ("ms", Origin.FILE)}),
        ("t,x_mm,y_mm,z_mm", "{ms}", {Subject.LENGTH_UNIT: ("mm", Origin.FILE)}),
        (
            "t,x,y,z",
            "{ms}",
            {
                Subject.TIME_UNIT: ("ms", Origin.GUESS),
                Subject.LENGTH_UNIT: ("m", Origin.GUESS),
                Subject.QUATERNION_ORDER: ("xyzw", Origin.FILE),
                Subject.CLOCK: ("column t, ms", Origin.FILE),
            },
        ),
        (
            "t,x,y,z",
            "03/04/2026 10:00:{step:02d}.5",
            {Subject.TIME_UNIT: ("%m/%d/%Y %H:%M:%S.%f", Origin.GUESS)},
        ),
        ("t,x,y,z", "2026-03-04T10:00:{step:02d}.5", {Subject.TIME_UNIT: ("ISO 8601", Origin.FILE)}),
    ],
)
def test_draft_records_whether_file_or_guess_gave_each_value(tmp_path, header, time, expected):
    """A draft is the mapping of columns that an import proposes: its values are those of the header or of the numbers
    themselves (origin FILE), or a guess from the numbers (GUESS): 03/04 may be March or April.

    Each of 20 rows begins with ``time``: 0, 1, 2 ... for {step} or 0, 11, 22 ... for {ms}.
    """
    assumptions = assumptions_by_draft(tmp_path, f"{header},{QUATERNION}", f"{time},1,2,3,0,0,0,1")
    assert {subject: (assumptions[subject].value, assumptions[subject].origin) for subject in expected} == expected


def test_row_of_units_is_what_the_file_states(tmp_path):
    """Below the header stands a row of units, ms and cm: the file gives both units."""
    header = f"t,x,y,z,{QUATERNION}\nms,cm,cm,cm,,,,"
    assumptions = assumptions_by_draft(tmp_path, header, "{ms},1,2,3,0,0,0,1")
    for subject, unit in ((Subject.TIME_UNIT, "ms"), (Subject.LENGTH_UNIT, "cm")):
        assert (assumptions[subject].value, assumptions[subject].origin) == (unit, Origin.FILE), subject


@pytest.mark.parametrize(
    ("time", "confidence"),
    [
        pytest.param("{ms}", Confidence.SURE, id="steps of 11"),
        pytest.param("{step}", Confidence.OPEN, id="steps of 1"),
        pytest.param("{step}00", Confidence.SURE, id="steps of 100"),
    ],
)
def test_guessed_time_unit_is_sure_at_tracker_rates(tmp_path, time, confidence):
    """The unit of a column "stamp" is guessed: steps of 11 or 100 fit a tracker in ms alone, steps of 1 also in s."""
    assumptions = assumptions_by_draft(tmp_path, f"stamp,x,y,z,{QUATERNION}", f"{time},1,2,3,0,0,0,1")
    time_unit = assumptions[Subject.TIME_UNIT]
    assert (time_unit.origin, time_unit.confidence) == (Origin.GUESS, confidence)


def test_guess_removed_from_mapping_becomes_a_user_statement(tmp_path):
    """A draft lists its guesses under "guessed"; the user who deletes the line says that the unit of time is right."""
    without_guesses = ('guessed = ["time.unit"]', "")
    rows = assumptions_by_draft(tmp_path, f"stamp,x,y,z,{QUATERNION}", "{ms},1,2,3,0,0,0,1", without_guesses)
    assert rows[Subject.TIME_UNIT].origin is Origin.USER


def without_comment_sign(line):
    """The change of a draft by a person who takes the comment sign off a line that begins so."""
    return f"# {line}", line


def test_columns_of_a_file_without_names_are_guessed(tmp_path):
    """A log has no header and eight numbers a row; the user says that w of the quaternion comes first.

    Which columns are time, position and quaternion stays a guess, and so does the clock.
    """
    w_first = without_comment_sign('quaternion_wxyz = ["q1"')
    rows = assumptions_by_draft(tmp_path, "", "{step}.5 1 2 3 1 0 0 0", w_first)
    assert (rows[Subject.COLUMNS].origin, rows[Subject.COLUMNS].confidence) == (Origin.GUESS, Confidence.OPEN)
    assert (rows[Subject.QUATERNION_ORDER].value, rows[Subject.QUATERNION_ORDER].origin) == ("wxyz", Origin.USER)
    assert rows[Subject.CLOCK].origin is Origin.GUESS


RADIANS_BY_THE_USER = ('# angle_unit = "deg"', 'angle_unit = "rad"')


@pytest.mark.parametrize(
    ("angle", "change", "origin", "is_open"),
    [
        pytest.param("3.1", [], Origin.GUESS, True, id="may be either"),
        pytest.param("-0.2", [], Origin.GUESS, True, id="may be either, negative"),
        pytest.param("179", [], Origin.GUESS, False, id="must be degrees"),
        pytest.param("0", [], Origin.GUESS, False, id="0 in both"),
        pytest.param("3.1", [RADIANS_BY_THE_USER], Origin.USER, False, id="the user decides"),
    ],
)
def test_angles_below_two_pi_leave_their_unit_open(tmp_path, angle, change, origin, is_open):
    """All rows of a log have the same ``angle`` about y, whose unit is guessed where the user does not say it.

    The user also says the order of the angles, XYZ.
    """
    order_by_the_user = without_comment_sign('order = "XYZ"')
    row = "{ms},1,2,3,0," + angle + ",0"
    rows = assumptions_by_draft(tmp_path, "t,x,y,z,rx,ry,rz", row, order_by_the_user, *change)
    assert (rows[Subject.ANGLE_UNIT].origin, rows[Subject.ANGLE_UNIT].is_open) == (origin, is_open)
    assert rows[Subject.EULER_ORDER].origin is Origin.USER


@pytest.mark.parametrize(
    ("unit", "largest_angle", "is_doubtful"),
    [
        pytest.param("rad", "170", True, id="27 turns"),
        pytest.param("rad", "7", False, id="a little over a turn"),
        pytest.param("deg", "3.14", True, id="half a turn in radians"),
        pytest.param("deg", "2", False, id="2 degrees"),
        pytest.param("deg", "170", False, id="170 degrees"),
    ],
)
def test_stated_unit_that_angles_contradict_is_named(tmp_path, unit, largest_angle, is_doubtful):
    """The user's mapping states the unit of angles; a text about what is doubtful says where it is likely the other.

    Radians beyond two turns, 12.6, are likely degrees; degrees that end just below 3.14 or 6.28 are likely radians.
    """
    path, mapping = tmp_path / "log.csv", tmp_path / "m.toml"
    path.write_text(f"t,x,y,z,rx,ry,rz\n0,1,2,3,0,{largest_angle},0\n0.1,1,2,3,0,0,0\n")
    mapping.write_text(
        f"""convention = "unity"\n[time]\ncolumn = "t"\nunit = "s"\n[bodies.cup]\nposition = ["x", "y", "z"]
        euler = {{x = "rx", y = "ry", z = "rz"}}\nangle_unit = "{unit}"\n"""
    )
    assumed = import_session("csv", path, mapping=mapping).facts.get("assumed", "")
    assert (f"angles of cup in {unit}, though the largest is {largest_angle}" in assumed) == is_doubtful
    assert ("angles of cup" in assumed) == is_doubtful


@pytest.mark.parametrize(("column", "origin"), [("time", Origin.FILE), ("stage", Origin.USER)])
def test_clock_is_stated_by_a_column_named_after_time(tmp_path, column, origin):
    """The user's mapping names the clock's column: "time" says it itself (origin: file), "stage" does not (user)."""
    path, mapping = tmp_path / "log.csv", tmp_path / "m.toml"
    path.write_text(f"{column},x,y,z,{QUATERNION}\n0,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1\n")
    mapping.write_text(
        f"""convention = "openxr"\n[time]\ncolumn = "{column}"\nunit = "s"\n[bodies.cup]
        position = ["x", "y", "z"]\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\n"""
    )
    rows = assumptions_of(import_session("csv", path, mapping=mapping).facts)
    assert [row.origin for row in rows if row.subject is Subject.CLOCK] == [origin]


def test_an_euler_order_that_the_convention_fixes_is_its_word(tmp_path):
    """The log has angles in Unity's axes, and nobody says their order: it is zxy, by the format of the axes."""
    unity_axes = ('convention = "openxr"', 'convention = "unity"')
    rows = assumptions_by_draft(tmp_path, "t,x,y,z,rx,ry,rz", "{ms},1,2,3,0,90,0", unity_axes)
    assert (rows[Subject.EULER_ORDER].value, rows[Subject.EULER_ORDER].origin) == ("zxy", Origin.FORMAT)


def test_misspelt_guess_in_a_mapping_is_refused_with_a_suggestion(tmp_path):
    """The draft's list of guesses holds time.unit; a user writes time.unti."""
    misspelt = ('"time.unit"', '"time.unti"')
    with pytest.raises(ImportFileError, match=r"guessed holds 'time\.unti'; did you mean 'time\.unit'"):
        assumptions_by_draft(tmp_path, f"stamp,x,y,z,{QUATERNION}", "{ms},1,2,3,0,0,0,1", misspelt)
