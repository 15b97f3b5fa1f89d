"""Bodies at rest, and the nearest moment of bodies that never touch."""

import numpy as np
import pytest
from support.shapes import unrotated_motion
from support.small_worlds import STEP_NS, along_x, cube, unit_cubes_on_x

from replay.advice import scene_outcome
from replay.advice.scene_outcome import Outcome, ReplayedBodies, outcome_text, resting_bodies
from replay.prepare.assemble import assemble
from sessions import MeshData, Session

PAIRS_OF_THREE = [("a", "b"), ("a", "c"), ("b", "c")]

FRAMES = 17
"""At 8 Hz: half a second is four frames, so that the last frame with a frame half a second later is number 12."""


def test_body_rests_where_it_moves_two_millimetres_at_most():
    """17 frames at 8 Hz. A body rests in a frame if half a second (four frames) later it is at most 2 mm away.

    So frames 13 to 16 are never at rest. A body must have a pose in both frames, or it is not known to rest.
    """
    frames = np.arange(FRAMES)
    stops_in_frame_8 = 0.1 * np.minimum(frames, 8)
    slow, less_slow = 0.0019 / 4 * frames, 0.0021 / 4 * frames  # 1.9 and 2.1 mm in four frames
    stands_still = np.zeros(FRAMES)
    translations = np.zeros((FRAMES, 4, 3))
    translations[:, :, 0] = np.stack([stops_in_frame_8, slow, less_slow, stands_still], axis=1)
    has_pose = np.ones((FRAMES, 4), np.bool_)
    has_pose[10, 3] = False  # the last body
    resting = resting_bodies(unrotated_motion(translations, frames / 8, has_pose))
    frames_at_rest = [np.flatnonzero(column).tolist() for column in resting.T]
    assert frames_at_rest == [
        [8, 9, 10, 11, 12],
        [*range(13)],
        [],
        [frame for frame in range(13) if frame not in (6, 10)],  # four frames after 6 is 10
    ]


@pytest.mark.parametrize("side", [pytest.param(1, id="right of it"), pytest.param(-1, id="left of it")])
def test_closest_moment_is_measured_in_the_nearest_frame(monkeypatch, side):
    """A unit cube at x = 10 m, and one 3, 1.5, 1.2 and 2 m beside it: in frame 2 their faces are 0.2 m apart.

    Gaps are measured in one frame only, that whose bounding boxes are nearest. The second mesh is 5 m off the origin of
    its body.
    """
    monkeypatch.setattr(scene_outcome, "GAP_FRAMES", 1)
    distances, mesh_offset = np.array([3.0, 1.5, 1.2, 2.0]), 5.0
    poses = {"a": along_x([10.0] * 4), "b": along_x(10.0 + side * distances - mesh_offset)}
    meshes = {"a": cube(), "b": MeshData(np.add(cube().vertices, [mesh_offset, 0.0, 0.0]), cube().faces)}
    assembly = assemble(Session.from_arrays(np.arange(4) * STEP_NS, poses, meshes))
    outcome = ReplayedBodies(assembly).outcome(assembly.motion)
    assert outcome.contacts == 0
    assert outcome.closest_frame == 2
    assert outcome.closest == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("contacts", "deepest", "closest", "text"),
    [
        pytest.param(0, 0.0, None, "no contact", id="no gap measured"),
        pytest.param(0, 0.0, 0.0012, "no contact, 1.2 mm at the closest", id="a gap"),
        pytest.param(2, 0.04, 0.0, "2 contacts, bodies up to 40 mm deep in each other", id="deep"),
        pytest.param(1, 0.0023, 0.0, "1 contact, at most 3 mm deep", id="shallow: rounded up"),
    ],
)
def test_outcome_names_contacts_depth_or_distance(contacts, deepest, closest, text):
    """Contacts of a replay, metres of the deepest overlap, and of the smallest gap, which counts without a contact."""
    no_frames = np.zeros((1, 1), np.bool_)  # contact a frame and pair: not of interest
    outcome = Outcome(contacts, no_frames, deepest=deepest, closest=closest, closest_frame=0, closest_pair=0)
    assert outcome_text(outcome) == text


def test_closest_pair_of_several_is_reported():
    """Unit cubes on X, still: 2 m, 3.5 m and 0.5 m lie between the surfaces of a-b, a-c and b-c."""
    assembly = assemble(unit_cubes_on_x({"a": [0.0, 0.0], "b": [3.0, 3.0], "c": [4.5, 4.5]}), pairs=PAIRS_OF_THREE)
    assert ReplayedBodies(assembly).outcome(assembly.motion).closest == pytest.approx(0.5)
