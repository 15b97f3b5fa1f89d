"""Every row is held to the truth: complete rows find all, none invents, and less budget never finds more."""

import numpy as np
import pytest

from replay.studies.paper.fixtures import POSES_PER_TARGET, TARGET_FACES, make_fixture
from replay.studies.paper.rows import ROWS, TREE_COUNTS, compared_answers, groups_of, make_detector_of_row

FEW = [(100, 0), (100, 1), (100, 3)]
"""(target, number): poses in which 100 faces meet, one of torus and sphere, two of beaker and flask."""
MORE = [(target, number) for target in TARGET_FACES for number in range(POSES_PER_TARGET)][::9]
"""One in nine of all poses: both families at every target."""
few_or_more_poses = pytest.mark.parametrize(
    "poses", [FEW, pytest.param(MORE, marks=pytest.mark.slow)], ids=["few", "more"]
)


def poses_by_meshes(poses):
    """Fixtures of the same two meshes together, for which a detector is made once; their stamps differ."""
    groups = groups_of(make_fixture(target, number) for target, number in poses)
    assert all(pose.bodies is group[0].bodies for group in groups for pose in group)
    assert all(len({pose.motion.times[0] for pose in group}) == len(group) for group in groups)
    return groups


@pytest.mark.sampled(3)
@few_or_more_poses
@pytest.mark.parametrize("name", ROWS)
def test_complete_rows_find_all_faces_and_no_row_invents(name, poses):
    """A row is a detector with settings: every face pair that it reports meets; complete rows report all that meet.

    Rows that can be cut short count their operations.
    """
    row = ROWS[name]
    for group in poses_by_meshes(poses):
        answers = compared_answers(name, make_detector_of_row(name, group[0].bodies), group)
        assert (answers["pairs"] == answers["right_pairs"]).all()
        assert ((answers["seconds"] > 0) & (answers["seconds"] < 60)).all(), "a difference of two clock readings"
        assert ((answers["operations"] > 0) == bool(row.counters)).all()
        if row.complete:
            assert (answers["right_pairs"] == answers["true_pairs"]).all()
            assert (answers["faces"] == answers["true_faces"]).all()


@pytest.mark.sampled(8)
@few_or_more_poses
@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.counters == TREE_COUNTS])
def test_larger_budget_never_finds_fewer_faces(name, poses):
    """Hierarchies, rows of ROWS, may do 5 % to 100 % of the operations of an answer: with all they find every face.

    With a quarter of the operations they find some faces and not nearly all: a budget cuts short.
    """
    fractions = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
    for group in poses_by_meshes(poses):
        bodies, true_faces = group[0].bodies, np.array([pose.faces for pose in group])
        all_operations = compared_answers(name, make_detector_of_row(name, bodies), group)["operations"].max()
        faces = []
        for fraction in fractions:
            detector = make_detector_of_row(name, bodies, budget=max(1, int(fraction * all_operations)))
            answers = compared_answers(name, detector, group)
            assert (answers["pairs"] == answers["right_pairs"]).all()
            faces.append(answers["faces"])
        assert (np.diff(faces, axis=0) >= 0).all()
        assert (faces[-1] == true_faces).all()
        assert 0.05 < faces[fractions.index(0.25)].sum() / true_faces.sum() < 0.95
