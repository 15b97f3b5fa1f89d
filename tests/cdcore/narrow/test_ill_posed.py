"""The stage says of placed surfaces what exact margins say of all their face pairs, however many are asked at once.

``near``: surfaces that do not meet are at most tau apart. ``shallow``: no pair of faces that meet is deeper than tau.
``loose``: some move of the surfaces by tau ends their contact.
"""

from functools import cache

import numpy as np
import pytest
from support.random_worlds import KINDS, bodies_of, grid_plate, motion_of, placed
from support.shapes import ball_mesh, box_mesh, merge_meshes

from cdcore import Body
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.ill_posed import MarginStage
from cdcore.narrow.margins import triangle_margins

PAIR = (0, 1)
TWO_MICROMETRES = 2e-6
"""The tau of most tests, metres."""


@cache
def face_pairs_in_frames(kind, count=24, step=3):
    """Bodies of two random soups of ten faces, their poses, and for some frames whether each face pair meets, and its
    margin: the gap, or where they meet how far one face must be moved until they do not.
    """
    rng = np.random.default_rng(4)
    meshes = [KINDS[kind](rng, 10) for _ in range(2)]
    rotations, translations = motion_of(kind, rng, frames=count, bodies=2)
    rows = []
    for frame in range(0, count, step):
        first, second = (placed(meshes[k], rotations[frame, k], translations[frame, k]) for k in range(2))
        meets, margin = triangle_margins(np.array([[a, b] for a in first for b in second]))
        rows.append((frame, meeting_faces_exhaustive(first, second), meets, margin))
    return bodies_of(meshes), rotations, translations, rows


@pytest.mark.sampled(3)
@pytest.mark.parametrize("tau", [1e-9, 0.02, 0.2])
@pytest.mark.parametrize("kind", KINDS)
def test_near_agrees_with_margins_of_all_face_pairs(kind, tau):
    """Two random soups of ten faces in 24 frames: near where no face pair meets and the smallest gap is at most tau."""
    bodies, rotations, translations, rows = face_pairs_in_frames(kind)
    near = MarginStage(bodies, tau).near(PAIR, rotations, translations)
    for frame, _faces, meets, margin in rows:
        assert near[frame] == (not meets.any() and margin.min() <= tau), frame


@pytest.mark.sampled(3)
@pytest.mark.parametrize("tau", [1e-9, 0.02, 0.2, "deepest", "a bit less than the deepest"])
@pytest.mark.parametrize("kind", KINDS)
def test_shallow_agrees_with_margins_of_all_face_pairs(kind, tau):
    """Two random soups of ten faces, in frames where some meet: shallow where the deepest of those is at most tau.

    At a tau of that depth it still is; at the next smaller double it is not.
    """
    bodies, rotations, translations, rows = face_pairs_in_frames(kind)
    frames_in_contact = 0
    for frame, faces, meets, margin in rows:
        if not meets.any():
            continue
        frames_in_contact += 1
        deepest = margin[meets].max()
        if tau == "a bit less than the deepest" and deepest == 0.0:
            continue  # there is no smaller depth
        tau_m = {"deepest": deepest, "a bit less than the deepest": np.nextafter(deepest, 0.0)}.get(tau, tau)
        stage = MarginStage(bodies, tau_m)
        assert stage.shallow(PAIR, faces, rotations[frame], translations[frame]) == (deepest <= tau_m), frame
    assert frames_in_contact > 0


@pytest.mark.parametrize(
    ("gap", "is_near"), [(1e-12, True), (1e-6, True), (1.9e-6, True), (2.3e-6, False), (1e-3, False)]
)
def test_surfaces_are_near_up_to_a_gap_of_two_micrometres(gap, is_near):
    """A ball of radius 0.5 m, whose outermost vertex is ``gap`` metres before the side of a box of 1 m.

    ``near``: surfaces do not meet, and are at most 2 um apart.
    """
    bodies = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]
    rotations, translations = np.tile(np.eye(3), (1, 2, 1, 1)), np.array([[[0.5 + gap + 0.5, 0, 0], [0, 0, 0]]])
    assert MarginStage(bodies, TWO_MICROMETRES).near(PAIR, rotations, translations).tolist() == [is_near]


