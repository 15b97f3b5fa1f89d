"""Every row is asked about the same poses and held to the same truth; complete rows find all, none invents."""

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from cdcore.search.features import features_of
from cdcore.search.samples import sample_of
from cdcore.search.settings import SearchSettings
from replay.studies.paper.contestants import (
    CAPPED,
    CAPS,
    CONTESTANTS,
    FCL,
    TREES,
    SearchEngine,
    ask,
    ask_capped,
    engines_of,
    first_contacts,
    make,
)  # fmt: skip


def test_poses_of_the_same_meshes_are_together_each_with_a_stamp_of_its_own(groups):
    assert [(one.family, len(one.truth)) for one in groups] == [("beaker-flask", 2), ("torus-sphere", 2)]
    assert all(len(set(one.motion.times.tolist())) == 2 for one in groups)


@pytest.mark.parametrize("name", CONTESTANTS)
def test_a_row_invents_nothing_and_a_complete_one_finds_every_face(name, groups):
    for group in groups:
        answer = ask(name, make(name, group.bodies), group, 1)
        assert answer.invented == 0
        assert 0 <= answer.faces <= answer.true_faces
        if CONTESTANTS[name].complete:
            assert answer.face_recall == 1.0 and answer.right_pairs == answer.true_pairs
        assert (answer.operations > 0) == bool(CONTESTANTS[name].counters)


@pytest.mark.parametrize("name", [name for name, row in CONTESTANTS.items() if row.counters and row.complete])
def test_faces_found_do_not_decrease_with_the_budget_and_a_quarter_finds_some_but_not_all(name, groups):
    group = groups[1]
    whole = ask(name, make(name, group.bodies), group, 0).operations
    budgets = [whole // 4, whole // 2, 3 * whole // 4, whole]
    found = [ask(name, make(name, group.bodies, budget=budget), group, 0).face_recall for budget in budgets]
    assert found == sorted(found) and found[-1] == 1.0
    assert 0.05 < found[0] < 0.95


BUDGETED = tuple(name for name, row in CONTESTANTS.items() if row.counters)


@pytest.fixture(scope="module")
def engines(groups):
    return [engines_of(group.bodies, BUDGETED) for group in groups]


@pytest.mark.parametrize("name", BUDGETED)
def test_an_engine_is_the_detector_of_the_same_budget(name, groups, engines):
    sizes = set()
    for group, made in zip(groups, engines, strict=True):
        for budget in (40, 700, 4000):
            detector = make(name, group.bodies, budget=budget)
            for pose in (1, 0):
                frame = group.motion.frames(pose, pose + 1)
                found = detector.detect(frame, faces=True)
                pairs, operations = made[name].ask(frame, budget)
                assert np.array_equal(pairs, found.faces(0, 0))
                assert operations == sum(int(found.work[counter]) for counter in CONTESTANTS[name].counters)
                sizes.add(len(pairs))
    assert len(sizes) > 1 or name in ("qaco printed", "qaco random")


@pytest.mark.parametrize("size", [60, None])
def test_a_first_hit_within_a_sample_is_that_of_the_detector_with_as_many_samples(size, groups):
    group = groups[1]
    engine = SearchEngine(
        group.bodies, [features_of(body.mesh) for body in group.bodies], SearchSettings(variant="random", seed=3)
    )
    engine.sample(size, 3)
    detector = create_detector("qaco", group.bodies, variant="random", seed=3, samples=size, budget=5000)
    for pose in range(2):
        found = detector.detect(group.motion.frames(pose, pose + 1))
        spent = engine.first_hit(group.motion.frames(pose, pose + 1), 5000)
        assert (spent is not None) == (found.verdict[0, 0] == Verdict.CONTACT)
        assert spent is None or spent == int(found.work["evaluations"])


def test_sampled_faces_are_those_of_each_body_whatever_the_order_of_names(groups):
    group = groups[1]
    features = [features_of(body.mesh) for body in group.bodies]
    drawn = SearchEngine(group.bodies, features, SearchSettings()).sampled_faces(30, 7)
    for body, some, faces in zip(group.bodies, features, drawn, strict=True):
        assert np.array_equal(faces, some.face[sample_of(some, 30, 7, body.name).pick]) and len(faces) == 30


@pytest.fixture(scope="module")
def group(groups):
    return groups[1]


@pytest.fixture(scope="module")
def trees(engines):
    return engines[1]


@pytest.fixture(scope="module")
def whole(group):
    return {name: [ask(name, make(name, group.bodies), group, pose).operations for pose in range(2)] for name in TREES}


def test_each_row_lists_as_many_pairs_as_its_cap_allows_and_none_is_invented(group, trees, whole):
    found = ask_capped(group, trees, whole)
    assert set(found) == {(name, cap) for name in CAPPED for cap in CAPS}
    for (name, cap), answers in found.items():
        assert [answer.target for answer in answers] == [100, 100]
        for answer, truth in zip(answers, group.truth, strict=True):
            assert answer.pairs == answer.right_pairs == min(cap, len(truth))
            assert (answer.operations > 0) == (name != FCL)


@pytest.mark.parametrize("name", TREES)
def test_a_cap_of_one_finds_the_pair_of_the_first_contact_mode(name, group, trees, whole):
    frame = group.motion.frames(0, 1)
    pairs, operations = first_contacts(trees[name], frame, 1, whole[name][0])
    first = make(name, group.bodies, mode="first").detect(frame, faces=True)
    assert np.array_equal(pairs, first.faces(0, 0)) and len(pairs) == 1
    assert operations == int(first.work["node_tests"]) + int(first.work["leaf_tests"])


@pytest.mark.parametrize("name", TREES)
def test_more_contacts_hold_fewer_and_cost_more(name, group, trees, whole):
    frame = group.motion.frames(1, 2)
    found = [first_contacts(trees[name], frame, cap, whole[name][1]) for cap in (3, 30, 10**6)]
    sets = [set(map(tuple, pairs.tolist())) for pairs, _ in found]
    assert [len(one) for one in sets] == [3, 30, len(group.truth[1])] and sets[0] < sets[1] < sets[2]
    assert found[0][1] < found[1][1] < found[2][1] <= whole[name][1]
