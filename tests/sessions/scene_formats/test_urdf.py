"""URDF beside yourdfpy's own values: poses, packages, scales; and meshes that a URDF may not read."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.errors import SceneSourceError
from sessions.scene_formats.scene_source import read_scene_source

yourdfpy = pytest.importorskip("yourdfpy")

CUP = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
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


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "lab" / "meshes").mkdir(parents=True)
    (tmp_path / "lab" / "meshes" / "cup.obj").write_text(CUP)
    (tmp_path / "lab" / "meshes" / "cup.dae").write_text("<COLLADA/>")
    path = tmp_path / "lab" / "arm.urdf"
    path.write_text(ARM.replace('<link name="frame"/>', '<link name="frame"/><joint name="f" type="fixed">'
                                '<parent link="base"/><child link="frame"/></joint>'))  # fmt: skip
    return path


def test_links_stand_where_the_library_has_them(arm):
    scene, model = read_scene_source(arm), yourdfpy.URDF.load(str(arm), load_meshes=False)
    assert [*scene.bodies] == ["base", "fore", "cup"]
    for name, body in scene.bodies.items():
        assert np.abs(body.pose - model.get_transform(name)).max() <= 1e-9
    assert {name: body.moves for name, body in scene.bodies.items()} == {"base": False, "fore": True, "cup": True}
    assert scene.bodies["fore"].mass == 2 and scene.excluded == (("base", "fore"), ("fore", "cup"))


def test_geometry_has_its_origin_scale_and_package(arm):
    scene = read_scene_source(arm)
    solid = scene.bodies["fore"].colliders[0]
    rotation = Rotation.from_euler("xyz", [0.5, 0, 0]).as_matrix()
    local = (solid.vertices - [0, 0, 0.1]) @ rotation
    assert np.abs(np.hypot(local[:, 0], local[:, 1]) - 0.05).max() <= 1e-9
    assert np.abs(np.abs(local[:, 2]) - 0.25).max() <= 1e-9
    cup = scene.bodies["cup"].mesh
    assert np.abs(cup.bounds - [[0, 0, -0.03], [0.01, 0.02, 0]]).max() <= 1e-9 and cup.volume > 0.0
    assert any("cup.dae is of no known type" in sentence for sentence in scene.left_out)


@pytest.mark.parametrize(
    ("name", "refusal"),
    [
        ("../../secret.obj", "lies outside"),
        ("file:///etc/passwd", "lies outside"),
        ("package://../secret.obj", "lies outside"),
        ("package://other/cup.obj", "is missing"),
    ],
)
def test_mesh_outside_the_folder_is_not_read(arm, name, refusal):
    arm.write_text(arm.read_text().replace("package://lab/meshes/cup.obj", name))
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(arm)


def test_entities_are_refused(arm):
    arm.write_text('<!DOCTYPE robot [<!ENTITY a "x">]>' + arm.read_text())
    with pytest.raises(SceneSourceError, match="document type or entities"):
        read_scene_source(arm)
