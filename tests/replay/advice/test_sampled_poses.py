"""Some poses of a recording, as a scene places its bodies."""

from dataclasses import replace

import numpy as np
from support.small_worlds import cube, unit_cubes_on_x

from replay.advice.sampled_poses import PlacedPoses
from sessions.scene_files.scene_toml import parse_scene

SCENE = """
[[body]]
id = "cup"
[[body]]
id = "table"
fixed = { position = [0.0, -1.0, 0.0] }
[[body]]
id = "shelf"
fixed = { position = [0.0, 2.0, 0.0] }
"""


def test_fixed_bodies_stand_once_where_the_scene_says():
    """The table was recorded although it is fixed; the shelf was not."""
    session = unit_cubes_on_x({"cup": [0.0, 1.0, 2.0], "table": [5.0] * 3}, scene=parse_scene(SCENE))
    session = replace(session, meshes={**session.meshes, "shelf": cube()})
    poses = PlacedPoses(session, rows=np.array([0, 2]))
    assert poses.names == ("cup", "table", "shelf")
    np.testing.assert_array_equal(poses.positions[:, 0], [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    np.testing.assert_array_equal(poses.positions[:, 2], [[0.0, 2.0, 0.0]] * 2)
    assert poses.is_usable.all()
