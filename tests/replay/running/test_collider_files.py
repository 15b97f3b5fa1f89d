"""Written colliders are those that an engine takes, and give the figures that are printed."""

import json
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from unittest.mock import Mock

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.shapes import revolved_mesh
from support.small_worlds import STEP_NS, cube

import replay
from replay.advice import collider_search
from replay.advice.collider_search import Limits
from replay.cli.main import main
from replay.cutting import piece_store
from replay.cutting.methods import METHODS
from replay.errors import OutputError, TradeoffError
from replay.running.collider_files import COLLIDERS_FOLDER, fix_colliders
from sessions import MeshData, Session, import_session, load_mesh, read_session, write_session

pytestmark = pytest.mark.usefixtures("quickest_cutter_only", "few_depth_frames")

BEAKER_PROFILE = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
ROD_PROFILE = [(0, 0), (0.003, 0), (0.003, 0.2), (0, 0.2)]
"""(radius, height) in metres of bodies of revolution: a beaker of 10 cm with a wall of 2 mm, a rod of 20 cm."""
MOST_FALSE = 0.3
"""Fraction of the contact time that may be false with the colliders searched for."""


@pytest.fixture(autouse=True, scope="module")
def without_report_page():
    """The page before and after takes a third of a search, and has tests of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.running.collider_files.before_after_page", lambda _: "<html></html>")
        yield


@pytest.fixture(autouse=True, scope="module")
def few_numbers_of_pieces():
    """A round body is cut into six numbers of pieces, not into 18: a fifth of a search."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(collider_search, "SECTOR_COUNTS", (2, 4, 6, 8, 12, 16))
        yield


def as_data(mesh):
    """The mesh as a session has it."""
    return MeshData(mesh.vertices, mesh.faces)


@pytest.fixture(scope="module")
def session():
    """A rod that stirs in a beaker: free in its middle most of the time, at its wall now and then; a cube beside.

    The hull of the beaker fills its hollow, so that hulls report contact of the rod all the time.
    """
    meshes = {
        "beaker": as_data(revolved_mesh(BEAKER_PROFILE, 12)),
        "rod": as_data(revolved_mesh(ROD_PROFILE, 8)),
        "cube*": cube(edge=0.02),
    }
    upwards = int(np.argmax(np.ptp(meshes["beaker"].vertices, axis=0)))
    sideways = (upwards + 1) % 3
    frames = np.arange(45)
    positions = {name: np.zeros((len(frames), 3)) for name in meshes}
    positions["rod"][:, upwards] = 0.05
    positions["rod"][:, sideways] = np.where(frames % 15 < 3, 0.031, 0.001 * (frames % 15))
    positions["cube*"][:, sideways] = np.where(frames > 36, 0.044, 0.3)
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(frames), 1))
    poses = {name: (position, still) for name, position in positions.items()}
    return Session.from_arrays(frames * STEP_NS, poses, meshes)


@pytest.fixture(scope="module")
def unity_fix(session, tmp_path_factory):
    """Colliders for Unity, searched for the session so that at most 30 % of contact time is false, and written."""
    out = tmp_path_factory.mktemp("made") / "unity"
    return fix_colliders(session, out, engine="unity", limits=Limits(false=MOST_FALSE))


def pieces_of(fix):
    """Body -> convex pieces that stand for it in written colliders."""
    return {row["body"]: row["after"]["pieces"] for row in fix.bodies}


@pytest.mark.slow
def test_written_pieces_are_convex_and_hold_their_mesh(session, unity_fix):
    """Written for Unity: at most 255 faces a piece, as PhysX takes, called as Unreal wants it, with the prefix UCX_.

    No vertex of a mesh is further outside the nearest piece than stated. An asterisk is in no file name.
    """
    files = {row["body"]: row["file"] for row in unity_fix.bodies}
    assert files == {"beaker": "beaker.glb", "rod": "rod.glb", "cube*": "cube-2.glb"}
    for row in unity_fix.bodies:
        scene = trimesh.load(unity_fix.folder / row["file"], force="scene", process=False)
        assert all(name.startswith(f"UCX_{row['body']}_") for name in scene.geometry)
        pieces = [*scene.geometry.values()]
        assert len(pieces) == row["after"]["pieces"]
        assert all(piece.is_convex and len(piece.faces) <= 255 for piece in pieces)
        vertices = session.meshes[row["body"]].vertices
        beyond_planes = [
            ((vertices[:, None] - piece.triangles[:, 0]) * piece.face_normals).sum(axis=2).max(axis=1)
            for piece in pieces
        ]
        outside = np.min(beyond_planes, axis=0).max()
        assert outside <= 1e-3 * row["after"]["outside_mm"] + 1e-6
        assert load_mesh(unity_fix.folder / row["file"]) is not None


