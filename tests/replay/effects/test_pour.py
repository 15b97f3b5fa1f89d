"""Liquid that a tilted glass pours, and that it spills."""

import math

import numpy as np
import pytest
from hypothesis import given
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


def millilitres_below_rim(degrees):
    """Millilitres that a glass keeps at this tilt: its volume below the rim."""
    return volume_kept(math.radians(degrees), RADIUS, HEIGHT) * 1e6


def total_ml(run):
    """Millilitres at the end, in all vessels and spilled."""
    data = run.output.data
    ends = [run.series[f"{name}/volume"].values[-1] for name in data.vessels]
    return math.fsum([*ends, *(event.total_ml for event in data.streams if not event.target)])


def test_poured_vessel_keeps_the_volume_of_its_greatest_tilt():
    """Glass a with 60 mL is tilted to 60 degrees and back by half a degree in a frame of 10 ms; b below it has 10 mL.

    The pour begins in the first frame in which less than 60 mL fit below the rim, and ends at the greatest tilt; b
    receives what leaves.
    """
    degrees = [*np.arange(0.0, 60.0, 0.5), *np.arange(60.0, 0.0, -0.5)]
    run = effects_of_tilt_degrees(degrees, (glass("a", volume_ml=60.0), glass("b", volume_ml=10.0)))["pour"]
    (event,) = run.events
    first = round(event.time / STEP_S)
    assert millilitres_below_rim(degrees[first - 1]) >= 60.0 > millilitres_below_rim(degrees[first])
    assert event.end == pytest.approx(120 * STEP_S), "the frame of 60 degrees"
    assert event.bodies == ("a", "b")
    assert event.values["seconds"] == pytest.approx(event.end - event.time)
    left_ml = millilitres_below_rim(degrees=60.0)
    assert run.series["a/volume"].values[-1] == pytest.approx(left_ml, rel=1e-9)
    assert event.values["volume_ml"] == pytest.approx(60.0 - left_ml, rel=1e-9)
    assert run.series["b/volume"].values[-1] == pytest.approx(10.0 + 60.0 - left_ml, rel=1e-9)


def test_a_full_glass_pours_from_its_first_tilt():
    """Glass a is full to its brim and tilted ever more, from frame 1 on, until the session ends; so the pour does."""
    full = glass("a", millilitres_below_rim(degrees=0.0))
    (event,) = effects_of_tilt_degrees(np.arange(0.0, 60.0, 0.5), (full, glass("b")))["pour"].events
    assert event.time == pytest.approx(1 * STEP_S) and event.end is None


@given(
    degrees=st.lists(st.floats(0.0, 180.0), min_size=2, max_size=30),
    a_ml=st.floats(0.0, 75.0),
    b_ml=st.floats(0.0, 75.0),
)
def test_pouring_conserves_volume_for_any_sequence_of_tilts(degrees, a_ml, b_ml):
    """Glass a, with ``a_ml``, is tilted over b, with ``b_ml``, by so many degrees, frame by frame.

    What is in both glasses and spilled in the end is what was in them at first; a never gains any.
    """
    run = effects_of_tilt_degrees(degrees, (glass("a", a_ml), glass("b", b_ml)))["pour"]
    assert total_ml(run) == pytest.approx(a_ml + b_ml, rel=1e-9, abs=1e-9)
    assert all((series.values >= 0.0).all() for series in run.series.values())
    assert (np.diff(run.series["a/volume"].values) <= 0.0).all()


@pytest.mark.parametrize(
    ("beside_m", "target"),
    [(0.0, "b"), (RADIUS - 1e-4, "b"), (RADIUS + 1e-4, "")],
    ids=["over its axis", "0.1 mm within its rim", "0.1 mm beyond its rim"],
)
def test_a_pour_enters_the_opening_below_the_lip(beside_m, target):
    """The lip of glass a, from which it pours, is ``beside_m`` beside the axis of glass b; beyond the rim it spills.

    ``target``: the vessel that all streams enter, "" for none.
    """
    pour = effects_of_tilt_degrees([0.0, 0.0, 60.0, 60.0, 60.0], position=(beside_m, 0.0, 0.0))["pour"]
    assert {stream.target for stream in pour.output.data.streams} == {target}


TILT_OF_1_FRAME = np.array([0.0, 0.0, 120.0, 0.0, 0.0])
"""Degrees, one a frame."""

JUMP_OF_3_M = poses_of_tilted_glass(TILT_OF_1_FRAME, (0.0, 0.2, 0.0))
JUMP_OF_3_M[0][2] += (0.0, 3.0, 0.0)
TIPPED = np.tile(poses_of_tilted_glass([0.0])[0], (60, 1)), poses_of_tilted_glass(75.0 * (np.arange(60) == 30))[1]
"""The glass is tilted in frame 30 of 60."""


