import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from support.mcap_samples import tetrahedron

from sessions.mcap_format import scene_update as module
from sessions.mcap_format.scene_update import scene_update
from sessions.model.scene import Pose, Scene, SceneBody


def entities(meshes, scene=None):
    update = SceneUpdate.FromString(scene_update(meshes, scene or Scene(), 5))
    return {entity.id: entity for entity in update.entities}


def test_every_body_is_drawn_with_its_own_triangles_in_its_own_frame():
    mesh = tetrahedron(1 / 3)
    entity = entities({"cup": mesh})["cup"]
    (part,) = entity.triangles
    points = np.array([[p.x, p.y, p.z] for p in part.points])
    assert points.tobytes() == mesh.vertices.tobytes()
    assert np.array(part.indices).reshape(-1, 3).tolist() == mesh.faces.tolist()
    assert entity.frame_id == "cup" and entity.frame_locked and entity.timestamp.nanos == 5
    assert part.color.a == 1


def test_a_body_that_never_moves_lies_where_the_scene_puts_it_and_glass_is_translucent():
    scene = Scene(bodies=(
        SceneBody("bench", fixed=Pose((1, 2, 3))),
        SceneBody("cup", offset=Pose((0, 0, 4)), tags=("glass",)),
        SceneBody("tap", fixed=Pose(), parent="cup"),
    ))  # fmt: skip
    found = entities(dict.fromkeys(["bench", "cup", "tap"], tetrahedron()), scene)
    assert [found[name].frame_id for name in ("bench", "cup", "tap")] == ["world", "cup", "cup"]
    assert found["bench"].triangles[0].pose.position.y == 2 and found["cup"].triangles[0].pose.position.z == 4
    assert found["cup"].triangles[0].color.a < 0.5 < found["bench"].triangles[0].color.a


def test_beyond_its_size_the_drawing_shows_boxes_that_hold_the_mesh(monkeypatch):
    monkeypatch.setattr(module, "DRAWING_BYTES", 200)
    turned = Pose((1, 0, 0), (0, 0, np.sqrt(0.5), np.sqrt(0.5)))  # a quarter turn about z
    scene = Scene(bodies=(SceneBody("big", offset=turned),))
    big = tetrahedron(2.0)
    found = entities({"big": big, "small": tetrahedron()}, scene)
    assert found["small"].cubes or found["big"].cubes
    found = entities({"one": tetrahedron(), "big": big}, scene)
    assert len(found["one"].triangles) == 1
    (box,) = found["big"].cubes
    assert (box.size.x, box.size.y, box.size.z) == (2, 2, 2)
    centre = [box.pose.position.x, box.pose.position.y, box.pose.position.z]
    assert np.allclose(centre, [1 - 1, 1, 1], atol=1e-12)
