"""A scene drafted from a recording: who comes near, who is held."""

import numpy as np
from support.small_worlds import cube

from replay.prepare import holding_poses
from replay.prepare.scene_draft import draft_scene, draft_text
from sessions import Session
from sessions.mesh_data import MeshData
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene

STEP = 20_000_000
"""Nanoseconds from frame to frame: 20 ms."""
COUNT = 100
"""Frames of a recording: 2 s."""


def noisy_path(*points):
    """Positions (COUNT, 3) along lines between points, with 0.1 mm of noise, and quaternions without rotation."""
    along = np.linspace(0, len(points) - 1, COUNT)
    positions = np.stack([np.interp(along, np.arange(len(points)), axis) for axis in np.array(points, float).T], axis=1)
    positions = positions + np.random.default_rng(len(points)).normal(0, 1e-4, positions.shape)
    return positions, np.tile([0.0, 0.0, 0.0, 1.0], (COUNT, 1))


def bench_session(scene=None, **more):
    """Cubes of 0.1 m about a table top of 2 m by 1 m, 4 cm thick, whose upper side is at y = 0.

    A cup stands on the top, 0.5 mm above it; a lamp comes down into it, with its middle 0.12 m above the top, and goes
    away; a rod moves with the right hand, 0.11 m below it; "far" stays 3 m away. ``more``: further bodies and poses.
    """
    small = cube(edge=0.1)
    hand = noisy_path((0.5, 0.4, 0), (0.3, 0.4, 0), (0.9, 0.4, 0))
    tracks = {
        "cup": noisy_path((0, 0.0505, 0), (0, 0.0505, 0)),
        "hand-right": hand,
        "rod": (hand[0] - [0, 0.11, 0], hand[1]),
        "far": noisy_path((3, 2, 0), (3, 1, 0)),
        "lamp": noisy_path((0, 0.3, 0.4), (0.0, 0.12, 0.0), (0, 0.3, 0.4)),
        **more,
    }
    top = MeshData(np.array([2.0, 0.04, 1.0]) * cube(edge=1.0).vertices - [0, 0.02, 0], cube(edge=1.0).faces)
    scene = scene or Scene(bodies=(SceneBody("top", fixed=Pose(), tags=("bench",)),))
    return Session.from_arrays(np.arange(COUNT) * STEP, tracks, {"top": top, **dict.fromkeys(tracks, small)}, scene)


def drafted_scene(session, files=None):
    """The scene that the draft of a session says, read back from its text."""
    return parse_scene(draft_text(session, draft_scene(session), files=files or {}, heading="A first scene."))


NEAR_PAIRS = {frozenset(("cup", "top")), frozenset(("cup", "lamp"))}
"""Bodies of ``bench_session`` that come near each other and are not in one hand."""


def test_bodies_that_come_near_or_move_together_are_drafted():
    """The cup on the top, and the lamp at the cup, come within 5 cm of each other.

    The rod is held: it moves with the hand, to 5 mm and 3 degrees, all the time.
    """
    draft = draft_scene(bench_session())
    assert {frozenset(pair) for pair in draft.near_pairs} == NEAR_PAIRS
    assert draft.held == (("hand-right", "rod"),)


def test_drafted_scene_contains_near_pairs_and_groups():
    """The text is a scene of all bodies: hand and rod are a group, near bodies pairs, and the top as it was declared.

    The cup's mesh is a node of a file in centimetres, as ``files`` says.
    """
    scene = drafted_scene(bench_session(), files={"cup": ("m/cup.glb", "Cup", 0.01)})
    assert [body.id for body in scene.bodies] == ["cup", "hand-right", "rod", "far", "lamp", "top"]
    assert scene.body("hand-right").group == scene.body("rod").group != ""
    assert scene.body("far").group == ""
    assert {frozenset(pair) for pair in scene.pairs} == NEAR_PAIRS
    assert scene.body("cup") == SceneBody("cup", mesh="m/cup.glb", node="Cup", scale=0.01)
    assert scene.body("top") == SceneBody("top", fixed=Pose(), tags=("bench",))


def test_draft_says_the_size_of_a_body():
    """All recorded bodies are cubes of 0.1 m; a comment in the text of the draft says so in centimetres."""
    session = bench_session()
    text = draft_text(session, draft_scene(session), files={}, heading="A first scene.")
    assert "10.0 x 10.0 x 10.0 cm" in text


