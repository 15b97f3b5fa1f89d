"""On straight ways the search agrees with Sturm's theorem in whole numbers; in steps it finds every first meeting."""

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


def decide(stage, directions, times=(0.0, 1.0), rotations=None):
    """One leg from (2, 2, 3) places; rotations (2, 3, 3) of both bodies, the same at both ends."""
    rotation = np.tile(
        np.eye(3) if rotations is None else rotations, (2, 1, 1, 1) if rotations is not None else (2, 2, 1, 1)
    )
    return stage.decide(np.array(times), rotation, np.asarray(directions, float), np.array([1]), np.array([0]))


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
@pytest.mark.parametrize("start", [0.0, 1 / 3, 1.7e9])
@pytest.mark.parametrize("kind", ["lattice", "degenerate"])
def test_straight_moves_meet_when_integers_decide_so(kind, start):
    """Triangles with whole coordinates move by whole steps; Sturm's theorem bounds the first meeting in rationals.

    ``want``: the bounds, as fractions of the move, or None where they never meet.
    """
    rng = np.random.default_rng(11)
    met = free = grazed = 0
    for _ in range(30):
        a, b = whole_number_faces(rng, kind), whole_number_faces(rng, kind)
        directions = rng.integers(-4, 5, (2, 2, 3))
        rotations = np.array([grid_rotation(rng), grid_rotation(rng)])
        body_a, body_b = a @ rotations[0], b @ rotations[1]
        if triangles_intersect([[a + directions[0, 0], b + directions[0, 1]]])[0]:
            continue
        want = first_meeting(a + directions[0, 0], a + directions[1, 0], b + directions[0, 1], b + directions[1, 1])
        answer = decide(stage_of(body_a[None], body_b[None]), directions, times=(start, start + 1), rotations=rotations)
        state = answer.states[0]
        if want is None:
            assert state == FREE
            free += 1
        elif state == HIT:
            length = Fraction(start + 1) - Fraction(start)
            lower, upper = ((Fraction(x) - Fraction(start)) / length for x in answer.impact[0].tolist())
            assert lower <= want[1]
            assert want[0] <= upper
            assert upper - lower <= Fraction(1, 10**6)
            met += 1
        else:
            # a touch without depth lasts one instant, which no sampled pose need hit
            assert state == TOO_CLOSE
            assert answer.impact[0, 0] - start <= want[1]
            assert want[0] <= answer.impact[0, 1] - start
            grazed += 1
    assert met > 2
    assert free > 6
    assert grazed < met


TREES = build_box_trees([box_mesh((0.1, 0.1, 0.1)).triangles, box_mesh((0.4, 0.02, 0.02)).triangles])


def state_of(rotation, move):
    """The outcome of the search for one leg of a cube and a bar."""
    stage = SegmentStage(TREES, FIRST_AND_SECOND, tolerance=1e-4, effort=10_000)
    return stage.decide(np.array([0.0, 1.0]), rotation, move, np.array([1]), np.array([0])).states[0]


def segment_poses(degrees=(0.0, 0.0), offset=(0.0, 0.15, 0.0)):
    """Rotations and moves of two bodies at both ends of a segment; they rotate about Z."""
    rotation, move = np.tile(np.eye(3), (2, 2, 1, 1)), np.zeros((2, 2, 3))
    for body in (0, 1):
        rotation[1, body] = Rotation.from_euler("z", degrees[body], degrees=True).as_matrix()
    move[:, 0] = offset
    return rotation, move


def test_straight_angles_and_extreme_coordinates_are_not_searched():
    """Half a turn has no shorter arc, and 1e80 m is beyond what the search computes with."""
    assert state_of(*segment_poses((0, 180))) == state_of(*segment_poses((180, 0))) == STRAIGHT_ANGLE
    assert state_of(*segment_poses((0, 179.99))) == HIT
    assert state_of(*segment_poses(offset=(1e80, 0, 0))) == TOO_LARGE


