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
    """A beaker with ``fill`` mL pours beyond ``onset`` degrees, which was counted from slices of the finest mesh.

    Ten times as much does not fit into it.
    """
    cavity = made_instrument(name, 3000).cavity
    assert np.degrees(tilt_keeping(cavity, fill)) == pytest.approx(onset, abs=0.1)
    with pytest.raises(ValueError, match=f"a vessel of {1e6 * cavity.to_brim.volume:.1f} mL cannot keep"):
        tilt_keeping(cavity, 10 * fill)


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
    """Poses (rounded to 10 um) and planted contacts equal the snapshot; whoever changes them raises the version."""
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
    """Truth states from when to when a hand holds a body; the recorded trigger and poses agree with it."""
    assert recorded.facts("hold")
    for hold in recorded.facts("hold"):
        (hand,) = (body for body in hold.bodies if body.startswith("hand-"))
        (thing,) = set(hold.bodies) - {hand}
        trigger = recorded.session.hands[f"student/{hand.removeprefix('hand-')}"].trigger
        positions, _ = recorded.pose(thing)
        during = recorded.near(hold.start, hold.end - 1e-9)
        before = recorded.near(hold.start - 0.5, hold.start - 1e-9)
        assert trigger[during][1:-1].min() > RELEASE_LEVEL
        presses = np.flatnonzero((trigger[1:] > GRASP_LEVEL) & (trigger[:-1] <= GRASP_LEVEL)) + 1
        assert np.abs(recorded.times[presses] - hold.start).min() < THREE_FRAMES_S
        assert (np.diff(positions[before], axis=0) == 0.0).all(), "at rest in the half second before"
        in_the_hand = recorded.within(hand, positions)[during]
        np.testing.assert_allclose(in_the_hand, np.broadcast_to(in_the_hand[0], in_the_hand.shape), atol=1e-9)


@pytest.mark.slow
def test_scenes_declare_effects_and_their_text_makes_the_same_meshes(recorded):
    """At least four effects; of the meshes all but two hands and a headset are made again, with the same vertices."""
    kept = tomllib.loads(recorded.session.scene.text)
    assert len(kept["effect"]) >= 4
    # Hands and headset take seconds to make and are the same in every scene.
    bodies = tuple(body for body in recorded.session.scene.bodies if not body.instrument.startswith(("hand", "proxy")))
    again = scene_meshes(replace(recorded.session.scene, bodies=bodies))
    assert len(again) == len(recorded.session.meshes) - 3
    assert all((recorded.session.meshes[name].vertices == mesh.vertices).all() for name, mesh in again.items())


def test_session_has_requested_touches_and_near_misses():
    """Two touches, of 20 and 250 ms, and three near misses are requested."""
    session, truth = make_practice(touches=(0.02, 0.25), near=3, pseudonym="S09", seed=2, noise="off")
    lengths = [episode.nominal[1] - episode.nominal[0] for episode in truth.episodes if episode.kind == "contact"]
    assert np.allclose(lengths, [0.02, 0.25], atol=1e-6)
    assert len([fact for fact in truth.facts if fact.kind == "near_miss"]) == 3
    assert session.facts["pseudonym"] == "S09"
    assert all((hand.times_ns == session.frames.stamp_ns).all() for hand in session.hands.values())
    starts = [fact.start for fact in truth.facts if fact.kind in ("grasp", "release")]
    assert [event.name for event in session.events] == ["grasp", "release"]
    assert np.allclose(truth.seconds_of(np.array([event.time_ns for event in session.events])), starts)
