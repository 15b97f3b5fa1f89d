from itertools import pairwise

import numpy as np

from sessions.synthetic.crowded import COLUMNS, FINGERS, NAME, ROWS


def test_crowded_scene_has_40_bodies_of_8_meshes_in_contact(made):
    """Fingers keep their place on the palm; neighbouring beakers overlap by up to 2 mm, or part by up to 3 mm."""
    session, truth = made(NAME).session, made(NAME).truth
    position = dict(zip(session.names, session.frames.position.transpose(1, 0, 2), strict=True))
    assert len(session.meshes) == 40 and len({id(mesh) for mesh in session.meshes.values()}) == len(ROWS) + 3
    assert not truth.episodes and truth.seconds == 2.0
    for side in ("left", "right"):
        offset = [position[f"{side}-{piece}"] - position[f"{side}-palm"] for piece in FINGERS]
        assert len(offset) == 6 and np.ptp(offset, axis=1).max() < 1e-9
    width = np.ptp(session.meshes["beaker-100-0"].bounds, axis=0)[0]
    names = [f"beaker-100-{k}" for k in range(COLUMNS)]
    gap = np.array([np.linalg.norm(position[a] - position[b], axis=1) - width for a, b in pairwise(names)])
    assert -0.002 < gap.min() < 0.0 < gap.max() < 0.003
