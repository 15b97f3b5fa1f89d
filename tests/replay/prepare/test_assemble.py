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
    """Three frames of 1/90 s. A glass is carried: the tracker's x of 3, 4, 5 m plus its own 10, an offset of 1 m up.

    The tracker has no mesh and is left out; a has a stand-in for a mesh (``proxy``); "ghost" was not recorded, which is
    noted; the bench is fixed and comes last.
    """
    start, frame_ns = 1_709_283_600_000_000_000, 11_111_111
    bodies = (
        SceneBody("bench", fixed=Pose()),
        SceneBody("a", proxy=True),
        SceneBody("ghost"),
        SceneBody("glass", parent="tracker", offset=Pose((0.0, 1.0, 0.0))),
    )
    tracks = {"tracker": along_x([3, 4, 5]), "a": along_x([0, 1, 2]), "glass": along_x([10, 10, 10])}
    meshes = dict.fromkeys(("a", "glass", "bench"), cube())
    stamps = start + np.array([0, frame_ns, 2 * frame_ns])
    actual = assemble(Session.from_arrays(stamps, tracks, meshes, Scene(bodies=bodies)))
    assert actual.motion.times.tolist() == [0.0, 0.011111111, 0.022222222]
    assert actual.stamp_ns.tolist() == stamps.tolist()

    assert actual.names == ("a", "glass", "bench") and actual.pair_name(0) == "a-glass"
    a, glass, bench = 0, 1, 2
    assert actual.motion.translations[:, a].tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert actual.motion.translations[:, glass].tolist() == [[13, 1, 0], [14, 1, 0], [15, 1, 0]]
    assert (actual.motion.rotations == np.eye(3)).all()
    assert actual.origin[:, bench].tolist() == [PoseOrigin.FIXED] * 3

    assert actual.left_out == ("tracker",)
    assert actual.proxies == ("a",)
    assert actual.notes == ("body 'ghost' is declared in the scene but was not recorded",)


def test_path_is_known_without_gap_teleport_or_missing_pose():
    """Nine frames; the steps to frames 4 and 5 take 30 and 31 ms, of which only the second is a gap.

    Body 0 teleports to frame 2 and is lost in frame 7. ``linked``: whether the motion from the frame before is known;
    frame 0 has none before, and after a lost frame it is unknown too.
    """
    steps = np.array([10, 10, 10, 30, 31, 10, 10, 10]) * MILLISECOND_NS
    stamps = np.concatenate([[0], np.cumsum(steps)])
    status = np.ones((9, 2))
    status[7, 0] = int(Status.LOST)
    position = np.zeros((9, 2, 3))
    position[2:, 0, 0] = 0.15  # 15 m/s, from rest: no hand does that
    position[:, 1, 2] = np.arange(9) * 0.01
    linked = assemble(session_of_frames(stamps, status, position)).motion.linked
    assert np.flatnonzero(~linked[:, 0]).tolist() == [0, 2, 5, 7, 8]
    assert np.flatnonzero(~linked[:, 1]).tolist() == [0, 5]


ALL_VALID = np.ones((12, 2))
"""The status of 12 frames of two bodies: every sample is valid."""


def session_with_jump(status=ALL_VALID, milliseconds=None, **more):
    """12 frames of two bodies, 10 ms apart: a rests but for a jump of half a metre in x from frame 4 to 5.

    b moves by 0.01 m a frame in z, from 3 m on.
    """
    position = np.zeros((12, 2, 3))
    position[5:, 0, 0], position[:, 1, 2] = 0.5, 3.0 + 0.01 * np.arange(12)
    milliseconds = np.arange(12) * 10 if milliseconds is None else milliseconds
    return dataclasses.replace(
        session_of_frames(np.asarray(milliseconds) * MILLISECOND_NS, status, position, names=("a", "b")), **more
    )


ABSENT_BEFORE = np.ones((12, 2))
ABSENT_BEFORE[3:5, 0] = int(Status.ABSENT)
"""The status of 12 frames: body a, number 0, has no sample in frames 3 and 4, before its jump to frame 5."""


