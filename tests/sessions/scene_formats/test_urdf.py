"""URDF beside yourdfpy's own values: poses, packages, scales; and meshes that a URDF may not read."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.errors import SceneSourceError
from sessions.scene_formats.scene_source import read_scene_source

yourdfpy = pytest.importorskip("yourdfpy")

CUP = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
"""A mesh in OBJ: a tetrahedron with legs of 1 along the axes."""
ARM = """
<robot name="arm">
  <link name="base"><collision><geometry><box size="0.4 0.2 0.1"/></geometry></collision></link>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="fore"/><axis xyz="0 0 1"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <link name="fore"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><cylinder radius="0.05" length="0.5"/></geometry></visual>
    <collision><origin xyz="0 0 0.1" rpy="0.5 0 0"/>
      <geometry><cylinder radius="0.05" length="0.5"/></geometry></collision>
  </link>
  <joint name="grip" type="fixed"><parent link="fore"/><child link="cup"/><origin xyz="0 0 0.3" rpy="0 0 1.5"/></joint>
  <link name="cup">
    <visual><geometry><mesh filename="package://lab/meshes/cup.obj" scale="0.01 0.02 -0.03"/></geometry></visual>
    <collision><geometry><mesh filename="meshes/cup.obj" scale="0.01 0.02 -0.03"/></geometry></collision>
    <collision><geometry><mesh filename="meshes/cup.dae"/></geometry></collision>
  </link>
  <link name="frame"/>
