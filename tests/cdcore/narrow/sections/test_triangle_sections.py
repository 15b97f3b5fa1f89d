"""A section, the segment in which two triangles cross, is there where they meet, and its ends lie on both of them."""

from fractions import Fraction

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, motion_at_rest, triangle_family

from cdcore import Body, create_detector
from cdcore.errors import InvalidTrianglesError
from cdcore.narrow.margins import triangle_margins
from cdcore.narrow.sections.triangle_sections import triangle_pair_sections
from cdcore.triangles.decide import triangles_intersect
from replay.studies.stress.families import FAMILIES

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
"""A right triangle in z = 0: x >= 0, y >= 0 and x + y <= 1."""
FAMILIES_WITH_PLANES = [family for family in FAMILIES if family.name != "needles"]
"""Random pairs of triangles that are hard to decide; of a needle a double does not know where its plane is."""


@pytest.mark.sampled(3)
@pytest.mark.parametrize("family", FAMILIES_WITH_PLANES, ids=lambda family: family.name)
def test_intersection_segment_ends_lie_on_both_triangles(family):
    """40 pairs of a family: every pair that meets has a segment, others have NaN or one within the same bound.

    Its ends are within 1e-12 of the largest coordinate of both triangles, an end being a triangle of three equal
    corners.
    """
    pairs = family.pairs(40, seed=9)
    sections = triangle_pair_sections(pairs)
    has_section = np.isfinite(sections).all(axis=(1, 2))
    assert has_section[triangles_intersect(pairs)].all()
    ends = np.repeat(sections[has_section].reshape(-1, 1, 3), 3, axis=1)
    for side in (0, 1):
        triangles = np.repeat(pairs[has_section, side], 2, axis=0)
        meets, distance = triangle_margins(np.stack([ends, triangles], axis=1))
        assert (meets | (distance < 1e-12 * np.abs(pairs).max())).all(), side


def test_exactly_the_triangles_that_meet_have_a_section():
    """300 random pairs of triangles; without a section the segment is NaN."""
    pairs = triangle_family("generic control").pairs(300, seed=9)
    has_section = np.isfinite(triangle_pair_sections(pairs)).all(axis=(1, 2))
    meets = triangles_intersect(pairs)
    assert 0 < meets.sum() < 300
    assert np.array_equal(has_section, meets)


def test_distance_from_origin_creates_no_section():
    """Two parallel triangles 2^-34 m apart, 0.06 nm, 8 km from the origin on each axis.

    A slack in proportion to the place, and not to the pair, would close a gap of 32 roundings of the place.
    """
    far, gap = 2.0**13, 2.0**-34
    above = np.array(FLOOR) + np.array([0.0, 0.0, gap])
    assert np.isnan(triangle_pair_sections(np.array([[FLOOR, above]]) + far)).all()


def test_a_coplanar_overlap_gives_its_longest_chord():
    """A right triangle upon itself: its longest chord is the hypotenuse, from (1, 0, 0) to (0, 1, 0)."""
    (section,) = triangle_pair_sections([[FLOOR, FLOOR]])
    assert sorted(section.tolist()) == [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]


def range_within_floor(p, q):
    """From and to which fraction of the way from p to q (x, y) points are in FLOOR; begin > end where none are."""
    begin, end = Fraction(0), Fraction(1)
    for a, b in ((p[0], q[0]), (p[1], q[1]), (1 - p.sum(), 1 - q.sum())):  # at p and at q, inside from 0 on
        a, b = Fraction(a), Fraction(b)
        if (a < 0 and b < 0) or a == b < 0:
            return Fraction(2), end
        if a < 0:
            begin = max(begin, a / (a - b))
        elif b < 0:
            end = min(end, a / (a - b))
    return begin, end


def test_coplanar_edge_is_cut_where_it_leaves_the_face():
    """300 triangles that stand on an edge in the plane of FLOOR, like tents, with their tips above it.

    The section is what of that edge lies within FLOOR, by rationals; a tent whose edge lies beside it has none.
    """
    ends = np.random.default_rng(2).integers(-16, 32, (300, 2, 2)) / 16
    ends = ends[(ends[:, 0] != ends[:, 1]).any(axis=1)]
    tips = np.tile([0.25, 0.25, 1.0], (len(ends), 1, 1))
    tents = np.concatenate([np.insert(ends, 2, 0.0, axis=2), tips], axis=1)
    for (p, q), section in zip(ends, triangle_pair_sections([[FLOOR, tent] for tent in tents]), strict=True):
        begin, end = range_within_floor(p, q)
        assert np.isfinite(section).all() == (begin <= end)
        if begin <= end:
            expected = np.array([p + float(fraction) * (q - p) for fraction in (begin, end)])
            in_either_order = (np.abs(section[:, :2] - expected).max(), np.abs(section[::-1, :2] - expected).max())
            assert min(in_either_order) < 1e-12


def test_no_pairs_give_no_segments():
    """An empty list has segments (0, 2, 3): of two ends with three coordinates."""
    assert triangle_pair_sections([]).shape == (0, 2, 3)


def test_sections_of_triangles_with_nan_are_refused():
    """A pair of triangles (1, 2, 3, 3) without any number."""
    with pytest.raises(InvalidTrianglesError, match="pair 0 has a coordinate that is not finite"):
        triangle_pair_sections(np.full((1, 2, 3, 3), np.nan))


@pytest.mark.parametrize("height", [0.31, 0.452], ids="ball at {} m".format)
def test_segments_lie_on_both_surfaces(height):
    """A ball of radius 0.5 m is sunk into a slab 0.2 m thick, both 10 m from the origin; each pair of faces has a
    segment.

    Its ends lie on a side of the slab, |z| = 0.1 m, and on the ball's facets of 18 x 22.5 degrees: their corners are on
    the sphere, their middles 0.5 cos(14.4 degrees) = 0.484 m from its centre; down to 0.45 m is allowed.
    """
    bodies = [Body("ball", ball_mesh(0.5, rings=10, sides=16)), Body("slab", box_mesh((4, 4, 0.2)))]
    slab_centre = np.array([10.0, 0.0, 0.0])
    ball_centre = slab_centre + np.array([0.007, 0.013, height])
    detection = create_detector("hybrid", bodies).detect(motion_at_rest(bodies, [ball_centre, slab_centre]), faces=True)
    segments = detection.section(frame=0, pair=0)
    assert len(segments) > 0
    assert segments.shape == (len(detection.faces(frame=0, pair=0)), 2, 3)
    ends, rounding = segments.reshape(-1, 3), 1e-12
    assert (np.abs(np.abs(ends[:, 2]) - 0.1) < rounding).all()
    distances = np.linalg.norm(ends - ball_centre, axis=1)
    assert distances.max() <= 0.5 + rounding
    assert distances.min() >= 0.45
