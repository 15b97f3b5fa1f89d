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
SECONDS = np.arange(COUNT) / 90
LOGS = Path(__file__).with_name("logs")
POSITIONS, QUATERNIONS = np.split(np.loadtxt(LOGS / "poses.txt").reshape(2, COUNT, 7), [3], axis=2)
KINDS = tomllib.loads((LOGS / "logs.toml").read_text("utf-8"))


def copied_log(folder, kind):
    """The path of a copy of the log of this kind, in a folder of its own."""
    return Path(shutil.copy(LOGS / f"{kind}.csv", folder / "log.csv"))


def refusal_with_draft(path):
    """The error of a CSV imported without a mapping (a TOML that says what its columns are).

    Its ``draft`` is a mapping to complete, its ``unknown`` the questions that the draft leaves open.
    """
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    return refusal.value


@pytest.mark.parametrize("kind", KINDS)
def test_completed_draft_gives_written_poses(tmp_path, kind):
    """A log of 12 frames at 90 Hz, as another program writes it, is refused with a draft of a mapping.

    Once a person answers the draft's open questions, the import has the bodies that logs.toml lists, at the poses of
    poses.txt, from which all the logs were written. Some logs are slower or round their times, as logs.toml says.
    """
    case, path, mapping = KINDS[kind], copied_log(tmp_path, kind), tmp_path / "log.columns.toml"
    refusal = refusal_with_draft(path)
    assert case["unknown"] in " ".join(refusal.unknown)
    answers = {
        '# convention = "unity"': 'convention = "openvr"',
        "# rate_hz": "rate_hz",
        '# order = "XYZ"': 'order = "ZXY"',
        '# unit = "s"': 'unit = "s"',
    }
    completed = refusal.draft
    for question, answer in answers.items():
        completed = completed.replace(question, answer)
    mapping.write_text(completed)
    session = import_session("csv", path, mapping=mapping)
    assert session.names == tuple(case["bodies"])
    for name, positions, quaternions in zip(
        session.names, POSITIONS, QUATERNIONS, strict=False
    ):  # some logs have the first alone
        track = session.tracks[name]
        assert has_poses(track, expected_positions=positions, rotations=Rotation.from_quat(quaternions)), name
        seconds = (track.times_ns - track.times_ns[0]) / 1e9
        assert np.allclose(seconds, SECONDS * case.get("slower", 1), atol=case.get("rounded_s", 2e-6)), name


@pytest.mark.sampled(16)
@pytest.mark.parametrize("kind", KINDS)
def test_convention_option_completes_a_draft_lacking_only_axes(tmp_path, kind):
    """A log as another program writes it is refused with a draft of a mapping, and told that its axes are OpenVR's.

    A draft that lacks only axes, and perhaps the unit of lengths, is then complete, and by it the first body has the
    poses of poses.txt. A draft that lacks more is no text at all.
    """
    path = copied_log(tmp_path, kind)
    refusal = refusal_with_draft(path)
    lacks_more = any("axes" not in item and "unit of lengths" not in item for item in refusal.unknown)
    completed = refusal.draft_with_axes("openvr")
    assert bool(completed) != lacks_more
    if completed:
        mapping = tmp_path / "log.columns.toml"
        mapping.write_text(completed)
        first_body = KINDS[kind]["bodies"][0]
        track = import_session("csv", path, mapping=mapping).tracks[first_body]
        assert has_poses(track, expected_positions=POSITIONS[0], rotations=Rotation.from_quat(QUATERNIONS[0]))


def test_command_without_axes_ends_with_a_draft(tmp_path, capsys):
    """The log "one-body" says all but its axes: the command exits with 1, and names the draft and the two options."""
    path, out, draft = copied_log(tmp_path, "one-body"), tmp_path / "s.mcap", tmp_path / "log.columns.toml"
    assert main(["import", "csv", str(path), "-o", str(out)]) == 1
    output = " ".join(capsys.readouterr().err.split())
    assert "--mapping" in output
    assert "--convention" in output
    assert str(draft) in output
    assert draft.is_file()
    assert not out.exists()


def test_command_goes_on_from_its_draft_with_a_convention(tmp_path, capsys):
    """A draft of an earlier try, unchanged, is no obstacle to --convention, which is noted in it.

    The same command succeeds again; a file that a person wrote in place of the draft is never replaced.
    """
    path, out, draft = copied_log(tmp_path, "one-body"), tmp_path / "s.mcap", tmp_path / "log.columns.toml"
    without_axes = ["import", "csv", str(path), "-o", str(out), "--force"]
    with_axes = [*without_axes, "--convention", "openvr"]
    assert main(without_axes) == 1
    assert main(with_axes) == 0
    assert read_session(out).names == ("log",)
    assert 'convention = "openvr"' in draft.read_text()
    assert main(with_axes) == 0

    draft.write_text("mine")
    capsys.readouterr()
    assert main(with_axes) == 1
    assert "is there already" in capsys.readouterr().err
    assert draft.read_text() == "mine"


