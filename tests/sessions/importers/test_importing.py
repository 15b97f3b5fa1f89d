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
    """Stamps 0, 10, 5, 7, 10, 11, 12, 13 ns increase longest without the first 10, whose sample the second repeats.

    Of the last three quaternions one is 1.1 long, one has no number, and one of 1.0005 is near enough to a unit.
    """
    stamps = np.array([0, 10, 5, 7, 10, 11, 12, 13])
    rotations = np.tile([0, 0, 0, 1.0], (8, 1))
    rotations[5:] = [[0, 0, 0, 1.1], [np.nan, 0, 0, 1], [0, 0, 0, 1.0005]]
    ledger = Ledger("log")
    poses = PoseTable(times_ns=stamps, positions=np.zeros((8, 3)), quaternions_xyzw=rotations)
    frame = SourceFrame(axes=CONVENTIONS["gltf"], units="m", clock="")
    result = session_of_tables({"cup": poses}, frame, ledger)
    track = result.tracks["cup"]
    assert track.times_ns.tolist() == [0, 5, 7, 10, 11, 12, 13]
    assert track.valid.tolist() == [True, True, True, True, False, False, True]
    assert track.quaternions_xyzw[4].tolist() == [0, 0, 0, 1.1]  # a lost pose is stored as it was written
    why = "1 with a missing number; 1 with a quaternion of length 1.1 in place of 1"
    assert ledger_of(result.facts).sentences() == [
        "cup: 1 of 8 samples merged: that repeat a sample",
        f"cup: 2 of 7 poses dropped: {why}",
    ]


def test_meshes_of_the_user_override_scene_and_stand_ins(tmp_path):
    """The scene has a sphere for the hand "left", the user a triangle; the headset "camera" has no mesh.

    The triangle is taken; where any mesh is given, no headset or controller gets a stand-in.
    """
    scene = parse_scene('[[body]]\nid = "left"\nshape = "sphere"\nradius = 0.1\n')
    session = finish_import(
        session_of_bodies("left", "camera"),
        source=tmp_path / "x",
        given=MeshOptions({"left": TRIANGLE}),
        scene=scene,
        stand_ins=True,
    )
    assert list(session.meshes) == ["left"]
    assert np.array_equal(session.meshes["left"].faces, TRIANGLE.faces)


def test_headsets_and_controllers_without_meshes_get_stand_ins(tmp_path):
    """By their names "camera" is a headset and "left" a controller; "table" and "leftWheel" are neither.

    A stand-in is marked as a proxy in the session and in the text of its scene.
    """
    session = session_of_bodies("table", "camera", "left", "leftWheel")
    result = finish_import(session, source=tmp_path / "x", stand_ins=True)
    assert list(result.meshes) == ["camera", "left"]
    assert result.scene.body("camera").proxy
    assert parse_scene(result.scene.text).body("camera").proxy


def test_body_without_a_sample_is_named():
    """The cup has two samples, the pen none: the session's fact on conversions, a text for people, says so."""
    pen = PoseTable(times_ns=np.zeros(0, dtype=np.int64), positions=np.zeros((0, 3)), quaternions_xyzw=np.zeros((0, 4)))
    cup = PoseTable(
        times_ns=np.arange(2), positions=np.zeros((2, 3)), quaternions_xyzw=np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    )
    frame = SourceFrame.in_axes("openxr", "openxr", "m", "ns")
    session = session_of_tables({"cup": cup, "pen": pen}, frame, Ledger("log"))
    assert session.facts["conversions"] == "pen: there is no sample of it"


def test_recording_of_lost_poses_is_refused_with_the_reason(tmp_path):
    """Five rows 0.1 s apart have the quaternion (0, 0, 0, 0); with the first of them mended the recording is read."""
    log = tmp_path / "log.csv"
    rows = [f"{0.1 * row},cup,0,0,0,0,0,0,0,pose,1" for row in range(5)]
    log.write_text("\n".join(["time,body,px,py,pz,qx,qy,qz,qw,kind,tracked", *rows, ""]))
    assert_import_refused(
        "csv", log, r"every pose in it is lost \(cup: 5 of 5 poses dropped: with a quaternion of length 0 "
    )
    log.write_text(log.read_text().replace("0,0,0,0,0,0,0,pose", "0,0,0,0,0,0,1,pose", 1))  # the first row alone
    assert import_session("csv", log).tracks["cup"].valid.tolist() == [True, False, False, False, False]


def read_bodies(source, *, bodies=1):
    """A reader of another package with an option of its own: a session of one body or two."""
    return session_of_bodies(*("cup", "plate")[:bodies])


def raise_key_error(path):
    """A reader of another package with a defect."""
    raise KeyError("colour")


@pytest.fixture
def four_foreign_importers(monkeypatch):
    """Entry points of other packages: "works", "raises" (KeyError), and "broken" and "csv" whose module is absent."""
    points = EntryPoints(
        [
            EntryPoint("works", "another_package:read_bodies", ENTRY_POINT_GROUP),
            EntryPoint("broken", "absent_package:read", ENTRY_POINT_GROUP),
            EntryPoint("csv", "absent_package:read", ENTRY_POINT_GROUP),
            EntryPoint("raises", "another_package:raise_key_error", ENTRY_POINT_GROUP),
        ]
    )
    module = type(sys)("another_package")
    module.read_bodies, module.raise_key_error = read_bodies, raise_key_error
    monkeypatch.setitem(sys.modules, "another_package", module)
    monkeypatch.setattr(importing, "entry_points", lambda **selection: points.select(**selection))


@pytest.mark.usefixtures("four_foreign_importers")
def test_importers_of_other_packages_are_listed_after_our_own():
    """Names are this program's, "auto", and those of the four entry points; "csv" of another package is ours."""
    assert importer_names() == [*IMPORTERS, "auto", "broken", "raises", "works"]


@pytest.mark.usefixtures("four_foreign_importers")
def test_importer_of_another_package_takes_own_and_common_options(tmp_path):
    """ "works" has an option ``bodies``, how many it makes; ``meshes`` is an option of every importer.

    An option that it has not is refused with a list of those that it has.
    """
    (tmp_path / "x").touch()
    session = import_session("works", tmp_path / "x", bodies=2, meshes={"cup": TRIANGLE})
    assert session.names == ("cup", "plate")
    assert list(session.meshes) == ["cup"]
    options = "importer .*has no option 'colour'; it has: bodies, scene, scene_folder, meshes"
    assert_import_refused("works", tmp_path / "x", options, colour=1)


@pytest.mark.usefixtures("four_foreign_importers")
def test_unloadable_importer_is_reported_and_hides_no_other(tmp_path):
    """ "broken" cannot be loaded, "csv" of another package does not replace ours, "raises" raises a KeyError.

    Our importer of CSV looks for the file first, and says that there is none.
    """
    (tmp_path / "x").touch()
    assert_import_refused("broken", tmp_path / "x", r"importer 'broken' failed .ModuleNotFoundError")
    assert_import_refused("raises", tmp_path / "x", r"importer 'raises' failed .KeyError: 'colour'.; repair or remove")
    assert_import_refused("csv", tmp_path / "none", "does not exist or is no file")
