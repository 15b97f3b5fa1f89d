"""An engine stopped at its k-th contact lists k true pairs, the first of its way, for fewer operations than all."""

import numpy as np
import pytest

from replay.studies.paper.contact_caps import CAPPED, CAPS, FCL, ask_capped, first_contacts
from replay.studies.paper.contestants import ask, groups_of, make
from replay.studies.paper.engines import TREES, engines_of
from replay.studies.paper.fixtures import table_fixtures


@pytest.fixture(scope="module")
def group():
    return list(groups_of(table_fixtures((100,), poses=4)))[1]


@pytest.fixture(scope="module")
def engines(group):
    return engines_of(group.bodies, tuple(TREES))


@pytest.fixture(scope="module")
def whole(group):
    return {name: [ask(name, make(name, group.bodies), group, pose).operations for pose in range(2)] for name in TREES}


def test_each_row_lists_as_many_pairs_as_its_cap_allows_and_none_is_invented(group, engines, whole):
    found = ask_capped(group, engines, whole)
    assert set(found) == {(name, cap) for name in CAPPED for cap in CAPS}
    for (name, cap), answers in found.items():
        assert [target for target, _ in answers] == [100, 100]
        for (_, answer), truth in zip(answers, group.truth, strict=True):
            assert answer.pairs == answer.right_pairs == min(cap, len(truth))
            assert (answer.operations > 0) == (name != FCL)


@pytest.mark.parametrize("name", TREES)
def test_a_cap_of_one_finds_the_pair_of_the_first_contact_mode(name, group, engines, whole):
    frame = group.motion.frames(0, 1)
    pairs, operations = first_contacts(engines[name], frame, 1, whole[name][0])
    first = make(name, group.bodies, mode="first").detect(frame, faces=True)
    assert np.array_equal(pairs, first.faces(0, 0)) and len(pairs) == 1
    assert operations == int(first.work["node_tests"]) + int(first.work["leaf_tests"])


@pytest.mark.parametrize("name", TREES)
def test_more_contacts_hold_fewer_and_cost_more(name, group, engines, whole):
    frame = group.motion.frames(1, 2)
    found = [first_contacts(engines[name], frame, cap, whole[name][1]) for cap in (3, 30, 10**6)]
    sets = [set(map(tuple, pairs.tolist())) for pairs, _ in found]
    assert [len(one) for one in sets] == [3, 30, len(group.truth[1])] and sets[0] < sets[1] < sets[2]
    assert found[0][1] < found[1][1] < found[2][1] <= whole[name][1]