def test_command_offers_no_convention_where_more_is_unknown(tmp_path, capsys):
    """The log "kitti" has no times, and its rate is unknown: --mapping is offered, as --convention is not enough."""
    path = copied_log(tmp_path, "kitti")
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "s.mcap")]) == 1
    output = " ".join(capsys.readouterr().err.split())
    assert "--mapping" in output
    assert "--convention" not in output


def test_named_axes_are_no_longer_asked_for(tmp_path, capsys):
    """The log "kitti" still lacks its rate; the command that is printed to go on keeps the axes and the direction."""
    path = copied_log(tmp_path, "kitti")
    named = ["--convention", "openvr", "--rotations", "world-to-body"]
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "s.mcap"), *named]) == 1
    output = " ".join(capsys.readouterr().err.split())
    assert "the axes" not in output and "the rate" in output
    assert "--convention openvr --rotations world-to-body -o" in output


@pytest.mark.parametrize(("convention", "is_complete"), [("unity", True), ("unreal", True), ("openvr", False)])
def test_convention_that_fixes_the_order_of_angles_completes_a_draft(tmp_path, convention, is_complete):
    """A log has angles about x, y, z. Unity and Unreal apply them in an order of their own, OpenVR in none.

    Where the order stays open there is no completed draft: the text is empty.
    """
    path = tmp_path / "log.csv"
    angles = np.column_stack([SECONDS, POSITIONS[0], 40 * SECONDS, -7 * SECONDS, 170 * SECONDS])
    np.savetxt(path, angles, delimiter=",", header="time,x,y,z,euler_x,euler_y,euler_z", comments="")
    completed = refusal_with_draft(path).draft_with_axes(convention)
    assert (completed != "") == is_complete


@pytest.fixture
def log_of_angles(tmp_path):
    """A log whose order of angles, unit of lengths and axes nobody says; its draft would be log.columns.toml."""
    path = tmp_path / "log.csv"
    path.write_text("t,x,y,z,yaw,pitch,roll\n" + "".join(f"{k / 90},1,2,3,0,0,0\n" for k in range(9)))
    return path


def test_file_of_the_user_is_not_overwritten_by_a_draft(log_of_angles, tmp_path, capsys):
    """A file of the draft's name is there before the command runs: it stays as it is, and the command says so."""
    draft = tmp_path / "log.columns.toml"
    draft.write_text("mine")
    assert main(["import", "csv", str(log_of_angles), "-o", str(tmp_path / "s.mcap")]) == 1
    assert draft.read_text() == "mine"
    assert "is there already" in capsys.readouterr().err


def test_unknown_values_are_comments_in_a_draft(log_of_angles):
    """Order of angles, unit of lengths and axes, which a log does not say, are comments in the draft, "# key = value".

    So no import by the draft succeeds before a person has decided.
    """
    keys = {line.split(" =")[0] for line in refusal_with_draft(log_of_angles).draft.splitlines()}
    assert keys >= {"# order", "# units", "# convention"}


@pytest.mark.parametrize(
    ("header", "row", "question"),
    [
        pytest.param("t,x,y,z,yaw,pitch,roll", "{},1,2,3,0,0,0", "the order of the angles", id="angles"),
        pytest.param("x,y,z,qx,qy,qz,qw", "{},2,3,0,0,0,1", "the rate (rate_hz)", id="no clock"),
        pytest.param("t,speed,load", "{},1,2", "which columns are a pose", id="no pose"),
        pytest.param(
            "t,x,y,z,qx,qy,qz,qw",
            "1{}000000000,1,2,3,0,0,0,1",
            "the unit of time",
            id="steps of 1e9: below 2 Hz in ns, above 2,000 Hz in any other unit",
        ),
        pytest.param(
            "t,x,y,z,qx,qy,qz,qw",
            "10:0{}.5,1,2,3,0,0,0,1",
            "'10:00.5' is of no known format of times",
            id="minutes and seconds",
        ),
        pytest.param(
            "t,x,y,z,qx,qy,qz,qw",
            "-{},1,2,3,0,0,0,1",
            "'t' never increases within the first 5 rows",
            id="clock runs backwards",
        ),
    ],
)
def test_facts_missing_in_a_header_are_questioned(tmp_path, header, row, question):
    """A log has five rows with 0, 1 ... 4 at {}: the refusal asks what header and rows leave open."""
    (tmp_path / "log.csv").write_text("\n".join([header, *(row.format(k) for k in range(5)), ""]))
    refusal = refusal_with_draft(tmp_path / "log.csv")
    assert "describe them with --mapping FILE" in str(refusal)
    assert question in " ".join(refusal.unknown)


