"""Parts that belong together fit, and hands go round what they hold: rays and radii of the meshes decide."""

import numpy as np
import pytest
from support.second_opinions import distances_along_rays, points_on_faces

from sessions.glassware.catalogue import made_instrument
from sessions.glassware.devices import FOLDER, GRIPS
from sessions.glassware.glass import delivery_tube
from sessions.meshes.mesh_files import load_mesh
from sessions.synthetic.experiments.record import experiment
from sessions.synthetic.scenes import SCENES

FRACTIONS = [0.0, 0.3, 0.7, 1.0]


def placed(name, faces, height=0.0, quarter_rotations=0.0):
    """A mesh lifted to a height and turned about Z."""
    angle = quarter_rotations * np.pi / 2.0
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[1, 3] = height
    return made_instrument(name, faces).mesh.transformed(pose)


def radii(mesh):
    """Distances of the vertices from the axis Y."""
    return np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2])


def test_the_stopper_fits_the_bottle_without_touching_its_neck():
    """The stopper stands 0.104 m up in the bottle (turned.toml), inside its neck: less than 2 mm are between them.

    The neck's inner radius is the least at heights of 0.11 to 0.12 m, the stopper's the largest below 0.119 m.
    """
    bottle, stopper = placed("reagent_bottle", 20_000), placed("reagent_bottle_stopper", 20_000, height=0.104)
    stopper_radius = radii(stopper)[stopper.vertices[:, 1] < 0.119].max()
    neck_radius = radii(bottle)[np.abs(bottle.vertices[:, 1] - 0.115) < 0.005].min()
    assert 0 < neck_radius - stopper_radius < 0.002


@pytest.mark.parametrize(("quarter_rotations", "is_shut"), [(0.0, True), (1.0, False)])
def test_stopcock_shuts_bore_and_opens_at_90_degrees(quarter_rotations, is_shut):
    """A ray from 1 m up goes down the axis of a burette, whose stopcock's key is 0.1 m up, and 10 um beside the axis.

    So it runs along no edge. It meets faces where the key is shut, and none where it is open, a quarter rotated.
    """
    meshes = placed("burette", 3000), placed("burette_stopcock", 3000, 0.1, quarter_rotations)
    origins, directions = [[1e-5, 1.0, 1e-5]], [[0.0, -1.0, 0.0]]
    faces_met = 0
    for mesh in meshes:
        (distances,) = distances_along_rays(mesh.triangles, origins, directions)
        faces_met += len(distances)
    assert (faces_met > 0) == is_shut


@pytest.mark.slow
@pytest.mark.parametrize("quarter_rotations", FRACTIONS)
def test_key_rotates_without_touching_the_glass(quarter_rotations):
    """No edge of the key, 0.1 m up in the burette, reaches a face of the glass within 3 cm of that height.

    A ray along an edge goes on beyond its end: some meet glass there, but none as near as the edge is long.
    """
    glass, key = placed("burette", 500), placed("burette_stopcock", 500, 0.1, quarter_rotations)
    edges = np.concatenate([key.faces[:, [0, 1]], key.faces[:, [1, 2]], key.faces[:, [2, 0]]])
    edges = edges[edges[:, 0] < edges[:, 1]]
    start, end = key.vertices[edges[:, 0]], key.vertices[edges[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    near = glass.triangles[np.abs(glass.triangles[..., 1] - 0.1).min(axis=1) < 0.03]
    hits = distances_along_rays(near, start, (end - start) / length[:, None])
    assert any(map(len, hits))
    for distances, edge_length in zip(hits, length, strict=True):
        assert len(distances) == 0 or distances[0] > edge_length


@pytest.mark.sampled(3)
@pytest.mark.parametrize("faces", [500, 2000, pytest.param(50_000, marks=pytest.mark.slow)])
def test_delivery_tube_has_1_mm_wall_and_6_mm_bore(faces):
    """From 300 points of its surface, 5 mm and more from both ends, rays leave the glass, beginning 1 um off it.

    A ray that meets a face within 6.5 mm crosses the bore of 6 mm; behind its point is 1 mm of wall, within a tenth.
    With radii of 3 and 4 mm 3/7 of the surface, some 128 points, are in the bore: more than 80 are measured.
    """
    tube = delivery_tube(faces).mesh
    points, normals = points_on_faces(tube, count=300, seed=faces)
    ends = np.array([(0.0, -0.012, 0.0), (0.17, -0.11, 0.0)])
    is_far_from_ends = np.linalg.norm(points[:, None] - ends, axis=2).min(axis=1) > 0.005
    points, normals = points[is_far_from_ends], normals[is_far_from_ends]
    across = distances_along_rays(tube.triangles, points + 1e-6 * normals, normals)
    is_in_bore = np.array([len(distances) > 0 and distances[0] < 0.0065 for distances in across])
    assert is_in_bore.sum() > 80
    into_wall = -normals[is_in_bore]
    through_wall = distances_along_rays(tube.triangles, points[is_in_bore] + 1e-6 * into_wall, into_wall)
    assert np.array([distances[0] for distances in through_wall]) == pytest.approx(0.001, rel=0.10)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("faces", [500, 2000, pytest.param(50_000, marks=pytest.mark.slow)])
def test_delivery_tube_is_open_up_to_its_bend(faces):
    """A ray from 0.1 m below the tube's lower end goes up its bore, 10 um beside its axis, for 0.2 m at least.

    The lower end is at y = -0.11 m, and the bend, in which the ray meets glass, begins at 0.055: 0.265 m on its way.
    """
    tube = delivery_tube(faces).mesh
    (distances,) = distances_along_rays(tube.triangles, [[0.17 + 1e-5, -0.21, 1e-5]], [[0, 1, 0]])
    assert distances[0] > 0.2


def test_hands_of_every_scene_use_a_shipped_grip():
    """Hands that grip a radius are shipped as meshes, for the radii GRIPS in metres.

    Made-up scenes use no other radius, for which the nearest hand would be taken; 0.01 m is used by some scene.
    """
    scenes = [experiment(name) for name in SCENES]
    grips = {grip for scene in scenes for grip in scene.grips}
    grips |= {body.options["grip_radius"] for scene in scenes for body in scene.bodies.values() if body.options}
    assert 0.01 in grips
    assert {*GRIPS} >= grips


@pytest.mark.parametrize("detail", ["", pytest.param("_coarse", marks=pytest.mark.slow)])
def test_device_with_shipped_face_count_is_the_shipped_mesh(detail):
    """The wand is shipped as a file in two sizes; requested with as many faces as a file has, it is that mesh."""
    shipped = load_mesh(FOLDER / f"wand{detail}.glb")
    assert np.array_equal(placed("proxy_wand", len(shipped.faces)).triangles, shipped.triangles)
