"""Written colliders are those that an engine takes, and give the figures that are printed."""

import json
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.shapes import revolved_mesh
from support.small_worlds import STEP_NS, cube

import replay
from replay.advice.collider_search import Limits
from replay.cli.main import main
from replay.cutting import piece_store
from replay.cutting.methods import METHODS
from replay.errors import OutputError, TradeoffError
from replay.running.collider_files import COLLIDERS_FOLDER, fix_colliders
from sessions import MeshData, Session, import_session, load_mesh, read_session, write_session

pytestmark = pytest.mark.usefixtures("quickest_cutter_only")

WALL = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
ROD = [(0, 0), (0.003, 0), (0.003, 0.2), (0, 0.2)]
MOST_FALSE = 0.3
"""Fraction of the contact time that may be false with the colliders searched for."""


@pytest.fixture(autouse=True, scope="module")
def without_report_page():
    """The page before and after takes a third of a search, and has tests of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.running.collider_files.before_after_page", lambda _: "<html></html>")
        yield


def as_data(mesh):
    """The mesh as a session has it."""
    return MeshData(mesh.vertices, mesh.faces)


@pytest.fixture(scope="module")
def session():
    """A rod that stirs in a beaker: free in its middle most of the time, at its wall now and then; a cube beside."""
    meshes = {
        "beaker": as_data(revolved_mesh(WALL, 24)),
        "rod": as_data(revolved_mesh(ROD, 8)),
        "cube*": cube(edge=0.02),
    }
    axis = int(np.argmax(np.ptp(meshes["beaker"].vertices, axis=0)))
    side = (axis + 1) % 3
    count = 45
    positions = {name: np.zeros((count, 3)) for name in meshes}
    positions["rod"][:, axis] = 0.05
    positions["rod"][:, side] = np.where(np.arange(count) % 15 < 3, 0.031, 0.001 * (np.arange(count) % 15))
    positions["cube*"][:, side] = np.where(np.arange(count) > 36, 0.044, 0.3)
    still = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    poses = {name: (position, still) for name, position in positions.items()}
    return Session.from_arrays(np.arange(count) * STEP_NS, poses, meshes)


@pytest.fixture(scope="module")
def unity_fix(session, tmp_path_factory):
    """Colliders for Unity, found and written for the session."""
    return fix_colliders(
        session, tmp_path_factory.mktemp("made") / "unity", engine="unity", limits=Limits(false=MOST_FALSE)
    )


@pytest.mark.slow
def test_written_pieces_are_convex_and_hold_their_mesh(session, unity_fix):
    """No vertex of a mesh is further outside of its pieces than stated; at most 255 faces a piece, as PhysX takes."""
    names = {row["body"]: row["file"] for row in unity_fix.bodies}
    assert names == {"beaker": "beaker.glb", "rod": "rod.glb", "cube*": "cube-2.glb"}
    for row in unity_fix.bodies:
        scene = trimesh.load(unity_fix.folder / row["file"], force="scene", process=False)
        pieces = [scene.geometry[name] for name in scene.geometry]
        assert len(pieces) == row["after"]["pieces"] and all(
            name.startswith(f"UCX_{row['body']}_") for name in scene.geometry
        )
        assert all(piece.is_convex and len(piece.faces) <= 255 for piece in pieces)
        mesh = session.meshes[row["body"]]
        gap = [
            ((mesh.vertices[:, None] - item.triangles[:, 0]) * item.face_normals).sum(axis=2).max(axis=1)
            for item in pieces
        ]
        assert np.min(gap, axis=0).max() <= 1e-3 * row["after"]["outside_mm"] + 1e-6
        assert load_mesh(unity_fix.folder / row["file"]) is not None


def test_printed_figures_match_a_run_of_the_written_colliders(unity_fix):
    """False contact and misses as written to the folder's JSON, and of a run of its session with its colliders."""
    reported = json.loads((unity_fix.folder / COLLIDERS_FOLDER.mark).read_text("utf-8"))
    assert reported["after"]["false"] <= MOST_FALSE < reported["before"]["false"] and reported["reached"]
    again = replay.run(read_session(unity_fix.folder / "session.mcap"), detectors=f"it={unity_fix.setting}")
    audit = again.document.audit["it"]
    assert reported["after"]["false"] == audit.means_over_offsets.false_contact.value
    over = audit.counts_over_offsets.contacts_missed
    assert [reported["after"][f"missed_{end}"] for end in ("smallest", "largest")] == [over.smallest, over.largest]


