"""On the fixtures of Table I every complete detector finds all faces, and none invents one however it is cut short."""

from copy import copy
from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from replay.studies.paper.fixtures import POSES, TARGETS, faces_of_pairs, fixture

TRUNCATED = ["rapid-style", "solid-style", "aabb", "obb"]
COMPLETE = ["exact", "hybrid", "hybrid-qaco[decide=mesh]", *TRUNCATED]
SHARES = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
FEW = [(100, 0), (100, 1), (100, 3), (300, 0), (300, 1)]
ALL = [(target, number) for target in TARGETS for number in range(POSES)]
some_poses = pytest.mark.parametrize("some", [FEW, pytest.param(ALL, marks=pytest.mark.slow)], ids=["few", "all 200"])


def row_of(name, bodies):
    kind, _, decide = name.rstrip("]").partition("[decide=")
    settings = {"decide": decide} if decide else {}
    return create_detector(kind, bodies, containment=False, **settings)


def each_pose(name, some):
    """Every fixture with a detector over its bodies, made once for all the poses of the same two: trees cost most."""
    fixtures = sorted((fixture(*key) for key in some), key=lambda one: (one.target, one.family))
    for _, group in groupby(fixtures, key=lambda one: (one.target, one.family)):
        poses = list(group)
        assert all(one.bodies is poses[0].bodies for one in poses)
        detector = row_of(name, poses[0].bodies)
        yield from ((one, detector) for one in poses)


def cut_short(detector, budget):
    """The same detector over the same trees, with a budget."""
    cut, cut_trees = copy(detector), copy(detector._trees)
    cut.settings = replace(detector.settings, budget=budget)
    cut._trees, cut_trees._budget = cut_trees, budget
    return cut


def work_done(detection):
    return detection.work["node_tests"] + detection.work["leaf_tests"]


def recalls(name, some):
    """Face recall over the poses of each target for each share of the tests that each pose needs, (targets, shares)."""
    found, wanted = {}, {}
    for one, detector in each_pose(name, some):
        work = work_done(detector.detect(one.motion, faces=True))
        truth = set(map(tuple, one.pairs.tolist()))
        faces = [0]
        for share in SHARES:
            cut = cut_short(detector, max(1, int(share * work)))
            pairs = cut.detect(one.motion, faces=True).faces(0, 0)
            assert set(map(tuple, pairs.tolist())) <= truth
            faces.append(faces_of_pairs(pairs))
        assert faces == sorted(faces)
        found[one.target] = found.get(one.target, 0) + np.array(faces[1:])
        wanted[one.target] = wanted.get(one.target, 0) + one.faces
    return np.array([found[target] / wanted[target] for target in found])


@pytest.mark.parametrize("name", COMPLETE)
@some_poses
def test_run_to_completion_it_finds_every_face(name, some):
    for one, detector in each_pose(name, some):
        found = detector.detect(one.motion, faces=True)
        assert found.verdict.tolist() == [[Verdict.CONTACT]]
        assert np.array_equal(found.faces(0, 0), one.pairs)


@pytest.mark.parametrize("name", TRUNCATED)
@some_poses
def test_cut_short_it_finds_some_faces_never_fewer_with_more_budget_and_invents_none(name, some):
    recall = recalls(name, some)
    quarter = recall[:, SHARES.index(0.25)]
    assert ((quarter > 0.05) & (quarter < 0.95)).all(), quarter
    assert (recall[:, -1] == 1.0).all()


@pytest.mark.parametrize("name", TRUNCATED)
def test_cut_over_the_trees_of_another_it_answers_as_one_made_with_that_budget(name):
    for one, detector in each_pose(name, FEW):
        budget = work_done(detector.detect(one.motion, faces=True)) // 4
        shared = cut_short(detector, budget).detect(one.motion, faces=True)
        alone = create_detector(name, one.bodies, containment=False, budget=budget).detect(one.motion, faces=True)
        assert np.array_equal(shared.faces(0, 0), alone.faces(0, 0))
        assert shared.digest == alone.digest and shared.work == alone.work
