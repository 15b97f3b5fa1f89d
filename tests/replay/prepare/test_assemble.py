import dataclasses
import gc
from weakref import ref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.small_worlds import along_x, cube, session_of_frames, unit_cubes_on_x

from cdcore import TriangleMesh
from replay.errors import AssemblyError
from replay.prepare import assemble as assembling
from replay.prepare.assemble import assemble
from replay.prepare.assembly import PoseOrigin
from sessions import Scene, Session, Status
from sessions.model.event import LiveContact
from sessions.model.scene import Pose, SceneBody

MILLISECOND_NS = 1_000_000


def test_motion_holds_bodies_with_a_mesh_and_names_the_others():
    """The glass is carried: the tracker's x of 3, 4, 5 plus its own 10, and an offset of 1 m upwards.

    The tracker has no mesh and is left out; "ghost" was not recorded; the bench is fixed and comes last.
    """
    start = 1_709_283_600_000_000_000
    bodies = (
        SceneBody("bench", fixed=Pose()),
        SceneBody("a", proxy=True),
        SceneBody("ghost"),
        SceneBody("glass", parent="tracker", offset=Pose((0.0, 1.0, 0.0))),
    )
    tracks = {"tracker": along_x([3, 4, 5]), "a": along_x([0, 1, 2]), "glass": along_x([10, 10, 10])}
    meshes = dict.fromkeys(("a", "glass", "bench"), cube())
    actual = assemble(
        Session.from_arrays(start + np.array([0, 11_111_111, 22_222_222]), tracks, meshes, Scene(bodies=bodies))
    )
    assert actual.motion.times.tolist() == [0.0, 0.011111111, 0.022222222]
    assert actual.stamp_ns.tolist() == [start, start + 11_111_111, start + 22_222_222]
    assert actual.names == ("a", "glass", "bench") and actual.pair_name(0) == "a-glass"
    assert actual.motion.translations[:, 0].tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert actual.motion.translations[:, 1].tolist() == [[13, 1, 0], [14, 1, 0], [15, 1, 0]]
    assert (actual.motion.rotations == np.eye(3)).all() and actual.origin[:, 2].tolist() == [PoseOrigin.FIXED] * 3
    assert (actual.left_out, actual.proxies) == (("tracker",), ("a",))
    assert actual.notes == ("body 'ghost' is declared in the scene but was not recorded",)


def test_path_is_known_without_gap_teleport_or_missing_pose():
    """Body 0 teleports in frame 2 and is lost in 7; steps of 31 ms are gaps, of 30 ms not.

    ``linked``: whether the motion from the frame before is known; frame 0 has none before.
    """
    steps = np.array([10, 10, 10, 30, 31, 10, 10, 10]) * MILLISECOND_NS
    stamps = np.concatenate([[0], np.cumsum(steps)])
    status = np.ones((9, 2))
    status[7, 0] = int(Status.LOST)
    position = np.zeros((9, 2, 3))
    position[2:, 0, 0] = 0.15  # 15 m/s, from rest: no hand does that
    position[:, 1, 2] = np.arange(9) * 0.01
    actual = assemble(session_of_frames(stamps, status, position))
    assert actual.motion.linked[:, 0].tolist() == [False, True, False, True, True, False, True, False, False]
    assert actual.motion.linked[:, 1].tolist() == [False, True, True, True, True, False, True, True, True]


def session_with_jump(status, stamps=None, **more):
    """Two slow bodies, of which the first jumps by half a metre to its sixth frame."""
    position = np.zeros((12, 2, 3))
    position[5:, 0, 0], position[:, 1, 2] = 0.5, 3.0 + 0.01 * np.arange(12)
    stamps = np.arange(12) * 10 if stamps is None else stamps
    return dataclasses.replace(
        session_of_frames(np.asarray(stamps) * MILLISECOND_NS, status, position, names=("a", "b")), **more
    )


ABSENT_BEFORE = np.ones((12, 2))
ABSENT_BEFORE[3:5, 0] = int(Status.ABSENT)


