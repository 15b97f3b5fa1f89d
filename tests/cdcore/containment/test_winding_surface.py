"""Lost faces are told from openings, faces drawn twice count once, and every hole is closed by its cap."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, icosphere_mesh, merge_meshes, shift_mesh

from cdcore import TriangleMesh
from cdcore.containment import winding_surface as module
from cdcore.containment.winding_surface import ComponentKind, winding_surface


def without_faces(mesh, *faces):
    """The mesh without the faces of these numbers."""
    return TriangleMesh(mesh.vertices, np.delete(mesh.faces, faces, axis=0))


def side(mesh, axis):
    """Faces of a box's side towards +axis."""
    return np.flatnonzero((mesh.triangles[:, :, axis] == mesh.bounds[1, axis]).all(axis=1)).tolist()


def cut_sphere(height):
    """A ball without all faces that reach above a height, in radii: a bowl, or a flask without a neck."""
    ball = ball_mesh(1.0, rings=24, sides=36)
    return without_faces(ball, *np.flatnonzero(ball.triangles[:, :, 2].max(axis=1) > height).tolist())


MESHES_WITH_KINDS = {
    "box": (box_mesh(), ComponentKind.CLOSED),
    "one triangle of a box": (without_faces(box_mesh(), 4), ComponentKind.HOLED),
    "one side of a box": (without_faces(box_mesh(), *side(box_mesh(), axis=2)), ComponentKind.OPEN),
    "one face of a ball": (without_faces(icosphere_mesh(), 7), ComponentKind.HOLED),
    "two places of a ball": (without_faces(ball_mesh(1.0, rings=24, sides=36), 200, 900), ComponentKind.HOLED),
    "half a ball": (cut_sphere(height=0.0), ComponentKind.OPEN),
    "bowl": (cut_sphere(height=0.7), ComponentKind.OPEN),
    "flask without a neck": (cut_sphere(height=0.9), ComponentKind.OPEN),
    "curved sheet": (
        TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]),
        ComponentKind.OPEN,
    ),
}


@pytest.mark.parametrize("name", MESHES_WITH_KINDS)
def test_lost_faces_are_distinguished_from_openings(name):
    """Each mesh as it is, drawn twice, and inside out."""
    mesh, kind = MESHES_WITH_KINDS[name]
    assert winding_surface(mesh).kinds.tolist() == [kind]
    assert winding_surface(merge_meshes(mesh, mesh)).kinds.tolist() == [kind]
    assert winding_surface(TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])).kinds.tolist() == [kind]


@pytest.mark.parametrize("name", MESHES_WITH_KINDS)
def test_lost_faces_are_distinguished_from_openings_at_any_size(name):
    """Sizes scaled by powers of two from 2^-330 to 2^330, which round nothing."""
    mesh, kind = MESHES_WITH_KINDS[name]
    surface = winding_surface(mesh)
    for exponent in (-330, -20, 20, 330):
        scaled = winding_surface(TriangleMesh(np.ldexp(mesh.vertices, exponent), mesh.faces))
        assert scaled.kinds.tolist() == [kind], exponent
        assert np.array_equal(scaled.caps, np.ldexp(surface.caps, exponent)), exponent
        assert np.array_equal(scaled.grid.triangles, np.ldexp(surface.grid.triangles, exponent)), exponent


def test_up_to_three_flat_sheets_cannot_enclose_a_volume():
    """Four planes are the fewest that bound a volume (a tetrahedron); fewer sheets have no winding surface."""
    side = TriangleMesh([[0, 0, 0], [1, 0, 0.5], [1, 1, 0.5], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    sheets = [shift_mesh(side, [0, 0, 3 * k]) for k in range(4)]
    assert winding_surface(side).kinds.tolist() == winding_surface(merge_meshes(*sheets[:3])).kinds.tolist() == []
    assert winding_surface(merge_meshes(*sheets)).kinds.tolist() == [ComponentKind.OPEN]


def test_large_flat_sheet_off_the_origin_has_no_winding_surface():
    """More than 10,000 corners, whose extents are taken from the eigenvalues of a 3 x 3 matrix."""
    x, y = np.meshgrid(np.arange(42.0), np.arange(42.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1000.0)])
    corner = np.arange(42 * 41)[np.arange(42 * 41) % 42 != 41]
    faces = np.concatenate([[corner, corner + 1, corner + 43], [corner, corner + 43, corner + 42]], axis=1).T
    assert 3 * len(faces) > 10_000
    assert winding_surface(TriangleMesh(points, faces)).kinds.tolist() == []


def test_open_components_have_the_sign_they_agree_on():
    """1 where all are wound outwards, -1 inwards, 0 where they differ."""
    bowl = cut_sphere(height=0.7)
    inwards = TriangleMesh(bowl.vertices, bowl.faces[:, ::-1])
    signs = [
        winding_surface(merge_meshes(first, shift_mesh(second, [5, 0, 0]))).signs.tolist()
        for first, second in ((bowl, bowl), (inwards, inwards), (bowl, inwards))
    ]
    assert signs == [[1], [-1], [0]]


def test_rims_too_many_to_follow_belong_to_their_components(monkeypatch):
    """Two boxes that lack a face each, as a mesh of which no rims are followed: each keeps its own hole.

    Holes ``first_hole[k]`` to ``first_hole[k + 1]`` are those of component k.
    """
    monkeypatch.setattr(module, "MOST_TRACED", 0)
    box = without_faces(box_mesh(), 4)
    surface = winding_surface(merge_meshes(box, shift_mesh(box, [3, 0, 0])))
    assert surface.kinds.tolist() == [ComponentKind.HOLED] * 2
    assert surface.first_hole.tolist() == [0, 1, 2]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(20))
