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
FRAMES = 300
FIRST_NS = 5_000_000_000
"""The stamp of the first frame: recorded seconds count from there."""


def assembly_with_trigger(positions, trigger, *, scene=None):
    """A recording of cubes by a right hand with this trigger."""
    stamps = FIRST_NS + np.arange(FRAMES) * STEP
    # A trigger of a left hand, of which there is no body, is pressed all the time.
    hands = {"p/right": HandTrack(stamps, trigger), "p/left": HandTrack(stamps, np.ones(FRAMES))}
    session = replace(unit_cubes_on_x(positions, first_ns=FIRST_NS, scene=scene), hands=hands)
    return assemble(session), session


def session_of_carried_cube():
    """The hand comes to the cube at 1 s, presses, carries it 0.5 m until 2 s and lets go."""
    t = np.arange(FRAMES) * 0.01
    hand = np.where(t < 1.0, -3.0 + 2.0 * t, -1.0 + 0.5 * np.clip(t - 1.0, 0.0, 1.0))
    cube = 0.5 * np.clip(t - 1.0, 0.0, 1.0)
    trigger = ((t >= 1.0) & (t < 2.0)).astype(float)
    return {"hand-right": hand, "cube": cube, "far": np.full(FRAMES, 9.0)}, trigger


def test_body_moving_with_the_hand_under_trigger_is_grasped():
    """The cube is carried from 1.0 to 2.0 s."""
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    (item,) = grasps(assembly, session)
    assert assembly.names[item.thing] == "cube" and assembly.names[item.hand] == "hand-right"
    assert (item.start, item.end) == pytest.approx((1.0, 2.0), abs=0.02)
    assert grasps(assembly, replace(session, hands={})) is None, "without a trigger nobody knows"


def test_press_until_the_end_lasts_to_the_last_frame():
    """The trigger is pressed from frame 100, at 1 s, and never let go."""
    positions, _ = session_of_carried_cube()
    assembly, session = assembly_with_trigger(positions, (np.arange(FRAMES) >= 100).astype(float))
    (press,) = grasps(assembly, session)
    assert (press.start, press.end) == pytest.approx((1.0, (FRAMES - 1) * STEP / 1e9))


def test_an_empty_press_is_an_attempt_and_trembling_presses_once():
    """Nothing is in reach, or the trigger is held too briefly to carry; both name no body.

    A trigger that trembles between 0.45 and 0.58, above the 0.4 at which it counts as released, is pressed once.
    """
    positions, trigger = session_of_carried_cube()
    still = {**positions, "cube": np.zeros(FRAMES)}
    shorter_than_a_grasp = np.isin(np.arange(FRAMES), range(110, 138)).astype(float)  # 0.28 s
    for world_ in (assembly_with_trigger(still, trigger), assembly_with_trigger(positions, shorter_than_a_grasp)):
        assert [item.thing for item in grasps(*world_)] == [-1]  # no body
    trigger[120:180] = np.where(np.arange(60) % 2, 0.45, 0.58)  # about the middle, never below 0.4: no release
    assert len(grasps(*assembly_with_trigger(positions, trigger))) == 1


def test_nearest_of_several_carried_bodies_is_grasped():
    """Three bodies are carried, 3, 1 and 2 m from the hand."""
    positions, trigger = session_of_carried_cube()
    carried = {"tray": positions["cube"] + 2.0, "cube": positions["cube"], "plate": positions["cube"] + 1.0}
    assembly, session = assembly_with_trigger({"hand-right": positions["hand-right"], **carried}, trigger)
    assert [assembly.names[item.thing] for item in grasps(assembly, session)] == ["cube"]


def test_body_beside_a_resting_hand_is_not_grasped():
    """The hand presses from 1.0 to 2.0 s and never moves; the cube rests meanwhile and moves before."""
    _, trigger = session_of_carried_cube()
    positions = {"hand-right": np.full(FRAMES, -1.0), "cube": np.clip(1.0 - 0.02 * np.arange(FRAMES), 0.0, 1.0)}
    assert [item.thing for item in grasps(*assembly_with_trigger(positions, trigger))] == [-1]


