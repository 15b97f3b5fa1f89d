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


@pytest.fixture(autouse=True)
def few_faces(monkeypatch):
    """Round shapes with 400 faces in place of 4,000: a hull takes a tenth of the time, and corners lie as exactly."""
    monkeypatch.setattr("sessions.scene_formats.mjcf.ROUND_FACES", 400)


@pytest.fixture
def arm_model(tmp_path):
    """MuJoCo's model of an arm, beside its defaults and a mesh."""
    folder = tmp_path / "scene"
    (folder / "parts").mkdir(parents=True)
    (folder / "arm.xml").write_text(ARM)
    (folder / "defaults.xml").write_text(DEFAULTS)
    (folder / "parts" / "cup.obj").write_text(CUP)
    return folder / "arm.xml"


def test_mjcf_poses_and_surfaces_agree_with_mujoco(arm_model):
    """Poses to 1e-9; a mesh's corners stand where MuJoCo has them; its collider is the hull that fills its hollow."""
    scene, model = read_scene_source(arm_model), mujoco.MjModel.from_xml_path(str(arm_model))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert [*scene.bodies] == ["table", "arm", "hand", "cup"]
    for name, body in scene.bodies.items():
        own = data.body(name)
        assert np.abs(body.pose[:3, 3] - own.xpos).max() <= 1e-9
        assert np.abs(body.pose[:3, :3] - own.xmat.reshape(3, 3)).max() <= 1e-9
        assert body.mass == model.body(name).mass[0]
    # The corners of a mesh stand in the world where the library has them.
    geom = model.body("cup").geomadr[0]
    corners = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    cup = scene.bodies["cup"]
    assert np.abs(cup.mesh.vertices @ cup.pose[:3, :3].T + cup.pose[:3, 3] - corners).max() <= 1e-9
    assert np.abs(np.sort(cup.mesh.bounds, axis=0) - [[0, 0, 0], [0.5, 0.5, 0.5]]).max() < 1e-7
    # A hollow that the library fills: its collider is the hull.
    assert cup.colliders[0].volume > 1.1 * cup.mesh.volume
    assert [scene.bodies[name].margin for name in ("arm", "cup")] == [0.001, 0.002]
    assert [name for name, body in scene.bodies.items() if not body.moves] == ["table"]


def test_round_geoms_lie_on_the_surfaces_of_the_library(arm_model):
    """An ellipsoid, a cylinder and a capsule, against MuJoCo's own centres, rotations and sizes."""
    scene, model = read_scene_source(arm_model), mujoco.MjModel.from_xml_path(str(arm_model))
    first, second = (int(model.body("hand").geomadr[0]) + k for k in range(2))
    ellipsoid = scene.bodies["hand"].colliders[0].vertices
    rotation = Rotation.from_quat(model.geom_quat[first][[1, 2, 3, 0]]).as_matrix()
    local = (ellipsoid - model.geom_pos[first]) @ rotation / model.geom_size[first]
    assert np.abs(np.linalg.norm(local, axis=1) - 1.0).max() <= 1e-9
    assert scene.bodies["hand"].colliders[1].bounds[1, 2] == pytest.approx(model.geom_size[second][1], abs=1e-12)
    capsule = model.body("arm").geomadr[0]
    ends = model.geom_pos[capsule], rotation_z(model.geom_quat[capsule]) * model.geom_size[capsule][1]
    arm_vertices = scene.bodies["arm"].mesh.vertices
    along = np.clip((arm_vertices - ends[0]) @ ends[1] / (ends[1] @ ends[1]), -1, 1)
    away = np.linalg.norm(arm_vertices - ends[0] - along[:, None] * ends[1], axis=1)
    assert np.abs(away - model.geom_size[capsule][0]).max() <= 1e-9


def rotation_z(quaternion_wxyz):
    """The axis z of a body after rotations (n, 4)."""
    return Rotation.from_quat(quaternion_wxyz[[1, 2, 3, 0]]).as_matrix()[:, 2]


def test_mjcf_excluded_pairs_and_unsupported_parts_are_listed(arm_model):
    """Excluded are a parent with its child (arm, hand) and the pair that the file excludes (hand, cup).

    Not taken are the endless floor, and the body ghost, of which nothing collides.
    """
    scene = read_scene_source(arm_model)
    assert {frozenset(pair) for pair in scene.excluded} == {frozenset(("arm", "hand")), frozenset(("hand", "cup"))}
    assert any("endless plane of body 'world'" in sentence for sentence in scene.left_out)
    assert any("nothing collides: ghost" in sentence for sentence in scene.left_out)