def test_columns_without_names_are_numbered_in_a_draft(tmp_path):
    """All six lines are five numbers, the first too: no line names the columns, which are column_1 to column_5."""
    (tmp_path / "log.csv").write_text("\n".join(["1,2,3,4,5", *(f"{k},2,3,4,5" for k in range(5)), ""]))
    refusal = refusal_with_draft(tmp_path / "log.csv")
    assert "describe them with --mapping FILE" in str(refusal)
    assert "column_5" in refusal.draft


def test_draft_lists_omitted_columns_and_negative_times(tmp_path, snapshot):
    """The cup has a whole pose; gaze lacks a rotation, and times run from -40 to 60 us. The header is line 161.

    The draft skips 160 lines, adds 40 us to the times, and says that gaze is left out.
    """
    notes = ["a note"] * 160
    columns = (
        "t_us cup.x cup.y cup.z cup.qx cup.qy cup.qz cup.qw cup.vel.x cup.vel.y cup.vel.z valid "
        "gaze.x gaze.y gaze.z hand.qx hand.qy hand.qz hand.qw"
    )
    times_us = (-40, -20, 0, 20, 40, 60)
    rows = (f"{time};{x};2;-3;0;0;0;1;5;6;7;1;{x};9;9;0;0;0;1" for x, time in enumerate(times_us))
    (tmp_path / "log.csv").write_text("\n".join([*notes, columns.replace(" ", ";"), *rows]))
    draft = refusal_with_draft(tmp_path / "log.csv").draft
    assert "skip_lines = 160" in draft
    assert "offset = 40.0 " in draft
    assert "gaze has a place and no rotation, so it is left out" in draft
    assert draft == snapshot


def draft_of_log(folder, clock, stamps):
    """The draft of a mapping for a log of two bodies whose first column is called ``clock`` and holds ``stamps``."""
    names = [f"{body}_{axis}" for body in ("Tool", "Tray") for axis in ("px", "py", "pz", "qx", "qy", "qz", "qw")]
    rows = [",".join(map(str, [stamp, *[0.1, 0.2, 0.3, 0, 0, 0, 1] * 2])) for stamp in stamps]
    (folder / "take.csv").write_text("\n".join([",".join([clock, *names]), *rows, ""]))
    return refusal_with_draft(folder / "take.csv").draft


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
    """A log of 20 rows, some 11 ms apart, calls its clock like a game engine; the draft has its unit, not a rate."""
    draft = draft_of_log(tmp_path, clock, [1000 + step * k for k in range(20)])
    assert f'column = "{clock}"' in draft
    assert f'\nunit = "{unit}"' in draft
    assert "rate_hz" not in draft


@pytest.mark.parametrize(
    ("stamps", "is_offered"),
    [
        pytest.param([0.011 * k for k in range(20)], True, id="increases by 0.011"),
        pytest.param([1.0] * 20, False, id="always 1"),
    ],
)
def test_a_column_that_increases_is_offered_as_the_clock(tmp_path, stamps, is_offered):
    """The first column's name, "Spalte1", says nothing: the draft asks for a rate, or offers it in a comment."""
    draft = draft_of_log(tmp_path, "Spalte1", stamps)
    offer = '# column = "Spalte1"   # in place of rate_hz, if it is the time: it increases'
    assert (offer in draft) == is_offered
    assert ("it increases" in draft) == is_offered


@pytest.mark.parametrize(
    ("count", "end_of_list"),
    [pytest.param(24, "c22, c23;", id="all are listed"), pytest.param(25, "c22, c23, ...;", id="the 25th is dots")],
)
def test_error_lists_at_most_24_columns(count, end_of_list):
    """A file's columns are c0, c1 and so on; none is known. Of 25 the error lists the first 24, and dots."""
    columns = [f"c{number}" for number in range(count)]
    error = UnknownColumnsError(Path("log.csv"), columns, draft="", unknown=[])
    assert f"{end_of_list} describe them" in str(error)


@pytest.mark.parametrize(
    ("columns", "is_named_by_file", "is_by_number"),
    [
        pytest.param(ROW_MAJOR, False, True, id="twelve, no header"),
        pytest.param(ROW_MAJOR, True, False, id="twelve with a header"),
        pytest.param(("t", "x"), False, False, id="two, no header"),
    ],
)
def test_columns_mean_by_number_only_what_no_line_names(columns, is_named_by_file, is_by_number):
    """Twelve columns without a header are the three rows of a pose's matrix, as KITTI writes them.

    A layout has names of columns only where the file has none.
    """
    layout = CsvLayout(columns=() if is_named_by_file else columns)
    assert CsvHead(Path("log.csv"), layout, columns).columns_by_number == is_by_number
