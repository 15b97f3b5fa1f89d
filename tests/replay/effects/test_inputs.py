from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import along_x, cube

from replay.effects.fitting import SETTLE_S, before, fitted, settled_runs, velocities
from replay.effects.inputs import HANDS, BodyPoses, EffectInputs
from replay.effects.output import EffectOutput
from replay.effects.spans import spans_of, steadied, switched
from replay.errors import EffectError
from replay.prepare.assemble import assemble
from sessions import Session
from sessions.model.hand import HandTrack
from sessions.model.scene import Scene, SceneBody

QUARTER = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))
"""A quarter turn about Z: +Y goes to -X."""


def inputs(**more):
    poses = {"cup": along_x([0, 1, 2], QUARTER), "hand_left": along_x([5, 5, 6])}
    scene = Scene(bodies=(SceneBody("cup"), SceneBody("hand_left"), SceneBody("lost")))
    session = Session.from_arrays([0, 10**7, 2 * 10**7], poses, {name: cube() for name in poses}, scene)
    hands = {f"{who}/{side}": HandTrack([0, 10**7]) for who in ("ann", "bob") for side in ("left", "right")}
    object.__setattr__(session, "hands", hands)
    given = {"declared": (), "pairs": (), "known_bodies": frozenset(("cup", "hand_left", "lost")), **more}
    return EffectInputs(kind="pour", session=session, assembly=assemble(session), **given)


def test_a_point_and_a_direction_of_a_body_follow_its_pose():
    cup = inputs().poses("cup")
    assert np.allclose(cup.point((0.0, 2.0, 0.0)), [[-2, 0, 0], [-1, 0, 0], [0, 0, 0]])
    assert np.allclose(cup.direction((0.0, 1.0, 0.0)), [-1, 0, 0])
    assert np.allclose(cup.tilt(), np.pi / 2)


def test_a_frame_without_a_pose_gives_no_number():
    cup = inputs().poses("cup")
    lost = BodyPoses(cup.times, cup.translation, cup.rotation, np.array([True, False, True]), cup.linked)
    assert np.isnan(lost.point((0, 0, 0)))[:, 0].tolist() == [False, True, False]
    assert np.isnan(lost.tilt()).tolist() == [False, True, False]


def test_a_tilt_of_a_nanoradian_keeps_its_digits():
    turn = np.eye(3)[None].copy()
    turn[0, :2, :2] = [[1.0, -1e-9], [1e-9, 1.0]]
    one = np.ones(1, dtype=np.bool_)
    assert BodyPoses(np.zeros(1), np.zeros((1, 3)), turn, one, one).tilt()[0] == pytest.approx(1e-9, rel=1e-12)


def test_a_pose_relative_to_another_body_is_in_its_frame():
    given = inputs()
    relative = given.poses("hand_left").relative_to(given.poses("cup"))
    assert np.allclose(relative.translation, [[0, -5, 0], [0, -4, 0], [0, -4, 0]])


def test_what_the_spec_does_not_name_cannot_be_had():
    given = inputs()
    for ask, said in (
        (lambda: given.poses("flask"), "which no declared effect names"),
        (lambda: given.poses("lost"), "has no mesh or was not recorded"),
        (lambda: given.output("contact"), "name it in `needs`"),
        (lambda: given.hand_of("hand_left"), "name '/hands' in `reads`"),
        (lambda: given.contact(("cup", "lost")), "name a `detector`"),
        (lambda: given.mesh("flask"), "which no declared effect names"),
    ):
        with pytest.raises(EffectError, match=said):
            ask()


def test_a_hand_is_found_by_the_words_of_its_body_and_counted_as_decoded():
    given = inputs(reads=(HANDS,))
    assert given.hand_of("hand_left") is given.session.hands["ann/left"]
    assert given.counters == {"decoded /hands/ann/left": 1}
    assert given.hand_of("cup") is None


def test_outputs_of_needed_effects_clock_mesh_and_declaration_are_there():
    given = inputs(outputs={"contact": EffectOutput()})
    assert given.has("contact") and not given.has("sweep") and given.output("contact").events == ()
    assert len(given) == 3 and given.times.tolist() == [0.0, 0.01, 0.02] and given.stamp_ns[1] == 10**7
    assert given.body("cup").id == "cup" and len(given.mesh("cup").vertices) == 8


def flags(text):
    return np.array([letter == "C" for letter in text]), np.array([letter != "-" for letter in text])


