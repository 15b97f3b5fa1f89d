"""A round hollow body in convex pieces: they cover it, and leave its hollow free."""

import numpy as np
import pytest
from support.shapes import box_mesh, merge_meshes, revolved_mesh, shift_mesh
from trimesh import Trimesh
from trimesh.creation import icosphere

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_collider, hull_of
from replay.cutting.convex_solids import outside_by, within_triangles
from replay.cutting.sectors import round_axis, sector_ladder

RIM, INNER, OUTER, FLOOR = 0.1, 0.033, 0.035, 0.002
PROFILE = [(0, 0), (OUTER, 0), (OUTER, RIM), (INNER, RIM), (INNER, FLOOR), (0, FLOOR)]
BEAKER = revolved_mesh(PROFILE, 48)
"""A closed mesh with 48 sides, of (radius, height) in metres: hollow above a floor of 2 mm."""


COUNTS = (1, 2, 4, 10, 16, 96)


def sector_pieces(mesh):
    """Lists of convex pieces of a body cut in sectors, the hull first, then more pieces a list; None: not cut."""
    ladder = sector_ladder(mesh)
    if ladder is None:
        return None
    pieces_by_count = {
        len(pieces): [within_triangles(hull_of(piece)) for piece in pieces] for pieces in map(ladder.pieces, COUNTS)
    }
    return [*pieces_by_count.values()]


COARSE_BEAKER = revolved_mesh(PROFILE, 12)
"""Cut for all tests of its pieces: a quarter of the sides, a quarter of the time."""


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


@pytest.mark.parametrize("mesh", [BEAKER, beaker_with_spout()], ids=["beaker", "beaker with a spout"])
def test_round_body_has_the_axis_through_its_middle(mesh):
    """Its middle is shifted to (7, 7, 7) m; the axis is along its height, by any point on it, to 1 mm."""
    point, direction = round_axis(shift_mesh(mesh, (7.0, 7.0, 7.0)))
    height = int(np.argmax(np.ptp(mesh.vertices, axis=0)))
    assert direction[height] == 1.0
    assert np.delete(point, height) == pytest.approx((7.0, 7.0), abs=1e-3)


def test_body_round_about_every_axis_has_that_of_its_nose():
    """A ball of 1 m radius, whose corners above 0.9 m are pulled up by 0.1 m."""
    ball = icosphere(subdivisions=4)
    with_nose = ball.vertices + (ball.vertices > 0.9) * [0.0, 0.0, 0.1]
    _point, direction = round_axis(TriangleMesh(with_nose, ball.faces))
    assert direction.tolist() == [0.0, 0.0, 1.0]


def test_oval_body_has_no_axis():
    """A beaker, a body of revolution, stretched by half on one axis."""
    assert round_axis(TriangleMesh(BEAKER.vertices * [1.0, 1.5, 1.0], BEAKER.faces)) is None


def test_body_not_round_or_without_inside_is_not_cut():
    """A box; and the beaker with one face turned round, of which nobody knows the inside."""
    assert sector_pieces(box_mesh((0.1, 0.05, 0.2))) is None
    one_face_turned = np.vstack([BEAKER.faces[:1, ::-1], BEAKER.faces[1:]])
    assert sector_pieces(TriangleMesh(BEAKER.vertices, one_face_turned)) is None


def trimesh_of(piece):
    """The piece as trimesh has it."""
    return Trimesh(piece.vertices, piece.faces, process=False)


def distance_beyond(points, piece):
    """Metres of each point beyond the planes of a convex piece, the largest; below 0 inside; by trimesh."""
    body = trimesh_of(piece)
    return ((points[:, None] - body.triangles[:, 0]) * body.face_normals).sum(axis=2).max(axis=1)


def test_lists_of_pieces_go_from_the_hull_to_32_sectors(pieces_by_count):
    """Lists of more and more pieces of a beaker: at most 16 by angle, above and below the bend of its profile."""
    counts = [len(pieces) for pieces in pieces_by_count]
    assert counts == sorted(set(counts))
    assert (counts[0], counts[-1]) == (1, 2 * 16)


