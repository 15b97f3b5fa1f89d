import numpy as np
import pytest
from support.surface_rays import distances_along_rays

from sessions.glassware.beakers import LOW_FORM, beaker, evaporating_dish, gas_jar, watch_glass
from sessions.glassware.flasks import CONICAL, erlenmeyer_flask, reagent_bottle, volumetric_flask
from sessions.glassware.tubes import burette, dropper, funnel, graduated_cylinder, pipette, test_tube


def to_parent(part):
    """The pose of a part at rest, 4x4."""
    pose = np.eye(4)
    pose[:3, 3] = part.position
    return pose


@pytest.mark.parametrize("millilitres", LOW_FORM)
def test_a_beaker_has_the_diameter_and_height_of_its_series(millilitres):
    instrument = beaker(20_000, millilitres=millilitres)
    diameter, height, wall = (value * 1e-3 for value in LOW_FORM[millilitres])
    body = instrument.mesh.vertices[instrument.mesh.vertices[:, 1] < 0.7 * height]
    assert 2 * np.hypot(body[:, 0], body[:, 2]).max() == pytest.approx(diameter, rel=2e-3)
    assert instrument.mesh.bounds[1, 1] == pytest.approx(height, abs=0.2 * wall)
    assert instrument.cavity.mark_height < 0.9 * height


def test_the_spout_points_where_the_opening_says():
    instrument = beaker(5000)
    opening = instrument.cavity.opening
    rim = instrument.mesh.vertices[instrument.mesh.vertices[:, 1] > opening.centre[1] - 1e-4]
    furthest = rim[np.argmax(np.hypot(rim[:, 0], rim[:, 2]))]
    assert furthest[[0, 2]] / np.hypot(*furthest[[0, 2]]) == pytest.approx([1, 0], abs=0.02)
    assert opening.pour_direction == (1, 0, 0)
    inside = np.linalg.norm(instrument.cavity.to_brim.vertices - np.array(opening.lip), axis=1).min()
    assert inside < 0.02 * opening.radius


def test_the_cover_lies_on_the_gas_jar_without_touching_it():
    jar = gas_jar(2000)
    cover = jar.parts[0].instrument.mesh.transformed(to_parent(jar.parts[0]))
    gap = cover.bounds[0, 1] - jar.mesh.bounds[1, 1]
    assert 0 < gap < 3e-3
    assert np.ptp(cover.bounds[:, 0]) >= 0.98 * np.ptp(jar.mesh.bounds[:, 0])


def test_a_watch_glass_is_part_of_a_ball_of_75_millimetres():
    inner = watch_glass(5000).cavity.to_brim.vertices
    wet = inner[np.hypot(inner[:, 0], inner[:, 2]) > 1e-6]
    height = inner[:, 1].min() + 0.075
    assert np.linalg.norm(wet - [0, height, 0], axis=1) == pytest.approx(0.075, rel=5e-3)
    assert np.ptp(inner[:, 0]) == pytest.approx(0.079, abs=2e-3) and np.ptp(inner[:, 1]) < 0.015


def test_an_evaporating_dish_stands_on_a_flat_base():
    mesh = evaporating_dish(5000).mesh
    base = mesh.vertices[mesh.vertices[:, 1] == 0]
    assert len(base) > 10
    assert np.hypot(base[:, 0], base[:, 2]).max() == pytest.approx(0.0125, rel=0.1)


@pytest.mark.parametrize("millilitres", CONICAL)
def test_a_conical_flask_has_the_neck_and_height_of_its_series(millilitres):
    flask = erlenmeyer_flask(20_000, millilitres=millilitres)
    body, height, neck, wall = (value * 1e-3 for value in CONICAL[millilitres])
    radii = np.hypot(flask.mesh.vertices[:, 0], flask.mesh.vertices[:, 2])
    at_neck = np.abs(flask.mesh.vertices[:, 1] - 0.9 * height) < 0.02 * height
    assert 2 * radii[at_neck].max() == pytest.approx(neck, rel=0.01)
    assert flask.mesh.bounds[1, 1] == pytest.approx(height, abs=0.5 * wall)
    assert 2 * radii.max() == pytest.approx(body, rel=0.08)  # the corner at the floor is rounded
    inside = neck - 2 * wall  # a hand takes the neck one inner diameter below the brim
    assert flask.mesh.bounds[1, 1] - flask.sites["neck"].point[1] == pytest.approx(inside, abs=2 * wall)


@pytest.mark.parametrize("faces", [500, 2000, 20_000])
def test_the_mark_of_a_volumetric_flask_stays_on_its_neck(faces):
    flask = volumetric_flask(faces)
    assert flask.cavity.mark_height == pytest.approx(0.113, abs=1e-5)
    around = np.hypot(*flask.mesh.vertices[:, [0, 2]].T)[np.abs(flask.mesh.vertices[:, 1] - 0.113) < 0.012]
    assert around.min() == pytest.approx(0.006, rel=0.06)  # inner neck diameter 12 mm