@pytest.mark.parametrize(
    ("session", "unlinked_of_a", "unlinked_of_b"),
    [
        pytest.param(session_with_jump(), [5], [], id="a jump"),
        pytest.param(
            session_with_jump(scene=Scene(bodies=(SceneBody("b", parent="a"),))), [5], [5], id="a carries b along"
        ),
        # Poses interpolated across a jump lie on no known path.
        pytest.param(session_with_jump(ABSENT_BEFORE), [3, 4, 5], [], id="no samples of a in the two frames before"),
        # The frame of the jump is left out, for its stamp repeats the one before: so the way to the next is broken.
        pytest.param(
            session_with_jump(milliseconds=[0, 10, 20, 30, 40, 40, *range(50, 110, 10)]),
            [5],
            [],
            id="the frame of the jump is left out",
        ),
    ],
)
def test_tracking_jump_unlinks_the_frames_across_the_jump(session, unlinked_of_a, unlinked_of_b):
    """Body a jumps from frame 4 to 5. A frame that is not linked has no known motion from the frame before.

    The first frame never has; it is not listed.
    """
    linked = assemble(session).motion.linked[1:]
    assert (1 + np.flatnonzero(~linked[:, 0])).tolist() == unlinked_of_a
    assert (1 + np.flatnonzero(~linked[:, 1])).tolist() == unlinked_of_b


def test_cut_leaves_interpolation_at_its_border_unchanged():
    """Six frames 10 ms apart; the pose of frame 2, where the cut starts, is interpolated from frame 1, outside of it.

    Times of the cut count from the first frame of the recording.
    """
    status = np.ones((6, 2))
    status[2, 0] = int(Status.ABSENT)
    session = session_of_frames(np.arange(6) * 10 * MILLISECOND_NS, status)
    whole, cut = assemble(session), assemble(session, start=0.02, end=0.05)
    assert cut.origin[0, 0] == PoseOrigin.INTERPOLATED
    assert cut.motion.translations.tolist() == whole.motion.translations[2:].tolist()
    assert cut.motion.times.tolist() == [0.02, 0.03, 0.04, 0.05]
    assert cut.first_ns == whole.first_ns == session.frames.stamp_ns[0]


def partly_meshed(meshed, bare, x_by_frame):
    """A session of two frames: bodies with a mesh, a letter each, and ``bare`` ones without, b0, b1, ..., all at x."""
    tracks = {name: along_x(x_by_frame) for name in (*meshed, *(f"b{k}" for k in range(bare)))}
    return Session.from_arrays([0, 1], tracks, {name: cube() for name in meshed})


AT_REST, MOVING = [0, 0], [0, 1]
"""X in metres in both frames."""


@pytest.mark.parametrize(
    ("session", "text"),
    [
        pytest.param(session_of_frames(np.zeros(0), np.zeros((0, 1))), "no frames", id="no frames"),
        pytest.param(
            partly_meshed([], bare=1, x_by_frame=MOVING),
            "no body has a mesh; there are tracks of: b0; import it again with --mesh",
            id="no mesh",
        ),
        pytest.param(
            partly_meshed("ab", bare=0, x_by_frame=AT_REST),
            "a, b do not move against each other; name pairs",
            id="nothing moves",
        ),
        pytest.param(
            partly_meshed("a", bare=0, x_by_frame=MOVING), "no pair to replay: a is the only body", id="one body"
        ),
        pytest.param(
            partly_meshed("a", bare=1, x_by_frame=MOVING),
            "b0 has no mesh, only a has one; import it again with --mesh BODY=FILE, or",
            id="one of two has a mesh",
        ),
        pytest.param(
            partly_meshed("ac", bare=25, x_by_frame=AT_REST),
            "a, c do not move against each other; 25 bodies have no mesh; name pairs in",
            id="nothing moves, many have no mesh",
        ),
        pytest.param(
            unit_cubes_on_x({"a": [0, 0], "b": [1, 2]}, scene=Scene(ignore=(("a", "b"),))),
            "leaves no pair of bodies with a mesh",
            id="the scene ignores the only pair",
        ),
    ],
)
def test_session_without_pairs_is_refused_with_the_reason(session, text):
    """A pair needs two bodies that have meshes and move against each other; the error says what is missing."""
    with pytest.raises(AssemblyError, match=text):
        assemble(session)


@pytest.mark.parametrize(
    ("start", "end", "text"),
    [
        pytest.param(5.0, 9.0, "between 5 and 9 s", id="after the last frame"),
        pytest.param(None, -1.0, "between 0 and -1 s", id="ends before the first frame"),
        pytest.param(0.2, None, "between 0.2 and 0.11 s", id="starts after the last frame"),
    ],
)
def test_window_without_frames_is_refused_with_its_ends(start, end, text):
    """12 frames at 100 Hz, the last at 0.11 s; an end that is not given is that of the recording."""
    with pytest.raises(AssemblyError, match=f"no frame lies {text}; the session runs from 0 to 0.11"):
        assemble(unit_cubes_on_x({"a": [0] * 12, "b": range(12)}), start=start, end=end)


