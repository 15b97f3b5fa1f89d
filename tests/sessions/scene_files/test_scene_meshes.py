import numpy as np
import pytest

from sessions.errors import SceneError
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import Scene, SceneBody
from sessions.scene_files.scene_meshes import scene_meshes

TRIANGLE = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_files_shapes_and_instruments_become_meshes(tmp_path):
    (tmp_path / "t.glb").write_bytes(mesh_to_glb(TRIANGLE, "t"))
    bodies = (
        SceneBody("file", mesh="t.glb", scale=0.5),
        SceneBody("shape", shape="sphere", size={"radius": 0.1}, extra={"faces": 500}),
        SceneBody("glass", instrument="beaker_100", extra={"faces": 600}),
        SceneBody("tracked"),
    )
    meshes = scene_meshes(Scene(bodies=bodies), tmp_path)
    assert list(meshes) == ["file", "shape", "glass"]
    assert np.array_equal(meshes["file"].vertices, TRIANGLE.vertices * 0.5)
    assert 300 < len(meshes["shape"].faces) < 700
    assert 400 < len(meshes["glass"].faces) < 900


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (SceneBody("m", mesh="absent.glb"), "body 'm': mesh file .*absent.glb does not exist"),
        (SceneBody("i", instrument="beaker_100", extra={"faces": 7}), "body 'i': beaker_100 with 7 faces"),
        (SceneBody("o", instrument="bench", extra={"options": {"colour": 1}}), "body 'o': bench has no option colour"),
        (SceneBody("f", instrument="bench", extra={"options": {"faces": 900}}), "body 'f': options hold faces"),
        (SceneBody("w", instrument="bench", extra={"options": {"width": "wide"}}), "body 'w': "),
        (SceneBody("n", mesh="a\0.glb"), "body 'n': .*null"),
    ],
)
def test_a_mesh_that_cannot_be_made_names_its_body(body, message, tmp_path):
    with pytest.raises(SceneError, match=message):
        scene_meshes(Scene(bodies=(body,)), tmp_path)