def test_the_stopper_fits_the_bottle_without_touching_its_neck():
    bottle = reagent_bottle(20_000)
    stopper = bottle.parts[0].instrument.mesh.transformed(to_parent(bottle.parts[0]))
    plug = stopper.vertices[stopper.vertices[:, 1] < 0.119]
    inside = np.hypot(plug[:, 0], plug[:, 2]).max()
    neck = bottle.mesh.vertices[np.abs(bottle.mesh.vertices[:, 1] - 0.115) < 0.005]
    assert 0 < np.hypot(neck[:, 0], neck[:, 2]).min() - inside < 2e-3


def test_a_test_tube_is_16_by_160_millimetres():
    mesh = test_tube(20_000).mesh
    low = mesh.vertices[mesh.vertices[:, 1] < 0.1]
    assert 2 * np.hypot(low[:, 0], low[:, 2]).max() == pytest.approx(0.016, rel=2e-3)
    assert mesh.bounds[1, 1] == pytest.approx(0.16, abs=5e-4)


@pytest.mark.parametrize("make", [funnel, pipette])
def test_what_drains_is_open_from_end_to_end(make):
    mesh = make(2000).mesh
    assert not len(distances_along_rays(mesh.triangles, [[0, -1, 0]], [[0, 1, 0]])[0])


def test_a_dropper_is_open_at_its_tip_and_closed_at_its_bulb():
    instrument = dropper(2000)
    assert 0.9 < instrument.sites["bulb"].point[1] / (instrument.mesh.bounds[1, 1] - 0.01) < 1.0
    upwards = distances_along_rays(instrument.mesh.triangles, [[1e-5, -1, 1e-5]], [[0, 1, 0]])[0]
    assert upwards == pytest.approx([1.149, 1.150], abs=1e-4)
    assert instrument.cavity.to_mark.bounds[0, 1] < 1e-3
    assert instrument.cavity.opening.normal == (0, -1, 0)


def test_a_measuring_cylinder_stands_on_a_hexagon():
    mesh = graduated_cylinder(5000).mesh
    foot = mesh.vertices[mesh.vertices[:, 1] == 0]
    radii = np.hypot(foot[:, 0], foot[:, 2])
    corners = np.degrees(np.arctan2(foot[:, 2], foot[:, 0]))[radii > 0.0329]
    assert sorted(np.round(np.mod(corners, 360)) % 360) == [0, 60, 120, 180, 240, 300]


def test_the_funnel_has_the_sixty_degrees_of_filter_paper():
    brim = funnel(5000).cavity.to_brim.vertices
    radii = np.hypot(brim[:, 0], brim[:, 2])
    cone = (radii > 0.012) & (radii < 0.034)
    slope = np.polyfit(radii[cone], brim[cone, 1], 1)[0]
    assert 2 * np.degrees(np.arctan(1 / slope)) == pytest.approx(60, abs=1)


@pytest.fixture(scope="module")
def made():
    return burette(3000)


def turned_about(joint, angle):
    cosine, sine = np.cos(angle), np.sin(angle)
    pose = np.eye(4)
    pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
    origin = np.array(joint.origin)
    pose[:3, 3] = origin - pose[:3, :3] @ origin
    return pose


def test_the_scale_of_50_millilitres_is_526_millimetres_long(made):
    assert made.cavity.mark_height - made.cavity.floor_height == pytest.approx(0.5261, abs=1e-3)


def passed(made, angle):
    """Return how many walls a ray straight down the bore meets."""
    part = made.parts[0]
    key = part.instrument.mesh.transformed(turned_about(part.joint, angle) @ to_parent(part))
    down = ([[1e-5, 1.0, 1e-5]], [[0.0, -1.0, 0.0]])
    return sum(len(distances_along_rays(mesh.triangles, *down)[0]) for mesh in (made.mesh, key))


def test_the_stopcock_shuts_the_bore_and_opens_it_at_a_quarter_turn(made):
    joint = made.parts[0].joint
    assert joint.axis == (0, 0, 1)
    assert (joint.lower, joint.upper) == (0, np.pi / 2)
    assert passed(made, joint.lower) > 0
    assert passed(made, joint.upper) == 0


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_the_key_turns_without_touching_the_glass(made, share):
    part = made.parts[0]
    key = part.instrument.mesh.transformed(turned_about(part.joint, share * part.joint.upper) @ to_parent(part))
    edges = np.concatenate([key.faces[:, [0, 1]], key.faces[:, [1, 2]], key.faces[:, [2, 0]]])
    edges = edges[edges[:, 0] < edges[:, 1]]
    start, end = key.vertices[edges[:, 0]], key.vertices[edges[:, 1]]
    length = np.linalg.norm(end - start, axis=1)
    near = made.mesh.triangles[np.abs(made.mesh.triangles[..., 1] - 0.1).min(axis=1) < 0.03]
    hits = distances_along_rays(near, start, (end - start) / length[:, None])
    assert not any(len(hit) and hit[0] <= whole for hit, whole in zip(hits, length, strict=True))
