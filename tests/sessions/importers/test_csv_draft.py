"""Logs that nobody has described get a draft of their mapping; completed, it gives the poses that were written."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.second_opinions import has_poses

from replay.cli.main import main
from sessions import read_session
from sessions.importers import import_session
from sessions.importers.csv_columns_and_units import ROW_MAJOR, CsvLayout
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.csv_head import CsvHead

COUNT = 12
TIME = np.arange(COUNT) / 90
LOGS = Path(__file__).with_name("logs")
POSITIONS, QUATERNIONS = np.split(np.loadtxt(LOGS / "poses.txt").reshape(2, COUNT, 7), [3], axis=2)
KINDS = tomllib.loads((LOGS / "logs.toml").read_text("utf-8"))


def copied_log(folder, kind):
    """A copy of the log of this kind, in a folder of its own."""
    return Path(shutil.copy(LOGS / f"{kind}.csv", folder / "log.csv"))


@pytest.mark.parametrize("kind", KINDS)
def test_completed_draft_gives_written_poses(tmp_path, kind):
    """A row of logs.toml: a log with unknown columns is refused with a draft, whose open questions a person answers.

    Poses are those of poses.txt, from which the logs were written.
    """
    case, path, mapping = KINDS[kind], copied_log(tmp_path, kind), tmp_path / "log.columns.toml"
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    assert case["unknown"] in " ".join(refusal.value.unknown)
    answers = {
        '# convention = "unity"': 'convention = "openvr"',
        "# rate_hz": "rate_hz",
        '# order = "XYZ"': 'order = "ZXY"',
        '# unit = "s"': 'unit = "s"',
    }
    completed = refusal.value.draft
    for question, answer in answers.items():
        completed = completed.replace(question, answer)
    mapping.write_text(completed)
    session = import_session("csv", path, mapping=mapping)
    assert session.names == tuple(case["bodies"])
    for body, name in enumerate(session.names):
        track = session.tracks[name]
        assert has_poses(track, POSITIONS[body], Rotation.from_quat(QUATERNIONS[body]))
        seconds = (track.times_ns - track.times_ns[0]) / 1e9
        assert np.allclose(seconds, TIME * case.get("slower", 1), atol=case.get("rounded_s", 2e-6))


@pytest.mark.sampled(16)
@pytest.mark.parametrize("kind", KINDS)
def test_convention_option_completes_a_draft_lacking_only_axes(tmp_path, kind):
    """Logs of many kinds; a draft that lacks only axes is completed, and by it the written pose is imported.

    A draft that lacks more, other than the unit of lengths, is not completed.
    """
    path = copied_log(tmp_path, kind)
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    lacks_more = any("axes" not in item and "unit of lengths" not in item for item in refusal.value.unknown)
    completed = refusal.value.draft_with_axes("openvr")
    assert bool(completed) != lacks_more
    if completed:
        mapping = tmp_path / "log.columns.toml"
        mapping.write_text(completed)
        track = import_session("csv", path, mapping=mapping).tracks[KINDS[kind]["bodies"][0]]
        assert has_poses(track, POSITIONS[0], Rotation.from_quat(QUATERNIONS[0]))


def test_command_writes_a_draft_and_goes_on_from_it(tmp_path, capsys):
    """Without axes the command ends with code 1 and a draft; with --convention it goes on, also from that draft."""
    path, out, draft = copied_log(tmp_path, "one-body"), tmp_path / "s.mcap", tmp_path / "log.columns.toml"
    assert main(["import", "csv", str(path), "-o", str(out)]) == 1
    output = " ".join(capsys.readouterr().err.split())
    assert "--mapping" in output and "--convention" in output and str(draft) in output and not out.exists()
    # A draft that nobody changed is no obstacle, and the option is noted in it, to be checked.
    assert main(["import", "csv", str(path), "--convention", "openvr", "-o", str(out)]) == 0
    assert (
        read_session(out).names == tuple(KINDS["one-body"]["bodies"]) and 'convention = "openvr"' in draft.read_text()
    )
    again = ["import", "csv", str(path), "--convention", "openvr", "--force", "-o", str(out)]
    assert main(again) == 0
    # One that a person wrote is never replaced.
    draft.write_text("mine")
    assert main(again) == 1 and draft.read_text() == "mine"


def test_command_offers_no_convention_where_more_is_unknown(tmp_path, capsys):
    """The log "kitti" has no times, so that --convention alone would not be enough."""
    path = copied_log(tmp_path, "kitti")  # its rate is unknown too
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "s.mcap")]) == 1
    assert "--convention" not in capsys.readouterr().err


@pytest.mark.parametrize(("convention", "is_complete"), [("unity", True), ("unreal", True), ("openvr", False)])
def test_convention_that_fixes_the_order_of_angles_completes_a_draft(tmp_path, convention, is_complete):
    """Unity and Unreal apply angles in an order of their own, OpenVR in none."""
    path = tmp_path / "log.csv"
    angles = np.column_stack([TIME, POSITIONS[0], 40 * TIME, -7 * TIME, 170 * TIME])
    np.savetxt(path, angles, delimiter=",", header="time,x,y,z,euler_x,euler_y,euler_z", comments="")
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    assert bool(refusal.value.draft_with_axes(convention)) == is_complete


def test_draft_is_never_overwritten_and_unknowns_are_comments(tmp_path, capsys):
    """The user's file has the name of the draft.

    In the draft the order of angles, the unit and the axes are comments.
    """
    path = tmp_path / "log.csv"
    path.write_text("t,x,y,z,yaw,pitch,roll\n" + "".join(f"{k / 90},1,2,3,0,0,0\n" for k in range(9)))
    draft = tmp_path / "log.columns.toml"
    draft.write_text("mine")
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "s.mcap")]) == 1
    assert draft.read_text() == "mine" and "is there already" in capsys.readouterr().err
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    assert {"# order", "# units", "# convention"} <= {line.split(" =")[0] for line in refusal.value.draft.splitlines()}


@pytest.mark.parametrize(
    ("header", "row", "text"),
    [
        ("t,x,y,z,yaw,pitch,roll", "{},1,2,3,0,0,0", "the order of the angles"),
        ("x,y,z,qx,qy,qz,qw", "{},2,3,0,0,0,1", "the rate (rate_hz)"),
        ("t,speed,load", "{},1,2", "which columns are a pose"),
        ("t,x,y,z,qx,qy,qz,qw", "1{}000000000,1,2,3,0,0,0,1", "the unit of time"),
        ("t,x,y,z,qx,qy,qz,qw", "10:0{}.5,1,2,3,0,0,0,1", "'10:00.5' is of no known format of times"),
        ("t,x,y,z,qx,qy,qz,qw", "-{},1,2,3,0,0,0,1", "'t' never increases within the first 5 rows"),
        ("1,2,3,4,5", "{},2,3,4,5", "column_5"),
    ],
)
def test_facts_missing_in_a_header_are_questioned(tmp_path, header, row, text):
    """A file of five rows: ``row`` has its number at {}; ``text``: of a question, or of the draft."""
    (tmp_path / "log.csv").write_text("\n".join([header, *(row.format(k) for k in range(5)), ""]))
    with pytest.raises(UnknownColumnsError, match="describe them with --mapping FILE") as refusal:
        import_session("csv", tmp_path / "log.csv")
    assert any(text in item for item in (*refusal.value.unknown, refusal.value.draft)), refusal.value.unknown


def test_draft_lists_omitted_columns_and_negative_times(tmp_path, snapshot):
    """The cup has a whole pose; gaze lacks a rotation, and times run from -40 to 60 us. The header is line 161."""
    notes = ["a note"] * 160
    columns = (
        "t_us cup.x cup.y cup.z cup.qx cup.qy cup.qz cup.qw cup.vel.x cup.vel.y cup.vel.z valid "
        "gaze.x gaze.y gaze.z hand.qx hand.qy hand.qz hand.qw"
    )
    rows = (f"{time};{x};2;-3;0;0;0;1;5;6;7;1;{x};9;9;0;0;0;1" for x, time in enumerate(range(-40, 80, 20)))
    (tmp_path / "log.csv").write_text("\n".join([*notes, columns.replace(" ", ";"), *rows]))
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", tmp_path / "log.csv")
    draft = refusal.value.draft
    assert "skip_lines = 160" in draft and "offset = 40.0 " in draft
    assert "gaze has a place and no rotation, so it is left out" in draft
    assert draft == snapshot


def draft_of_log(folder, clock, stamps):
    """The draft for a log of two bodies whose first column is called so."""
    names = [f"{body}_{axis}" for body in ("Tool", "Tray") for axis in ("px", "py", "pz", "qx", "qy", "qz", "qw")]
    rows = [",".join(map(str, [stamp, *[0.1, 0.2, 0.3, 0, 0, 0, 1] * 2])) for stamp in stamps]
    (folder / "take.csv").write_text("\n".join([",".join([clock, *names]), *rows, ""]))
    with pytest.raises(UnknownColumnsError) as caught:
        import_session("csv", folder / "take.csv")
    return caught.value.draft


@pytest.mark.parametrize(
    ("clock", "step", "unit"),
    [
        ("ticks_ms", 11, "ms"),
        ("get_ticks_msec", 11, "ms"),
        ("ticks_usec", 11111, "us"),
        ("uptime_s", 0.011, "s"),
        ("msec", 11, "ms"),
        ("now", 11.1, "ms"),
    ],
)
def test_time_columns_named_as_in_game_engines_are_recognised(tmp_path, clock, step, unit):
    """The draft names the column as time with its unit, and so asks for no frame rate."""
    draft = draft_of_log(tmp_path, clock, [1000 + step * k for k in range(20)])
    assert f'column = "{clock}"' in draft and f'\nunit = "{unit}"' in draft and "rate_hz" not in draft


def test_a_column_that_increases_is_offered_as_the_clock(tmp_path):
    """The name "Spalte1" says nothing: its numbers increase by 0.011, and then are all 1."""
    draft = draft_of_log(tmp_path, "Spalte1", [0.011 * k for k in range(20)])
    assert '# column = "Spalte1"   # in place of rate_hz, if it is the time: it increases' in draft
    assert "it increases" not in draft_of_log(tmp_path, "Spalte1", [1.0] * 20)


def test_error_lists_at_most_24_columns():
    """Columns c0 to c23 are listed; with c24 the list ends in dots."""
    for count, listed in ((24, "c22, c23;"), (25, "c22, c23, ...;")):
        columns = [f"c{number}" for number in range(count)]
        assert f"{listed} describe them" in str(UnknownColumnsError(Path("log.csv"), columns, draft="", unknown=[]))


@pytest.mark.parametrize(
    ("columns", "named_by_file", "by_number"),
    [(ROW_MAJOR, False, True), (ROW_MAJOR, True, False), (("t", "x"), False, False)],
)
def test_columns_mean_by_number_only_what_no_line_names(columns, named_by_file, by_number):
    """Twelve columns without names are the rows of a matrix, as KITTI writes them."""
    layout = CsvLayout(columns=() if named_by_file else columns)
    assert CsvHead(Path("log.csv"), layout, columns).columns_by_number == by_number
