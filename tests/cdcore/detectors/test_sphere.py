"""Spheres say CANDIDATE or CLEAR, never CONTACT, and the paper's ball only adds candidates."""

from __future__ import annotations

import numpy as np
import pytest
from support.shapes import ball_mesh, beaker_mesh, lab, still

from cdcore import Body, Verdict, create_detector
from cdcore.bounding.sphere import sphere_best, sphere_by_triangle_mean


def test_only_volumes_are_spoken_of():
    bodies, motion = lab(300, gaps=False)
    found = set(np.unique(create_detector("sphere", bodies).detect(motion).verdict).tolist())
    assert found == {Verdict.CLEAR, Verdict.CANDIDATE}


@pytest.mark.parametrize("mode", ["paper", "best"])
@pytest.mark.parametrize(
    ("gap", "verdict"), [(-1e-6, Verdict.CANDIDATE), (0.0, Verdict.CANDIDATE), (1e-6, Verdict.CLEAR)]
)
def test_a_pair_is_a_candidate_up_to_the_sum_of_radii(mode, gap, verdict):
    bodies = [Body("a", ball_mesh(0.5)), Body("b", beaker_mesh())]
    build = {"paper": sphere_by_triangle_mean, "best": sphere_best}[mode]
    one, other = (build(body.mesh) for body in bodies)
    offset = np.array([one.radius + other.radius + gap, 0, 0]) + one.centre - other.centre
    motion = still(bodies, [[0, 0, 0], offset])
    assert create_detector("sphere", bodies, sphere=mode).detect(motion).verdict[0, 0] == verdict


def test_the_best_ball_has_no_more_candidates_than_the_papers():
    bodies, motion = lab(300)
    counts = [
        (create_detector("sphere", bodies, sphere=mode).detect(motion).verdict == Verdict.CANDIDATE).sum()
        for mode in ("paper", "best")
    ]
    assert counts[1] <= counts[0]


def test_skipping_is_counted_and_changes_no_digest():
    bodies, motion = lab(300)
    leaping, plain = (create_detector("sphere", bodies, skip=skip).detect(motion) for skip in (True, False))
    assert leaping.digest == plain.digest
    assert leaping.work["skipped"] > plain.work["skipped"] == 0
    assert leaping.work["sphere_tests"] + leaping.work["skipped"] == plain.work["sphere_tests"]


def test_containment_is_refused_with_the_reason():
    bodies, motion = lab(2)
    assert set(create_detector("sphere", bodies).detect(motion).containment) == {"refused: spheres alone cannot tell"}
