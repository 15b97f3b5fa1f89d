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


def disc(name="cup", centre=(0.0, 0.0, 0.0), normal=UP, radius=0.03):
    """An opening: name, centre and normal (1, 3) each, and radius."""
    return name, np.array([centre]), np.array([normal]) / np.linalg.norm(normal), radius


def disc_entered(start, velocity, discs):
    """Name of the opening that is entered first."""
    times = {name: entry_times(start[None], velocity[None], *rest)[0] for name, *rest in discs}
    return min((time, name) for name, time in {**times, "": np.inf}.items())[1]


DROP_S = float(np.sqrt(2 * 0.2 / GRAVITY_M_S2))
THROWN_S = max(np.roots([-0.5 * GRAVITY_M_S2, 2.0, -0.1]))
"""Seconds after which what is thrown up at 2 m/s comes down through a height 10 cm above."""

POINT_HIT_AT_0_3_M_S = disc(centre=(0.3 * DROP_S, 0.0, 0.0), radius=1e-6)


@pytest.mark.parametrize(
    ("start", "velocity", "discs", "name"),
    [
        *(((x, 0.05, 0.0), REST, [disc()], name) for x, name in ((0.0, "cup"), (0.03, "cup"), (0.0301, ""))),
        # A push carries it as far as the fall takes time.
        ((0.0, 0.2, 0.0), (0.3, 0.0, 0.0), [POINT_HIT_AT_0_3_M_S], "cup"),
        ((0.0, 0.2, 0.0), (0.31, 0.0, 0.0), [POINT_HIT_AT_0_3_M_S], ""),
        # Above, sideways, overturned, none.
        ((0.0, 0.05, 0.0), REST, [disc(centre=(0.0, 0.06, 0.0))], ""),
        ((0.0, 0.05, 0.0), REST, [disc(normal=(1.0, 0.0, 0.0)), disc(normal=-UP)], ""),
        ((0.0, 0.05, 0.0), REST, [], ""),
        # Thrown up it comes down through an opening it started below.
        ((0.0, -0.1, 0.0), (0.0, 2.0, 0.0), [disc()], "cup"),
        ((0.0, -0.1, 0.0), (0.0, 1.0, 0.0), [disc()], ""),
        ((-0.5, -0.1, 0.0), (0.5 / THROWN_S, 2.0, 0.0), [disc()], "cup"),
    ],
)
def test_liquid_falls_into_the_upward_opening_below(start, velocity, discs, name):
    """Openings have a radius of 3 cm unless given; a drop starts at a place with a velocity, in metres and m/s."""
    assert disc_entered(np.array(start), np.array(velocity), discs) == name


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


@pytest.mark.parametrize("speed_up", [1.0, 0.0, -1.0])
def test_liquid_lands_where_its_parabola_meets_the_height(speed_up):
    """Let go at (1, 0.5, 2) with 0.3 m/s along x, it lands at a height of 0.2 m; to 5 m it never gets."""
    start, velocity = np.array([[1.0, 0.5, 2.0]] * 2), np.array([[0.3, speed_up, 0.0]] * 2)
    landed, never = points_at_height(start, velocity, np.array([0.2, 5.0]))
    seconds = max(np.roots([-0.5 * GRAVITY_M_S2, speed_up, 0.5 - 0.2]))
    assert landed == pytest.approx([1.0 + 0.3 * seconds, 0.2, 2.0])
    assert never.tolist() == [1.0, 0.5, 2.0]


def test_twist_angle_is_that_of_the_rotation_about_the_axis():
    """SciPy makes the rotations of these angles, in radians, about the axis (1, 2, -2) / 3."""
    axis, angles = np.array([1.0, 2.0, -2.0]) / 3.0, np.array([-3.0, -1.0, 0.0, 0.5, 2.5])
    rotations = Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
    assert twist_angle(rotations, axis) == pytest.approx(angles)


def test_only_a_long_pause_splits_a_flow():
    """A pause of 0.6 s does not, one of 0.8 s does."""
    segments = flows([stream([0.0, 0.6, 1.4], [0.1] * 3)], least_ml=0.0)
    assert [stream.times.tolist() for stream in segments] == [[0.0, 0.6], [1.4]]


def test_column_runs_out_by_torricelli_between_refills():
    """100 mL stand 12.5 cm high, 15 cm over the outlet; 20 mL come after 1 s. The root of the head falls evenly.

    With the opening shut (area 0) nothing runs out.
    """
    section, foot, area, discharge = 8e-4, 0.15, 4e-6, 0.6
    times, inflow = np.linspace(0.0, 2.0, 21), np.zeros(21)
    inflow[10] = 2e-5
    volume, expected = 1e-4, []
    for gained in (0.0, 2e-5):
        volume += gained
        head = foot + volume / section
        later = (np.sqrt(head) - discharge * area / section * np.sqrt(GRAVITY_M_S2 / 2.0)) ** 2
        expected.append(section * (head - later))
        volume -= expected[-1]
    settings = {"discharge": discharge, "section": section, "foot": foot, "volume": 1e-4}
    out = run_out(times, np.full(21, area), inflow, **settings)
    assert [out[:11].sum(), out[11:].sum()] == pytest.approx(expected, rel=1e-6)
    assert not run_out(times, np.zeros(21), inflow, **settings).any()