def test_soft_bodies_and_height_fields_are_named(tmp_path):
    """A ground with a height field and a box, and a cloth of 3 x 3 points."""
    path = tmp_path / "soft.xml"
    path.write_text(
        '<mujoco><asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset><worldbody>'
        '<body name="ground"><geom type="hfield" hfield="h"/><geom type="box" size="1 1 1"/></body>'
        '<flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" dim="2" radius="0.01" mass="1"/>'
        "</worldbody></mujoco>"
    )
    left_out = " ".join(read_scene_source(path).left_out)
    assert "a height field of body 'ground'" in left_out and "soft bodies (flex): 1" in left_out


@pytest.mark.parametrize(
    ("content", "kind"), [(b"", "empty; save it again"), (b"<!DOCTYPE html>", "an HTML page, as a share link")]
)
def test_joint_motion_of_another_kind_is_named(tmp_path, content, kind):
    """Files called arm.npz that are empty, or a page of HTML."""
    (tmp_path / "arm.npz").write_bytes(content)
    with pytest.raises(SceneSourceError, match=f"joint motion .*arm.npz is {kind}"):
        read_joint_motion(tmp_path / "arm.npz", model=None)


@pytest.mark.parametrize("file", ["arm.npz", "arm.csv"])
def test_joint_motion_becomes_poses_of_forward_kinematics(arm_model, tmp_path, file):
    """Five frames 20 ms apart, of random joint values; MuJoCo itself places the bodies by the same values.

    Its Z up becomes Y up: (x, y, z) is (x, z, -y). A CSV names its joints in another order than the model.
    """
    model = mujoco.MjModel.from_xml_path(str(arm_model))
    rng = np.random.default_rng(2)
    if file.endswith("npz"):
        cup = np.concatenate([rng.normal(size=(5, 3)), Rotation.random(5, random_state=1).as_quat()], axis=1)
        columns = {"robot": rng.normal(size=(5, 2)), "cup": cup, "ghost": rng.normal(size=(5, 1))}
        np.savez(arm_model.with_name(file), time=2.5 + 0.02 * np.arange(5), **columns)
        qpos = np.concatenate([*columns.values()], axis=1)
    else:
        text = arm_model.read_text().replace("<freejoint/>", '<joint name="slide" type="slide"/>')
        arm_model.write_text(text.replace("<joint/>", '<joint name="spin"/>'))
        model = mujoco.MjModel.from_xml_path(str(arm_model))
        qpos = rng.normal(size=(5, 4))
        rows = (",".join(map(repr, [2.5 + 0.02 * row, *values.tolist()[::-1]])) for row, values in enumerate(qpos))
        arm_model.with_name(file).write_text("time,spin,slide,wrist,shoulder\n" + "\n".join(rows))
    session = import_session("mjcf", arm_model, motion=arm_model.with_name(file))
    assert session.frames.stamp_ns.tolist() == [20_000_000 * row for row in range(5)]
    data = mujoco.MjData(model)
    for row in range(5):
        data.qpos[:] = qpos[row]
        mujoco.mj_kinematics(model, data)
        for name in session.names:
            x, y, z = data.body(name).xpos
            column = session.names.index(name)
            assert np.abs(session.frames.position[row, column] - [x, z, -y]).max() <= 1e-9
            matrix = Rotation.from_quat(session.frames.quaternion_xyzw[row, column]).as_matrix()
            assert np.abs(matrix - data.body(name).xmat.reshape(3, 3)[[0, 2, 1]] * [[1], [1], [-1]]).max() <= 1e-9
    assert session.scene.body("table").fixed.position == pytest.approx((0, 0.4, 0))