def test_printed_figures_match_a_run_of_the_written_colliders(unity_fix):
    """At most 30 % false contact, which hulls exceed, is reached by the pieces written for Unity.

    False contact and misses in the folder's JSON are those of a run of its session with its colliders.
    """
    written = json.loads((unity_fix.folder / COLLIDERS_FOLDER.mark).read_text("utf-8"))
    assert written["reached"]
    assert written["after"]["false"] <= MOST_FALSE < written["before"]["false"]
    run = replay.run(read_session(unity_fix.folder / "session.mcap"), detectors=f"it={unity_fix.setting}")
    audit = run.document.audit["it"]
    assert written["after"]["false"] == audit.means_over_offsets.false_contact.value
    missed = audit.counts_over_offsets.contacts_missed
    assert (written["after"]["missed_smallest"], written["after"]["missed_largest"]) == (
        missed.smallest,
        missed.largest,
    )


def test_only_the_hollow_body_is_split_into_pieces(unity_fix):
    """A rod stirs in a hollow beaker, a cube stands beside; at most 30 % of contact may be false.

    That takes several pieces of the beaker, up to eight, and one of each convex body.
    """
    pieces = pieces_of(unity_fix)
    assert 1 < pieces.pop("beaker") <= 8
    assert pieces == {"rod": 1, "cube*": 1}


def test_nothing_is_split_where_all_contact_may_be_false(session, tmp_path):
    """At most 100 % may be false: the hollow beaker too is one piece, its hull, as before.

    There is no time limit, so that no time is up.
    """
    fix = fix_colliders(session, tmp_path / "out", engine="mujoco", limits=Limits(false=1.0), time_limit=None)
    assert pieces_of(fix) == {"beaker": 1, "rod": 1, "cube*": 1}
    assert fix.before["false"] == fix.after["false"]
    assert not fix.time_up


class Stages:
    """Keeps what each stage of a search was reported to have done: name -> (total, [amounts])."""

    def __init__(self):
        self.amounts = {}

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        del unit
        self.amounts[name] = total, []
        yield self.amounts[name][1].append


def test_collider_search_out_of_time_writes_single_hulls(session, tmp_path):
    """No false contact is allowed, and no time: a hull a body is written, and that the time was up.

    The progress is in percent, 100 at most.
    """
    stages, no_false_contact = Stages(), Limits(false=0.0)
    fix = fix_colliders(
        session, tmp_path / "out", engine="mujoco", limits=no_false_contact, time_limit=0.0, progress=stages
    )
    assert fix.time_up and not fix.reached
    assert set(pieces_of(fix).values()) == {1}
    assert json.loads((fix.folder / COLLIDERS_FOLDER.mark).read_text("utf-8"))["time_up"]
    total, percents = stages.amounts["Cutting and trying colliders"]
    assert total == 100 and 0 < sum(percents) <= 100


@pytest.fixture
def fix_command(session, tmp_path):
    """The command that writes colliders for Unity, up to the number behind --max-false; the session is s.mcap."""
    write_session(session, tmp_path / "s.mcap")
    return ["fix", str(tmp_path / "s.mcap"), "--engine", "unity", "-o", str(tmp_path / "out"), "--max-false"]


