"""A third opinion: CGAL's exact kernel, through libigl, on proper triangles (it asks for proper ones)."""

import numpy as np
import pytest

from cdcore.narrow.triangles.predicates import triangles_intersect
from replay.studies.stress.families import FAMILIES

cgal = pytest.importorskip("igl.copyleft.cgal", reason="libigl with CGAL is not installed (extra 'test')")

FACE = np.array([[0, 1, 2]], dtype=np.int64)
COUNT = 150


def proper(pairs):
    """Which pairs have no face without area, exactly."""
    from cdcore.narrow.triangles.integers import integers_on_one_scale, normal

    found = []
    for pair in pairs.reshape(-1, 18).tolist():
        n = integers_on_one_scale(pair)
        p = [tuple(n[k : k + 3]) for k in range(0, 18, 3)]
        found.append(any(normal(p[:3])) and any(normal(p[3:])))
    return np.array(found)


def meets_by_cgal(pair):
    first, second = (np.ascontiguousarray(corners) for corners in pair)
    return len(cgal.intersect_other(first, FACE, second, FACE, detect_only=True)[0]) > 0


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_on_proper_triangles_cgal_gives_the_same_answer(family):
    pairs = family.pairs(COUNT, seed=31)
    pairs = pairs[proper(pairs)]
    if family.number in (9, 10, 11):
        assert len(pairs) == 0, "these families have a face without area by construction"
        return
    assert len(pairs) > COUNT // 2
    assert np.array_equal([meets_by_cgal(pair) for pair in pairs], triangles_intersect(pairs))
