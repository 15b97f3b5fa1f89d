"""Lost faces are distinguished from openings, faces drawn twice count once, and every hole is closed by its cap.

A winding surface has the components of a mesh that may enclose something, each with its kind (closed, with lost faces:
HOLED, or OPEN), the sign of its winding, and caps: triangles that close its holes.
"""

from collections import Counter

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
    """``MESHES_WITH_KINDS``: a box, ball or bowl with its kind: CLOSED, HOLED where single triangles are lost, or OPEN
    where a whole side, or all above a height, is missing.

    The kind is the same for all faces drawn twice, and for the mesh inside out.
    """
    mesh, kind = MESHES_WITH_KINDS[name]
    inside_out = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    assert winding_surface(mesh).kinds.tolist() == [kind]
    assert winding_surface(merge_meshes(mesh, mesh)).kinds.tolist() == [kind]
    assert winding_surface(inside_out).kinds.tolist() == [kind]


@pytest.mark.parametrize("name", MESHES_WITH_KINDS)
def test_winding_surface_scales_with_its_mesh(name):
    """Sizes scaled by powers of two from 2^-330 to 2^330, which round nothing: kinds, caps and faces scale exactly."""
    mesh, kind = MESHES_WITH_KINDS[name]
    surface = winding_surface(mesh)
    for exponent in (-330, -20, 20, 330):
        scaled = winding_surface(TriangleMesh(np.ldexp(mesh.vertices, exponent), mesh.faces))
        assert scaled.kinds.tolist() == [kind], exponent
        assert np.array_equal(scaled.caps, np.ldexp(surface.caps, exponent)), exponent
        assert np.array_equal(scaled.grid.triangles, np.ldexp(surface.grid.triangles, exponent)), exponent


def test_up_to_three_flat_sheets_cannot_enclose_a_volume():
    """Four planes are the fewest that bound a volume (a tetrahedron); fewer sheets have no winding surface."""
    sheet = TriangleMesh([[0, 0, 0], [1, 0, 0.5], [1, 1, 0.5], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    sheets = [shift_mesh(sheet, [0, 0, 3 * k]) for k in range(4)]
    assert winding_surface(sheet).kinds.tolist() == []
    assert winding_surface(merge_meshes(*sheets[:3])).kinds.tolist() == []
    assert winding_surface(merge_meshes(*sheets)).kinds.tolist() == [ComponentKind.OPEN]


def test_large_flat_sheet_off_the_origin_has_no_winding_surface():
    """41 x 41 squares of two triangles at a height of 1 km: a flat sheet, which encloses nothing.

    Whether corners lie in one plane is told by the singular values of all of them; from 10,000 on, as here, by the
    eigenvalues of a 3 x 3 matrix, which have fewer digits.
    """
    n = 42
    x, y = np.meshgrid(np.arange(float(n)), np.arange(float(n)))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1000.0)])
    in_a_row_but_the_last = np.arange(n * (n - 1)) % n != n - 1
    corner = np.arange(n * (n - 1))[in_a_row_but_the_last]
    lower, upper = [corner, corner + 1, corner + n + 1], [corner, corner + n + 1, corner + n]
    faces = np.concatenate([lower, upper], axis=1).T
    assert 3 * len(faces) > 10_000
    assert winding_surface(TriangleMesh(points, faces)).kinds.tolist() == []


def test_open_components_have_the_sign_they_agree_on():
    """Two bowls, one component of the surface: 1 where both are wound outwards, -1 inwards, 0 where they differ."""
    bowl = cut_sphere(height=0.7)
    inwards = TriangleMesh(bowl.vertices, bowl.faces[:, ::-1])
    for first, second, sign in ((bowl, bowl, 1), (inwards, inwards, -1), (bowl, inwards, 0)):
        both = merge_meshes(first, shift_mesh(second, [5, 0, 0]))
        assert winding_surface(both).signs.tolist() == [sign], sign


def test_rims_too_many_to_follow_belong_to_their_components(monkeypatch):
    """Two boxes that lack a face each, where no rim of a hole may be followed: each box keeps its own hole.

    Holes ``first_hole[k]`` to ``first_hole[k + 1]`` are those of component k.
    """
    monkeypatch.setattr(module, "MOST_TRACED", 0)
    holed = without_faces(box_mesh(), 4)  # any face
    surface = winding_surface(merge_meshes(holed, shift_mesh(holed, [3, 0, 0])))
    assert surface.kinds.tolist() == [ComponentKind.HOLED] * 2
    assert surface.first_hole.tolist() == [0, 1, 2]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(20))
def test_capped_components_are_closed_with_lost_or_reversed_faces(seed):
    """A ball and a box that cross and a ball beside them: a fifth of their faces lost, of the rest a third reversed and
    nine drawn twice.

    With its caps a component is closed: its faces use each edge as often in one direction as in the other.
    """
    rng = np.random.default_rng(seed)
    mesh = merge_meshes(
        icosphere_mesh(), shift_mesh(box_mesh(), [0.4, 0.1, 0.2]), shift_mesh(ball_mesh(0.3), [2, 0, 0])
    )
    faces = mesh.faces[rng.random(len(mesh.faces)) < 0.8].copy()
    reversed_rows = rng.random(len(faces)) < 0.3
    faces[reversed_rows] = faces[reversed_rows, ::-1]
    nine_again = [faces[:5], faces[5:9, ::-1]]
    surface = winding_surface(TriangleMesh(mesh.vertices, np.concatenate([faces, *nine_again])))
    assert len(surface.grid.triangles) == len(faces) + len(surface.caps)
    for component in np.unique(surface.component):
        uses = Counter()
        for triangle in surface.grid.triangles[surface.component == component].tolist():
            corners = [tuple(corner) for corner in triangle]
            for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
                uses[start, end] += 1
                uses[end, start] -= 1
        assert uses
        assert not any(uses.values())


