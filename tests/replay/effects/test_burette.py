import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from support.liquid_worlds import (
    BURETTE_COLUMN,
    MIXING_IN_FLASK,
    RADIUS,
    TAP,
    effects_of_tap_degrees,
    glass,
    poses_at_rest,
    session_with_effects,
    tap_rotations,
)

from replay.effects.models.outflow import volume_run_out
from replay.engine import compute
from sessions.model.scene import SceneBody

TAP_OPEN_FOR_2_S = [0.0, 0.0, *([90.0] * 200), 0.0, 0.0]
"""Degrees, one a frame of 10 ms."""


def test_an_open_tap_runs_at_the_rate_of_torricelli():
    """Discharge 0.6, opening 0.6 mm2, the level 0.65 m over the tip, g in m/s2, 1e6 mL in a cubic metre; 2 s open.

    Over a tip at 0.1 m the level is 0.55 m high. What has left the burette and what is in it are its 50 mL throughout.
    """
    run = effects_of_tap_degrees(TAP_OPEN_FOR_2_S)["burette"]
    (event,) = run.events
    rate = 0.6 * 6e-7 * np.sqrt(2 * 9.80665 * 0.65) * 1e6
    # Linear between frames: the turn to and from open adds half a frame on each side.
    assert event.name == "run-in" and event.values["volume_ml"] == pytest.approx(rate * 2.0, rel=0.01)
    (higher,) = effects_of_tap_degrees(TAP_OPEN_FOR_2_S, settings={"tip": [0.0, 0.1, 0.0]})["burette"].events
    assert higher.values["volume_ml"] == pytest.approx(rate * np.sqrt(0.55 / 0.65) * 2.0, rel=0.02)
    assert event.bodies == ("burette", "flask")
    assert run.frames_run == 201, "200 open frames, and the one in which it is shut again"
    left, gone = run.series["burette/volume"], run.series["burette/delivered"]
    assert left.values + gone.values == pytest.approx(np.full(len(left.times), 50.0), rel=1e-12)
    assert gone.values[0] == 0.0 and gone.values[-1] == pytest.approx(event.values["volume_ml"], rel=1e-9)


def test_two_burettes_keep_separate_volumes():
    """Both run out of one tap; the second has only 5 mL: delivered and left are 50 mL of one, 5 mL of the other."""
    poses = {name: poses_at_rest(len(TAP_OPEN_FOR_2_S), (0.0, 0.15, 0.0)) for name in ("burette", "other")}
    bodies = [glass(name, fill, cavity=BURETTE_COLUMN) for name, fill in (("burette", 50.0), ("other", 5.0))]
    poses |= {"tap": tap_rotations(TAP_OPEN_FOR_2_S), "flask": poses_at_rest(len(TAP_OPEN_FOR_2_S))}
    settings = [("burette", {**TAP, "body": name}) for name in ("burette", "other")]
    series = (
        compute(session_with_effects(poses, [*bodies, glass("flask"), SceneBody("tap")], *settings))
        .effects["burette"]
        .series
    )
    for name, fill in (("burette", 50.0), ("other", 5.0)):
        assert series[f"{name}/delivered"].values + series[f"{name}/volume"].values == pytest.approx(fill)


@pytest.mark.parametrize(("degrees", "fraction"), [(45.0, 0.5), (-45.0, 0.5), (135.0, 1.0)])
def test_a_tap_opens_with_its_angle_to_either_side(degrees, fraction):
    """90 degrees are open; more than that stay open."""
    partial, whole = (
        effects_of_tap_degrees([0.0, *([x] * 50), 0.0])["burette"].events[0].values["volume_ml"]
        for x in (degrees, 90.0)
    )
    assert partial == pytest.approx(fraction * whole, rel=0.01)


def test_a_lost_tap_or_flask_keeps_its_last_pose():
    """Lost in frames 50 to 59 of the 200 in which the tap is open."""
    lost = np.ones(len(TAP_OPEN_FOR_2_S), dtype=bool)
    lost[50:60] = False
    whole = effects_of_tap_degrees(TAP_OPEN_FOR_2_S)["burette"].events[0].values["volume_ml"]
    for name in ("tap", "flask"):
        (event,) = effects_of_tap_degrees(TAP_OPEN_FOR_2_S, valid={name: lost})["burette"].events
        assert event.values["volume_ml"] == pytest.approx(whole, rel=1e-9)


OUTFLOW = {"discharge": 0.6, "section": 1e-4, "head": 0.5, "available": 4e-5}
"""A tube of 1 cm2 with 0.5 m of liquid, of which 40 mL may run out; in m2, m and m3."""


def test_outflow_solves_torricellis_equation_with_a_changing_area():
    """The opening in m2 over 40 s, against SciPy's solver of the level in a tube of 1 cm2, which begins at 0.5 m."""
    times = np.linspace(0.0, 40.0, 401)
    area = 6e-7 * np.interp(times, [0, 5, 20, 30, 40], [0.0, 1.0, 1.0, 0.1, 0.0])

    def falling(time, level):
        return -0.6 * np.interp(time, times, area) * np.sqrt(2 * 9.80665 * np.maximum(0.0, level)) / 1e-4

    solved = solve_ivp(falling, (0.0, 40.0), [0.5], rtol=1e-10, atol=1e-14, max_step=0.05).y[0, -1]
    assert volume_run_out(times, area, **OUTFLOW)[-1] == pytest.approx((0.5 - solved) * 1e-4, rel=1e-7)


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=40), st.floats(0.0, 1e-4), st.floats(0.0, 2.0))
def test_a_burette_never_runs_back_or_dry_twice(area, available, head):
    """``area``: opening in m2, one a second; no more than the liquid in the tube of 1 cm2, or than is available."""
    settings = {**OUTFLOW, "available": available, "head": head}
    volume = volume_run_out(np.arange(len(area)) * 1.0, np.array(area), **settings)
    assert (np.diff(volume) >= 0.0).all() and volume[-1] <= min(available, 1e-4 * head * (1 + 1e-12))


def test_burette_overfills_a_glass_and_the_excess_overflows():
    """50 mL run into a glass of 75.4 mL that holds 70: it holds 75.4 in the end and 44.6 ran over."""
    full = glass("flask", volume_ml=70.0)
    run = effects_of_tap_degrees(
        [0.0, *([90.0] * 2000), 0.0], MIXING_IN_FLASK, flask=full, settings={"full_area_m2": 6e-6}
    )
    brim = np.pi * RADIUS**2 * 0.06 * 1e6
    assert run["mixing"].series["flask/volume"].values[-1] == pytest.approx(brim, rel=1e-9)
    (event,) = run["burette"].output.events_named("overflow")
    assert event.values["volume_ml"] == pytest.approx(120.0 - brim, rel=1e-9) and event.level == "warning"
