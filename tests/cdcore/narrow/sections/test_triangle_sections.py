"""A section exists exactly where the triangles meet, and its ends lie on both of them."""

import numpy as np
import pytest

from cdcore.errors import InvalidTrianglesError
from cdcore.narrow.sections.triangle_sections import triangle_pair_sections
from cdcore.narrow.triangles.predicates import triangles_intersect
from replay.studies.stress.families import FAMILIES

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def distance_to_triangle(point, triangle):
    """Distance by minimising over barycentric coordinates of a fine set of candidates: face, edges, corners."""
    a, b, c = triangle
    best = min(np.linalg.norm(point - corner) for corner in triangle)
    for p, q in ((a, b), (b, c), (c, a)):
        along = q - p
        length = along @ along
        share = np.clip((point - p) @ along / length, 0, 1) if length > 0 else 0.0
        best = min(best, np.linalg.norm(point - p - share * along))
    normal = np.cross(b - a, c - a)
    if normal @ normal > 0:
        foot = point - normal * ((point - a) @ normal) / (normal @ normal)
        sides = [np.cross(q - p, foot - p) @ normal for p, q in ((a, b), (b, c), (c, a))]
        if min(sides) >= 0:
            best = min(best, np.linalg.norm(point - foot))
    return best


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_a_section_exists_exactly_where_the_triangles_meet(family):
    pairs = family.pairs(300, seed=9)
    sections = triangle_pair_sections(pairs)
    assert np.array_equal(np.isfinite(sections).all(axis=(1, 2)), triangles_intersect(pairs))


@pytest.mark.parametrize("number", [1, 3, 4, 6, 8, 9, 10, 17, 18, 20, 24])
def test_both_ends_lie_on_both_triangles(number):
    pairs = FAMILIES[number - 1].pairs(200, seed=9)
    size = np.abs(pairs).max()
    for pair, section in zip(pairs, triangle_pair_sections(pairs), strict=True):
        if np.isfinite(section).all():
            assert max(distance_to_triangle(end, triangle) for end in section for triangle in pair) < 1e-11 * size


def test_two_crossing_faces_give_the_segment_they_share():
    wall = [[0.25, 0.25, -1], [0.25, 0.25, 1], [2.25, 0.25, -1]]
    section = triangle_pair_sections([[FLOOR, wall]])[0]
    assert sorted(section.tolist()) == [[0.25, 0.25, 0.0], [0.75, 0.25, 0.0]]


def test_one_common_point_gives_equal_ends():
    spike = [[0.25, 0.25, 0], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    assert triangle_pair_sections([[FLOOR, spike]])[0].tolist() == [[0.25, 0.25, 0.0]] * 2


def test_a_coplanar_overlap_gives_its_longest_chord():
    section = triangle_pair_sections([[FLOOR, FLOOR]])[0]
    assert sorted(section.tolist()) == [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]


def test_no_pairs_give_no_segments_and_nan_is_refused():
    assert triangle_pair_sections([]).shape == (0, 2, 3)
    with pytest.raises(InvalidTrianglesError):
        triangle_pair_sections(np.full((1, 2, 3, 3), np.nan))