@pytest.mark.slow
def test_command_prints_before_and_after_and_refuses_an_existing_folder(fix_command, capsys):
    """At most 30 % false contact is reached: exit code 0. Written again, the folder would need --force."""
    assert main([*fix_command, "0.3", "-v"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "before: a hull a body" in out and "after: these pieces" in out and "Report card" in out
    assert "shape=shipped" in out and "of all choices that were tried" in out
    assert "com.unity.cloud.gltfast" in out and "The poses are not in axes of Unity" in out
    assert main([*fix_command, "0.3"]) == 1
    assert "exists; name another folder" in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
def test_command_fails_if_the_limit_is_not_reached(fix_command, capsys):
    """No false contact at all is not reached: exit code 1, and what the best choice has."""
    assert main([*fix_command, "0", "--format", "json"]) == 1
    written = json.loads(capsys.readouterr().out)
    assert not written["reached"] and written["after"]["false"] > 0


@pytest.mark.slow
def test_command_without_an_engine_writes_a_report_and_no_mesh(fix_command, tmp_path, capsys):
    """The report says how to name an engine, for which colliders can be written."""
    session_file = fix_command[1]
    assert main(["fix", session_file, "-o", str(tmp_path / "report"), "--max-false", "0.3"]) == 0
    assert (tmp_path / "report" / "report.html").is_file()
    assert [*(tmp_path / "report").glob("*.glb")] == []
    assert "--engine unity" in capsys.readouterr().out


def test_front_is_better_with_every_more_pieces(unity_fix):
    """Rows of all numbers of pieces that were tried and that none beats, fewest first: each has less false contact."""
    pieces = [row["pieces"] for row in unity_fix.front]
    assert len(pieces) > 1 and pieces == sorted(set(pieces))
    assert all(more["false"] < fewer["false"] for fewer, more in pairwise(unity_fix.front))


@pytest.mark.slow
def test_every_method_has_a_card_or_its_time(session, monkeypatch, tmp_path):
    """The cutter CoACD seems to take 15 minutes, so it is not tried; others have cards beside the chosen pieces.

    One box is further beyond the mesh than its hull, which is further than the pieces. Nothing is written.
    """
    monkeypatch.setattr(piece_store, "in_memory", {})  # another test may have cut the beaker by CoACD
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setitem(METHODS, "coacd", replace(METHODS["coacd"], seconds=lambda _: 900.0))
    fix = fix_colliders(session, limits=Limits(false=0.3), every_method=True)
    beaker = fix.bodies[0]
    cards = {card["how"]: card for card in beaker["others"]}
    assert {"one box", "one sphere", "one capsule", "V-HACD, 16 at most"} == cards.keys()
    assert cards["one box"]["beyond"] > beaker["before"]["beyond"] > beaker["after"]["beyond"]
    assert cards["one box"]["false"] >= beaker["after"]["false"]
    assert fix.not_tried == ("CoACD of beaker (16 pieces) was not tried: it takes about 15 min.",)
    assert fix.folder is None and fix.engine == ""


@pytest.mark.slow
def test_mujoco_takes_the_written_model(session, tmp_path):
    """A beaker, a rod and a cube: the model has a geom a piece.

    The first OBJ of the beaker is its first piece in the session, in metres.
    """
    mujoco = pytest.importorskip("mujoco", reason="the extra `engines` is not installed")
    fix = fix_colliders(session, tmp_path / "out", engine="mujoco", limits=Limits(false=MOST_FALSE))
    model = mujoco.MjModel.from_xml_path(str(fix.folder / "colliders.xml"))
    assert model.ngeom == sum(pieces_of(fix).values())
    in_obj = trimesh.load(fix.folder / "beaker_00.obj", process=False)
    in_session, *_others = read_session(fix.folder / "session.mcap").colliders["beaker"]
    assert farthest(in_obj.vertices, in_session.vertices) < 1e-6


@pytest.mark.slow
def test_mujoco_takes_bodies_of_a_tenth_of_a_millimetre(session, tmp_path):
    """All is scaled by 0.005: the cube with an edge of 20 mm has 0.1 mm; a mesh a body is loaded."""
    mujoco = pytest.importorskip("mujoco", reason="the extra `engines` is not installed")
    scale = 0.005
    meshes = {name: MeshData(scale * mesh.vertices, mesh.faces) for name, mesh in session.meshes.items()}
    poses = {name: (scale * track.positions, track.quaternions_xyzw) for name, track in session.tracks.items()}
    small_session = Session.from_arrays(session.stamps(), poses, meshes)
    fix = fix_colliders(small_session, tmp_path / "out", engine="mujoco", limits=Limits(false=1.0))
    assert mujoco.MjModel.from_xml_path(str(fix.folder / "colliders.xml")).nmesh == len(meshes)


@pytest.mark.slow
def test_godot_gets_nodes_that_become_collision_shapes(session, tmp_path):
    """Godot takes nodes with the ending -convcolonly for convex shapes; its physics steps at 60 Hz."""
    fix = fix_colliders(session, tmp_path / "out", engine="godot", limits=Limits(false=MOST_FALSE))
    assert fix.step_hz == 60.0
    scene = trimesh.load(fix.folder / "beaker.glb", force="scene", process=False)
    pieces = pieces_of(fix)["beaker"]
    assert set(scene.geometry) == {f"beaker_{number:02d}-convcolonly" for number in range(pieces)}


def test_a_folder_of_something_else_is_not_replaced(session, tmp_path):
    """The folder holds somebody's text; ``force`` replaces only folders that this program wrote."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("x", "utf-8")
    with pytest.raises(OutputError, match="is not replaced"):
        fix_colliders(session, tmp_path / "mine", engine="unity", force=True)


FLIP_X = np.diag([-1.0, 1.0, 1.0])
"""What glTFast and UnityGLTF do on import and export: UnityGLTF, SchemaExtensions.CoordinateSpaceConversionScale."""
SWAP_YZ = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""What Unreal's importer and exporter of glTF do, but for the unit: GLTFExporter, FGLTFCoreUtilities::ConvertVector."""


def open_cup():
    """A floor with one wall, at x = -0.06 m, and a lip at its end along +z: no half circle maps it onto itself."""
    floor = trimesh.creation.box((0.12, 0.01, 0.12))
    wall = trimesh.creation.box((0.01, 0.10, 0.12)).apply_translation((-0.06, 0.05, 0))
    lip = trimesh.creation.box((0.03, 0.01, 0.02)).apply_translation((-0.05, 0.10, 0.07))
    return trimesh.util.concatenate([floor, wall, lip])


def placed_by_an_engine(file, importer):
    """Name of a mesh -> its vertices in the axes of the engine that imports a glTF with these coordinates changed."""
    scene = trimesh.load(file, force="scene", process=False)
    return {name: mesh.vertices @ importer.T for name, mesh in scene.geometry.items()}


def farthest(points, others):
    """Metres from each point to the nearest of others, the largest of all."""
    return np.linalg.norm(points[:, None] - others, axis=2).min(axis=1).max()


CUP_AND_ROD = {"Cup": open_cup(), "Rod": trimesh.creation.box((0.01, 0.1, 0.01))}


def import_cup_and_rod(folder, meshes, *, convention, metres=1.0):
    """The session of a CSV in a convention of axes and a unit of length: the rod moves by 2 cm beside the cup."""
    rows = ["t,x,y,z,zero,one"]
    for frame in range(20):
        x, y, z = -0.06 + 0.02 * (frame < 10), 0.05, 0.0  # metres
        rows.append(f"{0.02 * frame},{x / metres},{y / metres},{z / metres},0,1")
    (folder / "log.csv").write_text("\n".join(rows))
    still = 'quaternion_xyzw = ["zero", "zero", "zero", "one"]'
    (folder / "map.toml").write_text(
        f'convention = "{convention}"\nunits = "{"m" if metres == 1.0 else "cm"}"\n[time]\ncolumn = "t"\nunit = "s"\n'
        f'[bodies.Cup]\nposition = ["zero", "zero", "zero"]\n{still}\n'
        f'[bodies.Rod]\nposition = ["x", "y", "z"]\n{still}\n'
    )
    return import_session("csv", folder / "log.csv", mapping=folder / "map.toml", meshes=meshes)


@pytest.mark.parametrize(
    ("engine", "convention", "importer", "metres"),
    [
        pytest.param("unity", "unity", FLIP_X, 1.0, id="unity"),
        pytest.param("unreal", "unreal", SWAP_YZ, 0.01, id="unreal"),
        pytest.param("unity", "gltf", FLIP_X, 1.0, marks=pytest.mark.slow, id="unity, poses and mesh of glTF"),
        pytest.param("godot", "godot", np.eye(3), 1.0, marks=pytest.mark.slow, id="godot"),
    ],
)
def test_written_colliders_land_on_the_users_mesh(engine, convention, importer, metres, tmp_path):
    """A cup is exported as GLB by the engine, or by any program for glTF, and poses are in that convention of axes.

    ``importer``: by which the engine changes coordinates of a glTF; ``metres``: in its unit of length. Applied to the
    written colliders, one hull as all contact may be false, it must give the cup as the engine has it.
    """
    of_engine = convention != "gltf"
    in_engine = CUP_AND_ROD["Cup"].vertices @ (np.eye(3) if of_engine else importer.T)
    for name, solid in CUP_AND_ROD.items():
        exported = solid.copy()
        exported.vertices = solid.vertices @ (importer.T if of_engine else np.eye(3))
        if of_engine and np.linalg.det(importer) < 0.0:
            exported.faces = exported.faces[:, ::-1]  # a mirrored mesh stays the right side out
        (tmp_path / f"{name}.glb").write_bytes(exported.export(file_type="glb"))
    meshes = {name: tmp_path / f"{name}.glb" for name in CUP_AND_ROD}
    session = import_cup_and_rod(tmp_path, meshes, convention=convention, metres=metres)
    fix = fix_colliders(session, tmp_path / "out", engine=engine, limits=Limits(false=1.0))

    placed = placed_by_an_engine(fix.folder / "Cup.glb", importer)
    (piece,) = [points for name, points in placed.items() if name in ("UCX_Cup_00", "Cup_00-convcolonly")]
    assert farthest(piece, in_engine) < 1e-6
    assert piece.min(axis=0) == pytest.approx(in_engine.min(axis=0), abs=1e-6)
    assert piece.max(axis=0) == pytest.approx(in_engine.max(axis=0), abs=1e-6)
    half_circle = np.diag([-1.0, 1.0, -1.0])
    assert farthest(piece @ half_circle, in_engine) > 0.01, "the cup shows by which half circle it was once wrong"
    assert ("Cup" in placed) == (engine == "unreal"), "Unreal takes the mesh and its pieces from one file"
    if engine == "unreal":
        assert farthest(in_engine, placed["Cup"]) < 1e-6 and len(placed["Cup"]) == len(in_engine)
    (read_piece,) = read_session(fix.folder / "session.mcap").colliders["Cup"]
    assert farthest(read_piece.vertices, session.meshes["Cup"].vertices) < 1e-6, "in the session of the folder, too"


def corners_in_mujoco(model, body_name):
    """Corners of all mesh geoms of a body as MuJoCo has them, which moves each mesh to its middle."""
    import mujoco

    body, corners = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body_name), []
    for geom in np.flatnonzero(model.geom_bodyid == body):
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        rotation = Rotation.from_quat(np.roll(model.geom_quat[geom], -1))
        corners.append(rotation.apply(model.mesh_vert[first : first + count]) + model.geom_pos[geom])
    return np.concatenate(corners)


def test_mujoco_geoms_lie_on_the_users_mesh(tmp_path):
    """A cup as OBJ in the axes of the body, which MuJoCo reads as it is; poses have Z up.

    All contact may be false, so the cup becomes a single hull, whose corners are corners of the cup.
    """
    mujoco = pytest.importorskip("mujoco", reason="the extra `engines` is not installed")
    for name, mesh in CUP_AND_ROD.items():
        mesh.export(tmp_path / f"{name}.obj")
    meshes = {name: tmp_path / f"{name}.obj" for name in CUP_AND_ROD}
    session = import_cup_and_rod(tmp_path, meshes, convention="z-up")
    fix = fix_colliders(session, tmp_path / "out", engine="mujoco", limits=Limits(false=1.0))
    model = mujoco.MjModel.from_xml_path(str(fix.folder / "colliders.xml"))
    corners, cup = corners_in_mujoco(model, "Cup"), CUP_AND_ROD["Cup"]
    assert farthest(corners, cup.vertices) < 1e-6
    smallest, largest = cup.bounds
    assert corners.min(axis=0) == pytest.approx(smallest, abs=1e-6)
    assert corners.max(axis=0) == pytest.approx(largest, abs=1e-6)


def test_names_with_control_characters_are_refused_before_cutting(session, tmp_path, monkeypatch):
    """A body's name holds ESC [2J, which clears a terminal; the search that cuts bodies is not begun."""
    search = Mock(side_effect=AssertionError("bodies were cut before the names were refused"))
    monkeypatch.setattr("replay.running.collider_files.ColliderSearch", search)
    meshes = {"beaker\x1b[2J": session.meshes["beaker"], "rod": session.meshes["rod"]}
    still = np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))
    poses = {name: (np.full((4, 3), np.arange(4)[:, None] * k), still) for k, name in enumerate(meshes)}
    named = Session.from_arrays(np.arange(4) * STEP_NS, poses, meshes)
    with pytest.raises(TradeoffError, match=r"^bodies are called beaker\\x1b\[2J: no engine takes control characters"):
        fix_colliders(named, tmp_path / "out", engine="unity")


