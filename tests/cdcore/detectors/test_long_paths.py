"""A path that a body has behind it changes no answer: sums of long paths round by more than a small gap.

Truth needs no search: bodies with faces along the axes meet if and only if their placed intervals do.
"""

from functools import cache

import numpy as np
import pytest
from support.shapes import box_mesh, unrotated_motion

from cdcore import Body, TriangleMesh, Verdict, create_detector, join
from cdcore.protocol import detect_live

NEEDLES = 8
THIN = 2.0**-12
"""Metres: a needle's bounding sphere is longer than the needle by 30 nm, so that path lengths are asked to the end."""
APPROACH = 200
JUMP, CORRUPT = 900e3, 3e14
"""Metres: a jump that is not yet taken for a corrupt pose, and one that no room has."""


def scene(positions, step, handle):
    """A plate across x at ``positions`` (T,), then at rest while needles along x come nearer by some ``step`` a frame.

    ``handle``: a face of the plate beside the needles, so that its bounding box holds them before anything meets.
    Returns bodies, pairs, motion and whether each pair meets, (T, P).
    """
    rng, frames, wide = np.random.default_rng(0), len(positions) + APPROACH, float(NEEDLES)
    corners = [
        (0, -wide, -1),
        (0, wide, -1),
        (0, wide, 1),
        (0, -wide, 1),
        (1.5, -wide, -1),
        (1.5, -wide, 1),
        (1.5, 0.1 - wide, 1),
    ]
    plate = TriangleMesh(np.array(corners), np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6)][: 3 if handle else 2]))
    bodies = [Body("plate", plate), *(Body(f"needle {k}", box_mesh((1.0, THIN, THIN))) for k in range(NEEDLES))]
    translations = np.zeros((frames, 1 + NEEDLES, 3))
    translations[: len(positions), 0, 0] = positions
    start = 0.5 + step * APPROACH * rng.uniform(0.3, 0.7, NEEDLES)
    direction = start - np.cumsum(step * rng.uniform(0.5, 1.5, (APPROACH, NEEDLES)), axis=0)
    translations[: len(positions), 1:, 0] = direction[0] + rng.uniform(0.0, 1.0, NEEDLES)
    translations[len(positions) :, 1:, 0] = direction
    translations[:, 1:, 1] = 2.0 * (np.arange(NEEDLES) - NEEDLES / 2) + 0.3
    motion = unrotated_motion(translations, np.arange(frames) / 90.0)
    x, plate_x = translations[:, 1:, 0], translations[:, :1, 0]
    pairs = np.stack([np.zeros(NEEDLES, dtype=np.int64), 1 + np.arange(NEEDLES)], axis=1)
    return bodies, pairs, motion, (x - 0.5 <= plate_x) & (plate_x <= x + 0.5)


def jumps(frames):
    """Positions that alternate between the origin and about JUMP metres."""
    return np.where(np.arange(frames) % 2 == 0, JUMP, 0.0) * np.random.default_rng(1).uniform(0.9, 1.0, frames)


@cache
def jumps_then_rest():
    """A scene of 5,000 jumps, then of steps of 30 nm: a sum of their 4.5e9 m is rounded to 1 um."""
    return scene(jumps(frames=5_000), step=3e-8, handle=False)


def an_hour_of_jumps_then_rest():
    """A scene of 330,000 jumps, then of steps of 0.3 um."""
    return scene(jumps(frames=330_000), step=3e-7, handle=False)


@cache
def corrupt_pose_then_rest():
    """A scene of one corrupt pose, then of steps of 3 mm."""
    return scene(np.array([0.0, CORRUPT]), step=3e-3, handle=True)


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    ("name", "scene_after_a_long_path"),
    [("exact", jumps_then_rest), pytest.param("exact", an_hour_of_jumps_then_rest, marks=pytest.mark.slow)]
    + [(name, corrupt_pose_then_rest) for name in ("exact", "obb", "solid-style")],
)
def test_contact_after_a_long_path_starts_in_its_frame(name, scene_after_a_long_path):
    """A plate jumps for thousands of frames, or to 3e14 m; then it rests for 200 frames (APPROACH) while eight needles
    come nearer in tiny steps.

    ``meets``: whether a needle's interval on x holds the plate, by its placed ends; in those frames that comes and
    goes. Whole, in blocks of 997 frames, which end within the path, frame by frame, and for the last frame alone the
    contacts are those.
    """
    bodies, pairs, motion, meets = scene_after_a_long_path()
    assert 0.2 < meets[-APPROACH:].mean() < 0.8
    detector = create_detector(name, bodies, pairs=pairs)
    for answer in (detector.detect(motion), join(detector.stream(motion.blocks(997))), detect_live(detector, motion)):
        np.testing.assert_array_equal(answer.verdict == Verdict.CONTACT, meets)
    last_frame = motion.frames(len(motion) - 1, len(motion))
    np.testing.assert_array_equal(detector.detect(last_frame).verdict == Verdict.CONTACT, meets[-1:])
