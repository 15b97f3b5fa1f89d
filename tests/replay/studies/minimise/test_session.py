from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.errors import AssemblyError
from replay.studies.minimise.session import EPOCH_NS, minimise
from replay.studies.synthetic_sessions import synthetic_session
from sessions import Event, GazeTrack, LiveContact, ScalarTrack, Session
from sessions.errors import SessionError
from sessions.geometry.rotations import quaternion_about, quaternion_product, rotated
from sessions.model.scene import Pose, Scene, SceneBody

COUNT = 40
STAMPS = 1_700_000_000 * 10**9 + np.arange(COUNT) * 11_000_000
FIXED = Pose((0.4, 0.1, 0.2), (0.0, 0.0, 0.0, 1.0))


def walk(angle=0.0, step=(0.0, 0.0, 0.0), stamps=STAMPS, scene=None):
    """Three bodies that walk about, a fixed table, all turned about the vertical and moved."""
    draw, turn = np.random.default_rng(4), quaternion_about((0.0, 1.0, 0.0), angle)
    poses = {}
    for name in ("headset", "hand-left", "beaker"):
        places = draw.normal(size=(COUNT, 3)) * (0.5, 0.1, 0.2) + (1.0, 1.4, 2.0)
        turns = draw.normal(size=(COUNT, 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        poses[name] = rotated(turn, places) + step, quaternion_product(turn, turns)
    table = Pose(tuple((rotated(turn, FIXED.position) + step).tolist()), tuple(turn.tolist()))
    scene = scene or Scene(bodies=(SceneBody("table", fixed=table),))
    made = Session.from_arrays(stamps, poses, {**cubes({"table": [0]}).meshes}, scene)
    gaze = GazeTrack(stamps[:1], poses["headset"][0][:1], rotated(turn, [[0.6, 0.0, 0.8]]))
    live = (LiveContact(int(stamps[1]), "hand-left", "beaker", "enter", tuple(poses["beaker"][0][1].tolist())),)
    return replace(made, gaze={"anna": gaze}, live_contacts=live)


def distances(session):
    places = session.frames.position
    return np.linalg.norm(places[:, :, None] - places[:, None], axis=3)


def test_nothing_of_the_place_and_the_time_is_left():
    one = minimise(walk()).session
    for angle, step in ((2.0, (30.0, 0.0, -8.0)), (-0.7, (0.0, 0.0, 5.0)), (3.1, (-100.0, 0.0, 0.0))):
        other = minimise(walk(angle, step, STAMPS - 10**17)).session
        assert other.frames.stamp_ns.tolist() == one.frames.stamp_ns.tolist()
        assert np.allclose(other.frames.position, one.frames.position, rtol=0, atol=1e-11)
        assert np.allclose(other.frames.quaternion_xyzw, one.frames.quaternion_xyzw, rtol=0, atol=1e-11) or np.allclose(
            np.abs((other.frames.quaternion_xyzw * one.frames.quaternion_xyzw).sum(axis=2)), 1.0
        )
        tables = [np.array(made.scene.body("table").fixed.position) for made in (one, other)]
        assert np.allclose(*tables, rtol=0, atol=1e-11)
        (first,), (second,) = one.gaze.values(), other.gaze.values()
        assert np.allclose(first.origins, second.origins) and np.allclose(first.directions, second.directions)
        assert np.allclose(one.live_contacts[0].point, other.live_contacts[0].point)
    assert one.frames.stamp_ns[0] == one.frames.log_ns[0] == EPOCH_NS and abs(one.frames.position.mean()) < 1
    assert np.allclose(one.frames.position[..., [0, 2]].mean(axis=(0, 1)), 0.0)
    assert np.allclose(distances(one), distances(walk()), rtol=0, atol=1e-12)
    assert np.array_equal(one.frames.position[..., 1], walk().frames.position[..., 1])


def test_what_is_kept_keeps_its_bits():
    before = walk()
    made = minimise(before, keep=["place"]).session
    assert made.frames.position.tobytes() == before.frames.position.tobytes()
    assert made.frames.quaternion_xyzw.tobytes() == before.frames.quaternion_xyzw.tobytes()
    assert np.array_equal(np.diff(made.frames.stamp_ns), np.diff(before.frames.stamp_ns))
    assert np.array_equal(minimise(before, keep=["time"]).session.frames.stamp_ns, STAMPS)


def test_the_height_of_a_body_shows_only_against_others():
    low, high = (minimise(walk(step=(0.0, up, 0.0)), drop=["height"]).session for up in (0.0, 0.3))
    assert np.allclose(low.frames.position, high.frames.position) and abs(low.frames.position[..., 1].mean()) < 1e-12
    assert np.allclose(distances(low), distances(walk()))


def test_the_head_goes_with_its_gaze_and_its_pairs():
    scene = Scene(
        bodies=(SceneBody("headset"), SceneBody("hand-left"), SceneBody("beaker")),
        pairs=(("headset", "beaker"), ("hand-left", "beaker")),
    )  # fmt: skip
    made = minimise(walk(scene=scene), drop=["head"])
    assert made.session.names == ("hand-left", "beaker") == tuple(body.id for body in made.session.scene.bodies)
    assert not made.session.gaze and made.session.scene.pairs == (("hand-left", "beaker"),)
    assert "head: 1 dropped" in made.done and "head: as recorded" in minimise(walk()).done
    assert "head: no body is tagged as one" in minimise(made.session, drop=["head"]).done
    hangs = Scene(bodies=(SceneBody("headset"), SceneBody("beaker", parent="headset")))
    with pytest.raises(AssemblyError, match="the head carries 1 other of the bodies"):
        minimise(walk(scene=hangs), drop=["head"])


def test_a_joint_stays_where_it_is_on_its_parent():
    scene = Scene(bodies=(SceneBody("hand-left"), SceneBody("beaker", parent="hand-left")))
    before = walk(scene=scene)
    made = minimise(before).session
    assert np.array_equal(made.frames.position[:, 2], before.frames.position[:, 2])
    assert not np.allclose(made.frames.position[:, 1], before.frames.position[:, 1])


def test_a_clock_of_its_own_is_refused():
    late = replace(walk(), events=(Event(5, "start"),))
    with pytest.raises(SessionError, match="more than a day from the first frame"):
        minimise(late)
    assert minimise(late, keep=["time"]).session.events[0].time_ns == 5


def test_what_is_still_in_it_is_said():
    before = replace(walk(), scalars={"heart rate": ScalarTrack(STAMPS[:2], [70.0, 71.0], "bpm")})
    assert minimise(before).done[-1] == "still in it: gaze of 1, 1 other numbers over time"
    assert minimise(before).done[2:4] == ("height: as recorded", "head: as recorded")
    assert minimise(before, keep=["time", "place"]).done[:2] == ("time: as recorded", "place: as recorded")


def test_of_a_made_up_recording_the_maker_and_its_seed_stay_and_no_other_words_of_that_name():
    session, _ = synthetic_session("fast-ball", 7)
    assert {"synthetic": "fast-ball", "seed": "7"}.items() <= minimise(session).session.facts.items()
    for facts in (
        {"synthetic": "anna", "seed": "1984"},
        {"seed": "1984"},
        {"synthetic": "fast-ball", "seed": "anna 7"},
    ):
        kept = minimise(replace(session, facts=facts)).session.facts
        assert "seed" not in kept and kept.get("synthetic") in (None, "fast-ball")