@pytest.mark.parametrize(
    ("seconds", "ends", "fraction"),
    [
        ((0.0, 1.0), (2.0, 0.0), 0.5),
        ((2.0, 3.0), (2.0, 0.0), 0.5),
        ((0.0, 0.011), (32.0, 0.0), 31 / 32),
        # In Unix time doubles are 2^-22 s apart: a quarter of an odd number of them lies between two.
        ((1.7e9, 1.7e9 + 46601 * 2.0**-22), (1.5, -0.5), 0.25),
    ],
)
def test_impact_of_cubes_holds_the_instant_at_which_they_touch(seconds, ends, fraction):
    """One of two unit cubes moves along X; they touch exactly where it is at 1 m, a ``fraction`` of the way.

    The faces that touch are named too: -1 would be none.
    """
    cube = box_mesh((1.0, 1.0, 1.0)).triangles
    positions = [[(x, 0, 0), (0, 0, 0)] for x in ends]
    answer = decide(stage_of(cube, cube), positions, times=seconds)
    start, stop = map(Fraction, seconds)
    lower, upper = map(Fraction, answer.impact[0].tolist())
    assert answer.states[0] == HIT
    assert lower <= start + Fraction(fraction) * (stop - start) <= upper <= lower + Fraction(1, 10**6)
    assert (answer.faces >= 0).all()


PLATE, BALL = build_box_trees([box_mesh((1.0, 1.0, 0.002)).triangles, ball_mesh(0.01).triangles])


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
    """The outcome of a search while a ball moves straight past a plate at rest, and the memory it used."""
    leg = legs_of_straight_move(before, after)
    (speed,), (acceleration,) = leg_bounds(leg, BALL.reach, REST)
    rounding = leg_pads(leg, BALL.reach, REST, PLATE.reach)[0]
    room = make_room(PLATE, BALL)  # searches are possible either way round
    bounds = speed, acceleration, rounding if pad is None else pad, shortest
    return searched(leg, bounds, tolerance, effort, room), room


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-11])
def test_ball_sliding_past_a_plate_is_free(gap):
    """A ball of 1 cm over a plate 2 mm thick, which touch at a height of 0.011 m: one test of their boxes is enough."""
    state, room = search_of_ball_and_plate((-0.3, 0, 0.011 + gap), (0.3, 0, 0.011 + gap))
    assert state == FREE
    counts = [int(room.work[counter]) for counter in (search.INTERVALS, search.BOX_TESTS, search.FACE_TESTS)]
    assert counts == [1, 1, 0]


def test_gaps_below_rounding_are_too_close_and_located():
    """Ball and plate touch at a height of 0.011 m; a gap of 1 nm is below the pad of rounding of 10 nm.

    The whole leg, from 0 to 1, is where they are too close.
    """
    state, room = search_of_ball_and_plate(
        (-1e-6, 0, 0.011 + 1e-9), (1e-6, 0, 0.011 + 1e-9), pad=1e-8, effort=10**9, shortest=1e-3
    )
    assert state == TOO_CLOSE
    assert room.impacts[0] == 0.0
    assert room.impacts[1] == 1.0


def test_the_effort_ends_only_below_the_tolerance():
    """They touch at a height of 0.011 m. An effort of 0 still decides moves that end 1 mm apart, or deep."""
    touching = (-0.3, 0, 0.011 + 1e-9), (0.3, 0, 0.011 + 1e-9)
    state, _ = search_of_ball_and_plate(*touching, pad=1e-8, effort=100)
    assert state == TOO_LONG
    state, _ = search_of_ball_and_plate((0, 0, 0.1), (0, 0, 0.012), effort=0)
    assert state == FREE
    state, _ = search_of_ball_and_plate((0, 0, 0.1), (0, 0, -0.1), effort=0)
    assert state == HIT


@pytest.mark.parametrize(("end_height", "contact_time"), [(-0.1, 0.5), (0.005, 1.0)])
def test_shortest_segment_is_tested_at_middle_and_end(end_height, contact_time):
    """A segment that is not halved: the ball of 1 cm is in the thin plate at height 0 halfway, or only at the end."""
    state, room = search_of_ball_and_plate((0, 0, 0.1), (0, 0, end_height), shortest=1.0)
    assert state == HIT
    assert room.impacts[:2].tolist() == [0.0, contact_time]


def test_segment_search_reports_a_full_buffer():
    """The buffer has room for two pairs of nodes; a ball grazes a plate within many, and the search stays undecided."""
    room = make_room(BALL, PLATE)._replace(items=np.empty((2, 3), dtype=np.int32))
    leg = legs_of_straight_move((-1e-5, 0, 0.011), (1e-5, 0, 0.011))
    assert searched(leg, (2e-5, 0.0, 1e-3, 1e-2), tolerance=1e-4, effort=10**6, room=room) in (TOO_CLOSE, TOO_LONG)
