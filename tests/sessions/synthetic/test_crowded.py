from itertools import pairwise

import numpy as np
import pytest

from cdcore import create_detector
from replay.prepare.assemble import assemble
from sessions.synthetic.crowded import COLUMNS, FINGERS, ROWS, make_crowded_lab


@pytest.fixture(scope="module")
def crowd():
    return make_crowded_lab(faces=500, seconds=2.0)


def test_40_bodies_share_8_meshes_and_each_hand_is_seven_rigid_bodies(crowd):
    session, truth = crowd
    assert len(session.meshes) == 40 and len({id(mesh) for mesh in session.meshes.values()}) == len(ROWS) + 3
    assert not truth.episodes and truth.seconds == 2.0
    for side in ("left", "right"):
        hand = [session.names.index(f"{side}-{part}") for part in ("palm", *FINGERS)]
        offset = session.frames.position[:, hand[1:]] - session.frames.position[:, hand[:1]]
        assert len(hand) == 7 and np.ptp(offset, axis=0).max() < 1e-9


def test_glasses_of_a_row_stand_a_hair_apart_and_touch_now_and_then(crowd):
    session, _ = crowd
    assembly = assemble(session)
    names = [f"beaker-100-{k}" for k in range(COLUMNS)]
    pairs = [(assembly.names.index(a), assembly.names.index(b)) for a, b in pairwise(names)]
    verdict = create_detector("exact", assembly.bodies, pairs=pairs).detect(assembly.motion).verdict
    assert (verdict > 0).any() and (verdict == 0).any()
