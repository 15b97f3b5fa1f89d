"""Cuts, axes and surfaces of boxes by closed forms and LAPACK."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdcore.narrow.tree_builder import (
    body_axes,
    build_trees,
    coordinates_along,
    cut_by_side,
    extents,
    half_surface,
    principal_axes,
    tighter_boxes,
)


def test_half_surface_is_the_sum_of_three_sides():
    """A box of 2 x 3 x 5 m."""
    assert half_surface(np.array([2.0, 3.0, 5.0])) == 2 * 3 + 3 * 5 + 5 * 2


def test_cut_by_side_halves_nodes_whose_faces_agree():
    """How many faces are first: of four one is not ``second``; four and five on one side are halved."""
    second = np.array([0, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1, 1], dtype=bool)
    sizes, first = np.array([4, 4, 5]), np.array([0, 4, 8])
    assert cut_by_side(second, sizes, first).tolist() == [1, 4 // 2, 5 // 2]


@pytest.mark.parametrize(("by_side", "sizes"), [(True, [4, 1, 3]), (False, [4, 2, 2])])
def test_node_is_cut_by_side_or_at_the_median(by_side, sizes):
    """Three of four faces lie at positive x; ``sizes``: faces of the root and of its children."""
    faces = np.array([3.0, -1.0, 1.0, 2.0])[:, None, None] * np.ones((4, 3, 3))

    def rule(corners, node, first):
        """Boxes along x, y and z; cut at x = 0, or between two of four faces along x."""
        x = corners[0, 0]
        return (body_axes(len(first)), *extents(corners, first)), x > 0.0 if by_side else x

    ((nodes, depth),) = build_trees([faces], rule, leaf_faces=3)
    assert depth == 2
    assert (nodes.stop - nodes.start).tolist() == sizes
    assert nodes.number[: sizes[1]].tolist() == [1, 2][: sizes[1]], "the least x first"


def test_principal_axes_are_right_handed_eigenvectors():
    """Twenty random symmetric matrices, a diagonal one and zero; LAPACK's eigenvalues, the largest first."""
    halves = np.random.default_rng(0).normal(size=(20, 3, 3))
    symmetric = np.concatenate([halves + halves.transpose(0, 2, 1), [np.diag([1.0, 3.0, 2.0]), np.zeros((3, 3))]])
    axes = principal_axes(symmetric.transpose(1, 2, 0)).transpose(2, 0, 1)
    assert np.linalg.det(axes) == pytest.approx(np.ones(22))
    diagonal = axes @ symmetric @ axes.transpose(0, 2, 1)
    largest_first = np.linalg.eigvalsh(symmetric)[:, ::-1]
    assert diagonal == pytest.approx(largest_first[:, :, None] * np.eye(3), abs=1e-13)


def corners_of(faces):
    """Corners (3, 3, E) of faces (E, 3, 3), coordinates in rows, as the builder takes them."""
    return np.ascontiguousarray(faces.transpose(1, 2, 0))


def test_coordinates_and_extents_are_those_of_each_node():
    """A node of two faces and one of four, beside NumPy."""
    rng = np.random.default_rng(1)
    faces, axes = rng.normal(size=(6, 3, 3)), Rotation.random(6, random_state=2).as_matrix()
    along = coordinates_along(axes.transpose(1, 2, 0), corners_of(faces))
    expected = np.einsum("eij,ecj->eci", axes, faces)
    assert np.allclose(along.transpose(2, 0, 1), expected)
    for bound, smallest_or_largest in zip(extents(along, np.array([0, 2])), (np.min, np.max), strict=True):
        by_node = [smallest_or_largest(expected[rows], axis=(0, 1)) for rows in (slice(2), slice(2, 6))]
        assert np.allclose(bound.T, by_node)


def test_node_keeps_the_box_with_the_smaller_surface():
    """A needle that lies askew gets a box along itself; corners of a box along x, y and z keep these axes."""
    needle = np.array([[[0, 0, 0], [6, 0, 0], [3, 0.1, 0]], [[0, 0.1, 0], [6, 0.1, 0], [3, 0, 0]]])
    askew = 5.0 + Rotation.from_euler("zx", [30, 40], degrees=True).apply(needle.reshape(-1, 3)).reshape(2, 3, 3)
    # the first and the last corner stand in more faces than others, so that the principal axes lie askew
    upright = np.array([[x, y, z] for x in (0, 3) for y in (0, 2) for z in (0, 1)])[
        [0, 1, 2, 3, 4, 5, 6, 7, 0, 0, 7, 0]
    ]
    faces = np.concatenate([askew, upright.reshape(4, 3, 3)])
    (axes, lower, upper), along = tighter_boxes(corners_of(faces), np.array([0, 0, 1, 1, 1, 1]), np.array([0, 2]))
    sides = upper - lower
    assert sides.T.tolist() == [pytest.approx([6.0, 0.1, 0.0], abs=1e-12), [3.0, 2.0, 1.0]]
    assert axes[:, :, 1].tolist() == np.eye(3).tolist()
    assert np.array_equal(along[:, :, 2:], corners_of(faces)[:, :, 2:])
    assert np.allclose(along[:, :, :2], corners_of(askew @ axes[:, :, 0].T))
