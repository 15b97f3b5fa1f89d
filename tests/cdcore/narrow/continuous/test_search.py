"""The search proves clear or sees a contact, in order of time, and says so when its effort or its room ends."""

import numpy as np
import pytest
from support.motions import KINDS, placed, soup
from support.shapes import ball_mesh, box_mesh, random_rotations

from cdcore.narrow.continuous import search
from cdcore.narrow.continuous.motion_segments import LEG_WIDTH, fill_leg, leg_bounds, leg_pad
from cdcore.narrow.continuous.search import (
    FACES,
    FREE,
    HIT,
    TOO_CLOSE,
    TOO_LONG,
    Bounds,
    first_contact,
    make_room,
    seen_meeting,
)
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.triangles.predicates import triangles_intersect

PLATE = build_box_tree(box_mesh((1.0, 1.0, 0.002)).triangles)
BALL = build_box_tree(ball_mesh(0.01).triangles)


def straight(before, after):
    leg = np.empty(LEG_WIDTH)
    fill_leg(np.eye(3), np.asarray(before, float), np.eye(3), np.asarray(after, float), leg)
    return leg


def ask(before, after, *, tolerance=1e-4, shortest=1e-7, effort=10_000, pad=None):
    leg, rest = straight(before, after), straight((0, 0, 0), (0, 0, 0))
    speed, acceleration = leg_bounds(leg, BALL.reach, rest)
    rounding = leg_pad(leg, BALL.reach, rest, PLATE.reach)
    room = make_room(BALL, PLATE)
    bounds = Bounds(speed, acceleration, rounding if pad is None else pad, tolerance, shortest, effort)
    return first_contact(BALL, leg, PLATE, rest, bounds, room), room


def test_a_ball_through_a_plate_hits_when_its_pole_reaches_it():
    state, room = ask((0, 0, 0.1), (0, 0, -0.1))
    assert state == HIT
    assert room.found[0] <= 0.445 <= room.found[1]
    assert room.found[1] - room.found[0] <= 1e-7


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-11])
def test_a_ball_that_slides_past_a_plate_is_free_whatever_the_gap(gap):
    state, room = ask((-0.3, 0, 0.011 + gap), (0.3, 0, 0.011 + gap))
    assert state == FREE
    assert room.work[search.PARTS] < 2000


def test_what_rounding_cannot_tell_apart_is_too_close_and_says_where():
    state, room = ask((-1e-6, 0, 0.011 + 1e-9), (1e-6, 0, 0.011 + 1e-9), pad=1e-8, effort=10**9, shortest=1e-3)
    assert state == TOO_CLOSE
    assert room.found[0] == 0.0
    assert room.found[1] == 1.0


def test_the_effort_ends_only_below_the_tolerance():
    touching = (-0.3, 0, 0.011 + 1e-9), (0.3, 0, 0.011 + 1e-9)
    assert ask(*touching, pad=1e-8, effort=100)[0] == TOO_LONG
    assert ask((0, 0, 0.1), (0, 0, 0.012), effort=0)[0] == FREE
    assert ask((0, 0, 0.1), (0, 0, -0.1), effort=0)[0] == HIT


def test_more_pairs_than_there_is_room_for_are_an_answer_and_not_a_crash():
    leg, rest = straight((-1e-5, 0, 0.011), (1e-5, 0, 0.011)), straight((0, 0, 0), (0, 0, 0))
    room = make_room(BALL, PLATE)._replace(items=np.empty((2, 3), dtype=np.int32))
    state = first_contact(BALL, leg, PLATE, rest, Bounds(2e-5, 0.0, 1e-3, 1e-4, 1e-2, 10**6), room)
    assert state in (TOO_CLOSE, TOO_LONG)


@pytest.mark.parametrize("kind", KINDS)
def test_faces_seen_to_meet_are_those_of_the_predicate_on_placed_triangles(kind):
    rng = np.random.default_rng(4)
    meshes = [soup(rng, size=1.0) if kind == "soup" else KINDS[kind](rng) for _ in (0, 1)]
    trees = [build_box_tree(mesh) for mesh in meshes]
    turns = random_rotations(rng, 2) if kind == "soup" else np.tile(np.eye(3), (2, 1, 1))
    places = np.zeros((2, 3))
    legs = np.empty((2, LEG_WIDTH))
    for k in (0, 1):
        fill_leg(turns[k], places[k], turns[k], places[k], legs[k])
    world = [placed(meshes[k], turns[k], places[k]) for k in (0, 1)]
    room = make_room(*trees)
    met = 0
    for i in range(len(meshes[0])):
        for j in range(len(meshes[1])):
            faces = trees[0].faces[i], trees[1].faces[j]
            want = triangles_intersect(np.stack([world[0][faces[0]], world[1][faces[1]]])[None])[0]
            room.items[0] = FACES, i, j
            assert seen_meeting(trees[0], legs[0], trees[1], legs[1], 0.0, 0, 1, room) == (0 if want else -1)
            met += want
    assert met > 0
