"""Whatever is wrong with the input: one sentence that names it, the right exit code, no traceback, no crash."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from support.small_worlds import along_x, framed

from replay.cli.main import main
from sessions import Session, Status, write_session

FAILURE, USAGE = 1, 2

PLACES = {"a": [0] * 4, "b": [3, 3, 0.9, 3]}


def session_file(folder, session):
    write_session(session, folder / "s.mcap")
    return folder / "s.mcap"


def with_pose(place, turn, status=Status.VALID):
    """Body b's pose in frame 2 is this."""
    position = np.zeros((4, 2, 3))
    position[:, 0, 0] = np.arange(4)
    quaternion = np.tile([0.0, 0.0, 0.0, 1.0], (4, 2, 1))
    position[2, 1], quaternion[2, 1] = place, turn
    flags = np.full((4, 2), int(Status.VALID))
    flags[2, 1] = int(status)
    return framed(np.arange(4) * 10_000_000, flags, position, quaternion)


def run(path, folder, *more):
    return main(["run", str(path), "--out", str(folder / "run"), "--no-picture", "--detectors", "hybrid", *more])


def refused(capsys, code, expected, *words):
    """Exactly one sentence of error, all the words in it, and nothing that a program prints when it falls over."""
    said = capsys.readouterr().err
    assert code == expected, said
    errors = [line for line in said.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1, said
    assert "Traceback" not in said and "should not have happened" not in said
    assert [word for word in words if word not in errors[0]] == [], errors[0]


def test_a_pose_that_is_none_is_refused_and_flagged_as_lost_it_gives_no_pose_and_never_clear(tmp_path, capsys):
    place, turn = [np.nan, 0, 0], [0, 0, 0, 1]
    code = run(session_file(tmp_path, with_pose(place, turn)), tmp_path)
    refused(capsys, code, FAILURE, "frame 2 (0.020000 s), body b", "is not finite")
    assert not (tmp_path / "run").exists()
    file = tmp_path / "lost.mcap"
    write_session(with_pose(place, turn, Status.LOST), file)
    assert run(file, tmp_path, "--format", "json", "--oracle", "none") == 0
    verdicts = json.loads(capsys.readouterr().out)["detectors"]["hybrid"]["verdicts"]
    assert verdicts["NO_POSE"] == 1 and verdicts.get("CLEAR", 0) == 3 - verdicts.get("CONTACT", 0)


@pytest.mark.skipif(sys.platform == "win32", reason="closed by `>&-`, and /dev/full, are POSIX")
@pytest.mark.parametrize("where", (">&-", ">/dev/full", ">&- 2>&-"))
@pytest.mark.parametrize("unbuffered", ("", "1"))
def test_a_standard_output_that_takes_nothing_ends_a_verb_in_one_sentence(tmp_path, where, unbuffered):
    file = session_file(tmp_path, Session.from_arrays([0, 1], {"a": along_x([0, 1])}))
    words = f"exec {sys.executable} -m replay info {file} {where}"
    more = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    done = subprocess.run(["sh", "-c", words], capture_output=True, text=True, env=more)
    assert done.returncode == FAILURE and "Traceback" not in done.stderr and "Exception" not in done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == (0 if "2>" in where else 1)
    assert all(line.startswith("error: ") and "standard output" in line for line in lines)


@pytest.mark.parametrize("name", ("...mcap", "..mcap", "batch.json.mcap", "Batch.JSON.mcap"))
def test_a_session_whose_name_is_no_name_of_a_run_folder_is_refused_before_any_is_replayed(tmp_path, capsys, name):
    session = Session.from_arrays([0, 1], {"a": along_x([0, 1])})
    for file in (tmp_path / name, tmp_path / "good.mcap"):
        write_session(session, file)
    out = tmp_path / "runs"
    code = main(["run", str(tmp_path / name), str(tmp_path / "good.mcap"), "--out", str(out), "--no-picture"])
    refused(capsys, code, FAILURE, name, "another name")
    assert not out.exists()


def test_damaged_normals_of_an_stl_which_nobody_uses_are_no_traceback(tmp_path):
    mesh = tmp_path / "m.stl"
    corners = "outer loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop"
    mesh.write_text(f"solid m\nfacet normal 0 x 1\n{corners}\nendfacet\nendsolid m\n")
    done = subprocess.run([sys.executable, "-m", "replay", "doctor", str(mesh)], capture_output=True, text=True)
    assert done.returncode == 0 and "Traceback" not in done.stderr
