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


def test_fixed_body_stands_where_the_scene_says_unless_recorded():
    """A scene fixes the table at y = -1 m and the shelf at y = 2 m; the cup moves along x by 1 m a frame.

    The table was recorded too, at x = 5 m, where it is then; the shelf was not recorded. Frames 0 and 2 are placed.
    """
    session = unit_cubes_on_x({"cup": [0.0, 1.0, 2.0], "table": [5.0] * 3}, scene=parse_scene(SCENE))
    session = replace(session, meshes={**session.meshes, "shelf": cube()})
    poses = PlacedPoses(session, rows=np.array([0, 2]))
    position_of = dict(zip(poses.names, poses.positions.transpose(1, 0, 2).tolist(), strict=True))
    assert position_of == {
        "cup": [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]],
        "table": [[5.0, 0.0, 0.0], [5.0, 0.0, 0.0]],
        "shelf": [[0.0, 2.0, 0.0], [0.0, 2.0, 0.0]],
    }
    assert poses.is_usable.all()


@pytest.mark.parametrize(
    ("declaration", "is_as_recorded"),
    [
        pytest.param("", True, id="nothing"),
        pytest.param("offset = { position = [0.0, 0.1, 0.0] }", False, id="offset"),
        pytest.param('parent = "table"', False, id="parent"),
        pytest.param("fixed = { position = [0.0, -1.0, 0.0] }", False, id="fixed"),
    ],
)
def test_declared_position_of_a_body_makes_its_recording_not_plain(declaration, is_as_recorded):
    """A recording of cup and table is plain unless its scene (TOML) moves a body: then poses have to be placed by it.

    The cup gets the declaration.
    """
    scene = parse_scene(f'[[body]]\nid = "table"\n[[body]]\nid = "cup"\n{declaration}\n')
    session = unit_cubes_on_x({"cup": [0.0, 1.0], "table": [5.0] * 2}, scene=scene)
    assert is_plain(session) == is_as_recorded
    assert isinstance(sampled_poses(session, np.array([0])), RecordedPoses if is_as_recorded else PlacedPoses)


def test_pose_that_is_absent_is_filled_from_its_neighbours():
    """Frames at 0, 10 and 20 ms: the body is at x = 0 and 2 m in the first and the last, and has no pose in the second.

    Halfway in time is halfway between.
    """
    has_pose = [[1], [0], [1]]
    session = session_of_frames([0, 10_000_000, 20_000_000], status=has_pose)
    poses = sampled_poses(session, rows=np.array([1]))
    np.testing.assert_allclose(poses.positions, [[[1.0, 0.0, 0.0]]])
