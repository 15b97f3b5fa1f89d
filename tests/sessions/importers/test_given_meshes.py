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
    ("convention", "kind", "is_exported"),
    [
        (convention, FORMATS[(k + is_exported) % len(FORMATS)], is_exported)
        for is_exported in (False, True)
        for k, convention in enumerate(TO_SOURCE)
    ],
)
def test_imported_mesh_stands_in_the_room_where_exported(tmp_path, convention, kind, is_exported):
    """A tetrahedron (VERTICES) with one pose is written in the axes of each convention, by maps of this test's own.

    After import its corners are where the room has them, and its faces look outwards. ``is_exported``: the mesh file is
    written by the engine's exporter, which changes axes once more (EXPORTERS; a glTF has the room's axes); else it is
    in the axes of the poses.
    """
    rotation, position = Rotation.from_euler("xyz", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    unchanged = lambda x, y, z: (x, y, z)  # noqa: E731
    mesh_axes, export = EXPORTERS.get(convention, ("gltf", unchanged)) if is_exported else ("body", unchanged)
    to_engine = TO_SOURCE[convention]
    in_file = changed(changed(VERTICES, to_engine), export)
    if is_exported and convention == "x forward, y up":
        in_file = VERTICES  # no engine has these axes: a glTF in the room's
    mirrored = np.linalg.det(changed(changed(np.eye(3), to_engine), export)) < 0
    path = mesh_file(tmp_path, kind, in_file, FACES[:, ::-1] if mirrored else FACES)
    source = csv_of_pose(tmp_path, convention=convention, orientation=rotation, translation=position)
    session = import_session("csv", source, mapping=tmp_path / "map.toml", meshes={"tool": path}, mesh_axes=mesh_axes)

    expected = (rotation.apply(VERTICES) + position)[FACES]
    assert are_same_triangles(corners_in_room(session), expected)
    # The volume is positive where faces look outwards; three edges of 0.3, 0.2 and 0.1 m meet at right angles.
    assert session.meshes["tool"].volume == pytest.approx(0.3 * 0.2 * 0.1 / 6)
    (axes_row,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
    assert axes_row.origin is Origin.USER
    assert not axes_row.is_open


@pytest.mark.sampled(4)
@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
@pytest.mark.parametrize("convention", ["z-up", "ros", "unity", "unreal", "z up, left-handed"])
def test_given_mesh_rotates_with_poses_as_an_open_guess(tmp_path, convention, kind):
    """A tool's mesh is drawn in the axes of the poses, those of ``convention``; the import guesses so, and is right.

    The file does not say it, so that the guess is an open question about this file.
    """
    rotation, position = Rotation.from_euler("xyz", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    path = mesh_file(tmp_path, kind, changed(VERTICES, TO_SOURCE[convention]), FACES)
    source = csv_of_pose(tmp_path, convention=convention, orientation=rotation, translation=position)
    session = import_session("csv", source, mapping=tmp_path / "map.toml", meshes={"tool": path})
    expected = (rotation.apply(VERTICES) + position)[FACES]
    assert are_same_triangles(corners_in_room(session), expected)
    (mesh_axes,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
    assert mesh_axes.is_open
    assert mesh_axes.value == "body"
    assert mesh_axes.files == (f"tool.{kind}",)


@pytest.mark.parametrize(
    ("mesh_axes", "vertex_in_session"),
    [
        # The poses are Unity's. Its glTF exporter turns the sign of x, which "x-flipped" takes back.
        pytest.param(["tool=x-flipped"], [-0.3, 0, 0], id="x-flipped"),
        pytest.param(["tool=z up, x forward"], [0, 0, -0.3], id="x is forward, which is -z"),
        pytest.param(["x-flipped", "tool=gltf"], [0.3, 0, 0], id="of the tool before of all"),
    ],
)
def test_axes_of_meshes_are_given_per_body(tmp_path, mesh_axes, vertex_in_session):
    """A corner of the tool's mesh file is at x = 0.3 m; a choice for the tool wins over one for all bodies."""
    path = mesh_file(tmp_path, "obj", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="unity", orientation=Rotation.identity(), translation=np.zeros(3))
    session = import_session("csv", source, mapping=tmp_path / "map.toml", meshes={"tool": path}, mesh_axes=mesh_axes)
    assert VERTICES[1].tolist() == [0.3, 0, 0]
    assert session.meshes["tool"].vertices[1].tolist() == vertex_in_session


def test_axes_for_unknown_bodies_and_of_unknown_names_are_refused(tmp_path):
    """The body is misspelt, or no axes are called so: the error ends in those that there are."""
    path = mesh_file(tmp_path, "obj", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="unity", orientation=Rotation.identity(), translation=np.zeros(3))
    options = {"mapping": tmp_path / "map.toml", "meshes": {"tool": path}}
    assert_import_refused("csv", source, "no body 'tol'; did you mean 'tool'", mesh_axes=["tol=gltf"], **options)
    assert_import_refused("csv", source, "no axes of meshes 'sideways': body", mesh_axes="sideways", **options)
    assert_import_refused("csv", source, "no axes of meshes 'sideways': body", mesh_axes="tool=sideways", **options)


@pytest.mark.parametrize(
    ("key", "corner_in_room", "is_open"),
    [
        # ROS has x forward, which is -z of the room.
        pytest.param("", [0, 0, -0.3], True, id="guessed to be those of the poses"),
        pytest.param('mesh_axes = "y-up"\n', [0, 0, -0.3], False, id="y up and x forward too"),
        pytest.param('mesh_axes = "gltf"\n', [0.3, 0, 0], False, id="the room's own"),
    ],
)
def test_mesh_of_a_scene_is_rotated_by_its_axes_key(tmp_path, key, corner_in_room, is_open):
    """The tool's file has its farthest corner at (0.3, 0, 0); poses are in axes of ROS and do not rotate it.

    Without the scene's key ``mesh_axes`` the axes of the poses are guessed, which stays an open question.
    """
    mesh_file(tmp_path, "stl", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="ros", orientation=Rotation.identity(), translation=np.zeros(3))
    without_meshes = import_session("csv", source, mapping=tmp_path / "map.toml")
    (tmp_path / "scene.toml").write_text(f'[[body]]\nid = "tool"\nmesh = "tool.stl"\n{key}')
    session = with_scene(without_meshes, tmp_path / "scene.toml")
    farthest = max(session.meshes["tool"].vertices.tolist(), key=lambda point: np.abs(point).max())
    assert np.allclose(farthest, corner_in_room, rtol=0, atol=1e-7)
    (mesh_axes,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
    assert mesh_axes.is_open == is_open
    assert mesh_axes.bodies == ("tool",)


@pytest.mark.parametrize(
    ("scene_key", "option", "given_file", "is_open"),
    [
        pytest.param('mesh_axes = "gltf"\n', {}, "", False, id="the scene says it of its file"),
        pytest.param('mesh_axes = "gltf"\n', {}, "other/tool.stl", True, id="another file is given"),
        pytest.param("", {}, "", True, id="nobody says it"),
        pytest.param("", {"mesh_axes": "z-up"}, "", False, id="an option says it"),
    ],
)
def test_mesh_axes_of_a_scene_hold_only_for_its_file(tmp_path, scene_key, option, given_file, is_open):
    """The scene names tool.stl for the body "tool"; another file given for that body takes its place.

    The scene's ``mesh_axes`` are about the scene's file: the axes of the other one stay an open question.
    """
    mesh_file(tmp_path, "stl", VERTICES, FACES)
    (tmp_path / "other").mkdir()
    mesh_file(tmp_path / "other", "stl", VERTICES, FACES)
    source = csv_of_pose(tmp_path, convention="ros", orientation=Rotation.identity(), translation=np.zeros(3))
    (tmp_path / "scene.toml").write_text(f'[[body]]\nid = "tool"\nmesh = "tool.stl"\n{scene_key}')
    meshes = {"meshes": {"tool": tmp_path / given_file}} if given_file else {}
    session = import_session(
        "csv",
        source,
        mapping=tmp_path / "map.toml",
        scene=read_scene(tmp_path / "scene.toml"),
        scene_folder=tmp_path,
        **option,
        **meshes,
    )
    (mesh_axes,) = [row for row in assumptions_of(session.facts) if row.subject is Subject.MESH_AXES]
    assert mesh_axes.is_open == is_open


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


def csv_of_euler_angles(folder, order, convention, angles=(0, 0, 0)):
    """Writes a.csv, a row of angles about x, y, z in degrees, and map.toml, which states their order and convention."""
    (folder / "a.csv").write_text("t,x,y,z,rx,ry,rz\n0,0,0,0," + ",".join(map(str, angles)) + "\n")
    text = f'order = "{order}"\n' if order else ""
    (folder / "map.toml").write_text(
        f'convention = "{convention}"\nunits = "m"\n[time]\ncolumn = "t"\nunit = "s"\n[bodies.tool]\n'
        f'position = ["x", "y", "z"]\neuler = {{x = "rx", y = "ry", z = "rz"}}\n{text}'
    )
    return folder / "a.csv"


def first_rotation(session):
    """The rotation matrix of the tool's first pose."""
    return Rotation.from_quat(session.tracks["tool"].quaternions_xyzw[0]).as_matrix()


def test_angles_of_unreal_follow_its_own_formula(tmp_path):
    """Roll, pitch and yaw of 20, -35 and 110 degrees by the formula of Unreal's source, turned into the room's axes."""
    angles = (20.0, -35.0, 110.0)
    (sr, sp, sy), (cr, cp, cy) = np.sin(np.radians(angles) / 2), np.cos(np.radians(angles) / 2)
    # FRotator::Quaternion of Unreal's UnrealMath.cpp, in Unreal's own axes.
    quaternion_in_unreal = [
        cr * sp * sy - sr * cp * cy,
        -cr * sp * cy - sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
    unreal_from_room = changed(np.eye(3), TO_SOURCE["unreal"]).T
    expected = unreal_from_room.T @ Rotation.from_quat(quaternion_in_unreal).as_matrix() @ unreal_from_room
    source = csv_of_euler_angles(tmp_path, order="", convention="unreal", angles=angles)
    session = import_session("csv", source, mapping=tmp_path / "map.toml")
    assert np.allclose(first_rotation(session), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "order", [pytest.param("", id="no order"), pytest.param("zxy", id="fixed axes"), pytest.param("YXZ", id="own axes")]
)
def test_angles_of_unity_are_applied_about_z_x_y(tmp_path, order):
    """Unity turns about the fixed z, x, y, which is about the body's own y, x, z; a mapping may say either, or nothing.

    Angles are 20, -35 and 110 degrees about x, y, z; Unity's z has the other sign than the room's.
    """
    source = csv_of_euler_angles(tmp_path, order=order, convention="unity", angles=(20.0, -35.0, 110.0))
    session = import_session("csv", source, mapping=tmp_path / "map.toml")
    in_unity = Rotation.from_euler("zxy", [110.0, 20.0, -35.0], degrees=True).as_matrix()
    room_from_unity = np.diag([1.0, 1.0, -1.0])
    assert np.allclose(first_rotation(session), room_from_unity @ in_unity @ room_from_unity, atol=1e-12)


def test_lengths_use_the_unit_of_the_convention_by_default(tmp_path):
    """The mapping names Unreal's axes and no unit: 30, 110, -70 are centimetres, because Unreal's lengths are.

    That the axes are Unreal's is the user's word, and with it that they are left-handed.
    """
    source = csv_of_pose(
        tmp_path, convention="unreal", orientation=Rotation.identity(), translation=np.array([30.0, 110.0, -70.0])
    )
    mapping = tmp_path / "map.toml"
    mapping.write_text(mapping.read_text().replace('units = "m"\n', ""))
    session = import_session("csv", source, mapping=mapping)
    assert np.allclose(session.tracks["tool"].positions[0], [0.3, 1.1, -0.7], rtol=0, atol=1e-12)
    rows = {row.subject: row for row in assumptions_of(session.facts)}
    assert rows[Subject.LENGTH_UNIT].value == "cm"
    assert rows[Subject.LENGTH_UNIT].origin is Origin.FORMAT
    assert rows[Subject.POSE_AXES].origin is Origin.USER
    assert rows[Subject.HANDEDNESS].value == "left"


@pytest.mark.parametrize(
    ("option", "values", "message"),
    [
        ("mesh_axes", ("tool=gltf", "tool=z-up"), "--mesh-axes says gltf and z-up of tool"),
        ("mesh_axes", ("gltf", "z-up"), "--mesh-axes says gltf and z-up of the same bodies"),
        ("mesh_units", ("tool=mm", "tool=cm"), "--mesh-units says mm and cm of tool"),
    ],
)
def test_contradicting_choices_of_a_body_are_refused(tmp_path, option, values, message):
    """The option stands twice with different values: for the body "tool" (BODY=VALUE), or for all bodies (VALUE)."""
    source = csv_of_pose(tmp_path, convention="openxr", orientation=Rotation.identity(), translation=np.zeros(3))
    meshes = {"tool": mesh_file(tmp_path, "obj", VERTICES, FACES)}
    assert_import_refused("csv", source, message, mapping=tmp_path / "map.toml", meshes=meshes, **{option: values})


def test_body_that_is_given_two_meshes_is_refused(tmp_path, capsys):
    """--mesh tool=FILE stands twice: a usage error, exit code 2."""
    source = csv_of_pose(tmp_path, convention="openxr", orientation=Rotation.identity(), translation=np.zeros(3))
    mesh = mesh_file(tmp_path, "obj", VERTICES, FACES)
    options = ["--mapping", str(tmp_path / "map.toml"), "--mesh", f"tool={mesh}", "--mesh", f"tool={mesh}"]
    assert main(["import", "csv", str(source), *options, "-o", str(tmp_path / "s.mcap")]) == 2
    assert "tool is given two meshes" in capsys.readouterr().err
