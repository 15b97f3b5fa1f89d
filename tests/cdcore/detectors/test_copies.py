"""Kernels know memory by its address: a copy of a detector must not search that of the original."""

import pickle
from copy import deepcopy

import numpy as np
import pytest
from support.shapes import ball_mesh

from cdcore import Body, Motion, create_detector


def approach():
    """Two balls of radius 0.4 and 0.3 m whose middles come from 0.9 to 0.5 m, in 40 frames: they touch at 0.7 m."""
    positions = np.zeros((40, 2, 3))
    positions[:, 1, 1] = np.linspace(0.9, 0.5, 40)
    return Motion(np.arange(40) / 90.0, positions, np.tile(np.eye(3), (40, 2, 1, 1)))


@pytest.mark.parametrize(("name", "settings"), [("exact", {}), ("continuous", {}), ("collider", {"skin_m": 0.05})])
@pytest.mark.parametrize(
    "copied", [deepcopy, lambda detector: pickle.loads(pickle.dumps(detector))], ids=["deepcopy", "pickle"]
)
def test_copy_of_a_used_detector_outlives_it(name, settings, copied):
    """Two balls approach and touch; the copy gives the same answer, also when the original is freed.

    Its memory is written over: 8 MB of 1e300 are most likely to lie there.
    """
    detector = create_detector(name, [Body("a", ball_mesh(0.4)), Body("b", ball_mesh(0.3))], **settings)
    digest = detector.detect(approach()).digest
    copy = copied(detector)
    assert copy.detect(approach()).digest == digest
    del detector
    written_over = [np.full(5_000, 1e300) for _ in range(200)]
    assert copy.detect(approach()).digest == digest
    del written_over
