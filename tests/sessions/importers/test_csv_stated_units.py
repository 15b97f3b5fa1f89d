"""The unit that a heading states is the unit that is read; one that no mapping has is asked, never taken for metres."""

import re

import numpy as np
import pytest

from replay.cli.main import main
from sessions import read_session
from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError

SECONDS = 5.0 + np.arange(20) / 90
POSITION = (0.3, 1.25, -0.5)
"""Metres; the same in all rows."""
ANGLE = 0.7
"""Radians about the axis x."""
METRES_OF_A_UNIT = {
    "x (mm)": 1e-3, "x_mm": 1e-3, "x [millimetre]": 1e-3, "x (cm)": 0.01, "X(CM)": 0.01, "x [centimeters]": 0.01,
    "x (in)": 0.0254, "x_in": 0.0254, "x [inch]": 0.0254, "x (feet)": 0.3048, "x_ft": 0.3048, "x (m)": 1.0,
}  # fmt: skip
SECONDS_OF_A_UNIT = {
    "time (s)": 1.0, "time_ms": 1e-3, "time [us]": 1e-6, "time (µs)": 1e-6, "time (min)": 60.0, "time_min": 60.0,
    "time [hours]": 3600.0, "Timestamp (Milliseconds)": 1e-3,
}  # fmt: skip


def write_recording(path, time="time", axes=("x", "y", "z"), metres=1.0, seconds=1.0, rotation="qx,qy,qz,qw", units=""):
    """Write a recording of POSITION, ANGLE and SECONDS whose numbers are in other units, and return its path.

    ``metres``, ``seconds``: of one such unit; ``units``: a row of their names below the header.
    """
    head = [",".join([time, *axes, rotation]), *filter(None, [units])]
    rotation_cells = {4: (np.sin(ANGLE / 2), 0, 0, np.cos(ANGLE / 2)), 3: (ANGLE, 0, 0)}[rotation.count(",") + 1]
    cells = [*(coordinate / metres for coordinate in POSITION), *rotation_cells]
    rows = [",".join(f"{cell:.12g}" for cell in (stamp / seconds, *cells)) for stamp in SECONDS]
    path.write_text("\n".join([*head, *rows, ""]), encoding="utf-8")
    return path


def headings_of_axes(column):
    """The headings of three axes after the pattern of the first."""
    return [re.sub("^[xX]", axis, column) for axis in "xyz"]


def assert_track_is_that_of_the_constants(session):
    """Fails unless the only track has the times SECONDS, is at POSITION in metres and turned by ANGLE in radians."""
    (track,) = session.tracks.values()
    assert track.valid.all()
    assert np.allclose(track.positions, POSITION, atol=1e-6)
    assert np.allclose(track.times_ns / 1e9, SECONDS, atol=1e-6)
    assert np.allclose(2 * np.arctan2(track.quaternions_xyzw[:, 0], track.quaternions_xyzw[:, 3]), ANGLE, atol=1e-6)


def mapping_text(axes, lines="", time="time", unit="s", rotation='quaternion_xyzw = ["qx", "qy", "qz", "qw"]'):
    """A mapping of a cup whose position stands in these columns."""
    columns = ", ".join(f'"{axis}"' for axis in axes)
    return f'{lines}\n[time]\ncolumn = "{time}"\nunit = "{unit}"\n[bodies.cup]\nposition = [{columns}]\n{rotation}\n'


def import_with(folder, mapping, **recording):
    """The session of a recording (keywords of ``write_recording``) by a mapping."""
    (folder / "map.toml").write_text(mapping, encoding="utf-8")
    return import_session(
        "csv", write_recording(folder / "log.csv", **recording), mapping=folder / "map.toml", convention="openvr"
    )