@pytest.mark.parametrize(
    ("pose", "valid"),
    [
        (poses_of_tilted_glass(TILT_OF_1_FRAME), TILT_OF_1_FRAME == 0.0),
        (JUMP_OF_3_M, None),
        (TIPPED, None),
    ],
    ids=["a lost pose", "a jump", "it lies tipped in one frame"],
)
def test_tilt_of_a_lost_or_jumping_pose_pours_nothing(pose, valid):
    """A glass with 60 mL is tilted in a single frame: its pose is lost, jumps 3 m, or falls over and back."""
    poses = {"a": pose, "b": poses_at_rest(len(pose[0]))}
    glasses = (glass("a", volume_ml=60.0), glass("b"))
    session = session_with_effects(poses, glasses, ("pour", {"from": ["a"], "into": ["b"]}), valid={"a": valid})
    run = compute(session).effects["pour"]
    assert run.events == () and run.series["a/volume"].values[-1] == 60.0


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_a_glitch_of_few_frames_pours_little(frames):
    """Glass a with 60 mL pours for so many ``frames`` of 10 ms at 95 degrees, after one in which it jumps there.

    It pours as a weir, (2/3) 0.611 b sqrt(2 g) h^1.5, whose width b and height h are the glass's width, 40 mm.
    """
    degrees = [*([0.0] * 5), *([95.0] * (frames + 1)), *([0.0] * 5)]
    run = effects_of_tilt_degrees(degrees, (glass("a", volume_ml=60.0), glass("b", volume_ml=10.0)))["pour"]
    weir_ml_per_s = 2 / 3 * 0.611 * 0.04 * math.sqrt(2 * 9.80665) * 0.04**1.5 * 1e6  # 577
    assert run.series["a/volume"].values[-1] == pytest.approx(60.0 - frames * STEP_S * weir_ml_per_s, abs=0.2)
    assert total_ml(run) == pytest.approx(60.0 + 10.0)


def test_a_full_receiver_runs_over_its_brim():
    """Both glasses are cylinders of 75.4 mL; b has 70 mL and gets more than fits; all 130 mL are there or run over.

    All that leaves a enters b, so nothing is spilled: neither what a pours nor what runs over the brim of b.
    """
    run = effects_of_tilt_degrees([0.0, 60.0, 60.0], (glass("a", volume_ml=60.0), glass("b", volume_ml=70.0)))["pour"]
    brim_ml = math.pi * RADIUS**2 * HEIGHT * 1e6
    assert run.series["b/volume"].values[-1] == pytest.approx(brim_ml)
    assert total_ml(run) == pytest.approx(60.0 + 70.0)
    assert run.series["spilled/volume"].values.max() == 0.0


SPILLING_DEGREES = [0.0, 0.0, 60.0, 60.0, 60.0, 0.0]
"""Frame by frame; the tilt by 60 degrees in frame 2 is a jump, so the glass pours in frames 3 and 4."""


def pour_beside_a_glass():
    """The effect of a glass a with 60 mL that pours beside glass b, which stands 0.1 m lower than usual."""
    glasses = glass("a", volume_ml=60.0), glass("b", volume_ml=10.0)
    return effects_of_tilt_degrees(SPILLING_DEGREES, glasses, position=(3 * RADIUS, -0.1, 0.0))["pour"]


def test_liquid_poured_beside_the_glass_is_spilled():
    """Glass a with 60 mL pours in frames 3 and 4, of 10 ms; b stands 3 radii aside, its floor at y = -0.1 m.

    The spill is drawn on that level; what a has lost is the volume of the event and of the series of what is spilled.
    """
    pour = pour_beside_a_glass()
    (event,) = pour.events
    assert event.name == "spill" and event.level == "warning" and event.bodies == ("a",)
    assert event.time == pytest.approx(3 * STEP_S) and event.point[1] == pytest.approx(-0.1)
    lost_ml = 60.0 - pour.series["a/volume"].values[-1]
    assert event.values["volume_ml"] == pytest.approx(lost_ml, rel=1e-9)
    spilled = pour.series["spilled/volume"]
    assert spilled.values[0] == 0.0 and spilled.values[-1] == pytest.approx(lost_ml, rel=1e-9)
    assert pour.frames_run == 2


def test_a_glass_alone_spills_as_much_as_beside_another():
    """Glass a is tilted in a scene without another vessel, and in a scene with a glass b to pour into."""
    session = session_with_effects(
        {"a": poses_of_tilted_glass(SPILLING_DEGREES)}, (glass("a", volume_ml=60.0),), ("pour", {"from": ["a"]})
    )
    (alone,) = compute(session).effects["pour"].events
    (beside,) = pour_beside_a_glass().events
    assert alone.values["volume_ml"] == pytest.approx(beside.values["volume_ml"], rel=1e-9)