def test_fewer_pieces_fall_short_and_more_are_not_written(session, unity_fix, tmp_path):
    """At most 0.3 may be false: that takes several pieces of the beaker, one of each convex body.

    Where all may be false (1.0), the beaker too keeps one.
    """
    pieces = {row["body"]: row["after"]["pieces"] for row in unity_fix.bodies}
    assert 1 < pieces["beaker"] <= 8 and pieces["rod"] == pieces["cube*"] == 1
    free = fix_colliders(session, tmp_path / "loose", engine="unity", limits=Limits(false=1.0))
    assert {row["body"]: row["after"]["pieces"] for row in free.bodies} == dict.fromkeys(pieces, 1)
    assert free.before["false"] == free.after["false"]


class Stages:
    """Keeps the units of each stage that was reported."""

    def __init__(self):
        self.units = {}

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        del unit
        self.units[name] = [total]
        yield self.units[name].append


def test_collider_search_out_of_time_writes_single_hulls(session, tmp_path):
    """No false contact is allowed, and no time: a hull a body is written. The progress is in percent, 100 at most."""
    stages = Stages()
    made = fix_colliders(
        session, tmp_path / "made", engine="mujoco", limits=Limits(false=0.0), time_limit=0.0, progress=stages
    )
    assert made.time_up and not made.reached and all(row["after"]["pieces"] == 1 for row in made.bodies)
    total, *percents = stages.units["Cutting and trying colliders"]
    assert total == 100 and 0 < sum(percents) <= 100
    assert json.loads((made.folder / COLLIDERS_FOLDER.mark).read_text("utf-8"))["time_up"]
    unlimited = fix_colliders(session, tmp_path / "all", engine="mujoco", limits=Limits(false=1.0), time_limit=None)
    assert not unlimited.time_up


