import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from replay.effects.models.outflow import twist, volume_run_out

COLUMN = {"discharge": 0.6, "section": 1e-4, "head": 0.5, "available": 4e-5}


def test_it_solves_torricellis_equation_with_an_area_that_changes():
    times = np.linspace(0.0, 40.0, 401)
    area = 6e-7 * np.interp(times, [0, 5, 20, 30, 40], [0.0, 1.0, 1.0, 0.1, 0.0])

    def falling(time, level):
        return -0.6 * np.interp(time, times, area) * np.sqrt(2 * 9.80665 * np.maximum(0.0, level)) / 1e-4

    solved = solve_ivp(falling, (0.0, 40.0), [0.5], rtol=1e-10, atol=1e-14, max_step=0.05).y[0, -1]
    assert volume_run_out(times, area, **COLUMN)[-1] == pytest.approx((0.5 - solved) * 1e-4, rel=1e-7)


def test_a_closed_tap_an_empty_column_and_no_head_give_nothing():
    times = np.arange(4.0)
    assert volume_run_out(times, np.zeros(4), **COLUMN).tolist() == [0.0] * 4
    assert volume_run_out(times, np.full(4, 1e-6), **{**COLUMN, "available": 0.0}).tolist() == [0.0] * 4
    assert volume_run_out(times, np.full(4, 1e-6), **{**COLUMN, "head": 0.0}).tolist() == [0.0] * 4
    assert volume_run_out(times[:0], times[:0], **COLUMN).shape == (0,)


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=40), st.floats(0.0, 1e-4), st.floats(0.0, 2.0))
def test_it_never_runs_back_nor_gives_more_than_there_is(area, available, head):
    told = {**COLUMN, "available": available, "head": head}
    volume = volume_run_out(np.arange(len(area)) * 1.0, np.array(area), **told)
    assert (np.diff(volume) >= 0.0).all() and volume[-1] <= min(available, 1e-4 * head * (1 + 1e-12))


def test_a_tiny_opening_keeps_its_digits():
    volume = volume_run_out(np.array([0.0, 1.0]), np.full(2, 1e-20), **COLUMN)[-1]
    assert volume == pytest.approx(0.6e-20 * np.sqrt(2 * 9.80665 * 0.5), rel=1e-12)


@given(st.floats(-3.14, 3.14), st.sampled_from(["x", "y", "z"]))
def test_the_twist_is_the_angle_about_the_axis(angle, axis):
    turned = Rotation.from_euler(axis, angle).as_matrix()[None]
    unit = np.eye(3)["xyz".index(axis)]
    assert twist(turned, unit)[0] == pytest.approx(angle, abs=1e-12)
    assert twist(turned, np.roll(unit, 1))[0] == pytest.approx(0.0 if abs(angle) < np.pi / 2 else np.pi, abs=np.pi / 2)
