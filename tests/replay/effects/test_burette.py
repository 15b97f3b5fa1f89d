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


@pytest.mark.parametrize(
    ("settings", "level_m"),
    [({}, 0.65), ({"tip": [0.0, 0.1, 0.0]}, 0.65 - 0.1)],
    ids=["tip at the burette's origin", "tip 0.1 m up"],
)
def test_an_open_tap_runs_at_the_rate_of_torricelli(settings, level_m):
    """Liquid stands 0.65 m up in a burette whose tap is open for 2 s: 0.6 mm2 with a coefficient of discharge of 0.6.

    It runs out at discharge x area x root of 2 g h, with the ``level_m`` h over the tip, into the flask below.
    """
    run = effects_of_tap_degrees(TAP_OPEN_FOR_2_S, settings=settings)["burette"]
    (event,) = run.events
    discharge, area_m2, ml_per_m3 = 0.6, 6e-7, 1e6
    rate_ml_per_s = discharge * area_m2 * np.sqrt(2 * 9.80665 * level_m) * ml_per_m3
    assert event.name == "run-in" and event.bodies == ("burette", "flask")
    # Linear between frames: the turn to and from open adds half a frame on each side. The level falls by 2.6 cm.
    assert event.values["volume_ml"] == pytest.approx(rate_ml_per_s * 2.0, rel=0.02)
    assert run.frames_run == 201, "200 open frames, and the one in which it is shut again"


def test_volume_delivered_and_volume_left_are_those_of_the_burette():
    """A burette has 50 mL at first; its tap is open for 2 s: what is left and what is delivered are 50 mL together."""
    run = effects_of_tap_degrees(TAP_OPEN_FOR_2_S)["burette"]
    (event,) = run.events
    left, delivered = run.series["burette/volume"], run.series["burette/delivered"]
    assert left.values + delivered.values == pytest.approx(np.full(len(left.times), 50.0), rel=1e-12)
    assert delivered.values[0] == 0.0 and delivered.values[-1] == pytest.approx(event.values["volume_ml"], rel=1e-9)


def test_two_burettes_keep_separate_volumes():
    """A burette with 50 mL and another with 5 mL run through the same tap for 2 s.

    What each has delivered and what is left in it are its own volume throughout.
    """
    frames, volumes_ml = len(TAP_OPEN_FOR_2_S), {"burette": 50.0, "other": 5.0}
    poses = {name: poses_at_rest(frames, (0.0, 0.15, 0.0)) for name in volumes_ml}
    poses |= {"tap": tap_rotations(TAP_OPEN_FOR_2_S), "flask": poses_at_rest(frames)}
    burettes = [glass(name, volume_ml, cavity=BURETTE_COLUMN) for name, volume_ml in volumes_ml.items()]
    settings = [("burette", {**TAP, "body": name}) for name in volumes_ml]
    session = session_with_effects(poses, [*burettes, glass("flask"), SceneBody("tap")], *settings)
    series = compute(session).effects["burette"].series
    for name, volume_ml in volumes_ml.items():
        assert series[f"{name}/delivered"].values + series[f"{name}/volume"].values == pytest.approx(volume_ml)
        assert series[f"{name}/delivered"].values[-1] > 0.0


@pytest.mark.parametrize(("degrees", "fraction"), [(45.0, 0.5), (-45.0, 0.5), (135.0, 1.0)])
def test_a_tap_opens_with_its_angle_to_either_side(degrees, fraction):
    """A tap opens in proportion to its angle up to 90 degrees, and stays wholly open beyond; it is turned for 0.5 s."""
    delivered_ml, of_open_tap_ml = (
        effects_of_tap_degrees([0.0, *([angle] * 50), 0.0])["burette"].events[0].values["volume_ml"]
        for angle in (degrees, 90.0)
    )
    assert delivered_ml == pytest.approx(fraction * of_open_tap_ml, rel=0.01)


