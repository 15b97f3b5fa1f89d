"""Grasped bodies are counted separately: declared pairs, and while a trigger is pressed and a thing moves along."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x, verdict_column

from replay.auditing.compare import compare
from replay.auditing.contact_counts import count_contacts, count_reports
from replay.auditing.episodes import episodes
from replay.auditing.holding import grasps, hand_bodies, holdings, overlaps_holding
from replay.auditing.matching import match_episodes
from replay.auditing.outcome import Episode, Outcome
from replay.prepare.assemble import assemble
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import HandTrack

STEP = 10_000_000
"""Nanoseconds from frame to frame: 10 ms."""
FRAMES = 300
"""Frames of a recording: 3 s."""
FIRST_NS = 5_000_000_000
"""The stamp of the first frame: recorded seconds count from there."""


NO_BODY = -1
"""The number of the body that a press of the trigger took, where it took none."""


def assembly_with_trigger(positions, trigger, *, scene=None):
    """A recording of unit cubes at these x, and the session it is of; ``trigger``: of the right hand, 0 to 1."""
    stamps = FIRST_NS + np.arange(FRAMES) * STEP
    # A trigger of a left hand, of which there is no body, is pressed all the time.
    hands = {"p/right": HandTrack(stamps, trigger), "p/left": HandTrack(stamps, np.ones(FRAMES))}
    session = replace(unit_cubes_on_x(positions, first_ns=FIRST_NS, scene=scene), hands=hands)
    return assemble(session), session


def session_of_carried_cube():
    """X of hand and cube, and the trigger: the hand comes at 1 s, presses, carries the cube 0.5 m until 2 s, lets go.

    A third body, ``far``, rests at 9 m.
    """
    t = np.arange(FRAMES) * 0.01
    hand = np.where(t < 1.0, -3.0 + 2.0 * t, -1.0 + 0.5 * np.clip(t - 1.0, 0.0, 1.0))
    cube = 0.5 * np.clip(t - 1.0, 0.0, 1.0)
    trigger = ((t >= 1.0) & (t < 2.0)).astype(float)
    return {"hand-right": hand, "cube": cube, "far": np.full(FRAMES, 9.0)}, trigger


def grasped_names(assembly, session):
    """The body that each press of a trigger took, in order of time; ``None`` for a press that took none."""
    return [None if press.thing == NO_BODY else assembly.names[press.thing] for press in grasps(assembly, session)]


def test_body_moving_with_the_hand_under_trigger_is_grasped():
    """The right hand presses its trigger and carries a cube from 1.0 to 2.0 s: known to two frames of 10 ms."""
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    (grasp,) = grasps(assembly, session)
    assert assembly.names[grasp.thing] == "cube" and assembly.names[grasp.hand] == "hand-right"
    assert (grasp.start, grasp.end) == pytest.approx((1.0, 2.0), abs=0.02)


def test_grasps_are_unknown_without_a_trigger():
    """A cube moves along with a hand, but no trigger was recorded: whether it is grasped is unknown, None."""
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    assert grasps(assembly, replace(session, hands={})) is None


def test_press_until_the_end_lasts_to_the_last_frame():
    """A recording of 300 frames of 10 ms; the trigger is pressed from frame 100, at 1 s, and never let go.

    The last frame is at 2.99 s.
    """
    positions, _ = session_of_carried_cube()
    assembly, session = assembly_with_trigger(positions, (np.arange(FRAMES) >= 100).astype(float))
    (press,) = grasps(assembly, session)
    assert (press.start, press.end) == pytest.approx((1.0, 2.99))


def test_press_beside_a_resting_cube_takes_no_body():
    """The hand comes to a cube and moves on with its trigger pressed from 1 to 2 s; the cube stays."""
    positions, trigger = session_of_carried_cube()
    assert grasped_names(*assembly_with_trigger({**positions, "cube": np.zeros(FRAMES)}, trigger)) == [None]


def test_press_too_short_to_carry_takes_no_body():
    """The cube moves with the hand, but the trigger is pressed for 0.28 s, less than the 0.3 s of a grasp."""
    positions, _ = session_of_carried_cube()
    pressed_for_28_frames = np.isin(np.arange(FRAMES), range(110, 138)).astype(float)
    assert grasped_names(*assembly_with_trigger(positions, pressed_for_28_frames)) == [None]


def test_trembling_trigger_is_pressed_once():
    """A trigger that trembles between 0.45 and 0.58 counts as pressed still: it is released at 0.4, pressed at 0.6."""
    positions, trigger = session_of_carried_cube()
    trigger[120:180] = np.where(np.arange(60) % 2, 0.45, 0.58)
    assert grasped_names(*assembly_with_trigger(positions, trigger)) == ["cube"]


def test_nearest_of_several_carried_bodies_is_grasped():
    """A hand with its trigger pressed moves 0.5 m; three bodies move along with it, 3, 1 and 2 m from it."""
    positions, trigger = session_of_carried_cube()
    cube_1_m_away = positions["cube"]
    carried = {"tray": cube_1_m_away + 2.0, "cube": cube_1_m_away, "plate": cube_1_m_away + 1.0}
    recording = assembly_with_trigger({"hand-right": positions["hand-right"], **carried}, trigger)
    assert grasped_names(*recording) == ["cube"]


def test_body_beside_a_resting_hand_is_not_grasped():
    """The hand presses from 1.0 to 2.0 s and never moves; the cube comes to it until 0.5 s, and rests meanwhile."""
    _, trigger = session_of_carried_cube()
    positions = {"hand-right": np.full(FRAMES, -1.0), "cube": np.clip(1.0 - 0.02 * np.arange(FRAMES), 0.0, 1.0)}
    assert grasped_names(*assembly_with_trigger(positions, trigger)) == [None]


@pytest.mark.parametrize(
    ("start", "end", "presses"),
    [
        pytest.param(None, 0.9, 0, id="ends before"),
        pytest.param(None, 1.5, 1, id="ends within"),
        pytest.param(1.5, None, 1, id="starts within"),
        pytest.param(2.2, None, 0, id="starts after"),
    ],
)
def test_press_outside_the_requested_window_is_no_grasp(start, end, presses):
    """The trigger is pressed from 1.0 to 2.0 s; only seconds ``start`` to ``end`` of the recording are assembled."""
    _, session = assembly_with_trigger(*session_of_carried_cube())
    assert len(grasps(assemble(session, start=start, end=end), session)) == presses


def test_body_named_like_a_hand_is_a_hand():
    """ "hand-right" is the right hand by its name."""
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    assert {assembly.names[k]: side for k, side in hand_bodies(assembly, session).items()} == {"hand-right": "right"}


def test_bodies_tagged_as_hands_take_precedence_over_names():
    """The scene tags the body "far" as a hand; "hand-right" has only the name, and is none beside it."""
    scene = Scene(bodies=(SceneBody("far", tags=("hand",)), SceneBody("hand-right"), SceneBody("cube")))
    assembly, session = assembly_with_trigger(*session_of_carried_cube(), scene=scene)
    assert [assembly.names[k] for k in hand_bodies(assembly, session)] == ["far"]


def segment_of(pair, first, last):
    """First and last frame of a pair that is grasped, or in contact; of no times."""
    return Episode(pair, first, last, start=0.0, end=0.0)


def test_grasp_lasts_only_while_the_body_is_carried():
    """The hand carries the cube from 1.0 to 2.0 s, in frames 100 to 199; without a session nothing is known of it."""
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    (grasp,) = holdings(assembly, session)
    assert assembly.pair_name(grasp.pair) == "hand-right-cube"
    assert (grasp.first, grasp.last) == (100, 199)
    assert holdings(assembly, session=None) == ()


def test_contact_that_overlaps_a_grasp_belongs_to_it():
    """The hand carries the cube in frames 100 to 199; it touches it in frames 40 to 60, and 95 to 120."""
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    (grasp,) = holdings(assembly, session)
    before, during = segment_of(grasp.pair, first=40, last=60), segment_of(grasp.pair, first=95, last=120)
    assert holdings(assembly, session, contacts=(before, during)) == (grasp, during)


@pytest.mark.parametrize(
    ("pair", "first", "last", "overlaps"),
    [
        pytest.param(2, 0, 9, False, id="ends a frame before"),
        pytest.param(2, 0, 10, True, id="ends in its first frame"),
        pytest.param(2, 20, 30, True, id="begins in its last frame"),
        pytest.param(2, 21, 30, False, id="begins a frame after"),
        pytest.param(1, 0, 99, False, id="another pair"),
    ],
)
def test_interval_overlaps_a_grasp_if_they_share_a_frame(pair, first, last, overlaps):
    """Pair 2 is grasped in frames 10 to 20; the interval is of ``pair`` from frame ``first`` to ``last``."""
    grasp = segment_of(pair=2, first=10, last=20)
    answers = overlaps_holding((grasp,), np.array([pair]), np.array([first]), np.array([last]))
    assert answers.tolist() == [overlaps]


def test_contact_while_grasped_is_in_no_count():
    """True contacts are 1 (frames 1, 2), 2 (5, 6) and 3 (8); reports 1 (frame 1), 2 (3 to 5) and 3 (8).

    Grasped in frames 3 to 6 (G), contact 2 and report 2 are in no count, neither matched nor missed nor false: the
    others are matched. N: neither, B: both, M: missed, so that contact 1 is cut short.
    """
    oracle, subject = verdict_column(".CC..CC.C."), verdict_column(".C.CCC..C.")
    compared = compare(subject, oracle, holdings=(segment_of(pair=0, first=3, last=6),))
    initials = [Outcome(item).name[0] for item in compared.outcome[:, 0]]
    assert "".join(initials) == "NBMGGGGNBN"

    counts = count_contacts(compared, episodes(oracle))
    assert counts.numbers.tolist() == [1, 3]
    assert (counts.contacts, counts.missed, counts.late_or_cut_short) == (2, 0, 1)
    assert count_reports(compared).contacts == 2

    matches = match_episodes(compared, episodes(oracle), episodes(subject), counts)
    assert [(item.truth, item.reported) for item in matches.matched] == [(1, 1), (3, 3)]
    assert (matches.missed, matches.false_contacts) == ((), ())
    assert (matches.grasped_truth, matches.grasped_reports) == ((2,), (2,))