def test_capped_components_are_closed_with_lost_or_reversed_faces(seed):
    """A fifth of the faces lost, a third reversed, nine twice: caps use each edge equally in both directions."""
    rng = np.random.default_rng(seed)
    mesh = merge_meshes(
        icosphere_mesh(), shift_mesh(box_mesh(), [0.4, 0.1, 0.2]), shift_mesh(ball_mesh(0.3), [2, 0, 0])
    )
    faces = mesh.faces[rng.random(len(mesh.faces)) < 0.8].copy()
    some = rng.random(len(faces)) < 0.3
    faces[some] = faces[some, ::-1]
    surface = winding_surface(TriangleMesh(mesh.vertices, np.concatenate([faces, faces[:5], faces[5:9, ::-1]])))
    assert len(surface.grid.triangles) == len(faces) + len(surface.caps)
    for component in np.unique(surface.component):
        uses = {}
        for corners in surface.grid.triangles[surface.component == component].tolist():
            for k in range(3):
                a, b = tuple(corners[k]), tuple(corners[(k + 1) % 3])
                uses[a, b] = uses.get((a, b), 0) + 1
                uses[b, a] = uses.get((b, a), 0) - 1
        assert not any(uses.values())


def test_faces_of_mixed_winding_are_turned_to_one_side():
    """A box that lacks a face and has three faces reversed: one hole, and one orientation in the end."""
    box = box_mesh()
    faces = without_faces(box, 4).faces.copy()
    faces[[0, 3, 5]] = faces[[0, 3, 5], ::-1]
    surface = winding_surface(TriangleMesh(box.vertices, faces))
    assert surface.kinds.tolist() == [ComponentKind.HOLED]
    assert len(surface.caps) == 1
    assert surface.signs.tolist() == [1]


def lattice_of_boxes(counts, sizes=(1.0, 1.0, 1.0)):
    """Boxes side to side in a lattice, each with all of its faces: walls between two are drawn from both sides."""
    return merge_meshes(*(shift_mesh(box_mesh(sizes), np.array(cell) * sizes) for cell in np.ndindex(*counts)))


def from_both_sides(mesh, *faces):
    """The mesh, and some of its faces once more with the other winding."""
    return TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[list(faces), ::-1]]))


@pytest.mark.parametrize("wound", ["outwards", "inwards", "mixed"])
@pytest.mark.parametrize("exponent", [-330, 0, 330])
@pytest.mark.parametrize("counts", [(2, 1, 1), (3, 2, 1), (3, 3, 3)])
def test_inner_walls_of_a_solid_of_cells_are_removed(counts, wound, exponent):
    """A block of boxes side by side is closed; between neighbours lie two faces of two triangles each, 4 a wall."""
    mesh = lattice_of_boxes(counts)
    faces = mesh.faces.copy()
    reversed_faces = {"outwards": slice(0), "inwards": slice(None), "mixed": slice(0, 1)}[wound]
    faces[reversed_faces] = faces[reversed_faces, ::-1]
    surface = winding_surface(TriangleMesh(np.ldexp(mesh.vertices, exponent), faces))
    assert surface.kinds.tolist() == [ComponentKind.CLOSED]
    assert surface.signs.tolist() == [-1 if wound == "inwards" else 1]
    walls = sum((counts[axis] - 1) * 4 * np.prod(counts) // counts[axis] for axis in range(3))
    assert len(surface.grid.triangles) == len(mesh.faces) - walls


def test_two_sided_fin_inside_a_closed_box_is_ignored():
    """A fin within the box leaves its 12 faces closed; a fin that sticks out is an open edge."""
    box, corners = box_mesh(), [[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5]]
    for tip, kind, faces in (([0.0, 0.1, 0.1], ComponentKind.CLOSED, 12), ([0.0, -0.9, -0.9], ComponentKind.HOLED, 13)):
        fin = TriangleMesh([*corners, tip], [[0, 1, 2], [2, 1, 0]])
        surface = winding_surface(merge_meshes(box, fin))
        assert surface.kinds.tolist() == [kind]
        assert len(surface.grid.triangles) - len(surface.caps) == faces


def test_box_faces_drawn_from_both_sides_count_once():
    """One, two or all 12 faces of a box are drawn once more, reversed: 12 faces are left, and they are closed."""
    box = box_mesh()
    for faces in ([0], [0, 1], range(12)):
        surface = winding_surface(from_both_sides(box, *faces))
        assert surface.kinds.tolist() == [ComponentKind.CLOSED]
        assert len(surface.grid.triangles) == 12


def test_two_sided_cell_beside_a_solid_is_not_lost():
    """Two boxes side by side; the faces of the second, but for its wall to the first, are drawn from both sides.

    Whether it is filled is open, as its wall to the solid leaves edges of three faces; it is never outside.
    """
    double = lattice_of_boxes((2, 1, 1))
    second = [face for face in range(12, 24) if not (double.triangles[face][:, 0] == 0.5).all()]
    surface = winding_surface(from_both_sides(double, *second))
    assert surface.kinds.tolist() == [ComponentKind.OPEN]


def test_crossing_components_of_opposite_winding_are_noted():
    """A box and a ball that cross, the ball once with reversed faces, and a box far away.

    ``opposed``: 1 for a component that crosses another of the other winding.
    """
    box, ball = box_mesh(), shift_mesh(ball_mesh(0.3), [0.5, 0.3, 0.2])
    backwards = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    assert winding_surface(merge_meshes(box, ball, shift_mesh(box, [5, 0, 0]))).opposed.tolist() == [0, 0, 0]
    assert winding_surface(merge_meshes(box, backwards, shift_mesh(box, [5, 0, 0]))).opposed.tolist() == [1, 1, 0]