@pytest.mark.parametrize(
    ("depth", "is_shallow"), [(0.0, True), (1e-12, True), (1e-6, True), (1.9e-6, True), (2.3e-6, False), (1e-3, False)]
)
def test_contact_is_shallow_up_to_a_depth_of_two_micrometres(depth, is_shallow):
    """A ball of radius 0.5 m, whose outermost vertex is ``depth`` metres behind the side of a box of 1 m.

    ``shallow``: of the faces that meet no two are deeper in each other than 2 um.
    """
    bodies = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]
    contact = arguments_of_meeting_bodies(bodies, [[0.5 - depth + 0.5, 0, 0], [0, 0, 0]])
    assert MarginStage(bodies, TWO_MICROMETRES).shallow(*contact) == is_shallow


def arguments_of_meeting_bodies(bodies, translations):
    """The arguments of ``shallow`` and ``loose`` (pair, faces that meet, poses) for two bodies that stand unrotated."""
    rotations, translations = np.tile(np.eye(3), (2, 1, 1)), np.array(translations, dtype=float)
    first, second = (placed(bodies[k].mesh.triangles, rotations[k], translations[k]) for k in range(2))
    faces = meeting_faces_exhaustive(first, second)
    assert len(faces)
    return PAIR, faces, rotations, translations


@pytest.mark.parametrize(
    "offset",
    [
        pytest.param([1.0, 0, 0], id="share a face"),
        pytest.param([1.0, 1.0, 0], id="share an edge"),
        pytest.param([1.0, 1.0, 1.0], id="share a corner"),
        pytest.param([0.3, 0.2, 1.0 - 1e-6], id="a micrometre deep"),
    ],
)
def test_touching_cubes_are_shallow_and_separable(offset):
    """Two cubes of 1 m, the second at an offset: no two faces that meet are deeper in each other than 2 um
    (``shallow``), and some move of the surfaces by that ends the contact (``loose``).
    """
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    contact = arguments_of_meeting_bodies(bodies, [[0, 0, 0], offset])
    stage = MarginStage(bodies, TWO_MICROMETRES)
    assert stage.shallow(*contact)
    assert stage.loose(*contact)


@pytest.mark.parametrize("offset", [[0.5, 0, 0], [0.9, 0, 0], [0, 0.01, 0]])
def test_overlapping_cubes_with_common_planes_are_shallow_not_separable(offset):
    """Two cubes of 1 m, deep in each other along one axis: every face pair that meets only touches, in common planes
    (``shallow``).

    But no move of the surfaces by 2 um ends the contact (``loose``).
    """
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    contact = arguments_of_meeting_bodies(bodies, [[0, 0, 0], offset])
    stage = MarginStage(bodies, TWO_MICROMETRES)
    assert stage.shallow(*contact)
    assert not stage.loose(*contact)


def test_exactly_fitting_plug_is_separable():
    """A plug of 1 x 1 m in a hole of that size, between eight cubes: a move of the surfaces by 2 um frees it
    (``loose``).
    """
    hole = merge_meshes(*(box_mesh((1, 1, 1), [x, y, 0]) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y))
    bodies = [Body("plug", box_mesh((1, 1, 3))), Body("hole", hole)]
    assert MarginStage(bodies, TWO_MICROMETRES).loose(*arguments_of_meeting_bodies(bodies, np.zeros((2, 3))))


@pytest.mark.parametrize("faces", [grid_plate(), grid_plate()[:, ::-1]], ids=["faces look up", "faces look down"])
def test_tool_on_a_sheet_is_separable_for_either_winding(faces):
    """The bottom of a cube of 1 m, whose middle is at a height of 0.5 m, is in the plane of a flat sheet: a move of the
    surfaces by 2 um frees it (``loose``).
    """
    bodies = [*bodies_of([faces]), Body("cube", box_mesh(centre=(2.3, 2.4, 0.5)))]
    assert MarginStage(bodies, TWO_MICROMETRES).loose(*arguments_of_meeting_bodies(bodies, np.zeros((2, 3))))
