import numpy as np
import pytest

from sessions import make_shape
from sessions.errors import ImportFileError
from sessions.importers import import_session

HEADER = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"


def take(path, body, start, x):
    rows = [f"pose,{start + 0.01 * k:.3f},{body},{x},1,0,0,0,0,1,1,," for k in range(10)]
    path.write_text("\n".join([HEADER, *rows, f"event,{start:.3f},{body},,,,,,,,,begun,", ""]))
    return path


def test_a_file_per_body_becomes_one_session_on_the_clock_they_share(tmp_path):
    files = [take(tmp_path / "a.csv", "left", 0.005, 1), take(tmp_path / "b.csv", "right", 0, 2)]
    ball = make_shape("sphere", {"radius": 0.1}, 100)
    session = import_session("csv", files, meshes={"right": ball}, convention="unity")
    assert session.names == ("left", "right") and list(session.meshes) == ["right"]
    assert session.tracks["left"].times_ns.tolist() == [5_000_000 + 10_000_000 * k for k in range(10)]
    assert np.unique(session.tracks["right"].positions[:, 0]).tolist() == [2.0]
    assert [event.body for event in session.events] == ["right", "left"]
    assert session.facts["source_file"] == "a.csv, b.csv" and session.facts["source_convention"] == "unity"
    assert session.facts["conversions"].count("axes unity") == 1


def test_files_of_two_clocks_are_not_joined(tmp_path):
    files = [take(tmp_path / "a.csv", "left", 100, 1), take(tmp_path / "b.csv", "right", 0, 2)]
    with pytest.raises(ImportFileError, match=r"b.csv and a.csv lie apart in time; give files of one clock"):
        import_session("csv", files)


def test_a_short_file_within_a_long_one_and_files_of_one_name(tmp_path):
    (tmp_path / "x").mkdir()
    files = [take(tmp_path / "a.csv", "left", 0, 1), take(tmp_path / "b.csv", "right", 0.02, 2)]
    files[1].write_text("\n".join([*files[1].read_text().splitlines()[:4], ""]))
    files.append(take(tmp_path / "x" / "c.csv", "cup", 0.08, 2))
    assert import_session("csv", files).names == ("left", "right", "cup")
    files.append(take(tmp_path / "c.csv", "cup", 0.08, 2))
    with pytest.raises(ImportFileError, match="another file of that name has 'cup' too; rename the file"):
        import_session("csv", files)
