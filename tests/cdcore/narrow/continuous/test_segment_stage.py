"""On straight paths the search agrees with Sturm's theorem in whole numbers; in steps it finds every first meeting.

A stage decides the motion between two frames: FREE, HIT with bounds of the time of impact, or TOO_CLOSE to tell.
"""

from fractions import Fraction

import numpy as np
import pytest
from oracles.continuous_sturm import first_meeting
from scipy.spatial.transform import Rotation
from support.random_worlds import KINDS
from support.shapes import ball_mesh, box_mesh

from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.continuous import interval_search as search
from cdcore.narrow.continuous.interval_search import (
    FREE,
    HIT,
    TOO_CLOSE,
    TOO_LONG,
    make_room,
    search_legs,
)
from cdcore.narrow.continuous.motion_segments import leg_bounds, leg_pads, legs_of
from cdcore.narrow.continuous.segment_stage import (
    DEFAULT_EFFORT,
    DEFAULT_TOLERANCE,
    STRAIGHT_ANGLE,
    TOO_LARGE,
    SegmentStage,
)
from cdcore.triangles.decide import triangles_intersect

FIRST_AND_SECOND = np.array([[0, 1]])


def stage_of(a, b, **options):
    """The stage that searches between frames, for two sets of triangles."""
    requested = {"tolerance": DEFAULT_TOLERANCE, "effort": DEFAULT_EFFORT} | options
    return SegmentStage(build_box_trees([a, b]), FIRST_AND_SECOND, **requested)


def decide(stage, positions, times=(0.0, 1.0), rotations=None):
    """The answer for two bodies that move straight between positions (2, 2, 3), by frame and body.

    ``rotations`` (2, 3, 3) are the same in both frames.
    """
    rotations = np.tile(np.eye(3), (2, 1, 1)) if rotations is None else rotations
    last_frame, pair = np.array([1]), np.array([0])
    return stage.decide(
        np.array(times), np.tile(rotations, (2, 1, 1, 1)), np.asarray(positions, float), last_frame, pair
    )


def whole_number_faces(rng, kind):
    """A random triangle of whole coordinates."""
    if kind == "lattice":
        return rng.integers(-3, 4, (3, 3))
    return (KINDS["degenerate"](rng)[rng.integers(0, 24)] - 2).astype(int)


def grid_rotation(rng):
    """A rotation that takes the grid to itself, so that whole numbers stay whole."""
    rotation = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)[:, None]
    return rotation if np.linalg.det(rotation) > 0 else -rotation


@pytest.mark.slow
@pytest.mark.parametrize("start", [0.0, 1 / 3, 1.7e9], ids="from {:.4g} s".format)
@pytest.mark.parametrize("kind", ["lattice", "degenerate"])
def test_straight_moves_meet_when_integers_decide_so(kind, start):
    """Two triangles with whole coordinates move by whole steps; Sturm's theorem bounds their first meeting exactly.

    ``first_meeting``: those bounds, as fractions of the move, or None where they never meet. A touch without depth
    lasts one instant, which no sampled pose need hit: it is TOO_CLOSE, at about that instant.
    """
    rng = np.random.default_rng(11)
    hits = free = grazes = 0
    for _ in range(30):
        a, b = whole_number_faces(rng, kind), whole_number_faces(rng, kind)
        positions = rng.integers(-4, 5, (2, 2, 3))
        (a_start, b_start), (a_end, b_end) = positions
        rotations = np.array([grid_rotation(rng), grid_rotation(rng)])
        body_a, body_b = a @ rotations[0], b @ rotations[1]
        if triangles_intersect([[a + a_start, b + b_start]])[0]:
            continue
        expected = first_meeting(a + a_start, a + a_end, b + b_start, b + b_end)
        times = start, start + 1
        answer = decide(stage_of(body_a[None], body_b[None]), positions, times, rotations)
        (state,) = answer.states.tolist()
        if expected is None:
            assert state == FREE
            free += 1
            continue
        length = Fraction(times[1]) - Fraction(times[0])
        lower, upper, *_ = ((Fraction(time) - Fraction(start)) / length for time in answer.impact[0].tolist())
        earliest, latest = expected
        assert lower <= latest
        assert earliest <= upper
        if state == HIT:
            assert upper - lower <= Fraction(1, 10**6)
            hits += 1
        else:
            assert state == TOO_CLOSE
            grazes += 1
    assert hits > 2
    assert free > 6
    assert grazes < hits


