"""On every hard family the exact predicate agrees with two other exact algorithms and with every exact metamorphic
relation.
"""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from oracles.separating_axes import meets_by_axes
from support.optional import read_cases

from cdcore import Verdict
from cdcore.triangles.decide import triangles_intersect
from cdcore.triangles.integers import pair_intersects_integers
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.triangle_pairs import verdicts_of

by_name = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
FRESH_SEEDS = (20_261, 77_003)


def count_wrong(family, count, seed):
    """How many pairs the product decides other than integers, than separating axes, and than the family was built."""
    pairs = family.pairs(count, seed=seed)
    product = triangles_intersect(pairs)
    integers = np.array([pair_intersects_integers(pair.tolist()) for pair in pairs])
    axes = np.array([meets_by_axes(pair) for pair in pairs])
    by_construction = 0 if family.expected is None else int((product != family.expected).sum())
    return int((product != integers).sum()), int((product != axes).sum()), by_construction


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("count", "seed"),
    [(80, FRESH_SEEDS[0]), pytest.param(4_000, FRESH_SEEDS[1], marks=pytest.mark.slow)],
)
@by_name
def test_each_family_agrees_with_both_exact_algorithms(family, count, seed):
    """No random pair is decided other than by integers, than by separating axes, or than it was built."""
    assert count_wrong(family, count, seed) == (0, 0, 0)


def swapped(pairs, _rng):
    """Both triangles of each pair exchanged."""
    return pairs[:, ::-1]


def reordered(pairs, rng):
    """The corners of each triangle in a random order, so that windings are reversed too."""
    order = np.array([*permutations(range(3))])[rng.integers(0, 6, (len(pairs), 2))]
    return np.take_along_axis(pairs, order[..., None], axis=2)


def rotated(pairs, rng):
    """The axes permuted, each with a sign."""
    return pairs[..., rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)


def scaled(pairs, rng):
    """Each pair scaled by a power of two."""
    return pairs * 2.0 ** rng.integers(-10, 11, (len(pairs), 1, 1, 1))


def shifted(pairs, rng):
    """Each pair moved by multiples of 8, where that rounds no coordinate; elsewhere as it is."""
    moved = pairs + 8.0 * rng.integers(-4, 5, (len(pairs), 1, 1, 3))
    shift = moved - pairs
    exact = (moved - shift == pairs).all(axis=(1, 2, 3)) & (shift == shift[:, :1, :1]).all(axis=(1, 2, 3))
    return np.where(exact[:, None, None, None], moved, pairs)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("relation", [swapped, reordered, rotated, scaled, shifted])
@by_name
def test_no_exact_relation_flips_an_answer(family, relation):
    """Each relation changes numbers without rounding, so that whether triangles meet stays."""
    rng = np.random.default_rng(family.number)
    pairs = family.pairs(400, seed=FRESH_SEEDS[1])
    assert np.array_equal(triangles_intersect(relation(pairs, rng)), triangles_intersect(pairs))


FILES = sorted((Path(__file__).parent / "regressions").glob("*.npz"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_case_that_failed_somewhere_is_right_here(path):
    """Each file of regressions has triangle pairs and whether they meet, which separating axes confirm."""
    cases = read_cases(path)
    assert np.array_equal([meets_by_axes(pair) for pair in cases.triangles], cases.truth)
    assert np.array_equal(triangles_intersect(cases.triangles), cases.truth)
    assert np.array_equal(verdicts_of("exact", cases.triangles) == Verdict.CONTACT, cases.truth)
    assert len(cases.row) > 0 < len(FILES)


FACE = np.array([[0, 1, 2]], dtype=np.int64)
COUNT = 150


def proper(pairs):
    """Whether both faces of each pair have an area, exactly."""
    from cdcore.triangles.integers import integer_points, normal

    proper_pairs = []
    for pair in pairs:
        p, _ = integer_points(pair)
        proper_pairs.append(any(normal(p[:3])) and any(normal(p[3:])))
    return np.array(proper_pairs)


def meets_by_cgal(cgal, pair):
    """Whether CGAL says that two triangles meet."""
    first, second = (np.ascontiguousarray(corners) for corners in pair)
    return len(cgal.intersect_other(first, FACE, second, FACE, detect_only=True)[0]) > 0


@by_name
def test_on_proper_triangles_cgal_gives_the_same_answer(family):
    """A proper triangle has an area; CGAL is an independent exact library."""
    cgal = pytest.importorskip("igl.copyleft.cgal", reason="libigl with CGAL is not installed (extra 'test')")
    pairs = family.pairs(COUNT, seed=31)
    pairs = pairs[proper(pairs)]
    if family.name in ("collinear against proper", "point on a face", "point off a face"):
        assert len(pairs) == 0, "these families have a face without area by construction"
        return
    assert len(pairs) > COUNT // 2
    assert np.array_equal([meets_by_cgal(cgal, pair) for pair in pairs], triangles_intersect(pairs))