@pytest.mark.slow
def test_file_names_are_different_where_capitals_do_not_count(session, tmp_path):
    """Bodies of eight names; `Cup` and `cup` left one file on Windows and macOS, `my cup` and `mycup-0` everywhere.

    A name that can be a file name keeps it; `con`, a device of Windows, cannot, nor can 300 letters.
    """
    names = ["Cup", "cup", "my cup", "mycup-0", "con", "c" * 300, "..", "杯子"]
    still = np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))
    poses = {name: (np.tile(0.001 * k * np.arange(4)[:, None], 3), still) for k, name in enumerate(names)}
    named = Session.from_arrays(np.arange(4) * STEP_NS, poses, dict.fromkeys(names, session.meshes["cube*"]))
    fix = fix_colliders(named, tmp_path / "out", engine="mujoco", limits=Limits(false=1.0))
    file_of = {row["body"]: row["file"] for row in fix.bodies}
    assert sorted(file.name for file in fix.folder.glob("*.glb")) == sorted(file_of.values())
    assert len({file.lower() for file in file_of.values()}) == len(names)
    assert (file_of["Cup"], file_of["mycup-0"]) == ("Cup.glb", "mycup-0.glb")
    assert "con.glb" not in file_of.values()
    assert max(map(len, file_of.values())) <= 110, "100 letters of the name, a number and .glb"
    model = (fix.folder / "colliders.xml").read_text("utf-8")
    assert model.count("<body name=") == len(names)


