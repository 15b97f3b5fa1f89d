import numpy as np
import pytest

from sessions.glassware.dishes import evaporating_dish, watch_glass


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
