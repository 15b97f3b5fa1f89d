import numpy as np
import pytest

from sessions.glassware.beakers import LOW_FORM, beaker, evaporating_dish, gas_jar, watch_glass


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


def test_a_watch_glass_is_part_of_a_ball_of_75_millimetres():
    inner = watch_glass(5000).cavity.to_brim.vertices
    wet = inner[np.hypot(inner[:, 0], inner[:, 2]) > 1e-6]
    height = inner[:, 1].min() + 0.075
    assert np.linalg.norm(wet - [0, height, 0], axis=1) == pytest.approx(0.075, rel=5e-3)


def test_an_evaporating_dish_stands_on_a_flat_base():
    mesh = evaporating_dish(5000).mesh
    base = mesh.vertices[mesh.vertices[:, 1] == 0]
    assert len(base) > 10
    assert np.hypot(base[:, 0], base[:, 2]).max() == pytest.approx(0.0125, rel=0.1)