@pytest.mark.parametrize(
    ("reach_mm", "remark"),
    [(28.04, "(beaker: up to 28 mm beyond the mesh)"), (0.0, None)],
    ids=["28.04 mm beyond", "nowhere beyond"],
)
def test_remark_names_bodies_whose_joined_pieces_fill_hollows(unity_fix, reach_mm, remark):
    """The beaker's pieces were joined by motion and reach so far beyond its mesh; the rod is one hull."""
    beaker, rod, *_ = unity_fix.bodies
    joined = {**beaker, "how": "sectors by height and angle, joined by motion"}
    joined["after"] = {**beaker["after"], "reach_mm": reach_mm}
    remarks = [text for text in replace(unity_fix, bodies=[joined, rod]).remarks if "hollows" in text]
    assert len(remarks) == (0 if remark is None else 1)
    assert all(remark in text and "rod" not in text for text in remarks)


@pytest.fixture
def session_with_dipped_rod(session):
    """Returns sessions of a rod that goes into the beaker and out, so many metres from its middle, without a touch."""
    upwards = int(np.argmax(np.ptp(session.meshes["beaker"].vertices, axis=0)))
    frames = 30
    still = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 1))

    def make(metres_aside):
        rod = np.full((frames, 3), metres_aside)
        rod[:, upwards] = 0.02 + np.abs(np.linspace(-0.15, 0.15, frames))
        poses = {"beaker": (np.zeros((frames, 3)), still), "rod": (rod, still)}
        return Session.from_arrays(np.arange(frames) * STEP_NS, poses, {name: session.meshes[name] for name in poses})

    return make