@pytest.mark.parametrize(
    ("session", "breaks"),
    [
        (session_with_jump(np.ones((12, 2))), [[5], []]),
        # All that the body carries jumps with it.
        (session_with_jump(np.ones((12, 2)), scene=Scene(bodies=(SceneBody("b", parent="a"),))), [[5], [5]]),
        # Poses interpolated across a jump lie on no known path.
        (session_with_jump(ABSENT_BEFORE), [[3, 4, 5], []]),
        # The frame of the jump is left out, for its stamp repeats the one before: so the way to the next is broken.
        (session_with_jump(np.ones((12, 2)), [0, 10, 20, 30, 40, 40, *range(50, 110, 10)]), [[5], []]),
    ],
)
def test_tracking_jump_unlinks_the_frames_across_the_jump(session, breaks):
    """Body a jumps from frame 4 to 5. A frame that is not linked has no known motion from the frame before."""
    linked = assemble(session).motion.linked
    assert [np.flatnonzero(~column)[1:].tolist() for column in linked.T] == breaks


def test_cut_leaves_interpolation_at_its_border_unchanged():
    """Frames 10 ms apart; the pose of frame 2, where the cut starts, is interpolated from frame 1."""
    status = np.ones((6, 2))
    status[2, 0] = int(Status.ABSENT)
    session = session_of_frames(np.arange(6) * 10 * MILLISECOND_NS, status)
    whole, cut = assemble(session), assemble(session, start=0.02, end=0.05)
    assert cut.first_ns == whole.first_ns == session.frames.stamp_ns[0]
    assert cut.motion.times.tolist() == [0.02, 0.03, 0.04, 0.05]
    assert cut.motion.translations.tolist() == whole.motion.translations[2:].tolist()
    assert cut.origin[0, 0] == PoseOrigin.INTERPOLATED


def partly_meshed(meshed, bare, positions):
    """A session of bodies with a mesh and of ``bare`` ones without, all at these two places on X."""
    tracks = {name: along_x(positions) for name in (*meshed, *(f"b{k}" for k in range(bare)))}
    return Session.from_arrays([0, 1], tracks, {name: cube() for name in meshed})


@pytest.mark.parametrize(
    ("session", "text"),
    [
        (session_of_frames(np.zeros(0), np.zeros((0, 1))), "no frames"),
        (
            partly_meshed([], bare=1, positions=[0, 1]),
            "no body has a mesh; there are tracks of: b0; import it again with --mesh",
        ),
        (partly_meshed("ab", bare=0, positions=[0, 0]), "a, b do not move against each other; name pairs"),
        (partly_meshed("a", bare=0, positions=[0, 1]), "no pair to replay: a is the only body"),
        (
            partly_meshed("a", bare=1, positions=[0, 1]),
            "b0 has no mesh, only a has one; import it again with --mesh BODY=FILE, or",
        ),
        (
            partly_meshed("ac", bare=25, positions=[0, 0]),
            "a, c do not move against each other; 25 bodies have no mesh; name pairs in",
        ),
        (
            unit_cubes_on_x({"a": [0, 0], "b": [1, 2]}, scene=Scene(ignore=(("a", "b"),))),
            "leaves no pair of bodies with a mesh",
        ),
    ],
)
def test_session_without_pairs_is_refused_with_the_reason(session, text):
    """Bodies with a letter have a mesh, b0 to b24 have none.

    Positions [0, 0] are two frames at rest, [0, 1] a move of 1 m.
    """
    with pytest.raises(AssemblyError, match=text):
        assemble(session)


@pytest.mark.parametrize(
    ("start", "end", "text"),
    [(5.0, 9.0, "between 5 and 9 s"), (None, -1.0, "between 0 and -1 s"), (0.2, None, "between 0.2 and 0.11 s")],
)
def test_window_without_frames_is_refused_with_its_ends(start, end, text):
    """12 frames at 100 Hz, the last at 0.11 s."""
    with pytest.raises(AssemblyError, match=f"no frame lies {text}; the session runs from 0 to 0.11"):
        assemble(unit_cubes_on_x({"a": [0] * 12, "b": range(12)}), start=start, end=end)


def test_body_that_is_always_lost_leaves_no_pair():
    """Two bodies, of which b is lost in all of the 12 frames."""
    status = np.ones((12, 2))
    status[:, 1] = int(Status.LOST)
    with pytest.raises(AssemblyError, match="no pair to replay: b has no pose that is not lost; `replay doctor` says"):
        assemble(session_of_frames(np.arange(12) * 10 * MILLISECOND_NS, status, np.zeros((12, 2, 3)), names=("a", "b")))


