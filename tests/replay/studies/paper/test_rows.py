"""Every row is asked about the same poses and held to the same truth; complete rows find all, none invents."""

import pytest

from replay.studies.paper.rows import ROWS, ask, make


def test_poses_of_the_same_meshes_are_together_each_with_a_stamp_of_its_own(groups):
    assert [{pose.family for pose in group} for group in groups] == [{"beaker-flask"}, {"torus-sphere"}]
    assert all(len({pose.motion.times[0] for pose in group}) == 2 for group in groups)


@pytest.mark.parametrize("name", ROWS)
def test_a_row_invents_nothing_and_a_complete_one_finds_every_face(name, groups):
    for group in groups:
        answer = ask(name, make(name, group[0].bodies), group[1])
        assert answer.pairs == answer.right_pairs
        assert 0 <= answer.faces <= answer.true_faces and 0 < answer.seconds < 60
        if ROWS[name].complete:
            assert answer.face_recall == 1.0 and answer.right_pairs == answer.true_pairs
        assert (answer.operations > 0) == bool(ROWS[name].counters)
