"""MJCF beside MuJoCo's own values: bodies, surfaces, poses, excluded pairs; and files that a scene may not read."""

import os

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.errors import SceneSourceError, SessionError
from sessions.importers import import_session
from sessions.importers.ledger import ledger_of
from sessions.model.assumption import Origin
from sessions.scene_formats.joint_motion import read_joint_motion
from sessions.scene_formats.scene_source import Surface, read_scene_source, surface_assumptions

mujoco = pytest.importorskip("mujoco")

ARM = """
<mujoco model="arm">
  <compiler angle="degree" meshdir="parts"/>
  <include file="defaults.xml"/>
  <asset><mesh name="cup" file="cup.obj" scale="0.5 0.5 0.5"/></asset>
  <contact><exclude body1="hand" body2="cup"/></contact>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="table" pos="0 0 0.4"><geom type="box" size="0.5 0.3 0.02" euler="0 0 10"/></body>
    <body name="arm" pos="0.1 0 1" euler="0 30 0" childclass="link">
      <joint name="shoulder" axis="0 1 0" range="-90 90"/>
      <geom fromto="0 0 0 0.2 0 0.1"/>
      <body name="hand" pos="0.25 0 0.1" quat="0.9 0.1 0.2 0.3">
        <joint name="wrist" axis="1 0 0"/>
        <geom type="ellipsoid" size="0.03 0.02 0.01" pos="0.01 0.02 0.03" euler="5 6 7"/>
        <geom type="cylinder" size="0.01 0.03"/>
        <site name="tip"/>
      </body>
    </body>
    <body name="cup" pos="1 2 3"><freejoint/><geom type="mesh" mesh="cup" margin="0.002"/></body>
    <body name="ghost"><joint/><geom type="sphere" size="0.1" contype="0" conaffinity="0" mass="1"/></body>
  </worldbody>
</mujoco>
"""
DEFAULTS = """
<mujoco><default><default class="link"><geom type="capsule" size="0.02" margin="0.001"/></default></default></mujoco>
"""
CUP = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.1 0.1 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 5\nf 3 4 5\nf 4 2 5\n"
"""A mesh in OBJ: a tetrahedron with legs of 1 along the axes, whose slanted side is dented to a point inside."""


@pytest.fixture(autouse=True)
def few_faces(monkeypatch):
    """Round shapes with 400 faces in place of 4,000: a hull takes a tenth of the time, and corners lie as exactly."""
    monkeypatch.setattr("sessions.scene_formats.mjcf.ROUND_FACES", 400)


@pytest.fixture
def arm_model(tmp_path):
    """The model ARM, beside its defaults and a mesh: table, arm, hand, cup and a ghost, which collides with nothing."""
    folder = tmp_path / "scene"
    (folder / "parts").mkdir(parents=True)
    (folder / "arm.xml").write_text(ARM)
    (folder / "defaults.xml").write_text(DEFAULTS)
    (folder / "parts" / "cup.obj").write_text(CUP)
    return folder / "arm.xml"


@pytest.fixture
def arm_of_mujoco(arm_model):
    """The model of the arm and its poses, as MuJoCo itself has them."""
    model = mujoco.MjModel.from_xml_path(str(arm_model))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def test_mjcf_poses_and_masses_agree_with_mujoco(arm_model, arm_of_mujoco):
    """Poses of the four bodies that collide, to 1e-9 m, and their masses. The table, without a joint, does not move."""
    bodies = read_scene_source(arm_model).bodies
    model, data = arm_of_mujoco
    assert [*bodies] == ["table", "arm", "hand", "cup"]
    for name, body in bodies.items():
        expected = data.body(name)
        assert np.abs(body.pose[:3, 3] - expected.xpos).max() <= 1e-9, name
        assert np.abs(body.pose[:3, :3] - expected.xmat.reshape(3, 3)).max() <= 1e-9, name
        assert body.mass == model.body(name).mass[0], name
    assert bodies["arm"].margin == 0.001  # of its class in the defaults
    assert bodies["cup"].margin == 0.002
    assert [name for name, body in bodies.items() if not body.moves] == ["table"]


