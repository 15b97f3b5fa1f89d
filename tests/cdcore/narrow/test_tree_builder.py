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
    """A box of 2 x 3 x 5 m has two sides of 2 x 3, two of 3 x 5 and two of 5 x 2."""
    assert half_surface(np.array([2.0, 3.0, 5.0])) == 2 * 3 + 3 * 5 + 5 * 2


def test_cut_by_side_halves_nodes_whose_faces_agree():
    """A node's faces are cut by the side they lie on: of the first four one is on the first side.

    Of four faces on the first side, and of five on the second, half are in the first child.
    """
    on_second_side = np.array([*[0, 1, 1, 1], *[0, 0, 0, 0], *[1, 1, 1, 1, 1]], dtype=bool)
    sizes, first_faces = np.array([4, 4, 5]), np.array([0, 4, 8])
    assert cut_by_side(on_second_side, sizes, first_faces).tolist() == [1, 4 // 2, 5 // 2]


@pytest.mark.parametrize(
    ("by_side", "sizes", "first_child"),
    [
        pytest.param(True, [4, 1, 3], [1], id="by the side of x = 0"),
        pytest.param(False, [4, 2, 2], [1, 2], id="at the median of x"),
    ],
)
def test_node_is_cut_by_side_or_at_the_median(by_side, sizes, first_child):
    """Four faces at x = 3, -1, 1 and 2: a rule gives truth values or numbers, by which a node is cut.

    ``sizes``: faces of the root and of its children; ``first_child``: the faces of the first, the least x first.
    """
    faces = np.array([3.0, -1.0, 1.0, 2.0])[:, None, None] * np.ones((4, 3, 3))

    def rule(corners, node, first):
        """Boxes along x, y and z, and what cuts them."""
        x = corners[0, 0]
        return (body_axes(len(first)), *extents(corners, first)), x > 0.0 if by_side else x

    ((nodes, depth),) = build_trees([faces], rule, leaf_faces=3)
    assert depth == 2
    assert (nodes.stop - nodes.start).tolist() == sizes
    assert nodes.number[: sizes[1]].tolist() == first_child


def test_principal_axes_are_right_handed_eigenvectors():
    """Twenty random symmetric matrices, a diagonal one and zero: axes in rows, of determinant 1, make them diagonal.

    The diagonal has LAPACK's eigenvalues, the largest first.
    """
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


def test_coordinates_along_axes_are_products_with_them():
    """Six random faces, each with axes of its own; corners and coordinates have the face last, as the builder's do."""
    rng = np.random.default_rng(1)
    faces, axes = rng.normal(size=(6, 3, 3)), Rotation.random(6, random_state=2).as_matrix()
    along = coordinates_along(axes.transpose(1, 2, 0), corners_of(faces))
    expected = np.einsum("eij,ecj->eci", axes, faces)
    assert np.allclose(along, corners_of(expected))


def test_extents_are_the_bounds_of_each_node():
    """A node of two random faces and one of four: smallest and largest coordinates of all of their corners."""
    faces = np.random.default_rng(1).normal(size=(6, 3, 3))
    lower, upper = extents(corners_of(faces), np.array([0, 2]))
    assert np.allclose(lower.T, [faces[:2].min(axis=(0, 1)), faces[2:].min(axis=(0, 1))])
    assert np.allclose(upper.T, [faces[:2].max(axis=(0, 1)), faces[2:].max(axis=(0, 1))])


def test_node_keeps_the_box_with_the_smaller_surface():
    """Node 0 is a needle of 6 x 0.1 that lies askew: its box is along the needle.

    Node 1 has the corners of a box of 3 x 2 x 1 along x, y and z, and keeps these axes: two of them are in more faces
    than others, so that its principal axes lie askew.
    """
    needle = np.array([[[0, 0, 0], [6, 0, 0], [3, 0.1, 0]], [[0, 0.1, 0], [6, 0.1, 0], [3, 0, 0]]])
    askew = 5.0 + Rotation.from_euler("zx", [30, 40], degrees=True).apply(needle.reshape(-1, 3)).reshape(2, 3, 3)
    box_corners = np.array([[x, y, z] for x in (0, 3) for y in (0, 2) for z in (0, 1)])
    upright = box_corners[[0, 1, 2, 3, 4, 5, 6, 7, 0, 0, 7, 0]].reshape(4, 3, 3)
    faces = np.concatenate([askew, upright])
    node_of_face, first_face_of_node = np.array([0, 0, 1, 1, 1, 1]), np.array([0, 2])
    (axes, lower, upper), along = tighter_boxes(corners_of(faces), node_of_face, first_face_of_node)
    needle_sides, upright_sides = (upper - lower).T.tolist()
    assert needle_sides == pytest.approx([6.0, 0.1, 0.0], abs=1e-12)
    assert upright_sides == [3.0, 2.0, 1.0]
    assert axes[:, :, 1].tolist() == np.eye(3).tolist()
    assert np.allclose(along[:, :, :2], corners_of(askew @ axes[:, :, 0].T)), "coordinates along the chosen axes"
    assert np.array_equal(along[:, :, 2:], corners_of(upright))
