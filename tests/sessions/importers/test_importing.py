import sys
from importlib.metadata import EntryPoint, EntryPoints

import numpy as np
import pytest
from support.mutants import assert_import_refused

from sessions import MeshData, Session, Track
from sessions.importers import ENTRY_POINT_GROUP, IMPORTERS, import_session, importer_names, importing
from sessions.importers.given_meshes import MeshOptions
from sessions.importers.importing import PoseTable, SourceFrame, finish_import, session_of_tables
from sessions.importers.ledger import Ledger, ledger_of
from sessions.meshes.conventions import CONVENTIONS
from sessions.scene_files.scene_toml import parse_scene

TRIANGLE = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def session_of_bodies(*names):
    """A session of these bodies, which rest for 10 ns."""
    track = Track([0, 10], np.zeros((2, 3)), np.tile([0, 0, 0, 1.0], (2, 1)))
    return Session.from_tracks(dict.fromkeys(names, track))


def test_longest_increasing_rows_stay_and_missing_rotations_are_flagged():
    """Stamps 0, 10, 5, 7, 10, 11, 12, 13 increase longest without the first 10, whose sample the second repeats.

    Of the last three rotations one is 1.1 long, one has no number, and one of 1.0005 is near enough to a unit.
    """
    stamps = np.array([0, 10, 5, 7, 10, 11, 12, 13])
    rotations = np.tile([0, 0, 0, 1.0], (8, 1))
    rotations[5:] = [[0, 0, 0, 1.1], [np.nan, 0, 0, 1], [0, 0, 0, 1.0005]]
    ledger = Ledger("log")
    result = session_of_tables(
        {"cup": PoseTable(stamps, np.zeros((8, 3)), rotations)}, SourceFrame(CONVENTIONS["gltf"], "m", ""), ledger
    )
    track = result.tracks["cup"]
    assert track.times_ns.tolist() == [0, 5, 7, 10, 11, 12, 13]
    assert track.valid.tolist() == [True, True, True, True, False, False, True]
    assert track.quaternions_xyzw[4].tolist() == [0, 0, 0, 1.1]
    why = "1 with a missing number; 1 with a quaternion of length 1.1 in place of 1"
    assert ledger_of(result.facts).sentences() == [
        "cup: 1 of 8 samples merged: that repeat a sample",
        f"cup: 2 of 7 poses dropped: {why}",
    ]


def test_meshes_of_the_user_override_scene_and_stand_ins(tmp_path):
    """A triangle of the user takes the place of the scene's sphere; where any mesh is given, no body gets a stand-in.

    Where none is, heads and hands get one (camera, left), a table and a left wheel do not.
    """
    scene = parse_scene('[[body]]\nid = "left"\nshape = "sphere"\nradius = 0.1\n')
    session = finish_import(
        session_of_bodies("left", "camera"),
        tmp_path / "x",
        MeshOptions({"left": TRIANGLE}),
        scene=scene,
        stand_ins=True,
    )
    assert list(session.meshes) == ["left"] and len(session.meshes["left"].faces) == 1
    session = finish_import(session_of_bodies("table", "camera", "left", "leftWheel"), tmp_path / "x", stand_ins=True)
    assert list(session.meshes) == ["camera", "left"] and session.scene.body("camera").proxy
    assert parse_scene(session.scene.text).body("camera").proxy


def test_body_without_a_sample_is_named():
    """The cup has two samples, the pen none."""
    nothing = PoseTable(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 4)))
    cup = PoseTable(np.arange(2), np.zeros((2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
    frame = SourceFrame.in_axes("openxr", "openxr", "m", "ns")
    session = session_of_tables({"cup": cup, "pen": nothing}, frame, Ledger("log"))
    assert session.facts["conversions"] == "pen: there is no sample of it"


def test_recording_of_lost_poses_is_refused_with_the_reason(tmp_path):
    """Five quaternions (0, 0, 0, 0); with one of them mended the recording is read."""
    log = tmp_path / "log.csv"
    rows = [f"{0.1 * row},cup,0,0,0,0,0,0,0" for row in range(5)]
    log.write_text("\n".join(["time,body,px,py,pz,qx,qy,qz,qw,kind,tracked", *(f"{row},pose,1" for row in rows), ""]))
    assert_import_refused(
        "csv", log, r"every pose in it is lost \(cup: 5 of 5 poses dropped: with a quaternion of length 0 "
    )
    log.write_text(log.read_text().replace("0,0,0,0,0,0,0,pose", "0,0,0,0,0,0,1,pose", 1))
    assert import_session("csv", log).tracks["cup"].valid.tolist() == [True, False, False, False, False]


def read_outside(source, *, number=1):
    """A reader of somebody else, with a setting: a session of one body or two."""
    return session_of_bodies(*("cup", "plate")[:number])


def raise_key_error(path):
    """A reader that fails."""
    raise KeyError("colour")


@pytest.fixture
def outside(monkeypatch):
    """Two importers of other packages: one that works and one that cannot be loaded."""
    points = EntryPoints(
        [
            EntryPoint("outside", "sessions.importers.from_outside:read_outside", ENTRY_POINT_GROUP),
            EntryPoint("broken", "sessions.importers.absent:read", ENTRY_POINT_GROUP),
            EntryPoint("csv", "sessions.importers.absent:read", ENTRY_POINT_GROUP),
            EntryPoint("falls", "sessions.importers.from_outside:falls", ENTRY_POINT_GROUP),
        ]
    )
    module = type(sys)("sessions.importers.from_outside")
    module.read_outside, module.falls = read_outside, raise_key_error
    monkeypatch.setitem(sys.modules, "sessions.importers.from_outside", module)
    monkeypatch.setattr(importing, "entry_points", lambda **selection: points.select(**selection))


def test_importer_of_another_package_is_listed_like_others(outside, tmp_path):
    """Names are this program's, ``auto`` and those of entry points; ``number`` is a setting of the other's reader."""
    (tmp_path / "x").touch()
    assert importer_names() == [*IMPORTERS, "auto", "broken", "falls", "outside"]
    session = import_session("outside", tmp_path / "x", number=2, meshes={"cup": TRIANGLE})
    assert session.names == ("cup", "plate") and list(session.meshes) == ["cup"]
    assert_import_refused(
        "outside",
        tmp_path / "x",
        "importer .*has no option 'colour'; it has: number, scene, scene_folder, meshes",
        colour=1,
    )


def test_unloadable_importer_is_reported_and_hides_no_other(outside, tmp_path):
    """ "broken" cannot be loaded, "csv" of another package does not replace ours, "falls" raises a KeyError."""
    (tmp_path / "x").touch()
    assert_import_refused("broken", tmp_path / "x", r"importer 'broken' failed .ModuleNotFoundError")
    assert_import_refused("csv", tmp_path / "none", "does not exist or is no file")
    assert_import_refused("falls", tmp_path / "x", r"importer 'falls' failed .KeyError: 'colour'.; repair or remove")