</robot>
"""


@pytest.fixture(autouse=True)
def few_faces(monkeypatch):
    """Round shapes with 400 faces in place of 4,000: a hull takes a tenth of the time, and corners lie as exactly."""
    monkeypatch.setattr("sessions.scene_formats.urdf.ROUND_FACES", 400)


@pytest.fixture
def arm_model(tmp_path):
    """The URDF of an arm, beside its meshes."""
    (tmp_path / "lab" / "meshes").mkdir(parents=True)
    (tmp_path / "lab" / "meshes" / "cup.obj").write_text(CUP)
    (tmp_path / "lab" / "meshes" / "cup.dae").write_text("<COLLADA/>")
    path = tmp_path / "lab" / "arm.urdf"
    path.write_text(
        ARM.replace(
            '<link name="frame"/>',
            '<link name="frame"/><joint name="f" type="fixed"><parent link="base"/><child link="frame"/></joint>',
        )
    )
    return path


def test_urdf_link_poses_agree_with_yourdfpy(arm_model):
    """Poses of base, fore and cup, the links of an arm that have a shape, to 1e-9 m."""
    scene, model = read_scene_source(arm_model), yourdfpy.URDF.load(str(arm_model), load_meshes=False)
    assert [*scene.bodies] == ["base", "fore", "cup"]
    for name, body in scene.bodies.items():
        assert np.abs(body.pose - model.get_transform(name)).max() <= 1e-9, name


def test_urdf_links_move_below_a_joint_that_does(arm_model):
    """A joint of the arm slides fore, of 2 kg, along the base; the cup is fixed to fore. Both pairs are excluded."""
    scene = read_scene_source(arm_model)
    assert {name: body.moves for name, body in scene.bodies.items()} == {"base": False, "fore": True, "cup": True}
    assert scene.bodies["fore"].mass == 2
    assert scene.excluded == (("base", "fore"), ("fore", "cup"))


def chain(path, count):
    """A chain of links, each held by a joint that is fixed in its first half and moves from the middle on."""
    box = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    links = [f'<link name="link{k}">{box}</link>' for k in range(count)]
    limit = '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    joints = [
        f'<joint name="joint{k}" type="{"fixed" if k < count // 2 else "revolute"}"><parent link="link{k - 1}"/>'
        f'<child link="link{k}"/><origin xyz="0.1 0 0" rpy="0.01 0.02 0.03"/><axis xyz="0 0 1"/>{limit}</joint>'
        for k in range(1, count)
    ]
    # Joints stand in the file in any order.
    path.write_text(f'<robot name="chain">{"".join(links)}{"".join(reversed(joints))}</robot>')
    return path


def test_poses_of_forty_chained_links_agree_with_yourdfpy(tmp_path):
    """Joints are fixed up to link 19 and move from link 20 on; they stand in the file in reverse order."""
    path = chain(tmp_path / "chain.urdf", count=40)
    scene, model = read_scene_source(path), yourdfpy.URDF.load(str(path), load_meshes=False)
    assert [*scene.bodies] == [f"link{number}" for number in range(40)]
    for name, body in scene.bodies.items():
        assert np.abs(body.pose - model.get_transform(name)).max() <= 1e-9, name
    assert [body.moves for body in scene.bodies.values()] == [False] * 20 + [True] * 20


@pytest.mark.slow
def test_long_chain_asks_the_library_for_neighbours_alone(tmp_path, monkeypatch):
    """400 links are 400 calls for a pose, each relative to the parent's link, and only the base's in the world.

    A pose in the world walks up the whole chain: 400 of them would be 80,000 steps.
    """
    frames_of_calls = []
    usual = yourdfpy.URDF.get_transform

    def get_transform(model, *frames):
        frames_of_calls.append(frames)
        return usual(model, *frames)

    monkeypatch.setattr(yourdfpy.URDF, "get_transform", get_transform)
    read_scene_source(chain(tmp_path / "chain.urdf", count=400))
    assert len(frames_of_calls) == 400
    assert [len(frames) for frames in frames_of_calls].count(1) == 1


def test_urdf_cylinder_has_its_origin_and_rotation(arm_model):
    """The collider of fore: 0.5 m long, of radius 5 cm, its middle 0.1 m up, and rotated by 0.5 rad about x."""
    (solid,) = read_scene_source(arm_model).bodies["fore"].colliders
    rotation = Rotation.from_euler("xyz", [0.5, 0, 0]).as_matrix()
    local = (solid.vertices - [0, 0, 0.1]) @ rotation
    assert np.abs(np.hypot(local[:, 0], local[:, 1]) - 0.05).max() <= 1e-9
    assert np.abs(np.abs(local[:, 2]) - 0.5 / 2).max() <= 1e-9


def test_urdf_mesh_has_the_scale_of_each_axis(arm_model):
    """The cup of 1 m is scaled by 0.01, 0.02 and -0.03; the mirror along z turns no face inside out.

    Its second collider, of COLLADA, is listed as not taken.
    """
    scene = read_scene_source(arm_model)
    cup = scene.bodies["cup"].mesh
    assert np.abs(cup.bounds - [[0, 0, -0.03], [0.01, 0.02, 0]]).max() <= 1e-9
    assert cup.volume > 0.0
    assert any("cup.dae is of no known type" in sentence for sentence in scene.left_out)


@pytest.mark.parametrize(
    ("name", "refusal"),
    [
        pytest.param("../../secret.obj", "lies outside", id="two folders above"),
        pytest.param("file:///etc/passwd", "lies outside", id="a file of the system"),
        pytest.param("package://../secret.obj", "lies outside", id="above all packages"),
        pytest.param("package://other/cup.obj", "is missing", id="no such package"),
        pytest.param("file:///%65tc/passwd", "lies outside", marks=pytest.mark.slow, id="escaped letter"),
        pytest.param("package://lab/%2e%2e/secret.obj", "is missing", id="escaped dots"),
        pytest.param("package://lab/loop.obj", "a link to itself", id="a link to itself"),
        pytest.param("package://lab/link.obj", "lies outside", id="a link that leads out"),
    ],
)
def test_mesh_outside_the_folder_is_not_read(arm_model, name, refusal):
    """``name``: of the cup's mesh in the URDF, which stands in the folder lab; secret.obj is beside that folder."""
    (arm_model.parent.parent / "secret.obj").write_text(CUP)
    (arm_model.parent / "link.obj").symlink_to(arm_model.parent.parent / "secret.obj")
    (arm_model.parent / "loop.obj").symlink_to(arm_model.parent / "loop.obj")
    arm_model.write_text(arm_model.read_text().replace("package://lab/meshes/cup.obj", name))
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(arm_model)


def test_entities_are_refused(arm_model):
    """The URDF of the arm, below a DOCTYPE that declares an entity: by one, XML can read files or fill the memory."""
    arm_model.write_text('<!DOCTYPE robot [<!ENTITY a "x">]>' + arm_model.read_text())
    with pytest.raises(SceneSourceError, match="document type or entities"):
        read_scene_source(arm_model)


def one_link(geometry, more=""):
    """A robot of the link "l" with this inside its collision, and with ``more`` elements."""
    return f'<robot name="r"><link name="l"><collision>{geometry}</collision></link>{more}</robot>'


BOX = '<geometry><box size="1 1 1"/></geometry>'