def test_pose_of_seven_numbers_moves_three_slides_and_three_hinges(arm_model):
    """A position and a quaternion (w first); MuJoCo's Z up becomes Y up."""
    joints = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    joints += "".join(f'<joint axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    arm_model.write_text(arm_model.read_text().replace("<freejoint/>", joints).replace("<joint/>", ""))
    rotations = Rotation.random(4, random_state=3)
    poses = np.concatenate([np.zeros((4, 3)), rotations.as_quat()[:, [3, 0, 1, 2]]], axis=1)
    np.savez(arm_model.with_suffix(".npz"), time=np.arange(4.0), robot=np.zeros((4, 2)), cup=poses)
    session = import_session("mjcf", arm_model)
    column = session.names.index("cup")
    rotated = Rotation.from_quat(session.frames.quaternion_xyzw[:, column]).as_matrix()
    assert np.abs(rotated - [[1, 0, 0], [0, 0, 1], [0, -1, 0]] @ rotations.as_matrix()).max() <= 1e-9


def test_drawn_geom_is_the_surface_unless_inside_the_collider(tmp_path):
    """Spheres of radius 0.1 collide; the drawn box of 0.1 sticks out of its sphere, the box of 0.05 is inside.

    ``faces``: of part and bone, 12 where the surface is the box and 0 where it is the sphere.
    """
    path = tmp_path / "links.xml"
    drawn = '<geom type="box" size="{0} {0} {0}" contype="0" conaffinity="0" group="1"/>'
    solid = '<geom type="sphere" size="0.1" group="3"/>'
    bodies = "".join(
        f'<body name="{name}">{drawn.format(half)}{solid}</body>' for name, half in (("part", 0.1), ("bone", 0.05))
    )
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    expected = {Surface.AUTO: (12, 0), Surface.DRAWN: (12, 12), Surface.COLLIDING: (0, 0)}
    for surface, faces in expected.items():
        scene = read_scene_source(path, surface=surface)
        for name, count in zip(("part", "bone"), faces, strict=True):
            assert (len(scene.bodies[name].mesh.faces) == 12) == bool(count)
        rows = {(row.value, row.bodies, row.origin) for row in surface_assumptions(scene, surface)}
        both = ("part", "bone")
        guessed = {("drawn", both[:1], Origin.GUESS), ("colliding", both[1:], Origin.GUESS)}
        assert rows == (guessed if surface is Surface.AUTO else {(str(surface), both, Origin.USER)})


BOMB = '<!DOCTYPE m [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><mujoco model="&b;"/>'
BALL, WORLD_END = '<body name="b"><geom type="sphere" size="1"/></body>', "</worldbody></mujoco>"
COPIES = '<replicate count="100" offset="1 0 0">' * 4


@pytest.mark.parametrize(
    ("name", "text", "refusal"),
    [
        ("bomb.xml", BOMB, "declares a document type or entities"),
        ("wide.xml", BOMB.encode("utf-16"), "no XML in UTF-8"),
        ("circle.xml", '<mujoco><include file="circle.xml"/></mujoco>', "includes itself"),
        ("up.xml", '<mujoco><include file="../secret.xml"/></mujoco>', "'../secret.xml' lies outside"),
        ("abs.xml", '<mujoco><asset><mesh file="{secret}"/></asset></mujoco>', "lies outside"),
        (
            "dir.xml",
            '<mujoco><compiler meshdir=".."/><asset><mesh file="secret.obj"/></asset></mujoco>',
            "lies outside",
        ),
        ("skin.xml", '<mujoco><asset><skin file="../secret.obj"/></asset></mujoco>', "lies outside"),
        ("gone.xml", '<mujoco><asset><mesh file="../gone.obj"/></asset></mujoco>', "lies outside"),
        ("link.xml", '<mujoco><asset><mesh file="link.obj"/></asset></mujoco>', "lies outside"),
        ("large.xml", '<mujoco><asset><mesh file="large.stl"/></asset></mujoco>', "has 1,000 MB, more than 256 MB"),
        ("deep.xml", "<mujoco>" + "<body>" * 200 + "</body>" * 200 + "</mujoco>", "more than 100 elements within"),
        (
            "strip.xml",
            '<mujoco><compiler strippath="true" meshdir=".."/><asset><mesh file="a/b/secret.obj"/></asset></mujoco>',
            "lies outside",
        ),
        ("attach.xml", '<mujoco><asset><model name="m" file="attach.xml"/></asset></mujoco>', "includes itself"),
        ("part.xml", '<mujoco><asset><model name="m" file="inner.xml"/></asset></mujoco>', "lies outside"),
        ("laughs.xml", "<mujoco><worldbody>" + COPIES + BALL + "</replicate>" * 4 + WORLD_END, "asks for more than"),
        (
            "echo.xml",
            '<mujoco><asset><model name="m" file="ball.xml"/></asset><worldbody>' + '<replicate count="99999">'
            '<attach model="m" body="b" prefix="c"/></replicate>' + WORLD_END,
            "asks for more than",
        ),
        ("cloth.xml", '<mujoco><worldbody><flexcomp name="c" type="grid" count="999 999 9"/>' + WORLD_END, "asks for"),
        ("hills.xml", '<mujoco><asset><hfield name="h" nrow="99999" ncol="99999"/></asset></mujoco>', "asks for more"),
        ("loop.xml", '<mujoco><include file="loop"/></mujoco>', "a link to itself"),
        ("long.xml", '<mujoco><include file="' + "a" * 5000 + '"/></mujoco>', "or too long"),
        ("empty.xml", "<mujoco/>", "no body that collides"),
        ("fragment.xml", "<mujocoinclude/>", "a part that MJCF files include"),
        ("user.xml", '<mujoco><size nuser_geom="1000000000"/><worldbody>' + BALL + WORLD_END, "asks for more than"),
        ("cut.xml", "<mujoco><worldbody>", "no readable XML"),
        ("other.xml", "<scene/>", "begins with <scene>"),
        ("wrong.xml", "<mujoco><worldbody><geom/></worldbody></mujoco>", "MuJoCo does not read"),
    ],
)
def test_hostile_mjcf_file_is_refused_with_the_reason(tmp_path, name, text, refusal):
    """Files outside the scene's folder, endless inclusion, and sizes that would fill the memory."""
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
    """The model is in a folder "models" and its mesh beside that folder."""
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
    """Twenty files that each include the next one twice would be a million readings."""
    for number in range(20):
        include = f'<include file="{number + 1}.xml"/>' * 2 if number < 19 else BALL
        (tmp_path / f"{number}.xml").write_text(f"<mujoco>{include}</mujoco>")
    with pytest.raises(SceneSourceError, match="asks for more than 200,000 parts"):
        read_scene_source(tmp_path / "0.xml")


@pytest.mark.parametrize("limit", ["MOST_BODIES", "MOST_FACES"])
def test_scene_that_places_too_much_is_refused(tmp_path, monkeypatch, limit):
    """Four balls are placed; the limit of bodies, or of faces, is lowered to 3."""
    monkeypatch.setattr(f"sessions.scene_formats.scene_source.{limit}", 3)
    path = tmp_path / "balls.xml"
    path.write_text(f'<mujoco><worldbody><replicate count="4" offset="1 0 0">{BALL}</replicate>{WORLD_END}')
    with pytest.raises(SceneSourceError, match="the scene places more than"):
        read_scene_source(path)


def test_mjcf_attached_model_adds_its_bodies_with_prefix(tmp_path):
    """The body b of another file is attached with the prefix "x-"."""
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
    """An arm of four links, and bodies with masks (contype, conaffinity); expected are the pairs that MuJoCo tests.

    A declared <pair> counts in spite of masks that never meet (ghost) and of an exclusion (ball).
    """

    def body(name, masks, inner="", joint='<joint axis="0 0 1"/>'):
        return f'<body name="{name}">{joint}<geom name="{name}" type="sphere" size="0.1" {masks}/>{inner}</body>'

    never = 'contype="0" conaffinity="0"'
    arm = body("upper", "", body("lower", 'contype="2"', body("hand", "", body("pad", "", joint=""))))
    path = tmp_path / "pairs.xml"
    path.write_text(
        f'<mujoco><option><flag filterparent="{filter_parents}"/></option>'
        '<contact><exclude body1="ball" body2="cup"/><pair geom1="ghost" geom2="cup"/>'
        f'<pair geom1="ball" geom2="cup"/></contact><worldbody>{arm}{body("ball", "")}'
        + body("cup", 'conaffinity="3"')
        + body("ghost", never)
        + body("glove", 'conaffinity="0"')
        + body("wall", "", joint="")
        + WORLD_END
    )
    scene = read_scene_source(path)
    excluded = {frozenset(pair) for pair in scene.excluded}
    pairs = {frozenset((a, b)) for a in scene.bodies for b in scene.bodies if a != b}
    assert pairs - excluded == pairs_of_the_library(path)
    assert {frozenset(("ghost", "cup")), frozenset(("ball", "cup"))} <= pairs - excluded


def test_motion_of_mocap_bodies_is_named(tmp_path):
    """A mocap body is moved from outside the model, not by a joint."""
    path = tmp_path / "mocap.xml"
    path.write_text(f'<mujoco><worldbody>{BALL}<body name="m" mocap="true"><geom size="1"/></body>{WORLD_END}')
    assert read_scene_source(path).left_out == ("the motion of 'm', a mocap body: no joint moves it",)


@pytest.mark.parametrize("flag", ["contact", "constraint"])
def test_switched_off_contacts_are_named(tmp_path, flag):
    """Either flag of the model's options ends all contacts in MuJoCo."""
    path = tmp_path / "off.xml"
    path.write_text(f'<mujoco><option><flag {flag}="disable"/></option><worldbody>{BALL}{WORLD_END}')
    assert "switches all contacts off" in read_scene_source(path).left_out[0]


@pytest.mark.parametrize(
    ("arrays", "refusal"),
    [
        ({"robot": np.zeros((3, 2))}, "no array 'time'"),
        ({"time": np.arange(3.0), "robot": np.zeros((3, 5))}, "columns of joints: robot 5; the model has 10"),
        ({"time": np.array([{}, {}], dtype=object)}, "no readable .npz of numbers"),
    ],
)
def test_motion_of_another_model_or_of_objects_is_refused(arm_model, arrays, refusal):
    """Arrays without times, with five columns of joints where the model has ten, and of objects."""
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
ONLY_THE_ELBOW = LIMITED.replace("<freejoint/>", "")
"""The cup stands still, so that a motion has a number a row: the angle of the elbow."""

COUNT = 12
ELBOW_COLUMN = 7
"""Of ``qpos``: the cup's position (0 to 2) and quaternion (3 to 6) stand before the angle of the elbow."""


def motion_of_limited(folder, *changes):
    """The session of a motion in which some numbers, (rows, column, value), are others."""
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
        (3, 0.0, ["cup"]),
        (3, 2.0, ["cup"]),
        (0, np.nan, ["cup"]),
        (ELBOW_COLUMN, np.nan, ["arm", "hand"]),
        (ELBOW_COLUMN, np.inf, ["arm", "hand"]),
    ],
)
def test_bodies_below_a_joint_without_position_are_flagged_lost(tmp_path, column, value, lost):
    """In rows 4 to 6 of 12, ``qpos`` has no unit quaternion (3) or position (0) of the cup, or angle (7) of the arm."""
    session = motion_of_limited(tmp_path, (slice(4, 7), column, value))
    for name, track in session.tracks.items():
        assert np.flatnonzero(~track.valid).tolist() == ([4, 5, 6] if name in lost else [])
        assert np.isfinite(track.positions).all() and name in session.names
    why = "3 of 12 poses dropped: below a joint that has no position"
    assert f"{', '.join(lost)}: {why}" in ledger_of(session.facts).sentences()


