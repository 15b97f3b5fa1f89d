import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from replay.effects.models.outflow import (
    GRAVITY_M_S2,
    Stream,
    entry_times,
    flows,
    points_at_height,
    run_out,
    twist_angle,
)

UP = np.array([0.0, 1.0, 0.0])
REST = np.zeros(3)


def enters_opening(start, velocity, centre=(0.0, 0.0, 0.0), normal=UP, radius=0.03):
    """Whether a drop that starts here with this velocity falls into a round opening."""
    centre, normal = np.array([centre]), np.array([normal]) / np.linalg.norm(normal)
    (seconds,) = entry_times(np.array([start]), np.array([velocity], dtype=float), centre, normal, radius)
    return bool(np.isfinite(seconds))


FALL_OF_0_2_M_S = float(np.sqrt(2 * 0.2 / GRAVITY_M_S2))
THROWN_S = max(np.roots([-0.5 * GRAVITY_M_S2, 2.0, -0.1]))
"""Seconds after which what is thrown up at 2 m/s comes down through a height 10 cm above."""

POINT_HIT_AT_0_3_M_S = {"centre": (0.3 * FALL_OF_0_2_M_S, 0.0, 0.0), "radius": 1e-6}
"""What falls 0.2 m with 0.3 m/s along x falls through this point."""


DROPS = {
    "over its middle": ((0.0, 0.05, 0.0), REST, {}, True),
    "over its rim": ((0.03, 0.05, 0.0), REST, {}, True),
    "0.1 mm beside its rim": ((0.0301, 0.05, 0.0), REST, {}, False),
    "pushed onto it": ((0.0, 0.2, 0.0), (0.3, 0.0, 0.0), POINT_HIT_AT_0_3_M_S, True),
    "pushed beyond it": ((0.0, 0.2, 0.0), (0.31, 0.0, 0.0), POINT_HIT_AT_0_3_M_S, False),
    "opening above": ((0.0, 0.05, 0.0), REST, {"centre": (0.0, 0.06, 0.0)}, False),
    "opening sideways": ((0.0, 0.05, 0.0), REST, {"normal": (1.0, 0.0, 0.0)}, False),
    "opening downwards": ((0.0, 0.05, 0.0), REST, {"normal": -UP}, False),
    # 2 m/s rise to 0.1 m above the opening from 0.1 m below it, 1 m/s only to 0.05 m below it.
    "thrown up through it and back": ((0.0, -0.1, 0.0), (0.0, 2.0, 0.0), {}, True),
    "thrown not high enough": ((0.0, -0.1, 0.0), (0.0, 1.0, 0.0), {}, False),
    "thrown from beside it": ((-0.5, -0.1, 0.0), (0.5 / THROWN_S, 2.0, 0.0), {}, True),
}


def test_liquid_falls_into_the_upward_opening_below():
    """A drop starts at a point with a velocity, in metres and m/s, y up; it enters where it falls through the opening.

    The opening is a disc of 3 cm radius about the origin that looks up; ``opening``: what of that is changed.
    """
    for case, (start, velocity, opening, enters) in DROPS.items():
        assert enters_opening(start, velocity, **opening) == enters, case


def stream(times, volumes, source="a", target="b"):
    """Liquid that runs from one vessel into another: so many millilitres at these seconds."""
    times = np.array(times)
    return Stream(
        source,
        target,
        over=False,
        times=times,
        frames=np.round(times * 100).astype(int),
        volume_ml=np.array(volumes),
        points=np.zeros((len(times), 3)),
    )


def test_liquid_lands_where_its_parabola_meets_the_height():
    """Liquid is released at (1, 0.5, 2) m, y up, with 0.3 m/s along x and ``speed_up`` m/s along y.

    It comes down to a height of 0.2 m at the later root of the parabola. To a height of 5 m it never gets: then the
    answer is the point of release.
    """
    for speed_up in [1.0, 0.0, -1.0]:
        start, velocity = [1.0, 0.5, 2.0], [0.3, speed_up, 0.0]
        landed, never = points_at_height(np.array([start] * 2), np.array([velocity] * 2), np.array([0.2, 5.0]))
        seconds = max(np.roots([-0.5 * GRAVITY_M_S2, speed_up, 0.5 - 0.2]))
        assert landed == pytest.approx([1.0 + 0.3 * seconds, 0.2, 2.0]), speed_up
        assert never.tolist() == start, speed_up


def test_twist_angle_is_that_of_the_rotation_about_the_axis():
    """SciPy makes the rotations of these angles, in radians, about the axis (1, 2, -2) / 3."""
    axis, angles = np.array([1.0, 2.0, -2.0]) / 3.0, np.array([-3.0, -1.0, 0.0, 0.5, 2.5])
    rotations = Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
    assert twist_angle(rotations, axis) == pytest.approx(angles)


def test_only_a_long_pause_splits_a_flow():
    """Liquid runs at 0, 0.6 and 1.4 s, 0.1 mL each: the pause of 0.6 s does not split the flow, that of 0.8 s does.

    A pause of up to 0.7 s counts as the same flow.
    """
    segments = flows([stream(times=[0.0, 0.6, 1.4], volumes=[0.1] * 3)], least_ml=0.0)
    assert [segment.times.tolist() for segment in segments] == [[0.0, 0.6], [1.4]]


COLUMN = {"discharge": 0.6, "section": 8e-4, "foot": 0.15, "volume": 1e-4}
"""100 mL in a tube of 8 cm2, 15 cm over its outlet: m2, m and m3."""

TWO_SECONDS = np.linspace(0.0, 2.0, 21)


def test_column_runs_out_by_torricelli_between_refills():
    """100 mL stand 12.5 cm high in a tube, 15 cm over the open outlet of 4 mm2; 20 mL come in after 1 of 2 seconds.

    By Torricelli's law the root of the head falls by discharge x area / section x root of g / 2 in each second.
    """
    section_m2, foot_m, area_m2, discharge, refill_m3 = 8e-4, 0.15, 4e-6, 0.6, 2e-5
    inflow = np.zeros(21)
    inflow[10] = refill_m3  # at 1 s
    volume, expected = 1e-4, []
    for gained in (0.0, refill_m3):
        volume += gained
        head = foot_m + volume / section_m2
        head_after_1_s = (np.sqrt(head) - discharge * area_m2 / section_m2 * np.sqrt(GRAVITY_M_S2 / 2.0)) ** 2
        expected.append(section_m2 * (head - head_after_1_s))
        volume -= expected[-1]
    out = run_out(TWO_SECONDS, np.full(21, area_m2), inflow, **COLUMN)
    assert [out[:11].sum(), out[11:].sum()] == pytest.approx(expected, rel=1e-6)


def test_nothing_runs_out_of_a_shut_opening():
    """The area of the outlet is 0 for 2 s."""
    shut = np.zeros(21)
    assert not run_out(TWO_SECONDS, area=shut, inflow=np.zeros(21), **COLUMN).any()
