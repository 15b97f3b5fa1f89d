"""A section is there where triangles meet, and its ends lie on both of them."""

from fractions import Fraction

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, triangle_family

from cdcore import Body, Motion, create_detector
from cdcore.errors import InvalidTrianglesError
from cdcore.narrow.margins import triangle_margins
from cdcore.narrow.sections.triangle_sections import triangle_pair_sections
from cdcore.triangles.decide import triangles_intersect
from replay.studies.stress.families import FAMILIES

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


SOUND = [family for family in FAMILIES if family.name != "needles"]
"""Of a needle a double does not know where its plane is."""


@pytest.mark.sampled(3)
@pytest.mark.parametrize("family", SOUND, ids=lambda family: family.name)
def test_intersection_segment_ends_lie_on_both_triangles(family):
    """Within 1e-12 of the coordinates' size; every pair that meets has a segment."""
    pairs = family.pairs(80, seed=9)
    sections = triangle_pair_sections(pairs)
    answer = np.isfinite(sections).all(axis=(1, 2))
    assert not (triangles_intersect(pairs) & ~answer).any()
    points = np.repeat(sections[answer].reshape(-1, 1, 3), 3, axis=1)
    for side in (0, 1):
        meets, away = triangle_margins(np.stack([points, np.repeat(pairs[answer, side], 2, axis=0)], axis=1))
        assert (meets | (away < 1e-12 * np.abs(pairs).max())).all()


def test_triangles_with_a_clear_gap_have_no_section():
    """Random pairs of triangles: exactly those that meet have a section."""
    pairs = triangle_family("generic control").pairs(300, seed=9)
    answer = np.isfinite(triangle_pair_sections(pairs)).all(axis=(1, 2))
    assert np.array_equal(answer, triangles_intersect(pairs))


def test_distance_from_origin_creates_no_section():
    """Two triangles 2^-34 m apart, 8 km from the origin."""
    # A slack in proportion to the place, and not to the pair, would close a gap of 32 ulps of the place.
    above = np.array(FLOOR) + np.array([0.0, 0.0, 2.0**-34])
    assert np.isnan(triangle_pair_sections(np.array([[FLOOR, above]]) + 2.0**13)).all()


def test_a_coplanar_overlap_gives_its_longest_chord():
    """A right triangle upon itself: its longest chord is the hypotenuse, from (1, 0, 0) to (0, 1, 0)."""
    section = triangle_pair_sections([[FLOOR, FLOOR]])[0]
    assert sorted(section.tolist()) == [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]


def test_coplanar_edge_is_cut_where_it_leaves_the_face():
    """One edge of each "tent" lies in the plane of FLOOR; the part within it is computed in rationals."""
    rng = np.random.default_rng(2)
    ends = rng.integers(-16, 32, (300, 2, 2)) / 16
    ends = ends[(ends[:, 0] != ends[:, 1]).any(axis=1)]
    tents = np.concatenate([np.insert(ends, 2, 0.0, axis=2), np.tile([0.25, 0.25, 1.0], (len(ends), 1, 1))], axis=1)
    for (p, q), section in zip(ends, triangle_pair_sections([[FLOOR, tent] for tent in tents]), strict=True):
        begin, end = Fraction(0), Fraction(1)  # of the way from p to q inside x >= 0, y >= 0 and x + y <= 1
        for a, b in ((p[0], q[0]), (p[1], q[1]), (1 - p.sum(), 1 - q.sum())):
            a, b = Fraction(a), Fraction(b)
            if (a < 0 and b < 0) or a == b < 0:
                begin = Fraction(2)
            elif a < 0 or b < 0:
                begin, end = (max(begin, a / (a - b)), end) if a < 0 else (begin, min(end, a / (a - b)))
        expected = [p + float(fraction) * (q - p) for fraction in (begin, end)]
        assert np.isfinite(section).all() == (begin <= end)
        if begin <= end:
            assert min(np.abs(section[::step, :2] - expected).max() for step in (1, -1)) < 1e-12


def test_no_pairs_give_no_segments_and_nan_is_refused():
    assert triangle_pair_sections([]).shape == (0, 2, 3)
    with pytest.raises(InvalidTrianglesError):
        triangle_pair_sections(np.full((1, 2, 3, 3), np.nan))


BODIES = [Body("ball", ball_mesh(0.5, rings=10, sides=16)), Body("slab", box_mesh((4, 4, 0.2)))]


def ball_sinking_into_slab():
    """A ball at three heights: with its lower part in the slab, shallower, and away from it."""
    positions = np.zeros((3, 2, 3))
    positions[:, 0, 2] = [0.31, 0.452, 5.0]
    positions[:, 0, :2] = [0.007, 0.013]
    positions += [10.0, 0, 0]
    return Motion(np.arange(3), positions, np.tile(np.eye(3), (3, 2, 1, 1)))


def test_segments_lie_on_both_surfaces():
    """Ends lie on a face of the slab (|z| = 0.1 m) and within the facets of a ball of 0.5 m.

    Each pair of faces has a segment.
    """
    detection = create_detector("hybrid", BODIES).detect(ball_sinking_into_slab(), faces=True)
    for frame, height in ((0, 0.31), (1, 0.452)):
        segments = detection.section(frame, 0)
        assert segments.shape == (len(detection.faces(frame, 0)), 2, 3)
        points = segments.reshape(-1, 3) - [10.0, 0, 0]
        assert (np.abs(np.abs(points[:, 2]) - 0.1) < 1e-12).all()
        radius = np.linalg.norm(points - [0.007, 0.013, height], axis=1)
        assert ((radius <= 0.5 + 1e-12) & (radius >= 0.45)).all()