def test_body_that_is_always_lost_leaves_no_pair():
    """Two bodies at rest, of which b is lost in all of the 12 frames."""
    status = np.ones((12, 2))
    status[:, 1] = int(Status.LOST)
    stamps, at_the_origin = np.arange(12) * 10 * MILLISECOND_NS, np.zeros((12, 2, 3))
    with pytest.raises(AssemblyError, match="no pair to replay: b has no pose that is not lost; `replay doctor` says"):
        assemble(session_of_frames(stamps, status, at_the_origin, names=("a", "b")))


def test_fixed_pose_of_a_recorded_body_is_noted_as_unused():
    """The scene fixes b at z = 9 m; the recording moves it from 3 m on, by 0.01 m a frame, and that counts."""
    session = session_with_jump(scene=Scene(bodies=(SceneBody("b", fixed=Pose((9.0, 9.0, 9.0))),)))
    assembly = assemble(session)
    assert assembly.names == ("a", "b")
    assert "the fixed pose of body 'b' is not used: the recording has poses of it" in assembly.notes
    assert assembly.motion.translations[:, 1, 2].tolist() == (3.0 + 0.01 * np.arange(12)).tolist()


def session_with_reports_of(*pairs):
    """A session of bodies a and b, and an engine's reports that these pairs of names touch."""
    contacts = tuple(LiveContact(0, first, second, "enter") for first, second in pairs)
    return session_with_jump(live_contacts=contacts)


def test_engine_reports_naming_unknown_bodies_are_noted():
    """Bodies are a and b; three of four reports name 'B' or 'Bench'."""
    notes = assemble(session_with_reports_of(("a", "b"), ("a", "Bench"), ("b", "B"), ("b", "Bench"))).notes
    assert "compared with nothing, for no body is called 'B', 'Bench': 3 reports of the engine" in notes


def test_engine_reports_of_known_bodies_are_no_note():
    """The only report is of a and b, the bodies of the session."""
    notes = assemble(session_with_reports_of(("a", "b"))).notes
    assert not any("compared with nothing" in note for note in notes)


def test_note_lists_a_limited_number_of_unknown_names():
    """Reports of an engine name two bodies more that nobody knows than a note may list: those are a number."""
    unknown = [f"x{k}" for k in range(assembling.MOST_UNKNOWN_NAMES + 2)]
    (note,) = assembling.unknown_in_reports(session_with_reports_of(*(("a", name) for name in unknown)))
    assert f" and 2 more: {len(unknown)} reports of the engine" in note


@dataclasses.dataclass
class BlocksOfOneSize:
    """Frames that come in blocks of one size, whatever size is requested."""

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
@settings(max_examples=3, deadline=None)
def test_the_size_of_blocks_changes_no_bit(seed, size):
    """A session of 60 frames with lost poses, gaps and jumps is read whole and in blocks of 1 to 13 frames."""
    session = messy_session(seed)
    whole = assemble(session)
    in_blocks = assemble(dataclasses.replace(session, source=BlocksOfOneSize(session.frames, size)))
    for name in ("times", "translations", "rotations", "valid", "linked"):
        assert getattr(in_blocks.motion, name).tobytes() == getattr(whole.motion, name).tobytes(), name
    assert in_blocks.origin.tobytes() == whole.origin.tobytes()
    assert in_blocks.notes == whole.notes


@pytest.mark.slow
def test_runs_of_a_session_use_the_same_meshes(monkeypatch):
    """Assembled twice, the bodies share their meshes; when the session and both are gone, so are the meshes."""
    monkeypatch.setattr(assembling, "TriangleMesh", TriangleMesh)  # tests share meshes between sessions and keep them
    session = unit_cubes_on_x({"a": [0.0, 0.1], "b": [3.0, 3.1]})
    first, second = assemble(session).bodies, assemble(session).bodies
    assert all(body.mesh is same_body.mesh for body, same_body in zip(first, second, strict=True))
    mesh = ref(first[0].mesh)
    del session, first, second
    gc.collect()
    assert mesh() is None