def test_mjcf_mesh_stands_where_mujoco_has_it(arm_model, arm_of_mujoco):
    """Corners of the cup, the model's only mesh, in the world: to 1e-9 m, as both start from MuJoCo's, of float32.

    Its box is to 1e-7 m that of the file: legs of 1 m, which the model scales by 0.5. The collider is the hull, as in
    MuJoCo; it fills the dent in the cup's slanted side, and has more than 1.1 times its volume.
    """
    cup = read_scene_source(arm_model).bodies["cup"]
    model, data = arm_of_mujoco
    geom = model.body("cup").geomadr[0]
    expected = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    assert np.abs(cup.mesh.vertices @ cup.pose[:3, :3].T + cup.pose[:3, 3] - expected).max() <= 1e-9
    assert np.abs(cup.mesh.bounds - [[0, 0, 0], [0.5, 0.5, 0.5]]).max() < 1e-7
    (hull,) = cup.colliders
    assert hull.volume > 1.1 * cup.mesh.volume


def rotation_of(quaternion_wxyz):
    """The matrix of a quaternion of MuJoCo, w first."""
    return Rotation.from_quat(quaternion_wxyz[[1, 2, 3, 0]]).as_matrix()


def test_mjcf_ellipsoid_and_cylinder_have_mujocos_sizes(arm_model, arm_of_mujoco):
    """Every vertex of the hand's ellipsoid lies on MuJoCo's, and its cylinder ends at MuJoCo's half height."""
    ellipsoid, cylinder = read_scene_source(arm_model).bodies["hand"].colliders
    model, _ = arm_of_mujoco
    first = int(model.body("hand").geomadr[0])
    second = first + 1
    in_half_axes = (ellipsoid.vertices - model.geom_pos[first]) @ rotation_of(model.geom_quat[first])
    assert np.abs(np.linalg.norm(in_half_axes / model.geom_size[first], axis=1) - 1.0).max() <= 1e-9
    _, half_height, _ = model.geom_size[second]
    assert cylinder.bounds[1, 2] == pytest.approx(half_height, abs=1e-12)


def test_mjcf_capsule_lies_about_mujocos_segment(arm_model, arm_of_mujoco):
    """Every vertex of the arm's capsule is MuJoCo's radius from the segment along the geom's z."""
    vertices = read_scene_source(arm_model).bodies["arm"].mesh.vertices
    model, _ = arm_of_mujoco
    geom = model.body("arm").geomadr[0]
    radius, half_length, _ = model.geom_size[geom]
    middle, to_end = model.geom_pos[geom], rotation_of(model.geom_quat[geom])[:, 2] * half_length
    along = np.clip((vertices - middle) @ to_end / half_length**2, -1, 1)
    from_segment = np.linalg.norm(vertices - middle - along[:, None] * to_end, axis=1)
    assert np.abs(from_segment - radius).max() <= 1e-9


def test_mjcf_parent_and_excluded_pairs_never_meet(arm_model):
    """The hand is a child of the arm, and the file excludes hand and cup: these two pairs alone are excluded."""
    excluded = read_scene_source(arm_model).excluded
    assert {frozenset(pair) for pair in excluded} == {frozenset(("arm", "hand")), frozenset(("hand", "cup"))}


def test_unsupported_mjcf_parts_are_listed(arm_model):
    """In the model of an arm the endless floor is not taken, nor the body ghost, of which nothing collides."""
    left_out = read_scene_source(arm_model).left_out
    assert any("endless plane of body 'world'" in sentence for sentence in left_out)
    assert any("nothing collides: ghost" in sentence for sentence in left_out)


def test_soft_bodies_and_height_fields_are_named(tmp_path):
    """A ground with a height field and a box, and a cloth of 3 x 3 points: field and cloth are listed as not taken."""
    path = tmp_path / "soft.xml"
    path.write_text(
        '<mujoco><asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody>'
        '<body name="ground"><geom type="hfield" hfield="h"/><geom type="box" size="1 1 1"/></body>'
        '<flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" dim="2" radius="0.01" mass="1"/>'
        "</worldbody></mujoco>"
    )
    left_out = " ".join(read_scene_source(path).left_out)
    assert "a height field of body 'ground'" in left_out
    assert "soft bodies (flex): 1" in left_out


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        pytest.param(b"", "empty; save it again", id="empty"),
        pytest.param(b"<!DOCTYPE html>", "an HTML page, as a share link", id="a page"),
    ],
)
def test_joint_motion_of_another_kind_is_named(tmp_path, content, kind):
    """A file called arm.npz, for joint values over time, that is no file of NumPy."""
    (tmp_path / "arm.npz").write_bytes(content)
    with pytest.raises(SceneSourceError, match=f"joint motion .*arm.npz is {kind}"):
        read_joint_motion(tmp_path / "arm.npz", model=None)