def test_faces_of_mixed_winding_are_turned_to_one_side():
    """A box that lacks a triangle and has three reversed: it has one hole with one cap, and is wound outwards (1)."""
    holed = without_faces(box_mesh(), 4)
    faces = holed.faces.copy()
    faces[[0, 3, 5]] = faces[[0, 3, 5], ::-1]
    surface = winding_surface(TriangleMesh(holed.vertices, faces))
    assert surface.kinds.tolist() == [ComponentKind.HOLED]
    assert len(surface.caps) == 1
    assert surface.signs.tolist() == [1]


def lattice_of_boxes(counts, sizes=(1.0, 1.0, 1.0)):
    """Boxes side to side in a lattice, each with all of its faces: walls between two are drawn from both sides."""
    return merge_meshes(*(shift_mesh(box_mesh(sizes), np.array(cell) * sizes) for cell in np.ndindex(*counts)))


def from_both_sides(mesh, *faces):
    """The mesh, and some of its faces once more with the other winding."""
    return TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[list(faces), ::-1]]))


@pytest.mark.parametrize("wound", ["outwards", "inwards", "first face inwards"])
@pytest.mark.parametrize("counts", [(2, 1, 1), (3, 2, 1)], ids="{} boxes".format)
def test_inner_walls_of_a_solid_of_cells_are_removed(counts, wound):
    """A block of boxes side by side is closed, and wound outwards (1) or inwards (-1), at scales from 2^-330 to 2^330.

    A single face that is wound the other way is turned round. Each wall between two neighbours is drawn from both
    sides, two triangles each: these four are left out.
    """
    mesh = lattice_of_boxes(counts)
    faces = mesh.faces.copy()
    inwards = {"outwards": slice(0), "inwards": slice(None), "first face inwards": slice(0, 1)}[wound]
    faces[inwards] = faces[inwards, ::-1]
    x, y, z = counts
    walls = (x - 1) * y * z + x * (y - 1) * z + x * y * (z - 1)
    for exponent in (-330, 0, 330):
        surface = winding_surface(TriangleMesh(np.ldexp(mesh.vertices, exponent), faces))
        assert surface.kinds.tolist() == [ComponentKind.CLOSED], exponent
        assert surface.signs.tolist() == [-1 if wound == "inwards" else 1], exponent
        assert len(surface.grid.triangles) == len(mesh.faces) - 4 * walls, exponent


@pytest.mark.parametrize(
    ("tip", "kind", "faces"),
    [
        pytest.param([0.0, 0.1, 0.1], ComponentKind.CLOSED, 12, id="inside the box"),
        pytest.param([0.0, -0.9, -0.9], ComponentKind.HOLED, 12 + 1, id="sticks out"),
    ],
)
def test_two_sided_fin_inside_a_closed_box_is_ignored(tip, kind, faces):
    """A fin, one triangle drawn from both sides, hangs at an edge of a box of 12 faces: inside, the 12 stay closed.

    One that sticks out counts once and has open edges.
    """
    fin = TriangleMesh([[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], tip], [[0, 1, 2], [2, 1, 0]])
    surface = winding_surface(merge_meshes(box_mesh(), fin))
    assert surface.kinds.tolist() == [kind]
    assert len(surface.grid.triangles) - len(surface.caps) == faces


@pytest.mark.parametrize("count", [1, 2, 12])
def test_box_faces_drawn_from_both_sides_count_once(count):
    """The first faces of a box are drawn once more, reversed: 12 faces remain, and they are closed."""
    surface = winding_surface(from_both_sides(box_mesh(), *range(count)))
    assert surface.kinds.tolist() == [ComponentKind.CLOSED]
    assert len(surface.grid.triangles) == 12


def test_two_sided_cell_beside_a_solid_is_not_lost():
    """Two boxes side by side; the faces of the second, but for its wall to the first, are drawn from both sides.

    Whether it is filled is open, as its wall to the solid leaves edges of three faces; it is never outside.
    """
    boxes = lattice_of_boxes((2, 1, 1))
    wall_x = 0.5
    second = [face for face in range(12, 24) if not (boxes.triangles[face][:, 0] == wall_x).all()]
    surface = winding_surface(from_both_sides(boxes, *second))
    assert surface.kinds.tolist() == [ComponentKind.OPEN]


def test_crossing_components_of_opposite_winding_are_noted():
    """A box and a ball that cross, and a box far away: where the ball's faces are reversed both of them are
    ``opposed``.
    """
    box, ball, far_box = box_mesh(), shift_mesh(ball_mesh(0.3), [0.5, 0.3, 0.2]), shift_mesh(box_mesh(), [5, 0, 0])
    reversed_ball = TriangleMesh(ball.vertices, ball.faces[:, ::-1])
    assert winding_surface(merge_meshes(box, ball, far_box)).opposed.tolist() == [False, False, False]
    assert winding_surface(merge_meshes(box, reversed_ball, far_box)).opposed.tolist() == [True, True, False]
