"""Liquid that a tilted glass pours, and that it spills."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.liquid_worlds import (
    HEIGHT,
    RADIUS,
    effects_of_tilt_degrees,
    glass,
    poses_at_rest,
    poses_of_tilted_glass,
    session_with_effects,
)
from support.small_worlds import STEP_S

from replay.effects.models.sliced import volume_kept
from replay.engine import compute


def millilitres_kept(degrees):
    """Millilitres that a glass keeps at this tilt: its volume below the rim."""
    return volume_kept(math.radians(degrees), RADIUS, HEIGHT) * 1e6


def all_of(run):
    """Millilitres at the end, in all vessels and spilled."""
    data = run.output.data
    ends = [run.series[f"{name}/volume"].values[-1] for name in data.vessels]
    return math.fsum([*ends, *(event.total_ml for event in data.streams if not event.target)])


def moves(run):
    """Frame, source, target and millilitres of each step of each stream, in order."""
    return sorted(
        (frame, event.source, event.target, volume)
        for event in run.output.data.streams
        for frame, volume in zip(event.frames.tolist(), event.volume_ml.tolist(), strict=True)
    )


def test_poured_vessel_keeps_the_volume_of_its_greatest_tilt():
    """A glass of 60 mL is tilted to 60 degrees and back; one of 10 mL below it receives what leaves."""
    degrees = [*np.arange(0.0, 60.0, 0.5), *np.arange(60.0, 0.0, -0.5)]
    run = effects_of_tilt_degrees(degrees, (glass("a", volume_ml=60.0), glass("b", volume_ml=10.0)))["pour"]
    (event,) = run.events
    first = round(event.time / STEP_S)
    assert millilitres_kept(degrees[first - 1]) >= 60.0 > millilitres_kept(degrees[first])
    assert event.end == pytest.approx(120 * STEP_S), "the frame of 60 degrees"
    assert event.bodies == ("a", "b")
    assert event.values["seconds"] == pytest.approx(event.end - event.time)
    assert run.series["a/volume"].values[-1] == pytest.approx(millilitres_kept(degrees=60.0), rel=1e-9)
    assert event.values["volume_ml"] == pytest.approx(60.0 - millilitres_kept(degrees=60.0), rel=1e-9)
    assert run.series["b/volume"].values[-1] == pytest.approx(10.0 + event.values["volume_ml"], rel=1e-9)


def test_a_full_glass_pours_from_its_first_tilt():
    """It goes on until the session ends, so that the event has no end; frame 1 is the first that is tilted."""
    full = glass("a", millilitres_kept(degrees=0.0))
    (event,) = effects_of_tilt_degrees(np.arange(0.0, 60.0, 0.5), (full, glass("b")))["pour"].events
    assert event.time == pytest.approx(1 * STEP_S) and event.end is None


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.0, 180.0), min_size=2, max_size=30), st.floats(0.0, 75.0), st.floats(0.0, 75.0))
def test_pouring_conserves_volume_for_any_sequence_of_tilts(degrees, first, second):
    """Glass a is tilted and only loses; both glasses and the table hold the sum (mL)."""
    run = effects_of_tilt_degrees(degrees, (glass("a", first), glass("b", second)))["pour"]
    assert all_of(run) == pytest.approx(first + second, rel=1e-9, abs=1e-9)
    assert all((series.values >= 0.0).all() for series in run.series.values())
    assert (np.diff(run.series["a/volume"].values) <= 0.0).all()


@pytest.mark.parametrize(("beside", "target"), [(0.0, "b"), (RADIUS - 1e-4, "b"), (RADIUS + 1e-4, "")])
def test_a_pour_enters_the_opening_below_the_lip(beside, target):
    """Beside the axis of glass b by 0.1 mm less, and more, than its radius; beyond it is spilled."""
    moved = moves(effects_of_tilt_degrees([0.0, 0.0, 60.0, 60.0, 60.0], position=(beside, 0.0, 0.0))["pour"])
    assert {target for _frame, _source, target, _volume in moved} == {target}


GLITCH = np.array([0.0, 0.0, 120.0, 0.0, 0.0])
"""Degrees, one a frame."""

JUMP = poses_of_tilted_glass(GLITCH, (0.0, 0.2, 0.0))
JUMP[0][2] += (0.0, 3.0, 0.0)
TIPPED = np.tile(poses_of_tilted_glass([0.0])[0], (60, 1)), poses_of_tilted_glass(75.0 * (np.arange(60) == 30))[1]


@pytest.mark.parametrize(
    ("pose", "valid"),
    [(poses_of_tilted_glass(GLITCH), GLITCH == 0.0), (JUMP, None), (TIPPED, None)],
    ids=["a lost pose", "a jump", "it lies tipped in one frame"],
)
def test_tilt_of_a_lost_or_jumping_pose_pours_nothing(pose, valid):
    """A glass with 60 mL is tilted in a single frame: its pose is lost, jumps 3 m, or falls over and back."""
    poses = {"a": pose, "b": poses_at_rest(len(pose[0]))}
    pour = ("pour", {"from": ["a"], "into": ["b"]})
    run = compute(
        session_with_effects(poses, (glass("a", volume_ml=60.0), glass("b")), pour, valid={"a": valid})
    ).effects["pour"]
    assert run.events == () and run.series["a/volume"].values[-1] == 60.0


@pytest.mark.parametrize("hold", [1, 2, 5])
def test_a_glitch_of_few_frames_pours_little(hold):
    """``hold``: frames of 10 ms at 95 degrees. A weir (2/3) 0.611 b sqrt(2 g) h^1.5 lets 578 mL/s out.

    Its width b and height h are the glass's width, 40 mm.
    """
    degrees = [*([0.0] * 5), *([95.0] * (hold + 1)), *([0.0] * 5)]
    run = effects_of_tilt_degrees(degrees, (glass("a", volume_ml=60.0), glass("b", volume_ml=10.0)))["pour"]
    left = run.series["a/volume"].values[-1]
    assert left == pytest.approx(60.0 - hold * STEP_S * 578.0, abs=0.2)
    assert all_of(run) == pytest.approx(60.0 + 10.0)


def test_a_full_receiver_runs_over_its_brim():
    """Both glasses hold 75.4 mL; the second has 70 and gets more."""
    run = effects_of_tilt_degrees([0.0, 60.0, 60.0], (glass("a", volume_ml=60.0), glass("b", volume_ml=70.0)))["pour"]
    brim = math.pi * RADIUS**2 * HEIGHT * 1e6
    assert run.series["b/volume"].values[-1] == pytest.approx(brim) and all_of(run) == pytest.approx(130.0)


def test_liquid_poured_beside_the_glass_is_spilled_there():
    """Glass b stands aside and 0.1 m lower, on the level at which the spill is drawn.

    The tilt by 60 degrees in frame 2 is a jump, so a pours in frames 3 and 4. A glass alone spills as much.
    """
    degrees = [0.0, 0.0, 60.0, 60.0, 60.0, 0.0]
    glasses = glass("a", volume_ml=60.0), glass("b", volume_ml=10.0)
    pour = effects_of_tilt_degrees(degrees, glasses, position=(3 * RADIUS, -0.1, 0.0))["pour"]
    (event,) = pour.events
    assert event.name == "spill" and event.level == "warning" and event.bodies == ("a",)
    assert event.time == pytest.approx(3 * STEP_S) and event.point[1] == pytest.approx(-0.1)
    left = pour.series["a/volume"].values[-1]
    assert event.values["volume_ml"] == pytest.approx(60.0 - left, rel=1e-9)
    lost = pour.series["spilled/volume"]
    assert lost.values[0] == 0.0 and lost.values[-1] == pytest.approx(60.0 - left, rel=1e-9)
    assert pour.frames_run == 2
    alone = compute(
        session_with_effects(
            {"a": poses_of_tilted_glass(degrees)}, (glass("a", volume_ml=60.0),), ("pour", {"from": ["a"]})
        )
    ).effects["pour"]
    assert alone.events[0].values["volume_ml"] == pytest.approx(60.0 - left, rel=1e-9)
