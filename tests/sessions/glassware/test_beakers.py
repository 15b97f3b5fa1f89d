import numpy as np
import pytest

from sessions.glassware.beakers import LOW_FORM, beaker, gas_jar


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
    cover = jar.parts[0].instrument.mesh.transformed(jar.parts[0].to_parent)
    gap = cover.bounds[0, 1] - jar.mesh.bounds[1, 1]
    assert 0 < gap < 3e-3
    assert np.ptp(cover.bounds[:, 0]) >= 0.98 * np.ptp(jar.mesh.bounds[:, 0])