CUBE_AND_BAR = build_box_trees([box_mesh((0.1, 0.1, 0.1)).triangles, box_mesh((0.4, 0.02, 0.02)).triangles])


@pytest.mark.parametrize(
    ("cube_degrees", "bar_degrees", "cube_position", "state"),
    [
        pytest.param(0, 179.99, (0, 0.15, 0), HIT, id="the bar turns by almost half a turn, through the cube"),
        pytest.param(0, 180, (0, 0.15, 0), STRAIGHT_ANGLE, id="the bar turns by half a turn"),
        pytest.param(180, 0, (0, 0.15, 0), STRAIGHT_ANGLE, id="the cube turns by half a turn"),
        pytest.param(0, 0, (1e80, 0, 0), TOO_LARGE, id="the cube is at 1e80 m"),
    ],
)
def test_straight_angles_and_extreme_coordinates_are_not_searched(cube_degrees, bar_degrees, cube_position, state):
    """A cube of 10 cm beside a bar of 40 cm along x about the origin; both may turn about z between two frames.

    Half a turn has no shorter arc, and 1e80 m is beyond what the search computes with.
    """
    rotations, positions = np.tile(np.eye(3), (2, 2, 1, 1)), np.zeros((2, 2, 3))
    for body, degrees in enumerate((cube_degrees, bar_degrees)):
        rotations[1, body] = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
    positions[:, 0] = cube_position
    stage = SegmentStage(CUBE_AND_BAR, FIRST_AND_SECOND, tolerance=1e-4, effort=10_000)  # any tolerance and effort
    times, last_frame, pair = np.array([0.0, 1.0]), np.array([1]), np.array([0])
    assert stage.decide(times, rotations, positions, last_frame, pair).states.tolist() == [state]


@pytest.mark.parametrize(
    ("seconds", "x_of_ends", "fraction"),
    [
        pytest.param((0.0, 1.0), (2.0, 0.0), 0.5, id="a second"),
        pytest.param((2.0, 3.0), (2.0, 0.0), 0.5, id="a second later"),
        pytest.param((0.0, 0.011), (32.0, 0.0), 31 / 32, id="fast, 11 ms"),
        # In Unix time doubles are 2^-22 s apart: a quarter of an odd number of them lies between two.
        pytest.param((1.7e9, 1.7e9 + 46601 * 2.0**-22), (1.5, -0.5), 0.25, id="11 ms in Unix time"),
    ],
)
def test_impact_of_cubes_holds_the_instant_at_which_they_touch(seconds, x_of_ends, fraction):
    """One of two cubes of 1 m moves along x; they touch where its middle is at 1 m, a ``fraction`` of the way.

    The bounds of the time are at most a microsecond apart, and faces that touch are named; -1 would be none.
    """
    cube = box_mesh((1.0, 1.0, 1.0)).triangles
    positions = [[(x, 0, 0), (0, 0, 0)] for x in x_of_ends]
    answer = decide(stage_of(cube, cube), positions, times=seconds)
    assert answer.states.tolist() == [HIT]
    start, stop = map(Fraction, seconds)
    lower, upper = map(Fraction, answer.impact[0].tolist())
    assert lower <= start + Fraction(fraction) * (stop - start) <= upper <= lower + Fraction(1, 10**6)
    assert (answer.faces >= 0).all()


PLATE, BALL = build_box_trees([box_mesh((1.0, 1.0, 0.002)).triangles, ball_mesh(0.01).triangles])
TOUCH = 0.010 + 0.001
"""Height in metres at which the ball touches the plate: its radius, 1 cm, and half of the plate's 2 mm."""


def legs_of_straight_move(before, after):
    """A straight move without a rotation, as the kernels take it."""
    return legs_of(np.tile(np.eye(3), (2, 1, 1)), np.array([before, after], dtype=float), np.array([1]))


REST = legs_of_straight_move((0, 0, 0), (0, 0, 0))


def searched(leg, bounds, tolerance, effort, room):
    """State of one leg of the ball, by the kernel of the stage: another one would compile for seconds."""
    moving, resting = (np.ascontiguousarray(poses.T) for poses in (leg, REST))
    states, impacts = np.full(1, FREE, dtype=np.uint8), np.zeros((1, 4))
    row = room.search_row(BALL, PLATE)
    search_legs(row, moving, resting, np.array([bounds]), tolerance, effort, states, impacts)
    return states[0]