@pytest.mark.sampled(12)
@pytest.mark.parametrize("column", METRES_OF_A_UNIT)
def test_lengths_are_read_in_the_unit_of_their_heading(tmp_path, column):
    """The command imports POSITION, written in the unit of headings as "x (mm)", and it is in metres again."""
    axes, out = headings_of_axes(column), tmp_path / "s.mcap"
    path = write_recording(tmp_path / "log.csv", axes=axes, metres=METRES_OF_A_UNIT[column])
    assert main(["import", "csv", str(path), "--convention", "openvr", "-o", str(out)]) == 0
    assert_track_is_that_of_the_constants(read_session(out))


@pytest.mark.parametrize("column", METRES_OF_A_UNIT)
def test_a_mapping_leaves_the_unit_to_the_heading(tmp_path, column):
    """The user's mapping (which column is what) names no unit: POSITION, in that of the heading, is in metres again."""
    axes, metres = headings_of_axes(column), METRES_OF_A_UNIT[column]
    session = import_with(tmp_path, mapping_text(axes), axes=axes, metres=metres)
    assert_track_is_that_of_the_constants(session)


def test_heading_wins_over_the_unit_of_a_convention(tmp_path):
    """Unreal's lengths are in centimetres, those of the headings "x (m)" in metres, which are read.

    Unreal's axes turn and mirror a position, so that only its distance from the origin can be compared.
    """
    axes = headings_of_axes("x (m)")
    path = write_recording(tmp_path / "log.csv", axes=axes)
    (tmp_path / "map.toml").write_text(mapping_text(axes, lines='convention = "unreal"'))
    (track,) = import_session("csv", path, mapping=tmp_path / "map.toml").tracks.values()
    assert np.allclose(np.linalg.norm(track.positions, axis=1), np.linalg.norm(POSITION))


@pytest.mark.parametrize(
    ("units", "metres", "seconds"),
    [
        pytest.param("s,ft,ft,ft,,,,", 0.3048, 1.0, id="feet"),
        pytest.param("(s),[inch],[inch],[inch],-,-,-,-", 0.0254, 1.0, id="inches in brackets"),
        pytest.param("ms,mm,mm,mm,,,,", 0.001, 0.001, id="millimetres and milliseconds"),
    ],
)
def test_lengths_and_times_use_the_row_of_units(tmp_path, units, metres, seconds):
    """Below the header stands the row ``units``, for time, x, y, z and a quaternion, which has no unit.

    Numbers are written in units of so many metres and seconds, and are metres and seconds again.
    """
    path, out = write_recording(tmp_path / "log.csv", metres=metres, seconds=seconds, units=units), tmp_path / "s.mcap"
    assert main(["import", "csv", str(path), "--convention", "openvr", "-o", str(out)]) == 0
    assert_track_is_that_of_the_constants(read_session(out))


@pytest.mark.sampled(8)
@pytest.mark.parametrize("column", SECONDS_OF_A_UNIT)
def test_stamps_are_read_in_the_unit_of_their_heading(tmp_path, column):
    """A recording has the stamps SECONDS in the unit of its heading, as 5000 below "time_ms" for 5 s.

    The command that imports it makes a session with the same seconds.
    """
    out = tmp_path / "s.mcap"
    path = write_recording(tmp_path / "log.csv", time=column, seconds=SECONDS_OF_A_UNIT[column])
    assert main(["import", "csv", str(path), "--convention", "openvr", "-o", str(out)]) == 0
    assert_track_is_that_of_the_constants(read_session(out))


def test_angles_are_read_in_the_unit_of_their_heading(tmp_path):
    """ANGLE, in radians as the headings say, is a rotation about x; were it read in degrees, it would be 0.012 rad."""
    euler = 'euler = {x = "rx [rad]", y = "ry [rad]", z = "rz [rad]"}\norder = "XYZ"'
    assert_track_is_that_of_the_constants(
        import_with(tmp_path, mapping_text("xyz", rotation=euler), rotation="rx [rad],ry [rad],rz [rad]")
    )