Z_UP_TO_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""The rotation from MuJoCo's axes, +Z up, to those of a session, in which +Y is up: (x, y, z) is (x, z, -y)."""

MOTION_TIMES_S = 2.5 + 0.02 * np.arange(5)
"""Times of five frames 20 ms apart."""


def assert_poses_of_forward_kinematics(session, model, joint_values):
    """Fails unless the bodies of a session stand, to 1e-9 m, where MuJoCo places them by these joint values a frame."""
    assert session.frames.stamp_ns.tolist() == [20_000_000 * frame for frame in range(5)]
    data = mujoco.MjData(model)
    for frame in range(5):
        data.qpos[:] = joint_values[frame]
        mujoco.mj_kinematics(model, data)
        for body, name in enumerate(session.names):
            expected_rotation = Z_UP_TO_Y_UP @ data.body(name).xmat.reshape(3, 3)
            rotation = Rotation.from_quat(session.frames.quaternion_xyzw[frame, body]).as_matrix()
            assert np.abs(rotation - expected_rotation).max() <= 1e-9
            assert np.abs(session.frames.position[frame, body] - Z_UP_TO_Y_UP @ data.body(name).xpos).max() <= 1e-9
    assert session.scene.body("table").fixed.position == pytest.approx((0, 0.4, 0))


def test_joint_motion_in_npz_becomes_poses_of_forward_kinematics(arm_model):
    """Five frames of random values: two joints of the robot, the cup's pose, the ghost's joint, an array each.

    The table has no joint: it is fixed.
    """
    rng = np.random.default_rng(2)
    cup = np.concatenate([rng.normal(size=(5, 3)), Rotation.random(5, random_state=1).as_quat()], axis=1)
    arrays = {"robot": rng.normal(size=(5, 2)), "cup": cup, "ghost": rng.normal(size=(5, 1))}
    motion = arm_model.with_name("arm.npz")
    np.savez(motion, time=MOTION_TIMES_S, **arrays)
    session = import_session("mjcf", arm_model, motion=motion)
    model = mujoco.MjModel.from_xml_path(str(arm_model))
    assert_poses_of_forward_kinematics(session, model, np.concatenate([*arrays.values()], axis=1))


def test_joint_motion_in_csv_becomes_poses_of_forward_kinematics(arm_model):
    """Five frames of random values of four joints; the CSV names the joints in another order than the model.

    The cup slides here, and the ghost's joint has a name.
    """
    text = arm_model.read_text().replace("<freejoint/>", '<joint name="slide" type="slide"/>')
    arm_model.write_text(text.replace("<joint/>", '<joint name="spin"/>'))
    joint_values = np.random.default_rng(2).normal(size=(5, 4))
    lines = ["time,spin,slide,wrist,shoulder"]
    for time, (shoulder, wrist, slide, spin) in zip(MOTION_TIMES_S.tolist(), joint_values.tolist(), strict=True):
        lines.append(f"{time!r},{spin!r},{slide!r},{wrist!r},{shoulder!r}")
    motion = arm_model.with_name("arm.csv")
    motion.write_text("\n".join(lines))
    session = import_session("mjcf", arm_model, motion=motion)
    assert_poses_of_forward_kinematics(session, mujoco.MjModel.from_xml_path(str(arm_model)), joint_values)