def test_every_list_of_pieces_covers_the_beaker(pieces_by_count):
    """A beaker in 1 to 32 pieces: all are convex and have at most 255 faces, as engines take.

    By trimesh's planes no corner or middle of a face is further outside than ``outside_by`` says, less than 0.5 mm.
    """
    points = np.concatenate([COARSE_BEAKER.vertices, COARSE_BEAKER.triangles.mean(axis=1)])
    for pieces in pieces_by_count:
        assert all(trimesh_of(piece).is_convex and len(piece.faces) <= 255 for piece in pieces)
        outside_nearest_piece = np.min([distance_beyond(points, piece) for piece in pieces], axis=0)
        assert outside_nearest_piece.max() <= outside_by(COARSE_BEAKER, pieces) + 1e-9 < 5e-4


@pytest.mark.parametrize("count", [10, 16])
def test_few_pieces_leave_the_hollow_free_which_the_hull_fills(pieces_by_count, count):
    """A beaker 10 cm high is cut in sectors, so many pieces or the next more.

    Nine points up its middle, in the hollow, are outside the planes of every piece, and inside those of the hull.
    """
    pieces = next(pieces for pieces in pieces_by_count if len(pieces) >= count)
    _point, direction = round_axis(COARSE_BEAKER)
    height = int(np.argmax(direction))
    middle = np.zeros((9, 3))
    middle[:, height] = np.linspace(0.2 * RIM, 0.99 * RIM, 9)
    assert min(distance_beyond(middle, piece).min() for piece in pieces) >= 0.0
    assert distance_beyond(middle, hull_collider(COARSE_BEAKER)).max() <= 0.0


def test_distance_of_mesh_outside_pieces_matches_hand_value():
    """A box 3 m long about a cube of 1 m ends 1 m beyond it; the cube is wholly in the box.

    The corner (1, 1, 1) is 0.5 m beyond the cube on every axis: the root of 3 * 0.25.
    """
    cube, long_box = box_mesh((1.0, 1.0, 1.0)), box_mesh((1.0, 1.0, 3.0))
    assert outside_by(long_box, [cube]) == pytest.approx(1.0, abs=1e-6)
    assert outside_by(cube, [long_box]) == 0.0
    face_with_corner = TriangleMesh([[1, 1, 1], [0, 0, 0], [0, 0, 0.1]], [[0, 1, 2]])
    assert outside_by(face_with_corner, [cube]) == pytest.approx(0.75**0.5, abs=1e-6)


def test_convex_solid_keeps_255_triangles_with_small_error():
    """A ball of 1,280 faces and 5 cm radius; V corners make 2 V - 4 triangles, an even number, so 254 of 255.

    They leave out at most 4 % of the radius.
    """
    ball = icosphere(subdivisions=3, radius=0.05)
    piece = TriangleMesh(ball.vertices, ball.faces)
    assert len(piece.faces) == 1280
    fewer = within_triangles(piece)
    assert fewer.is_closed and len(fewer.faces) == 254
    assert 0.0 < outside_by(piece, [fewer]) < 0.04 * 0.05


@pytest.mark.slow
def test_spool_is_cut_at_every_flange():
    """Radii of 3 and 1 cm in turn, 2 cm each: three flanges and two necks, of which at most one is cut by angle.

    All pieces have less than 1.2 of the volume of the spool, of which the hull has more than 1 / 0.75.
    """
    radii = np.repeat([0.03, 0.01, 0.03, 0.01, 0.03], 2)
    heights = np.repeat(np.arange(6), 2)[1:-1] * 0.02 - 0.05
    spool = revolved_mesh([(0, -0.05), *zip(radii, heights, strict=True), (0, 0.05)], 24)
    pieces_by_count = sector_pieces(spool)
    most = pieces_by_count[-1]
    assert len(pieces_by_count[0]) == 1
    assert len(most) <= 4 + 16
    filled = sum(trimesh_of(piece).volume for piece in most)
    assert filled < 1.2 * trimesh_of(spool).volume < 0.9 * trimesh_of(hull_collider(spool)).volume


@pytest.mark.slow
def test_separate_discs_stay_two_pieces():
    """Two discs above each other, 2 cm high and 3 cm apart: there is no hull of both, nor are they cut."""
    disc = revolved_mesh([(0, 0), (0.03, 0), (0.03, 0.02), (0, 0.02)])
    (pieces,) = sector_pieces(merge_meshes(disc, shift_mesh(disc, (0, 0, 0.05))))
    assert len(pieces) == 2
