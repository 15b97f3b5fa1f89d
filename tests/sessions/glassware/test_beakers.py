import numpy as np
import pytest
from support.surface_rays import distances_along_rays

from sessions.glassware.beakers import LOW_FORM, beaker, gas_jar
from sessions.glassware.flasks import reagent_bottle
from sessions.glassware.tubes import burette


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


def test_the_cover_lies_on_the_gas_jar_without_touching_it():
    jar = gas_jar(2000)
    cover = jar.parts[0].instrument.mesh.transformed(to_parent(jar.parts[0]))
    gap = cover.bounds[0, 1] - jar.mesh.bounds[1, 1]
    assert 0 < gap < 3e-3
    assert np.ptp(cover.bounds[:, 0]) >= 0.98 * np.ptp(jar.mesh.bounds[:, 0])


def test_the_stopper_fits_the_bottle_without_touching_its_neck():
    bottle = reagent_bottle(20_000)
    stopper = bottle.parts[0].instrument.mesh.transformed(to_parent(bottle.parts[0]))
    plug = stopper.vertices[stopper.vertices[:, 1] < 0.119]
    inside = np.hypot(plug[:, 0], plug[:, 2]).max()
    neck = bottle.mesh.vertices[np.abs(bottle.mesh.vertices[:, 1] - 0.115) < 0.005]
    assert 0 < np.hypot(neck[:, 0], neck[:, 2]).min() - inside < 2e-3


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
