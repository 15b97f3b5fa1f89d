import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from replay.effects.models.ballistic import GRAVITY, Disc, disc_entered, place_at_height
from replay.effects.models.outflow import twist, volume_run_out
from replay.effects.models.tilted import SERIES_BELOW, TERMS, _wedge, tilt_of_onset, volume_kept

RADIUS, HEIGHT = 0.03, 0.08
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)
RIGHT = math.pi / 2


def integral(tilt, radius, height):
    """Columns of liquid over the floor, summed: no formula of the module, and no difference of nearly equal numbers.

    A column at distance u from the wall below the lip is ``height - u tan(tilt)`` high and ``2 sqrt(u (2R - u))`` wide;
    with u = 2 R sin^2(a / 2) both are smooth in a.
    """
    slope = math.tan(tilt)
    reach = height / slope if slope > 0.0 else math.inf
    last = math.pi if reach >= 2 * radius else 2 * math.asin(math.sqrt(reach / (2 * radius)))
    angle = 0.5 * last * (NODES + 1.0)
    column = height - 2.0 * radius * np.sin(angle / 2) ** 2 * slope
    if last < math.pi:
        column = 2.0 * radius * slope * np.sin((last - angle) / 2) * np.sin((last + angle) / 2)
    return float(0.5 * last * np.sum(WEIGHTS * 2.0 * radius**2 * np.sin(angle) ** 2 * column))


TILTS = [1e-9, 0.1, 10, 50, 53, 53.13, 54, 70, 80, 85, 89, 89.9, 89.99, 89.9999, 90 - 1e-6, 90 - 1e-8, 90 - 1e-9]


@pytest.mark.parametrize("degrees", TILTS)
@pytest.mark.parametrize(("radius", "height"), [(0.03, 0.08), (0.04, 0.006), (0.004, 0.2)])
def test_the_volume_kept_is_the_integral_to_one_in_a_billion(degrees, radius, height):
    tilt = math.radians(degrees)
    assert volume_kept(tilt, radius, height) == pytest.approx(integral(tilt, radius, height), rel=1e-9)


@given(st.floats(0.0, 90 - 1e-9), st.floats(0.001, 1.0), st.floats(0.001, 1.0))
def test_the_volume_kept_is_the_integral_for_any_cylinder(degrees, radius, height):
    tilt = math.radians(degrees)
    assert volume_kept(tilt, radius, height) == pytest.approx(integral(tilt, radius, height), rel=1e-9)


@pytest.mark.parametrize(("degrees", "millilitres"), [(10, 211.24), (50, 125.11), (70, 46.09), (85, 5.96)])
def test_four_tilts_keep_what_was_worked_out_elsewhere(degrees, millilitres):
    assert volume_kept(math.radians(degrees), RADIUS, HEIGHT) * 1e6 == pytest.approx(millilitres, abs=0.005)


def test_more_tilt_never_keeps_more_up_to_a_billionth_of_a_degree_from_level():
    degrees = np.concatenate([np.linspace(0, 89, 2000), 90 - np.logspace(0, -9, 4000)])
    kept = [volume_kept(math.radians(value), RADIUS, HEIGHT) for value in degrees]
    assert all(after <= before for before, after in pairwise(kept)) and kept[-1] > 0.0


def test_both_forms_meet_where_the_liquid_leaves_half_the_floor_and_where_the_series_begins():
    joint = math.atan(HEIGHT / (2 * RADIUS))
    assert volume_kept(joint, RADIUS, HEIGHT) == pytest.approx(math.pi * RADIUS**2 * HEIGHT / 2, rel=1e-12)
    below, above = np.nextafter(SERIES_BELOW, 0.0), SERIES_BELOW
    assert _wedge(below) == pytest.approx(_wedge(above), rel=1e-11)
    assert SERIES_BELOW ** (2 * TERMS) < 1e-15


def test_a_level_or_overturned_vessel_keeps_nothing_and_an_upright_one_all():
    assert [volume_kept(angle, RADIUS, HEIGHT) for angle in (RIGHT, 2.0, math.pi)] == [0.0, 0.0, 0.0]
    assert volume_kept(0.0, RADIUS, HEIGHT) == math.pi * RADIUS**2 * HEIGHT


