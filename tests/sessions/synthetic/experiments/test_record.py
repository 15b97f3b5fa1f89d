import hashlib
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from sessions.glassware.catalogue import made_instrument
from sessions.scene_files.scene_meshes import scene_meshes
from sessions.synthetic.experiments.pouring import tilt_keeping
from sessions.synthetic.experiments.practice import make_practice
from sessions.synthetic.scenes import SCENES


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("name", "fill", "onset"), [("beaker_50", 40, 48.7), ("beaker_100", 80, 40.2), ("beaker_250", 120, 57.1)]
)
def test_tilt_at_which_a_beaker_starts_to_pour(name, fill, onset):
    """A beaker with ``fill`` mL pours beyond ``onset`` degrees, which were counted once from slices of its mesh."""
    cavity = made_instrument(name, 3000).cavity
    assert np.degrees(tilt_keeping(cavity, fill)) == pytest.approx(onset, abs=0.1)


def test_tilt_of_a_beaker_that_is_too_full_is_refused():
    """400 mL do not fit into a beaker for 50 mL; its volume to the brim is named."""
    cavity = made_instrument("beaker_50", 3000).cavity
    with pytest.raises(ValueError, match=f"a vessel of {1e6 * cavity.to_brim.volume:.1f} mL cannot keep"):
        tilt_keeping(cavity, 400)


EXPERIMENTS = [name for name in SCENES if name != "bench-bumps"]
GRASP_LEVEL, RELEASE_LEVEL = 0.6, 0.4
"""A hand takes hold when its trigger, from 0 to 1, rises above the first, and lets go when it falls below the other."""
THREE_FRAMES_S = 0.03


@pytest.fixture(params=EXPERIMENTS)
def recorded(request, made):
    """Each experiment, recorded without noise, and its truth."""
    return made(request.param)


@pytest.mark.parametrize(
    ("name", "noise"),
    [
        *((name, "off") for name in (*SCENES, "ball-plate", "fast-ball")),
        *((name, "vive") for name in (SCENES[0], "ball-in-box", "crowded-lab")),
    ],
)
def test_recorded_poses_and_truth_of_made_up_sessions_stay_unchanged(name, noise, made, snapshot):
    """Poses (their digest, rounded to 10 um), planted contacts and facts of a made-up session equal the snapshot.

    Other tests say that they are right, this one notices changes: whoever makes one raises the version, "choreography"
    among the facts of the session.
    """
    run = made(name, noise)
    frames = run.session.frames
    pieces = (
        frames.stamp_ns,
        frames.status,
        *(np.round(v, 5) + 0.0 for v in (frames.position, frames.quaternion_xyzw)),
    )
    digest = hashlib.sha256(b"".join(map(bytes, pieces))).hexdigest()[:16]
    facts = []
    for fact in run.truth.facts:
        values = [f"{key} {v:.4g}" if isinstance(v, float) else f"{key} {v}" for key, v in fact.values.items()]
        bodies = f"{fact.kind} of {', '.join(fact.bodies)} from {fact.start:.3f} to {fact.end:.3f} s: "
        facts.append(bodies + ", ".join(values))
    episodes = []
    for item in run.truth.episodes:
        spans = (item.nominal, item.surely, item.possibly)
        times = [f"{span[0]:.3f}-{span[1]:.3f}" if span else "never" for span in spans]
        episodes.append(f"{item.kind} of {', '.join(item.pair)}: {', '.join(times)} {item.note}")
    assert [run.session.facts.get("choreography"), digest, *facts, *episodes] == snapshot


@pytest.mark.sampled(3)
def test_grasped_body_moves_from_press_until_release(recorded):
    """The truth of an experiment states from when to when a hand has hold of a body; the recording agrees with it.

    Within three frames of the start the hand's trigger rises above GRASP_LEVEL, and it stays above RELEASE_LEVEL; the
    body rests for half a second before, and does not move in the hand until the end.
    """
    assert recorded.facts("hold")
    for hold in recorded.facts("hold"):
        (hand,) = (body for body in hold.bodies if body.startswith("hand-"))
        (thing,) = {*hold.bodies} - {hand}
        trigger = recorded.session.hands[f"student/{hand.removeprefix('hand-')}"].trigger
        rises = np.flatnonzero((trigger[1:] > GRASP_LEVEL) & (trigger[:-1] <= GRASP_LEVEL)) + 1
        assert np.abs(recorded.times[rises] - hold.start).min() < THREE_FRAMES_S
        just_before_the_end = hold.end - 1e-9
        during = recorded.near(hold.start, just_before_the_end)
        _first, *triggers_between, _last = trigger[during]
        assert min(triggers_between) > RELEASE_LEVEL

        positions, _rotations = recorded.pose(thing)
        before = recorded.near(hold.start - 0.5, hold.start - 1e-9)
        assert (np.diff(positions[before], axis=0) == 0.0).all()
        positions_in_hand = recorded.within(hand, positions)[during]
        first_position = positions_in_hand[0]
        np.testing.assert_allclose(positions_in_hand - first_position, 0.0, atol=1e-9)


@pytest.mark.slow
def test_scenes_declare_effects_and_their_text_makes_the_same_meshes(recorded):
    """The scene of each experiment declares at least four effects, such as a pour.

    Its text, read again, makes the meshes of all bodies but two hands and a headset, which take seconds to make and are
    the same in every scene: with the same vertices as recorded.
    """
    assert len(tomllib.loads(recorded.session.scene.text)["effect"]) >= 4
    bodies = tuple(body for body in recorded.session.scene.bodies if not body.instrument.startswith(("hand", "proxy")))
    meshes = scene_meshes(replace(recorded.session.scene, bodies=bodies))
    hands_and_headset = 3
    assert len(meshes) == len(recorded.session.meshes) - hands_and_headset
    for name, mesh in meshes.items():
        assert np.array_equal(recorded.session.meshes[name].vertices, mesh.vertices), name


@pytest.fixture(scope="module")
def practice():
    """A made-up session and its truth: two touches, of 20 and 250 ms, and three near misses are requested."""
    return make_practice(touches=(0.02, 0.25), near=3, pseudonym="S09", seed=2, noise="off")


def test_session_has_requested_touches_and_near_misses(practice):
    """Two touches, of 20 and 250 ms, and three near misses were requested: planted contacts last so long, to 1 us."""
    session, truth = practice
    assert session.facts["pseudonym"] == "S09"
    contacts = [episode.nominal for episode in truth.episodes if episode.kind == "contact"]
    assert np.allclose([end - start for start, end in contacts], [0.02, 0.25], atol=1e-6)
    assert len([fact for fact in truth.facts if fact.kind == "near_miss"]) == 3


def test_events_of_a_practice_are_its_grasp_and_release(practice):
    """Events of the session are at the times that its truth says; hands have a sample in every frame."""
    session, truth = practice
    assert [event.name for event in session.events] == ["grasp", "release"]
    planted_seconds = [fact.start for fact in truth.facts if fact.kind in ("grasp", "release")]
    event_seconds = truth.seconds_of(np.array([event.time_ns for event in session.events]))
    assert np.allclose(event_seconds, planted_seconds)
    assert session.hands
    for hand in session.hands.values():
        assert (hand.times_ns == session.frames.stamp_ns).all()
