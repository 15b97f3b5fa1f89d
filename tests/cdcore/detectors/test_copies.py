"""Kernels know memory by its address: a copy of a detector must not search that of the original."""

import pickle
from copy import deepcopy

import numpy as np
import pytest
from support.shapes import ball_mesh

from cdcore import Body, Motion, create_detector


def approach():
    """Two balls of 0.4 and 0.3 m whose middles come from 0.9 to 0.5 m, in 40 frames."""
    positions = np.zeros((40, 2, 3))
    positions[:, 1, 1] = np.linspace(0.9, 0.5, 40)
    return Motion(np.arange(40) / 90.0, positions, np.tile(np.eye(3), (40, 2, 1, 1)))


@pytest.mark.parametrize(("name", "settings"), [("exact", {}), ("continuous", {}), ("collider", {"skin_m": 0.05})])
@pytest.mark.parametrize("copied", [deepcopy, lambda detector: pickle.loads(pickle.dumps(detector))])
def test_copy_of_a_used_detector_outlives_it(name, settings, copied):
    """Memory of the original is freed and written over before the copy is asked again."""
    detector = create_detector(name, [Body("a", ball_mesh(0.4)), Body("b", ball_mesh(0.3))], **settings)
    digest = detector.detect(approach()).digest
    copy = copied(detector)
    assert copy.detect(approach()).digest == digest
    del detector
    reused = [np.full(5_000, 1e300) for _ in range(200)]
    assert copy.detect(approach()).digest == digest and len(reused) == 200