@pytest.mark.parametrize(("start", "end", "count"), [(None, 0.9, 0), (None, 1.5, 1), (1.5, None, 1), (2.2, None, 0)])
def test_press_outside_the_requested_window_is_no_grasp(start, end, count):
    """The trigger is pressed from 1.0 to 2.0 s."""
    _, session = assembly_with_trigger(*session_of_carried_cube())
    assert len(grasps(assemble(session, start=start, end=end), session)) == count


def test_bodies_tagged_as_hands_take_precedence_over_names():
    """The body "far" has the tag, "hand-right" only the name, which counts where nothing is tagged."""
    positions, trigger = session_of_carried_cube()
    assembly, session = assembly_with_trigger(positions, trigger)
    assert {assembly.names[k]: side for k, side in hand_bodies(assembly, session).items()} == {"hand-right": "right"}
    scene = Scene(bodies=(SceneBody("far", tags=("hand",)), SceneBody("hand-right"), SceneBody("cube")))
    assembly, session = assembly_with_trigger(positions, trigger, scene=scene)
    assert [assembly.names[k] for k in hand_bodies(assembly, session)] == ["far"]


def grasp_episode(pair, first, last):
    """Episode of a grasp: its pair, first and last frame."""
    return Episode(pair, first, last, start=0.0, end=0.0)


def test_grasp_lasts_only_while_the_body_is_carried():
    """The hand carries the cube in frames 100 to 199; it touches in frames 40 to 60 and 95 to 120.

    The second touch overlaps the grasp and belongs to it; without a session nothing is grasped.
    """
    assembly, session = assembly_with_trigger(*session_of_carried_cube())
    ((pair, first, last),) = [(item.pair, item.first, item.last) for item in holdings(assembly, session)]
    assert assembly.pair_name(pair) == "hand-right-cube" and (first, last) == (100, 199)
    before, during = grasp_episode(pair, first=40, last=60), grasp_episode(pair, first=95, last=120)
    assert [item for item in holdings(assembly, session, (before, during)) if item.first < 100] == [during]
    assert holdings(assembly, session=None) == ()


def test_interval_overlaps_a_grasp_if_they_share_a_frame():
    """Pair 2 is grasped in frames 10 to 20; each row is (pair, first, last)."""
    item = (grasp_episode(pair=2, first=10, last=20),)
    requested = np.array([(2, 0, 9), (2, 0, 10), (2, 20, 30), (2, 21, 30), (1, 0, 99)]).T
    assert overlaps_holding(item, *requested).tolist() == [False, True, True, False, False]


def test_contact_while_grasped_is_in_no_count():
    """True contacts are 1 (frames 1, 2), 2 (5, 6) and 3 (8); reports 1 (frame 1), 2 (3 to 5) and 3 (8).

    Grasped in frames 3 to 6 (G), contact 2 and report 2 are in no count. N: neither, B: both, M: missed.
    """
    oracle, subject = verdict_column(".CC..CC.C."), verdict_column(".C.CCC..C.")
    compared = compare(subject, oracle, holdings=(grasp_episode(pair=0, first=3, last=6),))
    assert [Outcome(item).name[0] for item in compared.outcome[:, 0]] == list("NBMGGGGNBN")
    counts = count_contacts(compared, episodes(oracle))
    assert (counts.contacts, counts.missed, counts.late_or_cut_short, counts.numbers.tolist()) == (2, 0, 1, [1, 3])
    assert count_reports(compared).contacts == 2
    matches = match_episodes(compared, episodes(oracle), episodes(subject), counts)
    assert (matches.grasped_truth, matches.missed, matches.false_contacts) == ((2,), (), ())
    assert [(item.truth, item.reported) for item in matches.matched] == [
        (1, 1),
        (3, 3),
    ] and matches.grasped_reports == (2,)