def test_angles_in_degrees_are_refused(tmp_path):
    """The elbow may turn from -0.5 to 2 rad; its motion to 1.5 rad is written as 86 degrees."""
    every_row = slice(None)
    degrees = np.degrees(np.linspace(0.0, 1.5, COUNT))
    with pytest.raises(SessionError, match=r"'elbow' leaves its range of -0\.5 to 2 rad .* write angles in radians"):
        motion_of_limited(tmp_path, (every_row, ELBOW_COLUMN, degrees))


def test_angle_far_beyond_its_range_is_named(tmp_path):
    """The elbow's range ends at 2 rad: 3 rad in row 3 are named, 2.1 rad are not."""
    far, near = (motion_of_limited(tmp_path, (3, ELBOW_COLUMN, angle)).facts["conversions"] for angle in (3.0, 2.1))
    assert "joint 'elbow' leaves its range by up to 1 rad" in far
    assert "leaves its range" not in near


@pytest.mark.parametrize("head", ["time,elbow,elbow", "elbow,elbow,time"])
def test_column_of_a_joint_that_occurs_twice_is_refused(tmp_path, head):
    """The CSV has a column of times and two of the elbow."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text(f"{head}\n0,0,0\n1,1,1\n")
    with pytest.raises(SessionError, match="column 'elbow' occurs twice"):
        import_session("mjcf", model)


def test_columns_and_arrays_that_are_not_read_are_named(tmp_path):
    """Beside the elbow's angle a CSV, and then an .npz, has a force, which no joint of the model is."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text("time,elbow,force\n0,0,9\n1,1,9\n")
    assert "columns that are not read: force" in import_session("mjcf", model).facts["conversions"]
    model.with_suffix(".csv").unlink()
    np.savez(model.with_suffix(".npz"), time=np.arange(3.0), qpos=np.zeros((3, 1)), force=np.zeros((3, 1)))
    assert "arrays that are not read: force" in import_session("mjcf", model).facts["conversions"]


def test_row_without_a_time_is_refused(tmp_path):
    """The second of three rows has nan for its time."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text("time,elbow\n0,0\nnan,1\n2,1\n")
    with pytest.raises(SessionError, match="row 2 has no time"):
        import_session("mjcf", model)


@pytest.mark.parametrize("rows", ["", "0,0,1\n1,1,1\n", "0,0\n1\n"])
def test_rows_of_another_length_than_the_head_are_refused(tmp_path, rows):
    """``rows`` below the head "time,elbow": none, three cells each, and one cell in the second."""
    model = tmp_path / "limited.xml"
    model.write_text(ONLY_THE_ELBOW)
    model.with_suffix(".csv").write_text(f"time,elbow\n{rows}")
    with pytest.raises(SessionError, match="has rows of different lengths, or none"):
        import_session("mjcf", model)
