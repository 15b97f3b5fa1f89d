import json
from dataclasses import replace

import pytest
from support.small_worlds import cube, unit_cubes_on_x

from replay.cli.console import EXIT_FAILURE, EXIT_INTERRUPTED
from replay.cli.main import main
from replay.cutting import piece_store
from replay.cutting.methods import METHODS
from replay.cutting.piece_store import NotCut
from replay.running import advisor, collider_files
from sessions import write_session

POSITIONS = {"a": [0] * 12, "b": [3, 3, 0.9, 3, 3, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


@pytest.fixture
def session_file(tmp_path, monkeypatch):
    """A session of two cubes, on a machine without any engine."""
    monkeypatch.setattr(advisor, "find_spec", lambda name: None)
    write_session(unit_cubes_on_x(POSITIONS), tmp_path / "s.mcap")
    return str(tmp_path / "s.mcap")


@pytest.fixture
def store(tmp_path, monkeypatch):
    """Function that gives the command a cache folder with a file of pieces, or empty, and pieces in memory."""

    def fill(file, memory):
        (tmp_path / "cache").mkdir()
        if file:
            (tmp_path / "cache" / file).touch()
        monkeypatch.setattr(piece_store, "in_memory", memory)
        monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")

    return fill


def test_json_has_rows_and_advice_and_a_folder_is_written(session_file, tmp_path, capsys):
    """`replay tradeoff --engine unreal` of a session of two cubes: advice which colliders to use there.

    Its four rows are 1 or 16 convex pieces a body at 90 or 30 steps a second; the default limit of 150 s suffices.
    """
    out = tmp_path / "runs"
    arguments = ["tradeoff", session_file, "--engine", "unreal", "--format", "json", "--out", str(out), "--no-picture"]
    assert main(arguments) == 0
    printed, progress = capsys.readouterr()
    reported = json.loads(printed)
    assert (reported["engine"], reported["version"]) == ("Unreal Engine", "5")
    assert reported["advice"]
    assert [row["number"] for row in reported["rows"]] == [1, 2, 3, 4]
    assert (reported["time_limit"], reported["not_tried"]) == (150.0, [])
    assert (out / "report.html").is_file() and str(out) in progress


def test_rows_whose_pieces_are_late_are_named_as_not_tried(session_file, tmp_path, monkeypatch, capsys):
    """Rows 3 and 4 of Unreal need convex pieces of both cubes, a and b, of the same mesh; none are stored.

    CoACD, which cuts them, is said to take 900 s; the limit is 20 s. Screen and JSON say the same.
    Row 3 as the reference (``--oracle``) is an error, since it was not cut.
    """
    monkeypatch.setattr(piece_store, "in_memory", {})
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setitem(METHODS, "coacd", replace(METHODS["coacd"], seconds=lambda _: 900.0))
    command = ["tradeoff", session_file, "--engine", "unreal", "--time-limit", "20"]
    not_tried = "CoACD of a and b (16 pieces) was not tried: it takes about 15 min."
    assert main(command) == 0
    assert not_tried in capsys.readouterr().out.splitlines()
    assert main([*command, "--format", "json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert [row["number"] for row in reported["rows"]] == [1, 2]
    assert (reported["time_limit"], reported["not_tried"]) == (20.0, [not_tried])
    assert reported["advice"][-2:] == [
        "Rows 3 and 4 were not tried within 20 s: a longer --time-limit tries more.",
        not_tried,
    ]
    assert main([*command, "--oracle", "row-3"]) == EXIT_FAILURE
    assert "the reference, row-3, needs convex pieces" in capsys.readouterr().err


@pytest.mark.parametrize("are_stored", [True, False], ids=["in the cache folder", "in memory"])
def test_message_says_whether_pieces_cut_before_the_limit_stay(
    session_file, tmp_path, monkeypatch, capsys, store, are_stored
):
    """The mesh of a, a cube of 1 m, is cut within the time limit; that of b, a cube of 2 m, is late."""
    store(file="cut-a.npz" if are_stored else "", memory={} if are_stored else {"a": None})
    monkeypatch.setattr(advisor, "cut_in_time", lambda cuts, _: {cuts[-1].key: NotCut("", late=True)})
    session = unit_cubes_on_x(POSITIONS)
    meshes = {**session.meshes, "b": cube(edge=2.0)}
    write_session(replace(session, meshes=meshes), tmp_path / "two-sizes.mcap")
    assert main(["tradeoff", str(tmp_path / "two-sizes.mcap"), "--engine", "unreal"]) == 0
    printed = capsys.readouterr().out
    assert "CoACD of b (16 pieces) was not tried" in printed
    assert ("The pieces that are cut are kept: the same command goes on from them." in printed) is are_stored


@pytest.mark.parametrize("command", [["tradeoff", "--engine", "unity"], ["fix"]], ids=["tradeoff", "fix"])
@pytest.mark.parametrize(
    ("file", "memory", "are_stored"),
    [("cut-a.npz", {}, True), ("cut-a.npz", {"b": None}, False), ("", {}, False)],
    ids=["all are stored", "one is in memory alone", "none is cut"],
)
def test_stopped_cutting_says_whether_pieces_are_kept(
    session_file, monkeypatch, capsys, store, command, file, memory, are_stored
):
    """Ctrl-C while meshes are cut ends the command with its own exit code, 130."""
    store(file, memory)

    def interrupt(*_, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(advisor, "cut_in_time", interrupt)
    monkeypatch.setattr(collider_files, "fix_colliders", interrupt)
    assert main([command[0], session_file, *command[1:]]) == EXIT_INTERRUPTED == 130
    sentence = "the pieces that are cut are kept: the same command goes on from them"
    assert (sentence in capsys.readouterr().err) is are_stored
