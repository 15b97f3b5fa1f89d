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
    """The stopper stands 0.104 m up in the bottle, whose neck is 0.115 m up: less than 2 mm are between them."""
    bottle, stopper = placed("reagent_bottle", 20_000), placed("reagent_bottle_stopper", 20_000, 0.104)
    inside = radii(stopper)[stopper.vertices[:, 1] < 0.119].max()
    neck = radii(bottle)[np.abs(bottle.vertices[:, 1] - 0.115) < 0.005].min()
    assert 0 < neck - inside < 2e-3


@pytest.mark.parametrize(("quarter_rotations", "shut"), [(0.0, True), (1.0, False)])
def test_stopcock_shuts_bore_and_opens_at_90_degrees(quarter_rotations, shut):
    """A ray from 1 m down the axis of the burette meets glass or the stopcock's key (shut), or passes (open)."""
    meshes = placed("burette", 3000), placed("burette_stopcock", 3000, 0.1, quarter_rotations)
    down = ([[1e-5, 1.0, 1e-5]], [[0.0, -1.0, 0.0]])
    assert any(len(distances_along_rays(mesh.triangles, *down)[0]) for mesh in meshes) == shut


@pytest.mark.slow
@pytest.mark.parametrize("quarter_rotations", FRACTIONS)
def test_key_rotates_without_touching_the_glass(quarter_rotations):
    """No edge of the key, 0.1 m up in the burette, crosses a face of the glass."""
    glass, key = placed("burette", 500), placed("burette_stopcock", 500, 0.1, quarter_rotations)
    edges = np.concatenate([key.faces[:, [0, 1]], key.faces[:, [1, 2]], key.faces[:, [2, 0]]])
    edges = edges[edges[:, 0] < edges[:, 1]]
    start, end = key.vertices[edges[:, 0]], key.vertices[edges[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    near = glass.triangles[np.abs(glass.triangles[..., 1] - 0.1).min(axis=1) < 0.03]
    hits = distances_along_rays(near, start, (end - start) / length[:, None])
    assert any(map(len, hits)), "rays along the edges do meet the glass, farther away"
    assert not any(len(hit) and hit[0] <= whole for hit, whole in zip(hits, length, strict=True))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("faces", [500, 2000, pytest.param(50_000, marks=pytest.mark.slow)])
def test_delivery_tube_has_1_mm_wall_and_6_mm_bore(faces):
    """5 mm and more from its ends: a ray that meets a face within 6.5 mm crosses the bore, and 1 mm of wall behind."""
    tube = delivery_tube(faces).mesh
    points, normals = points_on_faces(tube, count=300, seed=faces)
    ends = np.array([(0.0, -0.012, 0.0), (0.17, -0.11, 0.0)])
    away = np.linalg.norm(points[:, None] - ends, axis=2).min(axis=1) > 0.005
    points, normals = points[away], normals[away]
    across = distances_along_rays(tube.triangles, points + 1e-6 * normals, normals)
    in_bore = np.array([len(hit) > 0 and hit[0] < 0.0065 for hit in across])
    assert in_bore.sum() > 80
    outwards = -normals[in_bore]
    hits = distances_along_rays(tube.triangles, points[in_bore] + 1e-6 * outwards, outwards)
    assert np.array([hit[0] for hit in hits]) == pytest.approx(1e-3, rel=0.10)
    up = distances_along_rays(tube.triangles, [[0.17 + 1e-5, -0.21, 1e-5]], [[0, 1, 0]])[0]
    assert up[0] > 0.2  # past the open end, up the bore to the bend


def test_hands_of_every_scene_use_a_shipped_grip():
    """A grip that is not shipped (GRIPS, m) gets the nearest hand, which would change what a seed makes."""
    scenes = [experiment(name) for name in SCENES]
    grips = {grip for scene in scenes for grip in scene.grips}
    grips |= {item.options["grip_radius"] for scene in scenes for item in scene.bodies.values() if item.options}
    assert 0.01 in grips and grips <= {*GRIPS}


@pytest.mark.parametrize("detail", ["", "_coarse"])
def test_device_with_shipped_face_count_is_the_shipped_mesh(detail):
    """The wand is a file in two sizes; made with as many faces as the file has, it is that mesh."""
    shipped = load_mesh(FOLDER / f"wand{detail}.glb")
    assert np.array_equal(placed("proxy_wand", len(shipped.faces)).triangles, shipped.triangles)