@pytest.mark.slow
def test_before_and_after_are_printed_and_unreached_limit_fails(session, tmp_path, capsys):
    """The number behind --max-false is the fraction that may be false: 0.3 is reached (exit code 0), 0 is not (1).

    Without an engine a report is written and no mesh; a folder that exists is not replaced without --force.
    """
    file = tmp_path / "s.mcap"
    write_session(session, file)
    arguments = ["fix", str(file), "--engine", "unity", "-o", str(tmp_path / "made"), "--max-false"]
    assert main([*arguments, "0.3", "-v"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "before: a hull a body" in out and "after: these pieces" in out and "Report card" in out
    assert "shape=shipped" in out and "of all choices that were tried" in out
    assert "com.unity.cloud.gltfast" in out and "The poses are not in axes of Unity" in out
    assert main([*arguments, "0", "--force", "--format", "json"]) == 1
    reported = json.loads(capsys.readouterr().out)
    assert not reported["reached"] and reported["after"]["false"] > 0
    assert main([*arguments, "0.3"]) == 1 and "exists; name another folder" in capsys.readouterr().err
    assert main(["fix", str(file), "-o", str(tmp_path / "x"), "--max-false", "0.3"]) == 0
    assert (tmp_path / "x" / "report.html").is_file() and not [*(tmp_path / "x").glob("*.glb")]
    assert "--engine unity" in capsys.readouterr().out


def test_front_is_better_with_every_more_pieces(unity_fix):
    """Rows of the front in order of pieces; each has less false contact than the one before."""
    assert [row["pieces"] for row in unity_fix.front] == sorted({row["pieces"] for row in unity_fix.front})
    assert all(more["false"] < less["false"] for less, more in pairwise(unity_fix.front))


@pytest.mark.slow
def test_every_method_has_a_card_or_its_time(session, monkeypatch, tmp_path):
    """CoACD is said to take 15 minutes, so it is not tried; the others have cards beside the chosen one."""
    monkeypatch.setattr(piece_store, "in_memory", {})  # another test may have cut the beaker by CoACD
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setitem(METHODS, "coacd", replace(METHODS["coacd"], seconds=lambda _: 900.0))
    made = fix_colliders(session, limits=Limits(false=0.3), every_method=True)
    cards = {card["how"]: card for card in made.bodies[0]["others"]}
    assert {"one box", "one sphere", "one capsule", "V-HACD, 16 at most"} == cards.keys()
    assert cards["one box"]["beyond"] > made.bodies[0]["before"]["beyond"] > made.bodies[0]["after"]["beyond"]
    assert cards["one box"]["false"] >= made.bodies[0]["after"]["false"]
    assert made.folder is None and made.engine == ""
    assert made.not_tried == ("CoACD of beaker (16 pieces) was not tried: it takes about 15 min.",)


@pytest.mark.slow
def test_mujoco_takes_the_written_model(session, tmp_path):
    """The model has a geom a piece, and the piece in the OBJ is that of the written session, in metres."""
    mujoco = pytest.importorskip("mujoco", reason="the extra `engines` is not installed")
    made = fix_colliders(session, tmp_path / "made", engine="mujoco", limits=Limits(false=MOST_FALSE))
    model = mujoco.MjModel.from_xml_path(str(made.folder / "colliders.xml"))
    assert model.ngeom == sum(row["after"]["pieces"] for row in made.bodies)
    solid = trimesh.load(made.folder / "beaker_00.obj", process=False)
    (first, *_) = [read_session(made.folder / "session.mcap").colliders["beaker"][0]]
    assert farthest(solid.vertices, first.vertices) < 1e-6


@pytest.mark.slow
def test_mujoco_takes_bodies_of_a_tenth_of_a_millimetre(session, tmp_path):
    """All is scaled by 0.005: the cube with an edge of 20 mm has 0.1 mm; a mesh a body is loaded."""
    mujoco = pytest.importorskip("mujoco", reason="the extra `engines` is not installed")
    tiny = {name: MeshData(5e-3 * mesh.vertices, mesh.faces) for name, mesh in session.meshes.items()}
    poses = {name: (5e-3 * track.positions, track.quaternions_xyzw) for name, track in session.tracks.items()}
    small = Session.from_arrays(session.stamps(), poses, tiny)
    made = fix_colliders(small, tmp_path / "made", engine="mujoco", limits=Limits(false=1.0))
    assert mujoco.MjModel.from_xml_path(str(made.folder / "colliders.xml")).nmesh == len(tiny)


@pytest.mark.slow
def test_godot_gets_nodes_that_become_collision_shapes(session, tmp_path):
    """Godot takes nodes with the ending -convcolonly for convex shapes; its physics steps at 60 Hz."""
    made = fix_colliders(session, tmp_path / "made", engine="godot", limits=Limits(false=MOST_FALSE))
    assert made.step_hz == 60.0
    scene = trimesh.load(made.folder / "beaker.glb", force="scene", process=False)
    assert set(scene.geometry) == {f"beaker_{k:02d}-convcolonly" for k in range(made.bodies[0]["after"]["pieces"])}


def test_a_folder_of_something_else_is_not_replaced(session, tmp_path):
    """The folder holds a text of somebody's; ``force`` replaces only folders that this program wrote."""
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
    """Name -> vertices in the axes of the engine."""
    scene = trimesh.load(file, force="scene", process=False)
    return {name: solid.vertices @ importer.T for name, solid in scene.geometry.items()}


def farthest(points, others):
    """How far the points lie from the nearest of others, at most."""
    return np.linalg.norm(points[:, None] - others, axis=2).min(axis=1).max()


@pytest.mark.parametrize(
    ("engine", "convention", "importer", "metres"),
    [
        ("unity", "unity", FLIP_X, 1.0),
        ("unreal", "unreal", SWAP_YZ, 0.01),
        pytest.param("unity", "gltf", FLIP_X, 1.0, marks=pytest.mark.slow),
        pytest.param("godot", "godot", np.eye(3), 1.0, marks=pytest.mark.slow),
    ],
)
def test_written_colliders_land_on_the_users_mesh(engine, convention, importer, metres, tmp_path):
    """``convention`` of the poses; the GLB of the mesh comes out of the same engine, or of any program for glTF.

    ``importer``: by which the engine changes coordinates of a glTF; ``metres`` in its unit of length. Applied to the
    written file it must give the mesh as the engine has it.
    """
    cup = open_cup()
    in_engine = cup.vertices @ (importer.T if convention == "gltf" else np.eye(3))
    for name, solid in {"Cup": cup, "Rod": trimesh.creation.box((0.01, 0.1, 0.01))}.items():
        exported = solid.copy()
        exported.vertices = solid.vertices @ (np.eye(3) if convention == "gltf" else importer.T)
        if convention != "gltf" and np.linalg.det(importer) < 0.0:
            exported.faces = exported.faces[:, ::-1]
        (tmp_path / f"{name}.glb").write_bytes(exported.export(file_type="glb"))
    frames = np.arange(20)
    rows = ["t,x,y,z,zero,one"]
    for frame in frames:
        x, y, z = (np.array([-0.06 + 0.02 * (frame < 10), 0.05, 0.0]) / metres).tolist()
        rows.append(f"{0.02 * frame},{x},{y},{z},0,1")
    (tmp_path / "log.csv").write_text("\n".join(rows))
    (tmp_path / "map.toml").write_text(
        f'convention = "{convention}"\nunits = "{"m" if metres == 1 else "cm"}"\n[time]\ncolumn = "t"\nunit = "s"\n'
        + "".join(
            f'[bodies.{name}]\nposition = {position}\nquaternion_xyzw = ["zero", "zero", "zero", "one"]\n'
            for name, position in (("Cup", ["zero"] * 3), ("Rod", ["x", "y", "z"]))
        )
    )
    meshes = {name: tmp_path / f"{name}.glb" for name in ("Cup", "Rod")}
    session = import_session("csv", tmp_path / "log.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    shipped = fix_colliders(session, tmp_path / "made", engine=engine, limits=Limits(false=1.0))
    placed = placed_by_an_engine(shipped.folder / "Cup.glb", importer)
    (piece,) = [points for name, points in placed.items() if name in ("UCX_Cup_00", "Cup_00-convcolonly")]
    assert farthest(piece, in_engine) < 1e-6
    assert np.abs([piece.min(axis=0) - in_engine.min(axis=0), piece.max(axis=0) - in_engine.max(axis=0)]).max() < 1e-6
    rotated = piece @ np.diag([-1.0, 1.0, -1.0])
    assert farthest(rotated, in_engine) > 0.01  # the half circle by which they were wrong is seen here
    assert ("Cup" in placed) == (engine == "unreal")
    if engine == "unreal":
        assert farthest(in_engine, placed["Cup"]) < 1e-6 and len(placed["Cup"]) == len(in_engine)
    # And the same file comes back into a session as it left it.
    again = read_session(shipped.folder / "session.mcap")
    (canonical,) = again.colliders["Cup"]
    assert farthest(canonical.vertices, session.meshes["Cup"].vertices) < 1e-6


def geoms_in_mujoco(model, body):
    """Corners of the mesh geoms of a body as MuJoCo has them, which moves each mesh to its middle."""
    corners = []
    for geom in np.flatnonzero(model.geom_bodyid == body):
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        rotation = Rotation.from_quat(np.roll(model.geom_quat[geom], -1))
        corners.append(rotation.apply(model.mesh_vert[first : first + count]) + model.geom_pos[geom])
    return np.concatenate(corners)


def test_mujoco_geoms_lie_on_the_users_mesh(tmp_path):
    """Poses with Z up, and an OBJ in the axes of the body, which MuJoCo reads as it is."""
    mujoco = pytest.importorskip("mujoco", reason="the extra `engines` is not installed")
    cup = open_cup()
    cup.export(tmp_path / "Cup.obj")
    trimesh.creation.box((0.01, 0.1, 0.01)).export(tmp_path / "Rod.obj")
    rows = [f"{0.02 * frame},{-0.06 + 0.02 * (frame < 10)},0.05,0,0,1" for frame in range(20)]
    (tmp_path / "log.csv").write_text("\n".join(["t,x,y,z,zero,one", *rows]))
    zero = 'quaternion_xyzw = ["zero", "zero", "zero", "one"]'
    (tmp_path / "map.toml").write_text(
        f'convention = "z-up"\n[time]\ncolumn = "t"\nunit = "s"\n[bodies.Cup]\nposition = ["zero", "zero", "zero"]\n'
        f'{zero}\n[bodies.Rod]\nposition = ["x", "y", "z"]\n{zero}\n'
    )
    meshes = {name: tmp_path / f"{name}.obj" for name in ("Cup", "Rod")}
    session = import_session("csv", tmp_path / "log.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    shipped = fix_colliders(session, tmp_path / "made", engine="mujoco", limits=Limits(false=1.0))
    model = mujoco.MjModel.from_xml_path(str(shipped.folder / "colliders.xml"))
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "Cup")
    corners = geoms_in_mujoco(model, body)
    assert farthest(corners, cup.vertices) < 1e-6
    assert np.abs([corners.min(axis=0) - cup.bounds[0], corners.max(axis=0) - cup.bounds[1]]).max() < 1e-6


def test_names_with_control_characters_are_refused_before_cutting(session, tmp_path, monkeypatch):
    """A body's name holds ESC [2J, which clears a terminal."""

    def no_search(*_):
        raise AssertionError("bodies were cut before the names were refused")

    monkeypatch.setattr("replay.running.collider_files.ColliderSearch", no_search)
    meshes = {"beaker\x1b[2J": session.meshes["beaker"], "rod": session.meshes["rod"]}
    still = np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))
    poses = {name: (np.full((4, 3), np.arange(4)[:, None] * k), still) for k, name in enumerate(meshes)}
    named = Session.from_arrays(np.arange(4) * STEP_NS, poses, meshes)
    with pytest.raises(TradeoffError, match=r"^bodies are called beaker\\x1b\[2J: no engine takes control characters"):
        fix_colliders(named, tmp_path / "made", engine="unity")


@pytest.mark.slow
def test_file_names_are_different_where_capitals_do_not_count(session, tmp_path):
    """`Cup` and `cup` left one file on Windows and macOS, `my cup` and `mycup-0` everywhere."""
    names = ["Cup", "cup", "my cup", "mycup-0", "con", "c" * 300, "..", "杯子"]
    still = np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))
    poses = {name: (np.tile(0.001 * k * np.arange(4)[:, None], 3), still) for k, name in enumerate(names)}
    named = Session.from_arrays(np.arange(4) * STEP_NS, poses, dict.fromkeys(names, session.meshes["cube*"]))
    shipped = fix_colliders(named, tmp_path / "made", engine="mujoco", limits=Limits(false=1.0))
    files = [row["file"] for row in shipped.bodies]
    written = sorted(file.name for file in shipped.folder.glob("*.glb"))
    assert written == sorted(files) and len({file.lower() for file in files}) == len(names)
    assert files[:1] == ["Cup.glb"] and files[3] == "mycup-0.glb" and "con.glb" not in files
    assert max(map(len, files)) <= 110
    text = (shipped.folder / "colliders.xml").read_text("utf-8")
    assert text.count("<body name=") == len(names)


