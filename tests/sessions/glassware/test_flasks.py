import numpy as np
import pytest

from sessions.glassware.flasks import CONICAL, erlenmeyer_flask, reagent_bottle, volumetric_flask


@pytest.mark.parametrize("millilitres", CONICAL)
def test_a_conical_flask_has_the_neck_and_height_of_its_series(millilitres):
    flask = erlenmeyer_flask(20_000, millilitres=millilitres)
    body, height, neck, wall = (value * 1e-3 for value in CONICAL[millilitres])
    radii = np.hypot(flask.mesh.vertices[:, 0], flask.mesh.vertices[:, 2])
    at_neck = np.abs(flask.mesh.vertices[:, 1] - 0.9 * height) < 0.02 * height
    assert 2 * radii[at_neck].max() == pytest.approx(neck, rel=0.01)
    assert flask.mesh.bounds[1, 1] == pytest.approx(height, abs=0.5 * wall)
    assert 2 * radii.max() == pytest.approx(body, rel=0.08)  # the corner at the floor is rounded


@pytest.mark.parametrize("faces", [500, 2000, 20_000])
def test_the_mark_of_a_volumetric_flask_stays_on_its_neck(faces):
    flask = volumetric_flask(faces)
    assert flask.cavity.mark_height == pytest.approx(0.113, abs=1e-5)
    around = np.hypot(*flask.mesh.vertices[:, [0, 2]].T)[np.abs(flask.mesh.vertices[:, 1] - 0.113) < 0.012]
    assert around.min() == pytest.approx(0.006, rel=0.06)  # inner neck diameter 12 mm


def test_the_stopper_fits_the_bottle_without_touching_its_neck():
    bottle = reagent_bottle(20_000)
    stopper = bottle.parts[0].instrument.mesh.transformed(bottle.parts[0].to_parent)
    plug = stopper.vertices[stopper.vertices[:, 1] < 0.119]
    inside = np.hypot(plug[:, 0], plug[:, 2]).max()
    neck = bottle.mesh.vertices[np.abs(bottle.mesh.vertices[:, 1] - 0.115) < 0.005]
    assert 0 < np.hypot(neck[:, 0], neck[:, 2]).min() - inside < 2e-3