def test_a_lost_tap_or_flask_keeps_its_last_pose():
    """The pose of tap or flask is not known in frames 50 to 59 of the 200 in which the tap is open.

    As much runs out as where all poses are known.
    """
    valid = np.ones(len(TAP_OPEN_FOR_2_S), dtype=bool)
    valid[50:60] = False
    (without_loss,) = effects_of_tap_degrees(TAP_OPEN_FOR_2_S)["burette"].events
    for name in ("tap", "flask"):
        (event,) = effects_of_tap_degrees(TAP_OPEN_FOR_2_S, valid={name: valid})["burette"].events
        assert event.values["volume_ml"] == pytest.approx(without_loss.values["volume_ml"], rel=1e-9)


OUTFLOW = {"discharge": 0.6, "section": 1e-4, "head": 0.5, "available": 4e-5}
"""A tube of 1 cm2 with 0.5 m of liquid, of which 40 mL may run out; in m2, m and m3."""


def test_outflow_solves_torricellis_equation_with_a_changing_area():
    """A tube of 1 cm2 is filled to 0.5 m; its opening of at most 0.6 mm2 opens in 5 s and closes from 20 to 40 s.

    SciPy solves the equation for the level, with a coefficient of discharge of 0.6; what the level falls has run out.
    """
    times = np.linspace(0.0, 40.0, 401)
    area_m2 = 6e-7 * np.interp(times, [0, 5, 20, 30, 40], [0.0, 1.0, 1.0, 0.1, 0.0])
    section_m2, start_m, discharge = 1e-4, 0.5, 0.6

    def level_change(time, level):
        speed = np.sqrt(2 * 9.80665 * np.maximum(0.0, level))
        return -discharge * np.interp(time, times, area_m2) * speed / section_m2

    end_m = solve_ivp(level_change, (0.0, 40.0), [start_m], rtol=1e-10, atol=1e-14, max_step=0.05).y[0, -1]
    volume_m3 = volume_run_out(times, area_m2, **OUTFLOW)
    assert volume_m3[-1] == pytest.approx((start_m - end_m) * section_m2, rel=1e-7)


@given(
    area_m2=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=40),
    available_m3=st.floats(0.0, 1e-4),
    head_m=st.floats(0.0, 2.0),
)
def test_a_burette_never_runs_back_or_dry_twice(area_m2, available_m3, head_m):
    """A tube of 1 cm2 is filled to ``head_m``; its opening changes every second.

    What has run out never gets less, and is no more than the liquid in the tube, or than may run out.
    """
    section_m2, rounding = 1e-4, 1 + 1e-12
    settings = {**OUTFLOW, "available": available_m3, "head": head_m}
    volume_m3 = volume_run_out(np.arange(len(area_m2)) * 1.0, np.array(area_m2), **settings)
    assert (np.diff(volume_m3) >= 0.0).all()
    assert volume_m3[-1] <= min(available_m3, section_m2 * head_m * rounding)


def test_burette_overfills_a_glass_and_the_excess_overflows():
    """50 mL run into a glass of 75.4 mL that holds 70: it holds 75.4 in the end and 44.6 ran over.

    The glass is a cylinder of 2 cm radius and 6 cm height; the opening of 6 mm2 empties the burette in 20 s.
    """
    run = effects_of_tap_degrees(
        [0.0, *([90.0] * 200), 0.0],
        MIXING_IN_FLASK,
        flask=glass("flask", volume_ml=70.0),
        settings={"full_area_m2": 6e-6},
        step_ns=100_000_000,
    )
    brim_ml = np.pi * RADIUS**2 * 0.06 * 1e6
    assert run["mixing"].series["flask/volume"].values[-1] == pytest.approx(brim_ml, rel=1e-9)
    (event,) = run["burette"].output.events_named("overflow")
    assert event.values["volume_ml"] == pytest.approx(50.0 + 70.0 - brim_ml, rel=1e-9) and event.level == "warning"
