"""Bodies at rest, and the nearest moment of bodies that never touch."""

import numpy as np
import pytest
from support.shapes import unrotated_motion
from support.small_worlds import STEP_NS, along_x, cube

from replay.advice import scene_outcome
from replay.advice.scene_outcome import Outcome, ReplayedBodies, outcome_text, resting_bodies
from replay.prepare.assemble import assemble
from sessions import MeshData, Session

FRAMES = 17
"""At 8 Hz: half a second is four frames, so that the last frame with a frame half a second later is number 12."""


def test_body_rests_where_it_moves_two_millimetres_at_most():
    """Bodies: stops in frame 8; moves by 1.9 mm in four frames; by 2.1 mm; stands still, without a pose in frame 10."""
    frames = np.arange(FRAMES)
    translations = np.zeros((FRAMES, 4, 3))
    translations[:, 0, 0] = 0.1 * np.minimum(frames, 8)
    translations[:, 1, 0], translations[:, 2, 0] = 0.0019 / 4 * frames, 0.0021 / 4 * frames
    has_pose = np.ones((FRAMES, 4), np.bool_)
    has_pose[10, 3] = False
    motion = unrotated_motion(translations, frames / 8, has_pose)
    resting = [np.flatnonzero(column).tolist() for column in resting_bodies(motion).T]
    assert resting == [[8, 9, 10, 11, 12], [*range(13)], [], [k for k in range(13) if k not in (6, 10)]]


@pytest.mark.parametrize("side", [1, -1])
def test_closest_moment_is_measured_in_the_nearest_frame(monkeypatch, side):
    """Unit cubes at 10 m and 3, 1.5, 1.2 and 2 m beside it; one frame is measured. One mesh is 5 m off its origin."""
    monkeypatch.setattr(scene_outcome, "GAP_FRAMES", 1)
    distances = np.array([3.0, 1.5, 1.2, 2.0])
    poses = {"a": along_x([10.0] * 4), "b": along_x(10.0 + side * distances - 5.0)}
    meshes = {"a": cube(), "b": MeshData(np.add(cube().vertices, [5.0, 0.0, 0.0]), cube().faces)}
    assembly = assemble(Session.from_arrays(np.arange(4) * STEP_NS, poses, meshes))
    outcome = ReplayedBodies(assembly).outcome(assembly.motion)
    assert (outcome.contacts, outcome.closest_frame) == (0, 2) and outcome.closest == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("contacts", "deepest", "closest", "text"),
    [
        (0, 0.0, None, "no contact"),
        (0, 0.0, 0.0012, "no contact, 1.2 mm at the closest"),
        (2, 0.04, 0.0, "2 contacts, bodies up to 40 mm deep in each other"),
        (1, 0.0023, 0.0, "1 contact, at most 3 mm deep"),
    ],
)
def test_outcome_names_contacts_depth_or_distance(contacts, deepest, closest, text):
    """Shallow depths are rounded up to whole millimetres; distances (metres) only where nothing touches."""
    outcome = Outcome(contacts, np.zeros((1, 1), np.bool_), deepest, closest, closest_frame=0, closest_pair=0)
    assert outcome_text(outcome) == text
