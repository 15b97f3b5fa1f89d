"""Solids that an engine is given for a mesh fill it, or its hull, and stay where it was."""

import numpy as np
import pytest
from support.shapes import ball_mesh, beaker_mesh, box_mesh, random_rotations, rod_mesh, shift_mesh, without_faces

from cdcore import Body, TriangleMesh
from cdcore.engines.engine_solids import engine_poses, engine_solid, is_convex, spread_positions


@pytest.mark.parametrize(
    ("mesh", "convex"),
    [
        pytest.param(box_mesh(), True, id="box"),
        pytest.param(ball_mesh(0.1), True, id="ball"),
        pytest.param(rod_mesh(), True, id="rod"),
        pytest.param(beaker_mesh(), False, id="beaker"),
        pytest.param(without_faces(box_mesh(), count=1), False, id="box that lacks a triangle"),
    ],
)
def test_only_a_closed_mesh_that_fills_its_hull_is_convex(mesh, convex):
    """Each mesh as it is, rotated and moved by 10 km along each axis, and with the digits of float32."""
    rotation = random_rotations(np.random.default_rng(1))
    for vertices in (mesh.vertices, mesh.vertices @ rotation.T + 1e4, mesh.vertices.astype(np.float32)):
        assert is_convex(TriangleMesh(vertices, mesh.faces)) == convex


LEAST_THICKNESS = 1e-4
"""Metres that the engine of these tests gives a sheet."""


def solid_of(mesh, shape="hull"):
    """The solid that an engine is given for a mesh: its corners about its own middle."""
    return engine_solid(Body("a", mesh), shape=shape, engine="Engine", least_thickness=LEAST_THICKNESS)


@pytest.mark.parametrize("mesh", [box_mesh(), shift_mesh(beaker_mesh(), [3, -2, 1])], ids=["box", "beaker"])
def test_posed_solid_corners_equal_posed_mesh_corners(mesh):
    """The engine has corners about a middle of its own, and a pose of that middle with a quaternion (x, y, z, w).

    That is written out as a matrix here: each placed corner is a vertex of the mesh at its random pose.
    """
    rng = np.random.default_rng(2)
    rotation, translation = random_rotations(rng), rng.normal(size=3)
    solid = solid_of(mesh, shape="mesh")
    (position,), ((x, y, z, w),) = engine_poses([solid], rotation[None], translation[None])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    corners = solid.corners @ matrix.T + position
    vertices = mesh.vertices @ rotation.T + translation
    distances = np.abs(corners[:, None] - vertices).max(axis=2)
    assert distances.min(axis=1).max() < 1e-12


def test_sheet_gets_the_least_thickness():
    """A flat sheet of 1 x 1 m: an engine gets a solid of that size, LEAST_THICKNESS thick."""
    sheet = TriangleMesh(box_mesh().vertices * [1, 1, 0], box_mesh().faces)
    assert np.ptp(solid_of(sheet).corners, axis=0) == pytest.approx([1, 1, LEAST_THICKNESS])


def test_solid_keeps_its_size():
    """A box of 1 m, thicker than the least thickness."""
    assert np.ptp(solid_of(box_mesh()).corners, axis=0) == pytest.approx([1, 1, 1])


def test_spread_bodies_are_a_metre_from_each_other():
    """Before the first frame solids stand in a line: the balls that hold two neighbours are 1 m apart."""
    solids = [solid_of(mesh) for mesh in (box_mesh(), ball_mesh(10.0), ball_mesh(0.1), rod_mesh())]
    radii = np.array([np.linalg.norm(solid.corners, axis=1).max() for solid in solids])
    positions, *_ = spread_positions(solids)
    distances = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert np.allclose(distances, radii[1:] + radii[:-1] + 1.0)
