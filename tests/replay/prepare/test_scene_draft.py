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
COUNT = 200


def noisy_path(*points):
    """(COUNT, 3) along straight pieces, with a tenth of a millimetre of noise, and no turn."""
    along = np.linspace(0, len(points) - 1, COUNT)
    positions = np.stack([np.interp(along, np.arange(len(points)), axis) for axis in np.array(points, float).T], axis=1)
    positions = positions + np.random.default_rng(len(points)).normal(0, 1e-4, positions.shape)
    return positions, np.tile([0.0, 0.0, 0.0, 1.0], (COUNT, 1))


def bench_session(scene=None, **more):
    """A bench with a cup on it, and a hand that moves a rod; ``more``: further bodies and their poses."""
    small = cube(edge=0.1)
    tracks = {
        "cup": noisy_path((0, 0.0505, 0), (0, 0.0505, 0)),
        "hand-right": noisy_path((0.5, 0.4, 0), (0.3, 0.4, 0), (0.9, 0.4, 0)),
        "rod": noisy_path((0.5, 0.29, 0), (0.3, 0.29, 0), (0.9, 0.29, 0)),
        "far": noisy_path((3, 2, 0), (3, 1, 0)),
        "lamp": noisy_path((0, 0.3, 0.4), (0.0, 0.12, 0.0), (0, 0.3, 0.4)),
        **more,
    }
    top = MeshData(np.array([2.0, 0.04, 1.0]) * cube(edge=1.0).vertices - [0, 0.02, 0], cube(edge=1.0).faces)
    scene = scene or Scene(bodies=(SceneBody("top", fixed=Pose(), tags=("bench",)),))
    tracks["rod"] = (tracks["hand-right"][0] - [0, 0.11, 0], tracks["rod"][1])
    return Session.from_arrays(np.arange(COUNT) * STEP, tracks, {"top": top, **dict.fromkeys(tracks, small)}, scene)


def test_drafted_scene_contains_near_pairs_and_groups():
    """The cup stands on the top, the lamp comes near it; the rod moves along 11 cm below the hand: a group."""
    session, near = bench_session(), {frozenset(("cup", "top")), frozenset(("cup", "lamp"))}
    draft = draft_scene(session)
    assert {*map(frozenset, draft.near_pairs)} == near and draft.held == (("hand-right", "rod"),)
    text = draft_text(session, draft, files={"cup": ("m/cup.glb", "Cup", 0.01)}, heading="A first scene.")
    scene = parse_scene(text)
    assert [body.id for body in scene.bodies] == ["cup", "hand-right", "rod", "far", "lamp", "top"]
    assert scene.body("hand-right").group == scene.body("rod").group != "" == scene.body("far").group
    assert scene.body("cup") == SceneBody("cup", mesh="m/cup.glb", node="Cup", scale=0.01)
    assert scene.body("top") == SceneBody("top", fixed=Pose(), tags=("bench",))
    assert {*map(frozenset, scene.pairs)} == near and "10.0 x 10.0 x 10.0 cm" in text


def test_body_that_rotates_in_a_hand_is_not_grouped():
    """A knob moves with the hand, 11 cm above it, and turns by 45 degrees about Y; a rod moves below and does not."""
    positions, upright = noisy_path((0.5, 0.51, 0), (0.3, 0.51, 0), (0.9, 0.51, 0))
    half_angle = np.linspace(0, np.radians(45 / 2), COUNT)
    rotating = upright * np.cos(half_angle)[:, None] + [0, 1, 0, 0] * np.sin(half_angle)[:, None]
    draft = draft_scene(bench_session(knob=(positions, rotating)))
    assert draft.held == (("hand-right", "rod"),) and ("hand-right", "knob") in draft.near_pairs


def test_draft_keeps_the_recorded_scene_and_pairs_of_effects():
    """The scene has a name, an effect, ignored pairs, a radius and colliders; its file of the cup's mesh is dropped.

    A scene's own pairs are kept, and where it has effects none are added.
    """
    bodies = (SceneBody("top", fixed=Pose()), SceneBody("cup", mesh="gone.glb", tags=("glass",), extra={"mass": 0.1}))
    effects = (SceneEffect("contact", {"between": ["cup", "top"]}),)

    def kept(**more):
        session = bench_session(Scene("lab", bodies, **more))
        return parse_scene(draft_text(session, draft_scene(session), files={}, heading="A first scene."))

    scene = kept(ignore=(("cup", "far"),), effects=effects, space_radius=9.0, colliders="c.glb")
    assert (scene.name, scene.effects, scene.ignore, scene.pairs) == ("lab", effects, (("cup", "far"),), None)
    assert (scene.space_radius, scene.colliders) == (9.0, "c.glb")
    assert scene.body("cup") == SceneBody("cup", tags=("glass",), extra={"mass": 0.1})  # the recording holds its mesh
    assert kept(pairs=(("cup", "far"),)).pairs == (("cup", "far"),) and kept(effects=()).effects == ()


def test_draft_without_meshes_or_neighbours_is_a_scene():
    """A body with a name that TOML must escape; two bodies that never come near each other have no pairs."""
    bare = Session.from_arrays([0, STEP], {'a"b\n': (np.zeros((2, 3)), np.tile([0.0, 0, 0, 1], (2, 1)))})
    text = draft_text(bare, draft_scene(bare), files={}, heading="A first scene.")
    assert parse_scene(text).bodies == (SceneBody('a"b\n'),) and "it has no mesh" in text
    separate = Session.from_arrays(
        [0, STEP],
        {
            "a": (np.zeros((2, 3)), bare.frames.quaternion_xyzw[:, 0]),
            "b": (np.array([[9.0, 0, 0], [8.0, 0, 0]]), bare.frames.quaternion_xyzw[:, 0]),
        },
        dict.fromkeys("ab", cube(edge=0.1)),
    )
    assert parse_scene(draft_text(separate, draft_scene(separate), files={}, heading="x")).pairs is None


def test_draft_of_a_too_long_recording_uses_its_beginning(monkeypatch):
    """Five bodies are recorded in 200 frames; there is room for half of their poses."""
    monkeypatch.setattr(holding_poses, "MOST_POSES", 5 * COUNT // 2)
    draft = draft_scene(bench_session())
    assert "first" in draft.examined_text and f"# Looked at: {draft.examined_text}" in draft_text(
        bench_session(), draft, files={}, heading="x"
    )