@given(st.lists(st.booleans(), max_size=40))
def test_spans_and_masks_say_the_same(mask):
    array = np.array(mask, dtype=np.bool_)
    assert [any(a <= k < b for a, b in spans_of(array)) for k in range(len(array))] == mask


@pytest.mark.parametrize(
    ("text", "spans"),
    [
        (".CC..", [(1, 3)]), (".C.C.", []), ("CC.CC..", [(0, 5)]), (".CC", [(1, 3)]), ("", []), ("C", []),
        ("C--C..", [(0, 4)]), ("CC---..", [(0, 5)]), ("CC-.-CC", [(0, 7)]), ("--CC", [(2, 4)]),
        (".CC..CC..", [(1, 3), (5, 7)]),
    ],
)  # fmt: skip
def test_two_frames_in_and_two_out_whatever_is_not_known_between(text, spans):
    assert steadied(*flags(text), 2, 2) == spans


@given(st.text(alphabet="C.-", max_size=60))
def test_spans_do_not_touch_and_hold_the_frames_that_opened_them(text):
    flag, known = flags(text)
    spans = steadied(flag, known, 2, 2)
    assert all(a[1] < b[0] for a, b in pairwise(spans))
    assert all(flag[first] and int((flag & known)[first:stop].sum()) >= 2 for first, stop in spans)


def test_a_switch_goes_on_above_one_level_and_off_below_another():
    value = np.array([0.0, 0.5, 0.7, 0.5, np.nan, 0.5, 0.3, 0.5, 0.61])
    assert switched(value, 0.6, 0.4) == [(2, 6), (8, 9)]


UNEVEN = np.cumsum(np.array([0.0, 0.011, 0.005, 0.02, 0.011, 0.003, 0.03, 0.011, 0.011, 0.009, 0.011, 0.014]))


@given(st.lists(st.floats(-50, 50), min_size=3, max_size=3), st.floats(0.0, 1e4))
def test_a_parabola_on_uneven_stamps_is_found_again(coefficients, zero):
    a, b, c = coefficients
    u = UNEVEN - UNEVEN[-1]
    fit = fitted(UNEVEN + zero, (a + b * u + c * u * u)[:, None])
    assert fit.misfit < 1e-9 and fit.place(fit.at)[0] == pytest.approx(a, abs=1e-7)
    assert fit.velocity(fit.at - 0.01)[0] == pytest.approx(b - 0.02 * c, abs=1e-4)


def test_a_step_in_the_path_shows_as_misfit():
    assert fitted(UNEVEN, np.where(np.arange(12) < 6, 0.0, 0.03)[:, None]).misfit > 0.005


def test_velocities_of_a_parabola_are_exact_at_every_frame_of_the_stretch():
    places = np.stack([3.0 * UNEVEN - 4.9 * UNEVEN**2, np.ones(12)], axis=1)
    found = velocities(UNEVEN, places, np.zeros(12, dtype=np.int64))
    assert np.allclose(found[:, 0], 3.0 - 9.8 * UNEVEN, atol=1e-9) and np.allclose(found[:, 1], 0.0, atol=1e-12)


def test_no_velocity_is_taken_across_a_gap_or_from_four_samples():
    runs = np.array([0] * 4 + [1] * 8)
    places = np.where(runs == 0, 0.0, 5.0)[:, None]
    found = velocities(UNEVEN, places, runs)
    assert np.isnan(found[:4]).all() and np.allclose(found[4:], 0.0)


def test_frames_without_a_pose_or_soon_after_a_loss_belong_to_no_stretch():
    times = np.arange(100) / 100
    valid = np.ones(100, dtype=np.bool_)
    valid[20:25] = False
    linked = valid.copy()
    linked[[0, 25]] = False
    runs = settled_runs(times, valid, linked)
    drifting = 25 + round(SETTLE_S * 100)
    assert (runs[:20] == runs[0]).all() and (runs[20:drifting] == -1).all() and runs[0] >= 0
    assert (runs[drifting:] == runs[-1]).all() and runs[-1] != runs[0] and runs[-1] >= 0


def test_the_samples_before_a_frame_are_the_last_nine_of_its_stretch_or_none():
    runs = np.array([0] * 10 + [1] * 12 + [-1])
    assert before(runs, 9).tolist() == list(range(1, 10))
    assert before(runs, 15).tolist() == list(range(10, 16))
    assert len(before(runs, 13)) == 0 and len(before(runs, 22)) == 0