def search_of_ball_and_plate(before, after, *, tolerance=1e-4, shortest=1e-7, effort=10_000, pad=None):
    """The outcome of a search while a ball moves straight past a plate at rest, and the memory it used.

    ``shortest``: segment of the move, of which it is 1, that is not halved; ``pad``: metres for rounding, as it is by
    default; ``effort``: most tests spent where bodies are nearer than ``tolerance``.
    """
    leg = legs_of_straight_move(before, after)
    (speed,), (acceleration,) = leg_bounds(leg, BALL.reach, REST)
    (rounding,) = leg_pads(leg, BALL.reach, REST, PLATE.reach)
    room = make_room(PLATE, BALL)  # searches are possible either way round
    bounds = speed, acceleration, rounding if pad is None else pad, shortest
    return searched(leg, bounds, tolerance, effort, room), room


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-11], ids="{} m".format)
def test_ball_sliding_past_a_plate_is_free(gap):
    """A ball slides by 0.6 m over a plate, ``gap`` above the height of TOUCH at which they touch, 11 mm: one test of
    their boxes, for the whole move, is enough.
    """
    state, room = search_of_ball_and_plate((-0.3, 0, TOUCH + gap), (0.3, 0, TOUCH + gap))
    assert state == FREE
    counts = [int(room.work[counter]) for counter in (search.INTERVALS, search.BOX_TESTS, search.FACE_TESTS)]
    assert counts == [1, 1, 0]


def test_gaps_below_rounding_are_too_close_and_located():
    """A ball moves by 2 um, 1 nm over a plate, which is less than the pad of 10 nm: they are too close all the time.

    However long the search takes (``effort``) it says so of the whole move, from 0 to 1.
    """
    height = TOUCH + 1e-9
    state, room = search_of_ball_and_plate((-1e-6, 0, height), (1e-6, 0, height), pad=1e-8, effort=10**9, shortest=1e-3)
    assert state == TOO_CLOSE
    lower, upper, *_ = room.impacts
    assert (lower, upper) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("before", "after", "effort", "state"),
    [
        pytest.param((-0.3, 0, TOUCH + 1e-9), (0.3, 0, TOUCH + 1e-9), 100, TOO_LONG, id="slides 1 nm above"),
        pytest.param((0, 0, 0.1), (0, 0, TOUCH + 1e-3), 0, FREE, id="ends 1 mm above"),
        pytest.param((0, 0, 0.1), (0, 0, -0.1), 0, HIT, id="goes through"),
    ],
)
def test_the_effort_ends_only_below_the_tolerance(before, after, effort, state):
    """A ball and a plate, with a pad of 10 nm for rounding and a tolerance of 0.1 mm: nearer than that effort is spent.

    Without any a move that ends farther away, or deep, is decided all the same.
    """
    answer, _room = search_of_ball_and_plate(before, after, pad=1e-8, effort=effort)
    assert answer == state


@pytest.mark.parametrize(
    ("end_height", "latest"),
    [pytest.param(-0.1, 0.5, id="in the plate halfway"), pytest.param(0.005, 1.0, id="in the plate at the end")],
)
def test_shortest_segment_is_tested_at_middle_and_end(end_height, latest):
    """A ball of 1 cm moves from a height of 0.1 m into a thin plate at 0, or through it; the segment is not halved.

    The time of impact is between its start, 0, and the first of middle and end at which they meet.
    """
    state, room = search_of_ball_and_plate((0, 0, 0.1), (0, 0, end_height), shortest=1.0)
    assert state == HIT
    lower, upper, *_ = room.impacts
    assert (lower, upper) == (0.0, latest)


def test_segment_search_reports_a_full_buffer():
    """A ball grazes a plate within many pairs of nodes, and the buffer has room for two: the search stays undecided."""
    room = make_room(BALL, PLATE)._replace(items=np.empty((2, 3), dtype=np.int32))
    leg = legs_of_straight_move((-1e-5, 0, TOUCH), (1e-5, 0, TOUCH))
    speed, acceleration, pad, shortest = 2e-5, 0.0, 1e-3, 1e-2
    state = searched(leg, (speed, acceleration, pad, shortest), tolerance=1e-4, effort=10**6, room=room)
    assert state in (TOO_CLOSE, TOO_LONG)