def test_body_that_rotates_in_a_hand_is_not_grouped():
    """A knob moves with the hand, 11 cm above it, and turns by 45 degrees about Y; the rod moves below and does not.

    The knob is near the hand (within 5 cm), and only the rod is held: that allows a turn of 3 degrees.
    """
    positions, unrotated = noisy_path((0.5, 0.51, 0), (0.3, 0.51, 0), (0.9, 0.51, 0))
    half_angle = np.linspace(0, np.radians(45 / 2), COUNT)
    quaternions = unrotated * np.cos(half_angle)[:, None] + [0, 1, 0, 0] * np.sin(half_angle)[:, None]
    draft = draft_scene(bench_session(knob=(positions, quaternions)))
    assert draft.held == (("hand-right", "rod"),)
    assert ("hand-right", "knob") in draft.near_pairs


RECORDED_BODIES = (
    SceneBody("top", fixed=Pose()),
    SceneBody("cup", mesh="gone.glb", tags=("glass",), extra={"mass": 0.1}),
)


def test_draft_keeps_the_recorded_scene():
    """The recording has a scene with a name, an effect, an ignored pair, a radius and colliders, which stay.

    The file of the cup's mesh is dropped: the recording holds the mesh itself.
    """
    effects = (SceneEffect("contact", {"between": ["cup", "top"]}),)
    recorded = Scene(
        "lab", RECORDED_BODIES, ignore=(("cup", "far"),), effects=effects, space_radius=9.0, colliders="c.glb"
    )
    scene = drafted_scene(bench_session(recorded))
    assert (scene.name, scene.effects, scene.ignore) == ("lab", effects, (("cup", "far"),))
    assert (scene.space_radius, scene.colliders) == (9.0, "c.glb")
    assert scene.body("cup") == SceneBody("cup", tags=("glass",), extra={"mass": 0.1})


def test_pairs_are_drafted_only_where_scene_and_effects_have_none():
    """A recorded scene with a pair keeps it alone; with an effect, which names its own pair, it gets none."""
    effects = (SceneEffect("contact", {"between": ["cup", "top"]}),)
    with_pair = Scene("lab", RECORDED_BODIES, pairs=(("cup", "far"),))
    with_effect = Scene("lab", RECORDED_BODIES, effects=effects)
    assert drafted_scene(bench_session(with_pair)).pairs == (("cup", "far"),)
    assert drafted_scene(bench_session(with_effect)).pairs is None


def test_scene_without_effects_is_drafted_without_any():
    """The recording has a scene with an empty list of effects, and so has its draft."""
    assert drafted_scene(bench_session(Scene("lab", RECORDED_BODIES, effects=()))).effects == ()


UNROTATED = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
"""Quaternions of two frames."""


def test_draft_of_a_body_without_a_mesh_is_a_scene():
    """Its name has a quote and a line break, which TOML must escape; a comment says that it has no mesh."""
    session = Session.from_arrays([0, STEP], {'a"b\n': (np.zeros((2, 3)), UNROTATED)})
    text = draft_text(session, draft_scene(session), files={}, heading="A first scene.")
    assert parse_scene(text).bodies == (SceneBody('a"b\n'),)
    assert "it has no mesh" in text


def test_draft_of_bodies_that_never_meet_has_no_pairs():
    """Cube a of 0.1 m rests at the origin, b comes from 9 to 8 m."""
    poses = {"a": (np.zeros((2, 3)), UNROTATED), "b": (np.array([[9.0, 0, 0], [8.0, 0, 0]]), UNROTATED)}
    session = Session.from_arrays([0, STEP], poses, dict.fromkeys("ab", cube(edge=0.1)))
    assert drafted_scene(session).pairs is None


def test_draft_of_a_too_long_recording_uses_its_beginning(monkeypatch):
    """Five bodies are recorded in 100 frames; there is room for half of their poses, 250 of 500.

    The draft says that it examined only the first part, and so does its text.
    """
    monkeypatch.setattr(holding_poses, "MOST_POSES", 5 * COUNT // 2)
    session = bench_session()
    draft = draft_scene(session)
    assert "first" in draft.examined_text
    text = draft_text(session, draft, files={}, heading="A first scene.")
    assert f"# Looked at: {draft.examined_text}" in text
