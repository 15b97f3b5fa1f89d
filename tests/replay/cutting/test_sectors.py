"""A round hollow body in convex pieces: they cover it, and leave its hollow free."""

import numpy as np
import pytest
from support.shapes import box_mesh, merge_meshes, revolved_mesh, shift_mesh
from trimesh import Trimesh
from trimesh.creation import box as solid_box
from trimesh.creation import icosphere

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_collider, hull_of
from replay.cutting.convex_solids import outside_by, volume_of, within_triangles
from replay.cutting.sectors import round_axis, sector_ladder

RIM, INNER, OUTER, FLOOR = 0.1, 0.033, 0.035, 0.002
PROFILE = [(0, 0), (OUTER, 0), (OUTER, RIM), (INNER, RIM), (INNER, FLOOR), (0, FLOOR)]
BEAKER = revolved_mesh(PROFILE, 48)


COUNTS = (1, 2, 3, 4, 6, 8, 10, 12, 16, 24, 32, 96)


def sector_pieces(mesh):
    """Pieces for each number of them, the hull first, until there are no more."""
    ladder = sector_ladder(mesh)
    if ladder is None:
        return None
    pieces_by_count = {
        len(pieces): [within_triangles(hull_of(piece)) for piece in pieces] for pieces in map(ladder.pieces, COUNTS)
    }
    return [*pieces_by_count.values()]


COARSE_BEAKER = revolved_mesh(PROFILE, 24)
"""Cut for all tests of its pieces: half of the sides, a third of the time."""


@pytest.fixture(scope="module")
def pieces_by_count():
    """Lists of pieces of the coarse beaker, the hull first."""
    return sector_pieces(COARSE_BEAKER)


def beaker_with_spout():
    """The beaker with a fifth of its upper rim pulled outwards."""
    corners = BEAKER.vertices.copy()
    axis = int(np.argmax(round_axis(BEAKER)[1]))
    across = [k for k in range(3) if k != axis]
    away = np.arctan2(corners[:, across[1]], corners[:, across[0]])
    pulled = (np.abs(away) < 0.6) & (corners[:, axis] > 0.9 * RIM)
    corners[np.ix_(pulled, across)] *= 1.1
    return TriangleMesh(corners, BEAKER.faces)


def test_round_bodies_have_an_axis_and_oval_bodies_not():
    """A beaker has the axis through its middle, also when shifted by 7 m; stretched to an oval it has none."""
    for mesh in (BEAKER, beaker_with_spout()):
        point, direction = round_axis(shift_mesh(mesh, (7.0, 7.0, 7.0)))
        height = int(np.argmax(np.ptp(mesh.vertices, axis=0)))
        assert direction[height] == 1.0 and np.allclose(np.delete(point, height), 7.0, atol=1e-3)
    assert round_axis(TriangleMesh(BEAKER.vertices * [1.0, 1.5, 1.0], BEAKER.faces)) is None
    ball = icosphere(subdivisions=4)  # with a nose: round about every axis, and best about that of the nose
    nose = ball.vertices + (ball.vertices > 0.9) * [0.0, 0.0, 0.1]
    assert round_axis(TriangleMesh(nose, ball.faces))[1].tolist() == [0.0, 0.0, 1.0]
    rotated = np.vstack([BEAKER.faces[:1, ::-1], BEAKER.faces[1:]])  # of such a mesh nobody knows the inside
    assert sector_pieces(box_mesh((0.1, 0.05, 0.2))) is None
    assert sector_pieces(TriangleMesh(BEAKER.vertices, rotated)) is None


def trimesh_of(piece):
    """The piece as trimesh has it."""
    return Trimesh(piece.vertices, piece.faces, process=False)


def distance_beyond(points, piece):
    """By how much points lie beyond the planes of a piece, at most; below 0 inside."""
    body = trimesh_of(piece)
    return ((points[:, None] - body.triangles[:, 0]) * body.face_normals).sum(axis=2).max(axis=1)