def test_fixed_pose_of_a_recorded_body_is_noted_as_unused():
    """The scene fixes b at z = 9 m; the recording moves it from 3 m on, by 0.01 m a frame, and that counts."""
    session = session_with_jump(np.ones((12, 2)), scene=Scene(bodies=(SceneBody("b", fixed=Pose((9.0, 9.0, 9.0))),)))
    assembly = assemble(session)
    assert assembly.names == ("a", "b")
    assert "the fixed pose of body 'b' is not used: the recording has poses of it" in assembly.notes
    assert assembly.motion.translations[:, 1, 2].tolist() == (3.0 + 0.01 * np.arange(12)).tolist()


def test_engine_reports_naming_unknown_bodies_are_noted():
    """Bodies are a and b, and three of four reports name 'B' or 'Bench'.

    Of more than MOST_UNKNOWN_NAMES unknown names the rest is a number; reports of known bodies are no note.
    """
    reports = (("a", "b"), ("a", "Bench"), ("b", "B"), ("b", "Bench"))
    contacts = tuple(LiveContact(0, first, second, "enter") for first, second in reports)
    notes = assemble(dataclasses.replace(session_with_jump(np.ones((12, 2))), live_contacts=contacts)).notes
    assert "compared with nothing, for no body is called 'B', 'Bench': 3 reports of the engine" in notes
    many = tuple(LiveContact(0, "a", f"x{k}", "enter") for k in range(assembling.MOST_UNKNOWN_NAMES + 2))
    (note,) = assembling.unknown_in_reports(
        dataclasses.replace(session_with_jump(np.ones((12, 2))), live_contacts=many)
    )
    assert f" and 2 more: {len(many)} reports of the engine" in note
    known = dataclasses.replace(session_with_jump(np.ones((12, 2))), live_contacts=contacts[:1])
    assert not any("compared with nothing" in note for note in assemble(known).notes)


@dataclasses.dataclass
class Blocks:
    """Frames that come in blocks of one size, whatever is asked for."""

    frames: object
    size: int

    @property
    def names(self):
        return self.frames.names

    def blocks(self, _):
        return self.frames.blocks(self.size)


def messy_session(seed, frames=60, bodies=3):
    """Missing, lost and held samples, a jittery clock that repeats and steps back, gaps and teleports, a child."""
    rng = np.random.default_rng(seed)
    step = rng.choice([-3, 0, 7, 11, 11, 11, 40, 90], size=frames) * MILLISECOND_NS + rng.integers(0, 3, size=frames)
    stamps = np.cumsum(step)
    status = rng.choice([*[Status.ABSENT] * 2, *[Status.VALID] * 4, Status.LOST, Status.HELD], size=(frames, bodies))
    status[0] = Status.VALID
    position = np.cumsum(rng.normal(size=(frames, bodies, 3)) * 0.1, axis=0)
    quaternion = Rotation.random(frames * bodies, rng=rng).as_quat().reshape(frames, bodies, 4)
    session = session_of_frames(stamps - stamps.min(), status, position, quaternion)
    scene = Scene(bodies=(SceneBody("b", parent="a", offset=Pose((0.1, 0.2, 0.3))), SceneBody("w", fixed=Pose())))
    return dataclasses.replace(session, scene=scene, meshes={**session.meshes, "w": cube()})


@given(st.integers(0, 10_000), st.integers(1, 13))
@settings(max_examples=6, deadline=None)
def test_the_size_of_blocks_changes_no_bit(seed, size):
    """A session with lost poses, gaps and jumps is read whole and in blocks of 1 to 13 frames."""
    session = messy_session(seed)
    whole, blocks = assemble(session), dataclasses.replace(session, source=Blocks(session.frames, size))
    cut = assemble(blocks)
    for name in ("times", "translations", "rotations", "valid", "linked"):
        assert getattr(cut.motion, name).tobytes() == getattr(whole.motion, name).tobytes(), name
    assert cut.origin.tobytes() == whole.origin.tobytes() and cut.notes == whole.notes


@pytest.mark.slow
def test_runs_of_a_session_use_the_same_meshes(monkeypatch):
    """Assembled twice, the bodies share their meshes; when the session and both are gone, so are the meshes."""
    monkeypatch.setattr(assembling, "TriangleMesh", TriangleMesh)  # tests share meshes between sessions and keep them
    session = unit_cubes_on_x({"a": [0.0, 0.1], "b": [3.0, 3.1]})
    first, again = (assemble(session).bodies for _ in range(2))
    assert all(item.mesh is other.mesh for item, other in zip(first, again, strict=True))
    kept = ref(first[0].mesh)
    del session, first, again
    gc.collect()
    assert kept() is None
