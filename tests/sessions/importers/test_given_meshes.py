import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.mutants import assert_import_refused
from support.planted_sessions import EXPORTERS, TO_SOURCE, changed

from replay.cli.main import main
from sessions.importers import import_session
from sessions.model.assumption import Origin, Subject, assumptions_of
from sessions.scene_files.scene_meshes import with_scene
from sessions.scene_files.scene_toml import read_scene

VERTICES = np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0.2, 0], [0, 0, 0.1]])  # no two axes alike, so no turn goes unseen
FORMATS = ("obj", "stl", "ply", "glb")
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def mesh_file(folder, kind, vertices, faces):
    """The path of a mesh that is written in a format."""
    path = folder / f"tool.{kind}"
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if kind == "obj":
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
        path.write_text("\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist())]))
    else:
        path.write_bytes(mesh.export(file_type=kind))
    return path


def csv_of_pose(folder, convention, orientation, translation):
    """A CSV of one pose of ``tool`` in the axes of a convention."""
    to_source = TO_SOURCE[convention]
    matrix = changed(np.eye(3), to_source).T
    rotation = Rotation.from_matrix(matrix @ orientation.as_matrix() @ matrix.T)
    numbers = [*changed(translation, to_source)[0], *rotation.as_quat()]
    (folder / "take.csv").write_text("t,x,y,z,qx,qy,qz,qw\n0," + ",".join(map(repr, map(float, numbers))) + "\n")
    (folder / "map.toml").write_text(
        f'convention = "{convention}"\nunits = "m"\n[time]\ncolumn = "t"\nunit = "s"\n[bodies.tool]\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["qx", "qy", "qz", "qw"]\n'
    )
    return folder / "take.csv"


def corners_in_room(session):
    """Triangles of the tool's mesh at its first pose."""
    track, mesh = session.tracks["tool"], session.meshes["tool"]
    placed = Rotation.from_quat(track.quaternions_xyzw[0]).apply(mesh.triangles.reshape(-1, 3)) + track.positions[0]
    return placed.reshape(-1, 3, 3)


def are_same_triangles(result, truth):
    """Whether two sets of triangles are the same ones, in whatever order: their corners, and the sums of these."""
    pairs = [(item.sum(axis=1), item.reshape(-1, 3)) for item in (result, truth)]
    return all(
        np.allclose(np.sort(here, axis=0), np.sort(other, axis=0), rtol=0, atol=1e-7)
        for here, other in zip(*pairs, strict=True)
    )


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("convention", "kind", "exported"),
    [(name, FORMATS[(k + exported) % 4], exported) for exported in (False, True) for k, name in enumerate(TO_SOURCE)],
)
def test_imported_mesh_stands_in_the_room_where_exported(tmp_path, convention, kind, exported):
    """A tool is written in the axes of each convention; after import its corners must be where the room has them.

    ``exported``: by that engine's exporter (EXPORTERS), which changes axes once more, or drawn in its body's axes.
    """
    rotation, position = Rotation.from_euler("xyz", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    axes, export = EXPORTERS.get(convention, ("gltf", lambda x, y, z: (x, y, z))) if exported else ("body", None)
    to_file = TO_SOURCE[convention]
    in_body = changed(VERTICES, to_file)
    in_file = in_body if export is None else changed(in_body, export)
    if exported and convention == "x forward, y up":
        in_file = VERTICES  # a glTF of the room's own axes
    mirrored = np.linalg.det(changed(np.eye(3), to_file)) < 0
    if export is not None and np.linalg.det(changed(np.eye(3), export)) < 0:
        mirrored = not mirrored
    path = mesh_file(tmp_path, kind, in_file, FACES[:, ::-1] if mirrored else FACES)
    source = csv_of_pose(tmp_path, convention=convention, orientation=rotation, translation=position)
    session = import_session("csv", source, mapping=tmp_path / "map.toml", meshes={"tool": path}, mesh_axes=axes)
    truth = (rotation.apply(VERTICES) + position)[FACES]
    assert are_same_triangles(corners_in_room(session), truth)
    assert session.meshes["tool"].volume == pytest.approx(0.3 * 0.2 * 0.1 / 6)  # faces still look outwards
    (axes_row,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
    assert axes_row.origin is Origin.USER and not axes_row.is_open


@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
@pytest.mark.parametrize("convention", ["z-up", "ros", "unity", "unreal", "z up, left-handed"])
def test_given_mesh_rotates_with_poses_as_an_open_guess(tmp_path, convention, kind):
    """The mesh is drawn in the axes of the poses; whether it is, the file does not say."""
    rotation, position = Rotation.from_euler("xyz", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    path = mesh_file(tmp_path, kind, changed(VERTICES, TO_SOURCE[convention]), FACES)
    source = csv_of_pose(tmp_path, convention=convention, orientation=rotation, translation=position)
    session = import_session("csv", source, mapping=tmp_path / "map.toml", meshes={"tool": path})
    truth = (rotation.apply(VERTICES) + position)[FACES]
    assert are_same_triangles(corners_in_room(session), truth)
    (axes_row,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
    assert axes_row.is_open and axes_row.value == "body" and axes_row.files == (f"tool.{kind}",)


def test_axes_are_given_per_body_and_unknown_names_refused(tmp_path):
    """The vertex at x = 0.3 m of the file, as it is in the axes of the session; the later option wins.

    A misspelt body and unknown axes are refused.
    """
    path = mesh_file(tmp_path, "obj", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="unity", orientation=Rotation.identity(), translation=np.zeros(3))
    given = {"mapping": tmp_path / "map.toml", "meshes": {"tool": path}}
    for axes, vertex in (
        (["x-flipped", "tool=gltf"], [0.3, 0, 0]),
        (["tool=x-flipped"], [-0.3, 0, 0]),
        (["tool=z up, x forward"], [0, 0, -0.3]),
    ):
        session = import_session("csv", source, mesh_axes=axes, **given)
        assert session.meshes["tool"].vertices[1].tolist() == vertex
    assert_import_refused("csv", source, "no body 'tol'; did you mean 'tool'", mesh_axes=["tol=gltf"], **given)
    assert_import_refused("csv", source, "no axes of meshes 'sideways': body", mesh_axes="sideways", **given)
    assert_import_refused("csv", source, "no axes of meshes 'sideways': body", mesh_axes="tool=sideways", **given)


def test_mesh_of_a_scene_is_rotated_by_its_axes_key(tmp_path):
    """The longest edge of the tool ends at (0.3, 0, 0) in its file.

    Without the key the axes of the poses are guessed (ros: +X is forward, which is -Z of the room). A y-up mesh in a
    room of ros faces forward along +X too; a mesh in axes of glTF stays as it is.
    """
    mesh_file(tmp_path, "stl", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="ros", orientation=Rotation.identity(), translation=np.zeros(3))
    bare = import_session("csv", source, mapping=tmp_path / "map.toml")
    for key, corner in (
        ("", [0, 0, -0.3]),
        ('mesh_axes = "y-up"\n', [0, 0, -0.3]),
        ('mesh_axes = "gltf"\n', [0.3, 0, 0]),
    ):
        (tmp_path / "scene.toml").write_text(f'[[body]]\nid = "tool"\nmesh = "tool.stl"\n{key}')
        session = with_scene(bare, tmp_path / "scene.toml")
        (axes_row,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
        assert axes_row.is_open == (not key) and axes_row.bodies == ("tool",)
        farthest = max(session.meshes["tool"].vertices.tolist(), key=lambda point: np.abs(point).max())
        assert np.allclose(farthest, corner, rtol=0, atol=1e-7)


def test_mesh_axes_of_a_scene_hold_only_for_its_file(tmp_path):
    """The scene states axes of its tool.stl; those of another file given for the same body stay an open question."""
    mesh_file(tmp_path, "stl", VERTICES, FACES)
    (tmp_path / "other").mkdir()
    other = mesh_file(tmp_path / "other", "stl", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="ros", orientation=Rotation.identity(), translation=np.zeros(3))
    options = {"mapping": tmp_path / "map.toml", "scene_folder": tmp_path}
    for axes, given, is_open in (
        ('mesh_axes = "gltf"\n', {}, False),
        ('mesh_axes = "gltf"\n', {"meshes": {"tool": other}}, True),
        ("", {}, True),
        ("", {"mesh_axes": "z-up"}, False),
    ):
        (tmp_path / "scene.toml").write_text(f'[[body]]\nid = "tool"\nmesh = "tool.stl"\n{axes}')
        scene = read_scene(tmp_path / "scene.toml")
        session = import_session("csv", source, scene=scene, **options, **given)
        (axes_row,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
        assert axes_row.is_open == is_open


@pytest.mark.parametrize(
    ("order", "convention", "message"),
    [
        ("XYZ", "unity", "contradicts convention 'unity', whose Euler order is 'zxy'"),
        ("", "openxr", "nothing says the order of the Euler angles"),
        ("xyz", "godot", r"contradicts .*convention = '\+x right, \+y up, -z forward, right-handed'"),
    ],
)
def test_contradicting_or_missing_euler_order_is_refused(tmp_path, order, convention, message):
    """Unity rotates about z, x and y; a small ``xyz`` is an order about fixed axes, capitals one about moving axes."""
    source = csv_of_euler_angles(tmp_path, order, convention)
    assert_import_refused("csv", source, message, mapping=tmp_path / "map.toml")


def csv_of_euler_angles(folder, order, convention, row=(0, 0, 0)):
    """Writes a.csv, a row of Euler angles in degrees, and map.toml, which states their order and the convention."""
    (folder / "a.csv").write_text("t,x,y,z,rx,ry,rz\n0,0,0,0," + ",".join(map(str, row)) + "\n")
    text = f'order = "{order}"\n' if order else ""
    (folder / "map.toml").write_text(
        f'convention = "{convention}"\nunits = "m"\n[time]\ncolumn = "t"\nunit = "s"\n[bodies.tool]\n'
        f'position = ["x", "y", "z"]\neuler = {{x = "rx", y = "ry", z = "rz"}}\n{text}'
    )
    return folder / "a.csv"


def test_convention_fixes_euler_order_and_unreal_follows_its_formula(tmp_path):
    """Roll, pitch and yaw of 20, -35 and 110 degrees; Unity applies z, x, y, whatever order the mapping states."""
    roll, pitch, yaw = np.radians([20.0, -35.0, 110.0])
    sines, cosines = np.sin(np.array([roll, pitch, yaw]) / 2), np.cos(np.array([roll, pitch, yaw]) / 2)
    (sr, sp, sy), (cr, cp, cy) = sines, cosines
    # FRotator::Quaternion of Unreal's UnrealMath.cpp, in Unreal's own axes.
    own = [
        cr * sp * sy - sr * cp * cy,
        -cr * sp * cy - sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
    matrix = changed(np.eye(3), TO_SOURCE["unreal"]).T
    truth = matrix.T @ Rotation.from_quat(own).as_matrix() @ matrix
    source = csv_of_euler_angles(tmp_path, "", "unreal", (20.0, -35.0, 110.0))
    result = import_session("csv", source, mapping=tmp_path / "map.toml").tracks["tool"]
    assert np.allclose(Rotation.from_quat(result.quaternions_xyzw[0]).as_matrix(), truth, rtol=0, atol=1e-12)
    for order in ("", "zxy", "YXZ"):
        source = csv_of_euler_angles(tmp_path, order, "unity", (20.0, -35.0, 110.0))
        result = import_session("csv", source, mapping=tmp_path / "map.toml").tracks["tool"]
        flip = np.diag([1.0, 1.0, -1.0])
        unity = Rotation.from_euler("zxy", [110.0, 20.0, -35.0], degrees=True).as_matrix()
        assert np.allclose(Rotation.from_quat(result.quaternions_xyzw[0]).as_matrix(), flip @ unity @ flip, atol=1e-12)


def test_lengths_use_the_unit_of_the_convention_by_default(tmp_path):
    """Unreal's unit is the centimetre: 30 in the mapping's metres is written as is, and read as 0.3 m."""
    source = csv_of_pose(
        tmp_path, convention="unreal", orientation=Rotation.identity(), translation=np.array([30.0, 110.0, -70.0])
    )
    mapping = tmp_path / "map.toml"
    mapping.write_text(mapping.read_text().replace('units = "m"\n', ""))
    session = import_session("csv", source, mapping=mapping)
    assert np.allclose(session.tracks["tool"].positions[0], [0.3, 1.1, -0.7], rtol=0, atol=1e-12)
    rows = {row.subject: row for row in assumptions_of(session.facts)}
    assert rows[Subject.LENGTH_UNIT].value == "cm" and rows[Subject.LENGTH_UNIT].origin is Origin.FORMAT
    assert rows[Subject.HANDEDNESS].value == "left" and rows[Subject.POSE_AXES].origin is Origin.USER


@pytest.mark.parametrize(
    ("option", "texts", "message"),
    [
        ("mesh_axes", ("tool=gltf", "tool=z-up"), "--mesh-axes says gltf and z-up of tool"),
        ("mesh_axes", ("gltf", "z-up"), "--mesh-axes says gltf and z-up of the same bodies"),
        ("mesh_units", ("tool=mm", "tool=cm"), "--mesh-units says mm and cm of tool"),
    ],
)
def test_contradicting_choices_of_a_body_are_refused(tmp_path, option, texts, message):
    """An option is given twice: for the tool, or for all bodies."""
    source = csv_of_pose(tmp_path, convention="openxr", orientation=Rotation.identity(), translation=np.zeros(3))
    given = {"meshes": {"tool": mesh_file(tmp_path, "obj", VERTICES, FACES)}, option: texts}
    assert_import_refused("csv", source, message, mapping=tmp_path / "map.toml", **given)


def test_body_that_is_given_two_meshes_is_refused(tmp_path, capsys):
    """--mesh tool=FILE stands twice: a usage error, exit code 2."""
    source = csv_of_pose(tmp_path, convention="openxr", orientation=Rotation.identity(), translation=np.zeros(3))
    mesh = mesh_file(tmp_path, "obj", VERTICES, FACES)
    options = ["--mapping", str(tmp_path / "map.toml"), "--mesh", f"tool={mesh}", "--mesh", f"tool={mesh}"]
    assert main(["import", "csv", str(source), *options, "-o", str(tmp_path / "s.mcap")]) == 2
    assert "tool is given two meshes" in capsys.readouterr().err
