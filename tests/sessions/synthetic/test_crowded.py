from itertools import pairwise

import numpy as np

from sessions.synthetic.crowded import COLUMNS, FINGERS, NAME, ROWS


def test_crowded_scene_has_40_bodies_of_8_meshes(made):
    """A made-up scene of 2 s has five rows of five glasses, two hands of a palm and six pieces each, and their bench.

    These 25 + 14 + 1 bodies share 8 meshes: one a row, and those of palm, finger and bench. No contact is planted.
    """
    session, truth = made(NAME).session, made(NAME).truth
    assert len(session.meshes) == 40
    different_meshes = {id(mesh) for mesh in session.meshes.values()}
    palm_finger_and_bench = 3
    assert len(different_meshes) == len(ROWS) + palm_finger_and_bench == 8
    assert truth.episodes == ()
    assert truth.seconds == 2.0


def positions_by_name(session):
    """Body -> positions (n, 3)."""
    return dict(zip(session.names, session.frames.position.transpose(1, 0, 2), strict=True))


def test_fingers_of_the_crowded_scene_stay_on_their_palm(made):
    """The distance of each of six pieces of a hand from its palm is the same in all frames."""
    positions = positions_by_name(made(NAME).session)
    for side in ("left", "right"):
        offsets = [positions[f"{side}-{piece}"] - positions[f"{side}-palm"] for piece in FINGERS]
        assert len(offsets) == 6, side
        assert np.ptp(offsets, axis=1).max() < 1e-9, side


def test_neighbouring_beakers_of_the_crowded_scene_touch_and_separate(made):
    """Beakers of a row stand 1 mm apart by their widths, and each trembles by 0.55 mm: gaps of -0.1 to 2.1 mm.

    So they overlap at times, by less than 2 mm, and are apart at others, by less than 3 mm.
    """
    session = made(NAME).session
    positions = positions_by_name(session)
    width, _height, _depth = np.ptp(session.meshes["beaker-100-0"].bounds, axis=0)
    names = [f"beaker-100-{column}" for column in range(COLUMNS)]
    gaps = np.array([np.linalg.norm(positions[a] - positions[b], axis=1) - width for a, b in pairwise(names)])
    assert -0.002 < gaps.min() < 0.0
    assert 0.0 < gaps.max() < 0.003