@pytest.mark.slow
def test_false_contact_is_mended_where_nothing_ever_touches(session_with_dipped_rod):
    """The rod goes into the beaker without touching it: for hulls that is all false contact, for pieces none."""
    fix = fix_colliders(session_with_dipped_rod(metres_aside=0.0), limits=Limits(false=0.2))
    assert fix.before["false"] == 1.0
    assert not fix.after["false"], "0, or nothing reported"
    assert fix.before["missed"] == fix.after["missed"] == 0


def test_session_in_which_not_even_hulls_touch_is_refused(session_with_dipped_rod):
    """A rod passes 5 m from the middle of a beaker."""
    with pytest.raises(TradeoffError, match="nothing touches in this session, not even the hulls"):
        fix_colliders(session_with_dipped_rod(metres_aside=5.0))


@pytest.mark.parametrize(
    ("most_missed", "missed", "remarks"),
    [
        pytest.param(None, 0.25, ["Missed contact: 25 %; with a hull a body it is 0 %."], id="missed"),
        pytest.param(None, 0.0, [], id="nothing missed"),
        pytest.param(0.5, 0.25, ["Missed contact: 25 %; at most 50 % was asked for."], id="missed within a limit"),
    ],
)
def test_remarks_state_missed_contact_that_changed_or_was_limited(unity_fix, most_missed, missed, remarks):
    """``missed``: fraction of the contact time that the pieces do not report; the hulls report all of it.

    ``most_missed``: the limit that was set for that fraction, if any.
    """
    limits = Limits(false=MOST_FALSE) if most_missed is None else Limits(false=MOST_FALSE, missed=most_missed)
    before, after = unity_fix.before | {"not_reported": 0.0}, unity_fix.after | {"not_reported": missed}
    changed = replace(unity_fix, limits=limits, before=before, after=after)
    assert [remark for remark in changed.remarks if remark.startswith("Missed contact")] == remarks
