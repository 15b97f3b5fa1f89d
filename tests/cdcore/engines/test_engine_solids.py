"""Solids that an engine is given for a mesh fill it, or its hull, and stay where it was."""

import numpy as np
import pytest
from support.shapes import ball_mesh, beaker_mesh, box_mesh, random_rotations, rod_mesh, without_faces

from cdcore import Body, TriangleMesh
from cdcore.engines.engine_solids import engine_poses, engine_solid, is_convex, spread_positions


@pytest.mark.parametrize(
    ("mesh", "convex"),
    [(box_mesh(), True), (ball_mesh(0.1), True), (rod_mesh(), True), (beaker_mesh(), False),
     (without_faces(box_mesh(), count=1), False)],
)  # fmt: skip
def test_only_a_closed_mesh_that_fills_its_hull_is_convex(mesh, convex):
    """Each mesh as it is, rotated and 10 km away on each axis, and in float32."""
    rotation = random_rotations(np.random.default_rng(1), 1)[0]
    for vertices in (mesh.vertices, mesh.vertices @ rotation.T + 1e4, mesh.vertices.astype(np.float32)):
        assert is_convex(TriangleMesh(vertices, mesh.faces)) == convex


def test_posed_solid_corners_equal_posed_mesh_corners():
    """Placed by the engine's quaternion, written out as a matrix, and by the mesh's rotation."""
    rng = np.random.default_rng(2)
    for mesh in (box_mesh(), TriangleMesh(beaker_mesh().vertices + np.array([3, -2, 1]), beaker_mesh().faces)):
        solid = engine_solid(Body("a", mesh), shape="mesh", engine="Engine", least_thickness=1e-4)
        rotation, move = random_rotations(rng, 1)[0], rng.normal(size=3)
        positions, quaternions = engine_poses([solid], rotation[None], move[None])
        x, y, z, w = quaternions[0]
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        placed = solid.corners @ (np.eye(3) + 2 * w * cross + 2 * cross @ cross).T + positions[0]
        present = mesh.vertices @ rotation.T + move
        assert np.abs(placed[:, None] - present).max(axis=2).min(axis=1).max() < 1e-12


def test_sheets_get_a_thickness_and_solids_stay_unchanged():
    """The least thickness is 0.1 mm; a box of 1 m keeps its size."""
    flat = TriangleMesh(box_mesh().vertices * [1, 1, 0], box_mesh().faces)
    assert np.ptp(
        engine_solid(Body("a", flat), shape="hull", engine="Engine", least_thickness=1e-4).corners[:, 2]
    ) == pytest.approx(1e-4)
    solid = engine_solid(Body("a", box_mesh()), shape="hull", engine="Engine", least_thickness=1e-4)
    assert np.allclose(np.ptp(solid.corners, axis=0), np.ptp(box_mesh().vertices, axis=0))


def test_spread_bodies_are_a_metre_from_each_other():
    """Along a line: the balls that hold two neighbouring solids are 1 m apart."""
    meshes = box_mesh(), ball_mesh(10.0), ball_mesh(0.1), rod_mesh()
    solids = [engine_solid(Body("a", mesh), shape="hull", engine="it", least_thickness=1e-4) for mesh in meshes]
    reach = np.array([np.linalg.norm(solid.corners, axis=1).max() for solid in solids])
    gaps = np.linalg.norm(np.diff(spread_positions(solids)[0], axis=0), axis=1)
    assert np.allclose(gaps, reach[1:] + reach[:-1] + 1.0)
