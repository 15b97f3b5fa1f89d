"""A false dismissal is found and named."""

import numpy as np
import pytest
from support.motions import grid_plate

from cdcore.narrow.spacetime.block import BY_BOX, BY_PATH, BY_SPAN
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.certificates import FalseDismissalError, count_verified

PLATE = grid_plate(2)
TREES = (build_box_tree(PLATE), build_box_tree(PLATE))


def far(frame):
    return PLATE, PLATE + 50.0


def touching(frame):
    return PLATE, PLATE


def test_true_dismissals_are_counted_frame_by_frame():
    records = np.array([BY_PATH, 3, 7, 0, BY_BOX, 8, 0b101, 0, BY_SPAN, 10, 12, 0])
    assert count_verified(TREES, records, far) == 10


@pytest.mark.parametrize("record", [[BY_PATH, 3, 7, 0], [BY_BOX, 8, 1, 0], [BY_SPAN, 0, 1, 0]])
def test_a_false_dismissal_raises_and_names_two_faces(record):
    with pytest.raises(FalseDismissalError, match=r"faces \d+ and \d+ meet"):
        count_verified(TREES, np.array(record), touching)