def test_every_list_covers_the_beaker_and_begins_with_its_hull(pieces_by_count):
    """Lists of 1 to 32 convex pieces: at most 16 sectors above and below the one bend of the profile, at the floor.

    By trimesh's planes no corner or middle of a face is further outside than ``outside_by`` says, less than 0.5 mm.
    """
    counts = [len(pieces) for pieces in pieces_by_count]
    assert counts == sorted(set(counts)) and (counts[0], counts[-1]) == (1, 2 * 16)
    for pieces in pieces_by_count:
        # trimesh is an independent judge: inside one piece, or that near to one.
        points = np.concatenate([COARSE_BEAKER.vertices, COARSE_BEAKER.triangles.mean(axis=1)])
        assert all(trimesh_of(piece).is_convex and len(piece.faces) <= 255 for piece in pieces)
        outside = np.min([distance_beyond(points, piece) for piece in pieces], axis=0).max()
        assert outside <= outside_by(COARSE_BEAKER, pieces) + 1e-9 < 5e-4


@pytest.mark.parametrize("most", [10, 16])
def test_few_pieces_leave_the_hollow_free_which_the_hull_fills(pieces_by_count, most):
    """Nine points up the middle of the beaker are outside of all pieces, and inside the one hull."""
    pieces = next(some for some in pieces_by_count if len(some) >= most)
    axis = int(np.argmax(round_axis(COARSE_BEAKER)[1]))
    middle = np.zeros((9, 3))
    middle[:, axis] = np.linspace(0.2 * RIM, 0.99 * RIM, 9)
    assert min(distance_beyond(middle, piece).min() for piece in pieces) >= 0.0
    assert outside_by(TriangleMesh(middle[[0, 4, 8]], [[0, 1, 2]]), [hull_collider(COARSE_BEAKER)]) == 0.0


def test_distance_of_mesh_outside_pieces_matches_hand_value():
    """A box 3 m long ends 1 m beyond a unit cube.

    The corner (1, 1, 1) is 0.5 m beyond it on every axis: root of 0.75.
    """
    small, large = box_mesh((1.0, 1.0, 1.0)), box_mesh((1.0, 1.0, 3.0))
    assert outside_by(large, [small]) == pytest.approx(1.0, abs=1e-6)
    corner = TriangleMesh([[1, 1, 1], [0, 0, 0], [0, 0, 0.1]], [[0, 1, 2]])
    assert outside_by(corner, [small]) == pytest.approx(0.75**0.5, abs=1e-6)
    assert outside_by(small, [large]) == 0.0


def test_convex_solid_keeps_255_triangles_with_small_error():
    """A ball of 5,120 faces and 5 cm radius; V corners make 2 V - 4 triangles, an even number, so 254 of 255."""
    ball = icosphere(subdivisions=4, radius=0.05)
    piece = TriangleMesh(ball.vertices, ball.faces)
    few = within_triangles(piece)
    assert len(few.faces) == 254 < len(piece.faces) and few.is_closed
    assert 0.0 < outside_by(piece, [few]) < 0.04 * 0.05
    assert within_triangles(few) is few


@pytest.mark.slow
def test_spool_is_cut_at_every_flange_and_separate_discs_stay():
    """Radii of 3 and 1 cm in turn, 2 cm each: three flanges and two necks."""
    radii = np.repeat([0.03, 0.01, 0.03, 0.01, 0.03], 2)
    heights = np.repeat(np.arange(6), 2)[1:-1] * 0.02 - 0.05
    spool = revolved_mesh([(0, -0.05), *zip(radii, heights, strict=True), (0, 0.05)], 24)
    pieces_by_count = sector_pieces(spool)
    # One of its five discs is cut by angle at most.
    assert len(pieces_by_count[0]) == 1 and len(pieces_by_count[-1]) <= 4 + 16
    full = sum(trimesh_of(piece).volume for piece in pieces_by_count[-1])
    assert full < 1.2 * trimesh_of(spool).volume < 0.9 * trimesh_of(hull_collider(spool)).volume
    disc = revolved_mesh([(0, 0), (0.03, 0), (0.03, 0.02), (0, 0.02)])
    assert [len(pieces) for pieces in sector_pieces(merge_meshes(disc, shift_mesh(disc, (0, 0, 0.05))))] == [2]


def test_corners_inside_flat_faces_are_removed_from_a_solid():
    """A box cut into a grid has corners in the middle of its flat faces; without them the volume stays."""
    box = solid_box((0.1, 0.2, 0.3)).subdivide().subdivide().subdivide()
    few = within_triangles(TriangleMesh(box.vertices, box.faces))
    assert len(box.faces) > 255 >= len(few.faces)
    assert volume_of(few) == pytest.approx(0.1 * 0.2 * 0.3, rel=1e-9)
