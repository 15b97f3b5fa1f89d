"""Some poses of a recording, as a scene places its bodies."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cube, session_of_frames, unit_cubes_on_x

from replay.advice.sampled_poses import PlacedPoses, RecordedPoses, is_plain, sampled_poses
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


@pytest.mark.parametrize(
    ("declared", "plain"),
    [
        ("", True),
        ("offset = { position = [0.0, 0.1, 0.0] }", False),
        ('parent = "table"', False),
        ("fixed = { position = [0.0, -1.0, 0.0] }", False),
    ],
)
def test_declared_position_of_a_body_makes_its_recording_not_plain(declared, plain):
    """An offset, a parent or a fixed place: bodies are not where they were recorded."""
    scene = parse_scene(f'[[body]]\nid = "table"\n[[body]]\nid = "cup"\n{declared}\n')
    session = unit_cubes_on_x({"cup": [0.0, 1.0], "table": [5.0] * 2}, scene=scene)
    assert is_plain(session) == plain
    assert isinstance(sampled_poses(session, np.array([0])), RecordedPoses if plain else PlacedPoses)


def test_pose_that_is_absent_is_filled_from_its_neighbours():
    """The body is at 0 m and 2 m in the frames around 10 ms, in which it has no pose (status 0)."""
    session = session_of_frames([0, 10_000_000, 20_000_000], [[1], [0], [1]])
    poses = sampled_poses(session, np.array([1]))
    np.testing.assert_allclose(poses.positions, [[[1.0, 0.0, 0.0]]])