@pytest.mark.parametrize(
    ("headings", "stated"),
    [
        pytest.param(("x [um]", "y [um]", "z [um]"), "um", id="a unit that no recorder has"),
        pytest.param(("x (furlong)", "y (furlong)", "z (furlong)"), "furlong", id="an unknown unit"),
        pytest.param(("x (m)", "y (mm)", "z (m)"), "m, mm", id="two units"),
    ],
)
def test_draft_asks_for_a_unit_that_headings_leave_open(tmp_path, capsys, headings, stated):
    """Headings of a position state no unit that can be read: the import asks for it, in its draft of a mapping.

    The command is refused too, as its option --convention answers only which axes the recording has.
    """
    path, out = write_recording(tmp_path / "log.csv", axes=headings), tmp_path / "s.mcap"
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    assert f"the unit of lengths (the headings say {stated})" in refusal.value.unknown
    assert main(["import", "csv", str(path), "--convention", "openvr", "-o", str(out)]) == 1
    assert f"the unit of lengths (the headings say {stated})" in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


@pytest.mark.parametrize("column", ["time (frames)", "time [0.1ms]", "time (m)"])
def test_draft_guesses_no_unit_of_time_beside_a_stated_unit(tmp_path, column):
    """Frames, tenths of a millisecond and metres are no known unit of time, so that the import asks for it."""
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", write_recording(tmp_path / "log.csv", time=column))
    assert "the unit of time" in refusal.value.unknown


@pytest.mark.parametrize(
    ("mapping", "recording", "message"),
    [
        pytest.param(
            mapping_text(["x (mm)", "y (mm)", "z (mm)"], lines='units = "m"'),
            {"axes": ["x (mm)", "y (mm)", "z (mm)"]},
            'state mm, .* units = "m"',
            id="mm, not m",
        ),
        pytest.param(
            mapping_text("xyz", time="time (ms)", unit="s"),
            {"time": "time (ms)"},
            'state ms, .* unit = "s"',
            id="ms, not s",
        ),
        pytest.param(
            mapping_text(["x (m)", "y (mm)", "z"]),
            {"axes": ["x (m)", "y (mm)", "z"]},
            "state m and mm; convert",
            id="two",
        ),
        pytest.param(
            mapping_text(["x (mile)", "y (mile)", "z (mile)"]),
            {"axes": ["x (mile)", "y (mile)", "z (mile)"]},
            "state mile; convert",
            id="unknown",
        ),
    ],
)
def test_mapping_that_contradicts_the_headings_is_refused(tmp_path, mapping, recording, message):
    """Headings of the recording state mm where the mapping says m, or ms and s; or units that no mapping can say."""
    with pytest.raises(ImportFileError, match=message):
        import_with(tmp_path, mapping, **recording)


def test_mapping_that_names_the_columns_decides_alone(tmp_path):
    """The header, which says mm, is skipped; the mapping gives each column a name, and says metres, which are read."""
    lines = 'skip_lines = 1\nunits = "m"\ncolumns = ["time", "a", "b", "c", "qx", "qy", "qz", "qw"]'
    mapping = mapping_text(axes=["a", "b", "c"], lines=lines)
    session = import_with(tmp_path, mapping, axes=headings_of_axes("x (mm)"), metres=1.0)
    assert_track_is_that_of_the_constants(session)


def test_open_unit_of_lengths_is_reported_even_without_contacts(tmp_path, capsys):
    """A single body, which has no contacts, is at POSITION in millimetres, 300, 1250 and -500, without a unit.

    The command says that it took metres, and is not sure.
    """
    path, out = write_recording(tmp_path / "log.csv", metres=1e-3), tmp_path / "s.mcap"
    assert main(["import", "csv", str(path), "--convention", "openvr", "-o", str(out)]) == 0
    assert "unit of lengths: m; guessed, not sure" in " ".join(capsys.readouterr().err.split())
