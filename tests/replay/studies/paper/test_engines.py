"""An engine finds, with any budget, to the bit what the detector made with that budget finds, and takes as much."""

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from cdcore.search.features import features_of
from cdcore.search.samples import sample_of
from cdcore.search.settings import SearchSettings
from replay.studies.paper.contestants import CONTESTANTS, groups_of, make
from replay.studies.paper.engines import SearchEngine, engines_of
from replay.studies.paper.fixtures import table_fixtures

BUDGETED = tuple(name for name, row in CONTESTANTS.items() if row.counters)


@pytest.fixture(scope="module")
def groups():
    return list(groups_of(table_fixtures((100,), poses=4)))


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