@given(st.floats(1e-12, 1.0))
def test_the_tilt_of_onset_is_the_least_that_keeps_the_fill(share):
    fill = share * volume_kept(0.0, RADIUS, HEIGHT)
    onset = tilt_of_onset(fill, RADIUS, HEIGHT)
    assert volume_kept(onset, RADIUS, HEIGHT) <= fill <= volume_kept(max(0.0, onset - 1e-7), RADIUS, HEIGHT) + 1e-18


def test_an_overfull_vessel_pours_upright_and_an_empty_one_at_a_right_angle():
    assert tilt_of_onset(1.0, RADIUS, HEIGHT) == 0.0
    assert tilt_of_onset(0.0, RADIUS, HEIGHT) == pytest.approx(RIGHT)


UP = np.array([0.0, 1.0, 0.0])
REST = np.zeros(3)


def disc(name="cup", centre=(0.0, 0.0, 0.0), normal=UP, radius=0.03):
    return Disc(name, np.array(centre), np.array(normal) / np.linalg.norm(normal), radius)


@pytest.mark.parametrize(("x", "name"), [(0.0, "cup"), (0.0299, "cup"), (0.03, "cup"), (0.0301, "")])
def test_from_rest_it_falls_straight_into_what_lies_below(x, name):
    assert disc_entered(np.array([x, 0.05, 0.0]), REST, [disc()]) == name


def test_a_push_carries_it_as_far_as_the_fall_takes_time():
    start, drop = np.array([0.0, 0.2, 0.0]), np.sqrt(2 * 0.2 / GRAVITY)
    aim = disc(centre=(0.3 * drop, 0.0, 0.0), radius=1e-6)
    assert disc_entered(start, np.array([0.3, 0.0, 0.0]), [aim]) == "cup"
    assert disc_entered(start, np.array([0.31, 0.0, 0.0]), [aim]) == ""


def test_of_two_openings_one_over_the_other_the_upper_one_is_met():
    both = [disc("low"), disc("high", (0.0, 0.1, 0.0))]
    assert disc_entered(np.array([0.0, 0.2, 0.0]), REST, both) == "high"
    assert disc_entered(np.array([0.0, 0.05, 0.0]), REST, both) == "low"


def test_an_opening_above_sideways_or_overturned_is_not_entered():
    start = np.array([0.0, 0.05, 0.0])
    assert disc_entered(start, REST, [disc(centre=(0.0, 0.06, 0.0))]) == ""
    assert disc_entered(start, REST, [disc(normal=(1.0, 0.0, 0.0)), disc(normal=-UP)]) == ""
    assert disc_entered(start, REST, []) == ""


def test_a_tilted_opening_is_met_on_its_own_plane():
    tilted = disc(normal=(1.0, 1.0, 0.0), radius=0.03)
    assert disc_entered(np.array([0.02, 0.05, 0.0]), REST, [tilted]) == "cup"
    assert disc_entered(np.array([0.022, 0.05, 0.0]), REST, [tilted]) == ""


def test_thrown_up_it_comes_down_through_an_opening_it_started_below():
    start, up = np.array([0.0, -0.1, 0.0]), np.array([0.0, 2.0, 0.0])
    assert disc_entered(start, up, [disc()]) == "cup"
    assert disc_entered(start, up / 2, [disc()]) == ""


@given(st.floats(-50, 50), st.floats(0.0, 10.0), st.floats(-5, 5))
def test_where_it_lands_lies_on_its_parabola(vertical, drop, sideways):
    start, velocity = np.array([0.0, drop, 0.0]), np.array([sideways, vertical, 0.0])
    place = place_at_height(start, velocity, 0.0)
    assert place[1] == pytest.approx(0.0, abs=1e-9 * (1 + vertical**2)) and np.isfinite(place).all()
    if abs(sideways) > 1e-3:
        time = place[0] / sideways
        assert time >= 0.0 and drop + vertical * time - 0.5 * GRAVITY * time**2 == pytest.approx(0.0, abs=1e-6)


def test_a_height_it_never_reaches_leaves_it_where_it_is():
    start = np.array([1.0, 0.0, 2.0])
    assert place_at_height(start, REST, 0.5).tolist() == start.tolist()


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
