"""Every row is asked about the same poses and held to the same truth; complete rows find all, none invents."""

import pytest

from replay.studies.paper.rows import BUDGETED, ROWS, ask, make


def test_poses_of_the_same_meshes_are_together_each_with_a_stamp_of_its_own(groups):
    assert [(group.family, len(group.truth)) for group in groups] == [("beaker-flask", 2), ("torus-sphere", 2)]
    assert all(len(set(group.motion.times.tolist())) == 2 for group in groups)


@pytest.mark.parametrize("name", ROWS)
def test_a_row_invents_nothing_and_a_complete_one_finds_every_face(name, groups):
    for group in groups:
        answer = ask(name, make(name, group.bodies), group, 1)
        assert answer.pairs == answer.right_pairs
        assert 0 <= answer.faces <= answer.true_faces
        if ROWS[name].complete:
            assert answer.face_recall == 1.0 and answer.right_pairs == answer.true_pairs
        assert (answer.operations > 0) == bool(ROWS[name].counters)


@pytest.mark.parametrize("name", [name for name in BUDGETED if ROWS[name].complete])
def test_faces_found_do_not_decrease_with_the_budget_and_a_quarter_finds_some_but_not_all(name, groups):
    group = groups[1]
    whole = ask(name, make(name, group.bodies), group, 0).operations
    budgets = [whole // 4, whole // 2, 3 * whole // 4, whole]
    found = [ask(name, make(name, group.bodies, budget=budget), group, 0).face_recall for budget in budgets]
    assert found == sorted(found) and found[-1] == 1.0
    assert 0.05 < found[0] < 0.95