def test_urdf_capsule_becomes_a_solid_along_z(tmp_path):
    """A radius of 0.1 m about a segment of 0.4 m: 0.4 / 2 + 0.1 m from the centre to the tip."""
    path = tmp_path / "r.urdf"
    path.write_text(one_link('<geometry><capsule radius="0.1" length="0.4"/></geometry>'))
    (solid,) = read_scene_source(path).bodies["l"].colliders
    assert np.abs(solid.bounds - [[-0.1, -0.1, -0.3], [0.1, 0.1, 0.3]]).max() <= 1e-9


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        pytest.param('<geometry><plane normal="0 0 1"/></geometry>', "its shape is a plane", id="plane"),
        pytest.param(
            '<geometry><box size="1 1"/></geometry>', "size is '1 1', not three numbers", id="box of two numbers"
        ),
        pytest.param(
            '<geometry><mesh filename="cup.obj" scale="1 1 1 1"/></geometry>',
            "scale is '1 1 1 1', not three numbers",
            id="scale of four numbers",
        ),
        pytest.param("<geometry><sphere/></geometry>", "its sphere has no radius", id="sphere without a radius"),
        pytest.param('<origin xyz="nan 0 0"/>' + BOX, "xyz is 'nan 0 0', not three numbers", id="place of NaN"),
        pytest.param("<geometry/>", "it has no shape", id="no shape"),
        pytest.param("", "it has no shape", id="no geometry"),
    ],
)
def test_geometry_that_cannot_be_taken_is_named(tmp_path, text, reason):
    """``text``: inside the only collision of link l, which is left out; link b has a box and is taken."""
    (tmp_path / "cup.obj").write_text(CUP)
    path = tmp_path / "r.urdf"
    path.write_text(one_link(text, f'<link name="b"><collision>{BOX}</collision></link>' + joint("l", "b")))
    scene = read_scene_source(path)
    assert [*scene.bodies] == ["b"]
    assert reason in scene.left_out[0]


def joint(parent, child):
    """A fixed joint of two links."""
    return f'<joint name="j" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


@pytest.mark.parametrize("limit", ["MOST_BODIES", "MOST_FACES"])
def test_scene_that_places_too_much_is_refused(arm_model, monkeypatch, limit):
    """The arm has three bodies with more than two faces; at most two bodies, or two faces, may be placed."""
    monkeypatch.setattr(f"sessions.scene_formats.scene_source.{limit}", 2)
    with pytest.raises(SceneSourceError, match="the scene places more than"):
        read_scene_source(arm_model)


@pytest.mark.parametrize("tag", ["deformable", "reduced_deformable"])
def test_soft_bodies_are_named(tmp_path, tag):
    """A soft body, by tags that only other programs know, beside a link with a box: it is listed as not taken."""
    path = tmp_path / "r.urdf"
    path.write_text(one_link(BOX, f'<{tag} name="jelly"><visual filename="jelly.vtk"/></{tag}>'))
    assert read_scene_source(path).left_out == ("the soft body 'jelly'",)


@pytest.mark.parametrize("tag", ["deformable", "reduced_deformable"])
def test_soft_body_alone_is_no_scene(tmp_path, tag):
    """A robot of a soft body and no link: some versions of yourdfpy refuse it, else no body is left."""
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r"><{tag} name="jelly"/></robot>')
    with pytest.raises(SceneSourceError, match=r"yourdfpy does not read|no body that collides; not taken: the soft"):
        read_scene_source(path)


@pytest.mark.parametrize(
    ("package", "is_named_by_package_xml", "robot"),
    [
        pytest.param("src/lab", False, "src/stack/robot", id="folder of that name above"),
        pytest.param("src/stack/lab", False, "src/stack/robot", id="folder of that name beside"),
        pytest.param("src/checkout-of-lab", True, "src/checkout-of-lab/urdf", id="folder above, named by package.xml"),
        pytest.param("", True, "urdf", id="the root, named by package.xml"),
    ],
)
def test_package_is_looked_for_from_the_file_upwards(tmp_path, package, is_named_by_package_xml, robot):
    """The robot's mesh is in the package "lab": a folder of that name, or one whose package.xml says so.

    ``robot``: the folder of the URDF.
    """
    (tmp_path / package / "meshes").mkdir(parents=True)
    (tmp_path / package / "meshes" / "cup.obj").write_text(CUP)
    if is_named_by_package_xml:
        (tmp_path / package / "package.xml").write_text("<package><name>lab</name></package>")
    (tmp_path / robot).mkdir(parents=True)
    path = tmp_path / robot / "r.urdf"
    path.write_text(one_link('<geometry><mesh filename="package://lab/meshes/cup.obj"/></geometry>'))
    assert [*read_scene_source(path, root=tmp_path).bodies] == ["l"]
