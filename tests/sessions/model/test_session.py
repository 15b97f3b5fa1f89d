from dataclasses import replace

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
    """Tracks a and b have random stamps of their own; frames are at the stamps of either, and give the tracks back.

    Half of the poses of a are lost.
    """
    valid = np.random.default_rng(seed).random(len(first)) < 0.5
    tracks = {"a": track_of(first, seed=1, valid=valid), "b": track_of(second, seed=2)}
    session = Session.from_tracks(tracks)
    assert session.frames.stamp_ns.tolist() == sorted({*first, *second})
    for name, track in tracks.items():
        for field in ("times_ns", "positions", "quaternions_xyzw", "valid"):
            assert getattr(session.tracks[name], field).tobytes() == getattr(track, field).tobytes(), (name, field)


def test_body_without_sample_in_a_frame_is_absent():
    """Samples of a at 1 and 3 ns, of b at 2 and 3 ns: frames at 1, 2 and 3 ns.

    Where a body has no sample its status is absent, its position nan, and the stamp of its sample 0.
    """
    frames = Session.from_tracks({"a": track_of([1, 3]), "b": track_of([2, 3])}).frames
    absent, valid = Status.ABSENT, Status.VALID
    assert frames.status.tolist() == [[valid, absent], [absent, valid], [valid, valid]]
    is_absent = frames.status == absent
    assert np.isnan(frames.position[is_absent]).all()
    assert (frames.sample_ns[is_absent] == 0).all()


def test_no_body_is_a_session():
    """A session without stamps and poses has no name, no frame, no track and no block of frames."""
    session = Session.from_arrays([], {})
    assert session.names == ()
    assert len(session.frames) == 0
    assert session.tracks == {}
    assert list(session.blocks()) == []


def test_frames_are_loaded_once_and_blocks_then_come_from_memory():
    """A source counts how often its frames are read: by the blocks before they are loaded, and by loading them.

    Blocks after that come from memory.
    """

    class CountingSource:
        names = ("body 0", "body 1", "body 2")
        reads = 0

        def blocks(self, length):
            self.reads += 1
            yield from random_frames(seed=3).blocks(length)

    source, expected = CountingSource(), random_frames(seed=3)
    session = Session(source, {})
    assert_same_frames(Frames.join(list(session.blocks(7))), expected)
    assert source.reads == 1
    assert_same_frames(session.frames, expected)
    assert source.reads == 2
    assert_same_frames(Frames.join(list(session.blocks(7))), expected)
    assert source.reads == 2


def test_repeated_device_stamp_keeps_the_first_sample():
    """The device of a body stamps its samples in four frames with 10, 10, 30 and 20 ns.

    The body's track has the samples of frames 0, 3 and 2, in order of time. Frame 1 repeats the stamp of frame 0 and is
    left out: its sample says that the body is lost, the other that it is valid.
    """
    random = random_frames(seed=3, count=4, bodies=1)
    sample_ns = np.array([[10], [10], [30], [20]])
    status = np.array([[Status.VALID], [Status.LOST], [Status.VALID], [Status.HELD]], dtype=np.uint8)
    frames = replace(random, sample_ns=sample_ns, status=status)
    track = session_of(frames).tracks["body 0"]
    assert track.times_ns.tolist() == [10, 20, 30]
    assert track.valid.tolist() == [True, True, True]
    assert np.array_equal(track.positions, random.position[[0, 3, 2], 0])


def test_the_frames_between_two_stamps_know_where_they_stood():
    """Frames are at 1, 3, 4 and 9 ns; those from 3 to 4 ns have the numbers 1 and 2, and know the first stamp, 1 ns."""
    session = Session.from_tracks({"a": track_of([1, 3, 4, 9])})
    piece = session.between(3, 4)
    assert piece.frames.stamp_ns.tolist() == [3, 4]
    assert piece.segment.first_ns == 1
    assert piece.segment.numbers.tolist() == [1, 2]


def test_pairs_are_all_but_those_in_groups_and_ignored():
    """Bodies a, b, c and d are recorded; a and b are a group, and the pair of d and a is ignored."""
    bodies = (SceneBody("a", group="g"), SceneBody("b", group="g"), SceneBody("c"))
    scene = Scene(bodies=bodies, ignore=(("d", "a"),))
    assert candidate_pairs(scene, names="abcd") == [("a", "c"), ("b", "c"), ("b", "d"), ("c", "d")]


def test_declared_pairs_exclude_all_others():
    """A scene declares the pairs (d, a) and (a, x), and x is not recorded: only d and a are tested for contact."""
    assert candidate_pairs(Scene(pairs=(("d", "a"), ("a", "x"))), names="abcd") == [("d", "a")]


def test_bodies_counted_as_one_thing_are_no_pair():
    """Fingers a and b are one hand, c and d one tray: pairs are those between hand and tray."""
    groups = (SceneGroup("hand", ("a", "b")), SceneGroup("tray", ("c", "d")))
    assert candidate_pairs(Scene(groups=groups), names="abcd") == [("a", "c"), ("a", "d"), ("b", "c"), ("b", "d")]


def test_absent_bodies_are_those_of_declared_pairs_alone():
    """Recorded are a and b; a scene without pairs lacks none, a scene with pairs of x and y lacks these."""
    assert absent_bodies(Scene(), names="ab") == []
    assert absent_bodies(Scene(pairs=(("a", "x"), ("x", "y"), ("a", "b"))), names="ab") == ["x", "y"]