def test_remark_names_bodies_whose_joined_pieces_fill_hollows(unity_fix):
    """The beaker's joined pieces reach 28.04 mm beyond its mesh, or 0 mm, which is no remark; the rod is a hull."""
    cut = {**unity_fix.bodies[0], "how": "sectors by height and angle, joined by motion"}
    cut["after"] = {**cut["after"], "reach_mm": 28.04}
    hull = unity_fix.bodies[1]
    (sentence,) = [line for line in replace(unity_fix, bodies=[cut, hull]).remarks if "hollows" in line]
    assert "(beaker: up to 28 mm beyond the mesh)" in sentence and "rod" not in sentence
    within = {**cut, "after": {**cut["after"], "reach_mm": 0.0}}
    assert not [line for line in replace(unity_fix, bodies=[within, hull]).remarks if "hollows" in line]


@pytest.fixture
def dipped(session):
    """Returns sessions of a rod that goes into the beaker and out, this far from its middle, and touches nothing."""
    axis = int(np.argmax(np.ptp(session.meshes["beaker"].vertices, axis=0)))
    count = 30
    still = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))

    def at(aside):
        rod = np.full((count, 3), aside)
        rod[:, axis] = 0.02 + np.abs(np.linspace(-0.15, 0.15, count))
        poses = {"beaker": (np.zeros((count, 3)), still), "rod": (rod, still)}
        return Session.from_arrays(np.arange(count) * STEP_NS, poses, {name: session.meshes[name] for name in poses})

    return at