def test_pose_of_seven_numbers_moves_three_slides_and_three_hinges(arm_model):
    """The cup has six joints in place of a free one; its motion is a position and a quaternion, w first, a frame.

    Four frames at the origin with random rotations: those of the session are the same, with +Y up.
    """
    joints = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    joints += "".join(f'<joint axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    arm_model.write_text(arm_model.read_text().replace("<freejoint/>", joints).replace("<joint/>", ""))
    rotations = Rotation.random(4, random_state=3)
    quaternions_wxyz = rotations.as_quat()[:, [3, 0, 1, 2]]
    poses = np.concatenate([np.zeros((4, 3)), quaternions_wxyz], axis=1)
    np.savez(arm_model.with_suffix(".npz"), time=np.arange(4.0), robot=np.zeros((4, 2)), cup=poses)
    session = import_session("mjcf", arm_model)
    cup = session.names.index("cup")
    actual = Rotation.from_quat(session.frames.quaternion_xyzw[:, cup]).as_matrix()
    assert np.abs(actual - Z_UP_TO_Y_UP @ rotations.as_matrix()).max() <= 1e-9


@pytest.fixture
def drawn_boxes(tmp_path):
    """A model of two balls of radius 0.1 that collide; on each a box is drawn.

    The box of "part", of half edge 0.1, sticks out of its ball; that of "bone", of 0.05, is inside its ball.
    """
    path = tmp_path / "links.xml"
    drawn = '<geom type="box" size="{0} {0} {0}" contype="0" conaffinity="0" group="1"/>'
    solid = '<geom type="sphere" size="0.1" group="3"/>'
    part, bone = (
        f'<body name="{name}">{drawn.format(half_edge)}{solid}</body>'
        for name, half_edge in (("part", 0.1), ("bone", 0.05))
    )
    path.write_text(f"<mujoco><worldbody>{part}{bone}</worldbody></mujoco>")
    return path


@pytest.mark.parametrize(
    ("surface", "drawn", "origin"),
    [
        pytest.param(Surface.AUTO, {"part"}, Origin.GUESS, id="guessed"),
        pytest.param(Surface.DRAWN, {"part", "bone"}, Origin.USER, id="drawn by request"),
        pytest.param(Surface.COLLIDING, set(), Origin.USER, id="colliding by request"),
    ],
)
def test_drawn_geom_is_the_surface_unless_inside_the_collider(drawn_boxes, surface, drawn, origin):
    """``drawn``: bodies whose surface is the drawn box, of 12 faces, and not the ball.

    The assumptions of the import list both kinds, and whether they are a guess or the user's.
    """
    scene = read_scene_source(drawn_boxes, surface=surface)
    faces_of_a_box = 12
    assert {name for name, body in scene.bodies.items() if len(body.mesh.faces) == faces_of_a_box} == drawn
    assumptions = surface_assumptions(scene, surface)
    assert {assumption.origin for assumption in assumptions} == {origin}
    bodies_of_surface = {assumption.value: {*assumption.bodies} for assumption in assumptions}
    expected = {"drawn": drawn, "colliding": {"part", "bone"} - drawn}
    assert bodies_of_surface == {value: bodies for value, bodies in expected.items() if bodies}


BOMB = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><mujoco model="&b;"/>'
BALL = '<body name="b"><geom type="sphere" size="1"/></body>'
WORLD_END = "</worldbody></mujoco>"
COPIES = '<replicate count="100" offset="1 0 0">' * 4
"""Four replications within each other: 100^4 copies."""


@pytest.mark.parametrize(
    ("name", "text", "refusal"),
    [
        pytest.param("bomb.xml", BOMB, "declares a document type or entities", id="entities"),
        pytest.param("wide.xml", BOMB.encode("utf-16"), "no XML in UTF-8", id="UTF-16"),
        pytest.param(
            "circle.xml", '<mujoco><include file="circle.xml"/></mujoco>', "includes itself", id="includes itself"
        ),
        pytest.param(
            "up.xml",
            '<mujoco><include file="../secret.xml"/></mujoco>',
            "'../secret.xml' lies outside",
            id="includes a file above",
        ),
        pytest.param(
            "abs.xml", '<mujoco><asset><mesh file="{secret}"/></asset></mujoco>', "lies outside", id="absolute path"
        ),
        pytest.param(
            "dir.xml",
            '<mujoco><compiler meshdir=".."/><asset><mesh file="secret.obj"/></asset></mujoco>',
            "lies outside",
            id="folder of meshes above",
        ),
        pytest.param(
            "skin.xml", '<mujoco><asset><skin file="../secret.obj"/></asset></mujoco>', "lies outside", id="skin above"
        ),
        pytest.param(
            "gone.xml",
            '<mujoco><asset><mesh file="../gone.obj"/></asset></mujoco>',
            "lies outside",
            id="missing file above",
        ),
        pytest.param(
            "link.xml",
            '<mujoco><asset><mesh file="link.obj"/></asset></mujoco>',
            "lies outside",
            id="link to a file above",
        ),
        pytest.param(
            "large.xml",
            '<mujoco><asset><mesh file="large.stl"/></asset></mujoco>',
            "has 1,000 MB, more than 256 MB",
            id="file of 1 GB",
        ),
        pytest.param(
            "deep.xml",
            "<mujoco>" + "<body>" * 200 + "</body>" * 200 + "</mujoco>",
            "more than 100 elements within",
            id="200 elements within each other",
        ),
        pytest.param(
            "strip.xml",
            '<mujoco><compiler strippath="true" meshdir=".."/><asset><mesh file="a/b/secret.obj"/></asset></mujoco>',
            "lies outside",
            id="folder of meshes above, paths stripped",
        ),
        pytest.param(
            "attach.xml",
            '<mujoco><asset><model name="m" file="attach.xml"/></asset></mujoco>',
            "includes itself",
            id="attaches itself",
        ),
        pytest.param(
            "part.xml",
            '<mujoco><asset><model name="m" file="inner.xml"/></asset></mujoco>',
            "lies outside",
            id="attached model with a mesh above",
        ),
        pytest.param(
            "laughs.xml",
            "<mujoco><worldbody>" + COPIES + BALL + "</replicate>" * 4 + WORLD_END,
            "asks for more than",
            id="10^8 copies",
        ),
        pytest.param(
            "echo.xml",
            '<mujoco><asset><model name="m" file="ball.xml"/></asset><worldbody>' + '<replicate count="99999">'
            '<attach model="m" body="b" prefix="c"/></replicate>' + WORLD_END,
            "asks for more than",
            id="99,999 attached models",
        ),
        pytest.param(
            "cloth.xml",
            '<mujoco><worldbody><flexcomp name="c" type="grid" count="999 999 9"/>' + WORLD_END,
            "asks for",
            id="cloth of 9 million points",
        ),
        pytest.param(
            "hills.xml",
            '<mujoco><asset><hfield name="h" nrow="99999" ncol="99999"/></asset></mujoco>',
            "asks for more",
            id="height field of 10^10 points",
        ),
        pytest.param("loop.xml", '<mujoco><include file="loop"/></mujoco>', "a link to itself", id="link to itself"),
        pytest.param(
            "long.xml",
            '<mujoco><include file="' + "a" * 5000 + '"/></mujoco>',
            "or too long",
            id="5000 letters",
        ),
        pytest.param("empty.xml", "<mujoco/>", "no body that collides", id="empty model"),
        pytest.param("fragment.xml", "<mujocoinclude/>", "a part that MJCF files include", id="part of a model"),
        pytest.param(
            "user.xml",
            '<mujoco><size nuser_geom="1000000000"/><worldbody>' + BALL + WORLD_END,
            "asks for more than",
            id="10^9 numbers a geom",
        ),
        pytest.param("cut.xml", "<mujoco><worldbody>", "no readable XML", id="text that ends early"),
        pytest.param("other.xml", "<scene/>", "begins with <scene>", id="other XML"),
        pytest.param(
            "wrong.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>", "MuJoCo does not read", id="no size"
        ),
    ],
)
def test_hostile_mjcf_file_is_refused_with_the_reason(tmp_path, name, text, refusal):
    """Files outside the scene's folder, endless inclusion, sizes that would fill the memory, and what is no model.

    secret.xml and secret.obj stand above the folder; {secret} is the path of the latter.
    """
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    (tmp_path / "secret.obj").write_text(CUP)
    (folder / "link.obj").symlink_to(tmp_path / "secret.obj")
    (folder / "loop").symlink_to(folder / "loop")
    (folder / "ball.xml").write_text(f"<mujoco><worldbody>{BALL}<geom type='sphere' size='1'/>{WORLD_END}")
    (folder / "inner.xml").write_text(
        '<mujoco><compiler meshdir=".."/><asset><mesh file="secret.obj"/></asset></mujoco>'
    )
    with (folder / "large.stl").open("wb") as large:
        os.truncate(large.fileno(), 1_000_000_000)
    path = folder / name
    data = text if isinstance(text, bytes) else text.replace("{secret}", str(tmp_path / "secret.obj")).encode()
    path.write_bytes(data)
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(path)


def test_files_above_the_model_are_read_below_the_named_root(tmp_path):
    """The model is in a folder "models" and its mesh beside that folder: read only where their parent is the root.

    The refusal says that a root can be named.
    """
    (tmp_path / "models").mkdir()
    (tmp_path / "cup.obj").write_text(CUP)
    path = tmp_path / "models" / "cup.xml"
    path.write_text(
        '<mujoco><asset><mesh name="c" file="../cup.obj"/></asset><worldbody><body name="cup">'
        '<geom type="mesh" mesh="c"/></body></worldbody></mujoco>'
    )
    with pytest.raises(SceneSourceError, match=r"outside .*name the folder that holds all of it: root"):
        read_scene_source(path)
    assert [*read_scene_source(path, root=tmp_path).bodies] == ["cup"]


def test_folders_of_assets_are_stripped_where_the_model_says(tmp_path):
    """The mesh is named /lab/cup.obj and read as cup.obj, beside the model: strippath."""
    (tmp_path / "cup.obj").write_text(CUP)
    path = tmp_path / "scene.xml"
    path.write_text(
        '<mujoco><compiler strippath="true"/><asset><mesh name="cup" file="/lab/cup.obj"/></asset><worldbody>'
        '<body name="cup"><joint/><geom type="mesh" mesh="cup"/></body></worldbody></mujoco>'
    )
    assert [*read_scene_source(path).bodies] == ["cup"]


def test_nested_includes_are_limited_in_number(tmp_path):
    """20 files; each but the last includes the next one twice: 2^19 readings of the last, half a million.

    200,000 are allowed: the model is refused before it is read so often.
    """
    files = 20
    for number in range(files):
        includes = f'<include file="{number + 1}.xml"/>' * 2
        content = includes if number < files - 1 else BALL
        (tmp_path / f"{number}.xml").write_text(f"<mujoco>{content}</mujoco>")
    with pytest.raises(SceneSourceError, match="asks for more than 200,000 parts"):
        read_scene_source(tmp_path / "0.xml")


@pytest.mark.parametrize("limit", ["MOST_BODIES", "MOST_FACES"])
def test_scene_that_places_too_much_is_refused(tmp_path, monkeypatch, limit):
    """A replication places four balls; at most three bodies, or three faces, may be placed."""
    monkeypatch.setattr(f"sessions.scene_formats.scene_source.{limit}", 3)
    path = tmp_path / "balls.xml"
    path.write_text(f'<mujoco><worldbody><replicate count="4" offset="1 0 0">{BALL}</replicate>{WORLD_END}')
    with pytest.raises(SceneSourceError, match="the scene places more than"):
        read_scene_source(path)


def test_mjcf_attached_model_adds_its_bodies_with_prefix(tmp_path):
    """A model attaches the body b of another file, a ball, with the prefix "x-"."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "ball.xml").write_text(f"<mujoco><worldbody>{BALL}{WORLD_END}")
    path = tmp_path / "two.xml"
    path.write_text(
        '<mujoco><asset><model name="m" file="parts/ball.xml"/></asset><worldbody>'
        '<attach model="m" body="b" prefix="x-"/>' + WORLD_END
    )
    assert [*read_scene_source(path).bodies] == ["x-b"]


def pairs_of_the_library(path):
    """Pairs of bodies that MuJoCo tests where every geom is a ball that holds the whole world."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.geom_type[:], model.geom_size[:], model.geom_rbound[:] = mujoco.mjtGeom.mjGEOM_SPHERE, 1e3, 1e3
    model.geom_aabb[:, :3], model.geom_aabb[:, 3:], model.bvh_aabb[:, :3], model.bvh_aabb[:, 3:] = 0, 1e3, 0, 1e4
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    bodies = [model.body(number).name for number in range(model.nbody)]
    return {frozenset(bodies[model.geom_bodyid[geom]] for geom in contact.geom) for contact in data.contact}


@pytest.mark.parametrize("filter_parents", ["enable", "disable"])
def test_pairs_that_collide_agree_with_mujoco(tmp_path, filter_parents):
    """All pairs but those excluded are the ones that MuJoCo tests where every body overlaps every other.

    upper, lower, hand and pad are an arm, each the child of the one before, and the pad is fixed to the hand; the
    others differ in their masks, contype and conaffinity. Ball and cup are excluded, but also declared as a <pair>,
    as are ghost and cup, whose masks never meet: a declared pair counts all the same.
    """
    hinge = '<joint axis="0 0 1"/>'

    def body(name, masks="", children="", joint=hinge):
        return f'<body name="{name}">{joint}<geom name="{name}" type="sphere" size="0.1" {masks}/>{children}</body>'

    pad = body("pad", joint="")
    arm = body("upper", children=body("lower", 'contype="2"', children=body("hand", children=pad)))
    others = [
        body("ball"),
        body("cup", 'conaffinity="3"'),
        body("ghost", 'contype="0" conaffinity="0"'),
        body("glove", 'conaffinity="0"'),
        body("wall", joint=""),
    ]
    path = tmp_path / "pairs.xml"
    path.write_text(
        f'<mujoco><option><flag filterparent="{filter_parents}"/></option>'
        '<contact><exclude body1="ball" body2="cup"/><pair geom1="ghost" geom2="cup"/>'
        f'<pair geom1="ball" geom2="cup"/></contact><worldbody>{arm}{"".join(others)}' + WORLD_END
    )
    scene = read_scene_source(path)
    all_pairs = {frozenset((a, b)) for a in scene.bodies for b in scene.bodies if a != b}
    collides = all_pairs - {frozenset(pair) for pair in scene.excluded}
    assert collides == pairs_of_the_library(path)
    assert {frozenset(("ghost", "cup")), frozenset(("ball", "cup"))} <= collides


def test_motion_of_mocap_bodies_is_named(tmp_path):
    """A mocap body is moved from outside the model, not by a joint: its motion is listed as not taken."""
    path = tmp_path / "mocap.xml"
    path.write_text(f'<mujoco><worldbody>{BALL}<body name="m" mocap="true"><geom size="1"/></body>{WORLD_END}')
    assert read_scene_source(path).left_out == ("the motion of 'm', a mocap body: no joint moves it",)


@pytest.mark.parametrize("flag", ["contact", "constraint"])
def test_switched_off_contacts_are_named(tmp_path, flag):
    """Either flag of a model's options ends all contacts in MuJoCo: that is listed as not taken over."""
    path = tmp_path / "off.xml"
    path.write_text(f'<mujoco><option><flag {flag}="disable"/></option><worldbody>{BALL}{WORLD_END}')
    assert "switches all contacts off" in read_scene_source(path).left_out[0]


@pytest.mark.parametrize(
    ("arrays", "refusal"),
    [
        pytest.param({"robot": np.zeros((3, 2))}, "no array 'time'", id="no times"),
        pytest.param(
            {"time": np.arange(3.0), "robot": np.zeros((3, 5))},
            "columns of joints: robot 5; the model has 10",
            id="five columns for ten joints",
        ),
        pytest.param({"time": np.array([{}, {}], dtype=object)}, "no readable .npz of numbers", id="objects"),
    ],
)
def test_motion_of_another_model_or_of_objects_is_refused(arm_model, arrays, refusal):
    """``arrays``: of the .npz beside the model of an arm, which has ten numbers a frame.

    They are two joints of the robot, the cup's pose in seven, and the ghost's joint.
    """
    np.savez(arm_model.with_suffix(".npz"), **arrays)
    with pytest.raises(SessionError, match=refusal):
        import_session("mjcf", arm_model)


LIMITED = """
<mujoco><compiler angle="radian"/><worldbody>
<body name="cup"><freejoint/><geom type="box" size=".05 .06 .07" pos=".01 .02 .03"/></body>
<body name="arm" pos="0 0 1"><joint name="elbow" axis="0 1 0" range="-0.5 2" limited="true"/><geom size="0.1"/>
<body name="hand" pos="0 0 0.3"><geom size="0.05"/></body></body>
</worldbody></mujoco>
"""
"""A free cup, and an arm whose elbow may turn from -0.5 to 2 rad; the hand is fixed to the arm."""
ONLY_THE_ELBOW = LIMITED.replace("<freejoint/>", "")
"""The cup stands still, so that a motion has a number a row: the angle of the elbow."""

COUNT = 12
"""Frames of a motion."""
CUP_X_COLUMN, CUP_QUATERNION_W_COLUMN, ELBOW_COLUMN = 0, 3, 7
"""Of ``qpos``: the cup's position (0 to 2) and quaternion (3 to 6, w first), then the angle of the elbow."""


def motion_of_limited(folder, *changes):
    """The session of LIMITED in a motion of 12 frames: the cup at rest, the elbow from 0 to 1.5 rad.

    ``changes``: numbers of ``qpos`` that are others, (rows, column, value).
    """
    model = folder / "limited.xml"
    model.write_text(LIMITED)
    angles = np.linspace(0.0, 1.5, COUNT)
    configurations = np.column_stack([np.zeros((COUNT, 3)), np.tile([1.0, 0, 0, 0], (COUNT, 1)), angles])
    for rows, column, value in changes:
        configurations[rows, column] = value
    np.savez(model.with_suffix(".npz"), time=np.arange(COUNT) / 90, qpos=configurations)
    return import_session("mjcf", model)


@pytest.mark.parametrize(
    ("column", "value", "lost"),
    [
        pytest.param(CUP_QUATERNION_W_COLUMN, 0.0, ["cup"], id="quaternion of length 0"),
        pytest.param(CUP_QUATERNION_W_COLUMN, 2.0, ["cup"], id="quaternion of length 2"),
        pytest.param(CUP_X_COLUMN, np.nan, ["cup"], id="position of NaN"),
        pytest.param(ELBOW_COLUMN, np.nan, ["arm", "hand"], id="angle of NaN"),
        pytest.param(ELBOW_COLUMN, np.inf, ["arm", "hand"], id="infinite angle"),
    ],
)
def test_bodies_below_a_joint_without_position_are_flagged_lost(tmp_path, column, value, lost):
    """In rows 4 to 6 of 12, the cup's pose or the elbow's angle is no number or no rotation.

    The bodies below that joint are lost there, which the conversions of the import say; their positions stay finite.
    """
    session = motion_of_limited(tmp_path, (slice(4, 7), column, value))
    assert session.tracks.keys() == {"cup", "arm", "hand"}
    for name, track in session.tracks.items():
        assert np.flatnonzero(~track.valid).tolist() == ([4, 5, 6] if name in lost else []), name
        assert np.isfinite(track.positions).all(), name
    reason = "3 of 12 poses dropped: below a joint that has no position"
    assert f"{', '.join(lost)}: {reason}" in ledger_of(session.facts).sentences()


def test_angles_in_degrees_are_refused(tmp_path):
    """The elbow may turn from -0.5 to 2 rad; its motion from 0 to 1.5 rad is written as 0 to 86 degrees."""
    every_row = slice(None)
    degrees = np.degrees(np.linspace(0.0, 1.5, COUNT))
    with pytest.raises(SessionError, match=r"'elbow' leaves its range of -0\.5 to 2 rad .* write angles in radians"):
        motion_of_limited(tmp_path, (every_row, ELBOW_COLUMN, degrees))


def test_angle_far_beyond_its_range_is_named(tmp_path):
    """The elbow's range ends at 2 rad: 3 rad in row 3, 1 rad beyond it, are named; 2.1 rad are not."""
    far, near = (motion_of_limited(tmp_path, (3, ELBOW_COLUMN, angle)).facts["conversions"] for angle in (3.0, 2.1))
    assert "joint 'elbow' leaves its range by up to 1 rad" in far
    assert "leaves its range" not in near


@pytest.mark.parametrize(
    "head",
    [pytest.param("time,elbow,elbow", id="times first"), pytest.param("elbow,elbow,time", id="times last")],
)
def test_column_of_a_joint_that_occurs_twice_is_refused(tmp_path, head):
    """The CSV has a column of times and two of the elbow: nobody knows which one counts."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text(f"{head}\n0,0,0\n1,1,1\n")
    with pytest.raises(SessionError, match="column 'elbow' occurs twice"):
        import_session("mjcf", model)


def test_columns_of_a_csv_that_are_not_read_are_named(tmp_path):
    """A CSV of joint values has, beside the elbow's angle, a force, which no joint of the model is."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text("time,elbow,force\n0,0,9\n1,1,9\n")
    assert "columns that are not read: force" in import_session("mjcf", model).facts["conversions"]


def test_arrays_of_an_npz_that_are_not_read_are_named(tmp_path):
    """A file of NumPy has, beside the joint values (``qpos``), an array of forces."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    np.savez(model.with_suffix(".npz"), time=np.arange(3.0), qpos=np.zeros((3, 1)), force=np.zeros((3, 1)))
    assert "arrays that are not read: force" in import_session("mjcf", model).facts["conversions"]


def test_row_without_a_time_is_refused(tmp_path):
    """A CSV of joint values over time: the second of three rows has nan for its time."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text("time,elbow\n0,0\nnan,1\n2,1\n")
    with pytest.raises(SessionError, match="row 2 has no time"):
        import_session("mjcf", model)


@pytest.mark.parametrize(
    "rows",
    [
        pytest.param("", id="no rows"),
        pytest.param("0,0,1\n1,1,1\n", id="three cells each"),
        pytest.param("0,0\n1\n", id="one cell in the second"),
    ],
)
def test_rows_of_another_length_than_the_head_are_refused(tmp_path, rows):
    """``rows``: below the head "time,elbow" of a CSV of joint values."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text(f"time,elbow\n{rows}")
    with pytest.raises(SessionError, match="has rows of different lengths, or none"):
        import_session("mjcf", model)
