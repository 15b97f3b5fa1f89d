import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.session_files import assert_same_frames, random_frames, session_of

from sessions.model.scene import Scene, SceneBody, SceneGroup, absent_bodies, candidate_pairs
from sessions.model.session import Frames, Session, Status, Track

POSES = (np.zeros((2, 3)), np.ones((2, 4)))


def track_of(times, seed=0, valid=None):
    """A track of random poses at these times."""
    rng = np.random.default_rng(seed)
    return Track(times, rng.normal(size=(len(times), 3)), rng.normal(size=(len(times), 4)), valid)


stamps = st.sets(st.integers(-50, 50), max_size=12).map(sorted)


@given(stamps, stamps, st.integers(0, 9))
def test_tracks_survive_the_frames_they_are_laid_into(first, second, seed):
    """Two tracks have stamps of their own; frames are at the stamps of either."""
    valid = np.random.default_rng(seed).random(len(first)) < 0.5
    tracks = {"a": track_of(first, seed=1, valid=valid), "b": track_of(second, seed=2)}
    session = Session.from_tracks(tracks)
    assert session.frames.stamp_ns.tolist() == sorted({*first, *second})
    for name, track in tracks.items():
        for field in ("times_ns", "positions", "quaternions_xyzw", "valid"):
            assert getattr(session.tracks[name], field).tobytes() == getattr(track, field).tobytes()


def test_body_without_sample_in_a_frame_is_absent():
    """Samples of a at 1 and 3 ns, of b at 2 and 3 ns: frames at 1, 2 and 3 ns."""
    frames = Session.from_tracks({"a": track_of([1, 3]), "b": track_of([2, 3])}).frames
    assert frames.status.tolist() == [[1, 0], [0, 1], [1, 1]]
    gone = frames.status == Status.ABSENT
    assert np.isnan(frames.position[gone]).all() and (frames.sample_ns[gone] == 0).all()


def test_no_body_is_a_session():
    """No stamps and no poses: no name, no frame, no track, no block."""
    session = Session.from_arrays([], {})
    assert session.names == () and len(session.frames) == 0 and session.tracks == {} and list(session.blocks()) == []


def test_frames_are_loaded_once_and_blocks_then_come_from_memory():
    """Blocks before the frames are loaded read the source, then the frames do; blocks after that do not."""

    class Counted:
        names, requested = ("body 0", "body 1", "body 2"), 0

        def blocks(self, length):
            Counted.requested += 1
            yield from random_frames(seed=3).blocks(length)

    session = Session(Counted(), {})
    assert_same_frames(Frames.join(list(session.blocks(7))), random_frames(seed=3))
    assert_same_frames(session.frames, random_frames(seed=3))
    assert_same_frames(Frames.join(list(session.blocks(7))), random_frames(seed=3))
    assert Counted.requested == 2


def test_repeated_device_stamp_keeps_the_first_sample():
    """Samples of 10, 10, 30 and 20 ns in four frames: the track has those of frames 0, 3 and 2, in order of time."""
    frames = random_frames(seed=3, count=4, bodies=1)
    twice = Frames(frames.names, frames.stamp_ns, frames.log_ns, np.array([[10], [10], [30], [20]]), frames.position,
                   frames.quaternion_xyzw, np.array([[1], [2], [1], [3]], dtype=np.uint8))  # fmt: skip
    track = session_of(twice).tracks["body 0"]
    assert track.times_ns.tolist() == [10, 20, 30] and track.valid.tolist() == [True, True, True]
    assert np.array_equal(track.positions, frames.position[[0, 3, 2], 0])


def test_the_frames_between_two_stamps_know_where_they_stood():
    """Frames from 3 to 4 ns, out of those at 1, 3, 4 and 9 ns, have the numbers 1 and 2; the first stamp is 1 ns."""
    session = Session.from_tracks({"a": track_of([1, 3, 4, 9])})
    piece = session.between(3, 4)
    assert piece.frames.stamp_ns.tolist() == [3, 4]
    assert (piece.segment.first_ns, piece.segment.numbers.tolist()) == (1, [1, 2])


def test_pairs_are_declared_or_all_outside_groups_and_ignores():
    """Bodies a and b are a group, and the pair of d and a is ignored.

    Declared pairs are all there are, without absent bodies.
    """
    bodies = (SceneBody("a", group="g"), SceneBody("b", group="g"), SceneBody("c"))
    scene = Scene(bodies=bodies, ignore=(("d", "a"),))
    assert candidate_pairs(scene, "abcd") == [("a", "c"), ("b", "c"), ("b", "d"), ("c", "d")]
    assert candidate_pairs(Scene(pairs=(("d", "a"), ("a", "x"))), "abcd") == [("d", "a")]


def test_bodies_counted_as_one_thing_are_no_pair():
    """Fingers a and b are one hand, c and d one tray: pairs are those between hand and tray."""
    groups = (SceneGroup("hand", ("a", "b")), SceneGroup("tray", ("c", "d")))
    assert candidate_pairs(Scene(groups=groups), "abcd") == [("a", "c"), ("a", "d"), ("b", "c"), ("b", "d")]


def test_absent_bodies_are_those_of_declared_pairs_alone():
    """Recorded are a and b; x and y stand in declared pairs only."""
    assert absent_bodies(Scene(), "ab") == []
    assert absent_bodies(Scene(pairs=(("a", "x"), ("x", "y"), ("a", "b"))), "ab") == ["x", "y"]
