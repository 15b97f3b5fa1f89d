"""Every row is held to the truth: complete rows find all, none invents, and less budget never finds more."""

import numpy as np
import pytest

from replay.studies.paper.fixtures import POSES_PER_TARGET, TARGET_FACES, make_fixture
from replay.studies.paper.rows import ROWS, TREE_COUNTS, compared_answers, groups_of, make_detector_of_row

FEW = [(100, 0), (100, 1), (100, 3)]
MORE = [(target, number) for target in TARGET_FACES for number in range(POSES_PER_TARGET)][::9]
"""Both families at every target."""
FRACTIONS = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
some_poses = pytest.mark.parametrize("some", [FEW, pytest.param(MORE, marks=pytest.mark.slow)], ids=["few", "more"])


def groups(some):
    """Poses of the same meshes, for which a detector is made once."""
    result = groups_of(make_fixture(*key) for key in some)
    assert all(pose.bodies is group[0].bodies for group in result for pose in group)
    assert all(len({pose.motion.times[0] for pose in group}) == len(group) for group in result)
    return result


@pytest.mark.sampled(3)
@some_poses
@pytest.mark.parametrize("name", ROWS)
def test_complete_rows_find_all_faces_and_no_row_invents(name, some):
    """Every pair that a row reports is right; complete rows have all true pairs and faces of the fixtures."""
    for group in groups(some):
        result = compared_answers(name, make_detector_of_row(name, group[0].bodies), group)
        assert (result["pairs"] == result["right_pairs"]).all() and (
            (result["seconds"] > 0) & (result["seconds"] < 60)
        ).all()
        assert ((result["operations"] > 0) == bool(ROWS[name].counters)).all()
        if ROWS[name].complete:
            assert (result["right_pairs"] == result["true_pairs"]).all()
            assert (result["faces"] == result["true_faces"]).all()


@pytest.mark.sampled(8)
@some_poses
@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.counters == TREE_COUNTS])
def test_larger_budget_never_finds_fewer_faces(name, some):
    """Budgets are fractions of the operations of a whole answer; the largest one finds all faces."""
    for group in groups(some):
        bodies, true = group[0].bodies, np.array([pose.faces for pose in group])
        work = compared_answers(name, make_detector_of_row(name, bodies), group)["operations"].max()
        cut = [
            compared_answers(name, make_detector_of_row(name, bodies, budget=max(1, int(fraction * work))), group)
            for fraction in FRACTIONS
        ]
        assert all((result["pairs"] == result["right_pairs"]).all() for result in cut)
        faces = np.array([result["faces"] for result in cut])
        assert (np.diff(faces, axis=0) >= 0).all() and (faces[-1] == true).all()
        assert 0.05 < faces[FRACTIONS.index(0.25)].sum() / true.sum() < 0.95