@pytest.mark.slow
def test_false_contact_is_mended_where_nothing_ever_touches(dipped):
    """The rod goes into the beaker without touching it: for hulls that is all false contact, for pieces none."""
    fixed = fix_colliders(dipped(0.0), limits=Limits(false=0.2))
    assert fixed.before["false"] == 1.0 and not fixed.after["false"]
    assert fixed.before["missed"] == fixed.after["missed"] == 0


def test_session_in_which_not_even_hulls_touch_is_refused(dipped):
    """The rod passes 5 m from the middle of the beaker."""
    with pytest.raises(TradeoffError, match="nothing touches in this session, not even the hulls"):
        fix_colliders(dipped(5.0))


@pytest.mark.parametrize(
    ("limits", "missed", "sentence"),
    [
        (Limits(false=0.3), 0.25, "Missed contact: 25 %; with a hull a body it is 0 %."),
        (Limits(false=0.3), 0.0, ""),
        (Limits(false=0.3, missed=0.5), 0.25, "Missed contact: 25 %; at most 50 % was asked for."),
    ],
)
def test_remarks_state_missed_contact_that_changed_or_was_limited(unity_fix, limits, missed, sentence):
    """``missed``: fraction of the contact time that the pieces do not report; the hulls report all of it."""
    before, after = unity_fix.before | {"not_reported": 0.0}, unity_fix.after | {"not_reported": missed}
    remarks = replace(unity_fix, limits=limits, before=before, after=after).remarks
    assert [remark for remark in remarks if remark.startswith("Missed contact")] == [sentence] * bool(sentence)
