"""The stage says of placed surfaces what the integers say of all their face pairs, however many are asked at once."""

import numpy as np
import pytest
from support.random_worlds import KINDS, bodies_of, grid_plate, motion_of, placed
from support.shapes import ball_mesh, box_mesh, merge_meshes

from cdcore import Body
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.ill_posed import MarginStage
from cdcore.narrow.margins import triangle_margins


@pytest.mark.sampled(3)
@pytest.mark.parametrize("tau", [1e-9, 0.02, 0.2])
@pytest.mark.parametrize("kind", KINDS)
def test_near_and_shallow_agree_with_margins_of_all_face_pairs(kind, tau):
    """``near``: the surfaces do not meet and are at most tau apart. ``shallow``: no face pair meets by more than tau.

    The margin of two faces is their gap, or where they meet how far one must be moved until they do not.
    """
    rng = np.random.default_rng(4)
    meshes = [KINDS[kind](rng, 10) for _ in range(2)]
    rotation, move, bodies = *motion_of(kind, rng, frames=24, bodies=2), bodies_of(meshes)
    stage = MarginStage(bodies, tau)
    near = stage.near((0, 1), rotation, move)
    for frame in range(0, 24, 3):
        first, second = (placed(meshes[k], rotation[frame, k], move[frame, k]) for k in range(2))
        pairs = np.array([[a, b] for a in first for b in second])
        meets, margin = triangle_margins(pairs)
        if not meets.any():
            assert near[frame] == (margin.min() <= tau)
            continue
        faces = meeting_faces_exhaustive(first, second)
        assert not near[frame]
        assert stage.shallow((0, 1), faces, rotation[frame], move[frame]) == (margin[meets].max() <= tau)
        # Where tau is the deepest margin they are shallow, where it is the next smaller double they are not.
        deepest = margin[meets].max()
        for border in {deepest, np.nextafter(deepest, 0.0)}:
            exact = MarginStage(bodies, border)
            assert exact.shallow((0, 1), faces, rotation[frame], move[frame]) == (border == deepest)


def ball_beside_box(gap, tau=2e-6):
    """Whether a ball and a box are shallow, or near where they do not meet, within 2 um.

    The ball's extreme vertex is ``gap`` off the wall of the box; below 0 inside it.
    """
    bodies = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]
    rotation, move = np.tile(np.eye(3), (1, 2, 1, 1)), np.array([[[1.0 + gap, 0, 0], [0, 0, 0]]])
    stage = MarginStage(bodies, tau)
    first, second = (placed(bodies[k].mesh.triangles, rotation[0, k], move[0, k]) for k in range(2))
    faces = meeting_faces_exhaustive(first, second)
    return (
        stage.shallow((0, 1), faces, rotation[0], move[0])
        if len(faces)
        else bool(stage.near((0, 1), rotation, move)[0])
    )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("gap", "within"), [(0.0, True), (1e-12, True), (1e-6, True), (1.9e-6, True), (2.3e-6, False), (1e-3, False)]
)
def test_two_micrometres_on_either_side_of_touching_is_the_border(gap, within, side):
    """The ball's outermost vertex is ``gap`` metres before the wall of the box, or as deep in it; tau is 2 um."""
    assert ball_beside_box(side * gap) == within


def arguments_of_meeting_bodies(bodies, move):
    """The arguments of ``shallow`` and ``loose`` for two bodies that stand unrotated."""
    rotation, move = np.tile(np.eye(3), (2, 1, 1)), np.array(move, dtype=float)
    first, second = (placed(bodies[k].mesh.triangles, rotation[k], move[k]) for k in range(2))
    faces = meeting_faces_exhaustive(first, second)
    assert len(faces)
    return (0, 1), faces, rotation, move


@pytest.mark.parametrize("away", [[1.0, 0, 0], [1.0, 1.0, 0], [1.0, 1.0, 1.0], [0.3, 0.2, 1.0 - 1e-6]])
def test_touching_cubes_separate(away):
    """Unit cubes share a face, an edge or a corner, or are a micrometre deep in each other.

    ``shallow``: no face pair is deeper than tau, 2 um; ``loose``: some move of the surfaces by tau ends the contact.
    """
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    requested = arguments_of_meeting_bodies(bodies, [[0, 0, 0], away])
    stage = MarginStage(bodies, 2e-6)
    assert stage.shallow(*requested) and stage.loose(*requested)


@pytest.mark.parametrize("away", [[0.5, 0, 0], [0.9, 0, 0], [0, 0.01, 0]])
def test_overlapping_cubes_with_common_planes_do_not_separate(away):
    """The faces in common planes touch only, though the cubes are up to half an edge deep in each other.

    ``loose``: whether some move of the surfaces by tau, 2 um, ends the contact.
    """
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    requested = arguments_of_meeting_bodies(bodies, [[0, 0, 0], away])
    stage = MarginStage(bodies, 2e-6)
    assert stage.shallow(*requested), "every face pair only touches"
    assert not stage.loose(*requested)


def test_exactly_fitting_plug_separates():
    """A plug of 1 x 1 m in a hole of that size, between eight cubes; ``loose``: a move of surfaces by 2 um frees it."""
    hole = merge_meshes(*(box_mesh((1, 1, 1), [x, y, 0]) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y))
    bodies = [Body("plug", box_mesh((1, 1, 3))), Body("hole", hole)]
    requested = arguments_of_meeting_bodies(bodies, np.zeros((2, 3)))
    assert MarginStage(bodies, 2e-6).loose(*requested)


def test_tool_on_a_sheet_separates_for_either_winding():
    """The bottom of a cube is in the plane of a flat sheet, whose faces look up or down; 2 um free it (``loose``)."""
    for faces in (grid_plate(), grid_plate()[:, ::-1]):
        bodies = [*bodies_of([faces]), Body("box", box_mesh(centre=(2.3, 2.4, 0.5)))]
        assert MarginStage(bodies, 2e-6).loose(*arguments_of_meeting_bodies(bodies, np.zeros((2, 3))))
