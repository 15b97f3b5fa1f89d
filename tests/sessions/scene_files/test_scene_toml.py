import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import SceneError
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect, SceneGroup
from sessions.model.session import Session
from sessions.scene_files.scene_meshes import checked_scene, scene_meshes, with_meshes, with_scene
from sessions.scene_files.scene_toml import parse_scene, scene_to_toml, with_recorded_groups

BENCH_TOML = """
[scene]
name = "bench"

[[body]]
id = "table"
shape = "box"
size = [1.2, 0.04, 0.7]
tags = ["support"]
fixed = { position = [0, 0.88, 0] }

[[body]]
id = "beaker"
instrument = "beaker_250"
faces = 800
tags = ["glass", "vessel"]
group = "glasses"
mass = 0.1
offset = { position = [0, 0, 0.1], euler_deg = [90, 0, 0] }

[[body]]
id = "flask"
mesh = "flask.glb"
scale = 0.01
tags = ["glass"]
parent = "beaker"
properties = { fill_ml = 25.0 }

[[pair]]
between = ["tag:glass", "table"]

[[ignore]]
between = ["beaker", "flask"]

[[effect]]
kind = "contact"
between = ["tag:glass", "tag:support"]
"""


def test_a_scene_is_read_as_written():
    """BENCH_TOML has bodies with a fixed pose, an offset and keys of their own, a pair, an ignored pair and an effect.

    "tag:glass" in a pair becomes every body with that tag; an effect keeps the word, as it is resolved when it runs.
    Keys for effects and meshes, such as mass and faces, stay with the body as ``extra``. 90 degrees about x are the
    quaternion (sin 45, 0, 0, cos 45).
    """
    scene = parse_scene(BENCH_TOML)
    assert scene.name == "bench"
    table, beaker, flask = scene.bodies
    assert (table.id, beaker.id, flask.id) == ("table", "beaker", "flask")
    assert table.fixed == Pose((0.0, 0.88, 0.0))
    assert beaker.offset.quaternion_xyzw == pytest.approx((0.5**0.5, 0, 0, 0.5**0.5))
    assert beaker.extra == {"mass": 0.1, "faces": 800}
    assert flask.extra == {"properties": {"fill_ml": 25.0}}
    assert scene.pairs == (("beaker", "table"), ("flask", "table"))
    assert scene.ignore == (("beaker", "flask"),)
    assert scene.effects == (SceneEffect("contact", {"between": ["tag:glass", "tag:support"]}),)
    assert scene.text == BENCH_TOML


def test_the_space_of_a_scene_has_a_radius():
    """Bodies are within 1,000 m unless the table [space] says 5 m, which is written and read again."""
    assert parse_scene(BENCH_TOML).space_radius == 1000.0
    scene = parse_scene("[space]\nradius_m = 5\n" + BENCH_TOML)
    assert scene.space_radius == 5.0
    assert parse_scene(scene_to_toml(scene)).space_radius == 5.0


FAULTY = """
[scene]
nam = "bench"
[[body]]
id = "table"
offset = { position = [0, 0, 0], turn = 3 }
[[body]]
mesh = "a.glb"
scale = "feet"
[sapce]
"""


def test_every_problem_of_a_scene_is_listed():
    """FAULTY has five faults: three unknown keys, a missing id and a scale in words.

    The error has them all, each once, and its text is the first with the command that lists the others.
    """
    with pytest.raises(SceneError) as caught:
        parse_scene(FAULTY, "lab.toml")
    faults = caught.value.faults
    beginnings = (
        "[scene]: unknown key 'nam'",
        "[[body]] 1 ('table') offset: unknown key 'turn'",
        "[[body]] 2: id is missing",
        "[[body]] 2 (''): scale is 'feet'",
        "unknown key 'sapce'",
    )
    assert len(faults) == len(beginnings)
    for beginning in beginnings:
        assert sum(fault.startswith(f"lab.toml: {beginning}") for fault in faults) == 1, (beginning, faults)
    first_fault, *_others = faults
    assert str(caught.value) == f"{first_fault}; and more: `replay scene check` lists every fault"


numbers = st.floats(-1e6, 1e6)
# A few characters of each kind: a table of all of Unicode takes a second to make.
CHARACTERS = "aB9 _-.,:;/\\\"'[]{}=#\n\t\0\x1b\x7fä\u202e杯🙂"
names = st.text(CHARACTERS, min_size=1, max_size=8)
poses = st.builds(Pose, st.tuples(numbers, numbers, numbers))
extras = {"mass": st.floats(1e-3, 10), "properties": st.dictionaries(names, names)}
bodies = st.builds(
    SceneBody, id=names, mesh=st.just("") | names, scale=st.floats(1e-6, 1e6), group=st.text(CHARACTERS, max_size=5),
    offset=poses, fixed=st.none() | poses, tags=st.lists(names, max_size=2).map(tuple), proxy=st.booleans(),
    extra=st.fixed_dictionaries({}, optional=extras),
)  # fmt: skip


@given(
    st.text(CHARACTERS, max_size=8),
    st.lists(bodies, max_size=4, unique_by=lambda body: body.id),
    st.none() | st.just(()),
)
def test_a_scene_written_as_toml_reads_back_the_same(name, declared, effects):
    """A scene has a random name, up to four random bodies, and effects that are absent or an empty list.

    Written, read and written again it has the same content and the same text.
    """
    scene = Scene(name=name, bodies=tuple(declared), effects=effects)
    back = parse_scene(scene_to_toml(scene))
    assert (back.name, back.bodies, back.pairs, back.effects) == (name, tuple(declared), None, effects)
    assert scene_to_toml(back) == scene_to_toml(scene)


@given(
    st.text(CHARACTERS, max_size=200) | st.lists(st.sampled_from(BENCH_TOML.splitlines()), max_size=30).map("\n".join)
)
def test_any_text_ends_in_scene_or_named_error(text):
    """A text of random characters, or of random lines of a good scene, is a scene or an error that names its file."""
    try:
        parse_scene(text)
    except SceneError as error:
        assert str(error).startswith("scene.toml: ")


TRIANGLE = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_files_shapes_and_instruments_become_meshes(tmp_path):
    """Bodies name a mesh file, of which the scene takes half the size, a shape, an instrument, or nothing.

    500 and 600 faces are met roughly; a body that names nothing has no mesh.
    """
    (tmp_path / "t.glb").write_bytes(mesh_to_glb(TRIANGLE, "t"))
    bodies = (
        SceneBody("file", mesh="t.glb", scale=0.5),
        SceneBody("shape", shape="sphere", size={"radius": 0.1}, extra={"faces": 500}),
        SceneBody("glass", instrument="beaker_100", extra={"faces": 600}),
        SceneBody("tracked"),
    )
    meshes = scene_meshes(Scene(bodies=bodies), tmp_path)
    assert list(meshes) == ["file", "shape", "glass"]
    assert np.array_equal(meshes["file"].vertices, TRIANGLE.vertices * 0.5)
    assert 300 < len(meshes["shape"].faces) < 700
    assert 400 < len(meshes["glass"].faces) < 900


@pytest.mark.parametrize(("name", "start"), [("lab", "lab: body 'cup': "), ("", "scene: body 'cup': ")])
def test_faulty_mesh_is_named_by_scene_and_body(tmp_path, name, start):
    """The cup's file does not exist; the error begins with the scene's name, or with "scene" where it has none."""
    with pytest.raises(SceneError) as caught:
        scene_meshes(Scene(name, bodies=(SceneBody("cup", mesh="none.obj"),)), tmp_path)
    (fault,) = caught.value.faults
    assert fault.startswith(start)


def faults_of_three_bodies(tmp_path, faults_of_effects):
    """Faults of a scene whose three bodies are all wrong, where planning its effects finds these."""
    text = """
        body = [
            {id = "cup", mesh = "none.obj", scale = -1.0},
            {id = "rod", shape = "capsule", radius = 1.0, length = 0.5},
            {id = "lid", shape = "box", size = [1.0, -1.0, 1.0]},
        ]"""
    _scene, _meshes, faults = checked_scene(text, "lab.toml", lambda scene: faults_of_effects, tmp_path)
    return faults


def test_check_lists_each_fault_of_a_body_once(tmp_path):
    """The cup's scale and file are wrong, the rod is shorter than its round ends, a side of the lid is below 0."""
    faults = faults_of_three_bodies(tmp_path, faults_of_effects=[])
    patterns = (
        "cup.*scale is -1.0",
        "lid.*a box needs size",
        "cup.*none.obj does not exist",
        "rod.*shorter than its two",
    )
    for pattern, fault in zip(patterns, faults, strict=True):
        assert re.search(pattern, fault), pattern


def test_faults_of_effects_that_follow_from_bodies_are_left_out(tmp_path):
    """Faults of effects are that of a body again, a body that is no vessel without a mesh, and a fault of their own."""
    faults = faults_of_three_bodies(tmp_path, faults_of_effects=[])
    of_vessel = "lab.toml: body 'cup' has a cavity that cannot be made: it has no mesh"
    of_effects = [faults[0], of_vessel, "an effect is wrong"]
    assert faults_of_three_bodies(tmp_path, faults_of_effects=of_effects) == [*faults, "an effect is wrong"]


def test_scene_text_omits_meshes_that_bodies_already_have():
    """A scene's text says that "a" is a box; a recorded triangle takes its place: shape and text are dropped."""
    scene = parse_scene('[[body]]\nid = "a"\nshape = "box"\nsize = [1, 1, 1]')
    recording = Session.from_arrays([0], {"a": ([[0, 0, 0]], [[0, 0, 0, 1]])}, scene=scene)
    scene_with_triangle = with_meshes(recording, {"a": TRIANGLE}, []).scene
    (body,) = scene_with_triangle.bodies
    assert body.shape == ""
    assert scene_with_triangle.text == ""


def test_scene_without_recorded_meshes_is_unchanged():
    """The only body is a box by the scene, and no mesh was recorded."""
    scene = parse_scene('[[body]]\nid = "a"\nshape = "box"\nsize = [1, 1, 1]')
    recording = Session.from_arrays([0], {"a": ([[0, 0, 0]], [[0, 0, 0, 1]])}, scene=scene)
    assert with_meshes(recording, {}, []).scene is scene


THREE_BODIES = """
[[body]]
id = "thumb"
[[body]]
id = "index"
[[body]]
id = "glass"
"""


def test_group_takes_its_members_by_name_and_pattern():
    """A group "hand" has the thumb and, by the pattern "in*", the index; a pair with it is a pair with each member.

    Written and read again the scene is the same.
    """
    scene = parse_scene(
        THREE_BODIES + '[[group]]\nname = "hand"\nmembers = ["thumb", "in*"]\n[[pair]]\nbetween = ["hand", "glass"]'
    )
    assert scene.groups == (SceneGroup("hand", ("thumb", "index")),)
    assert scene.pairs == (("thumb", "glass"), ("index", "glass"))
    assert replace(parse_scene(scene_to_toml(scene)), text="") == replace(scene, text="")


@pytest.mark.parametrize(
    ("tables", "fault"),
    [
        ('[[group]]\nname = "glass"\nmembers = ["thumb", "index"]', "a body has that name"),
        ('[[group]]\nname = "hand"\nmembers = ["thumb", "indx"]', "no body is 'indx'.*index"),
        ('[[group]]\nname = "hand"\nmembers = ["thumb"]', "two bodies at least"),
        (
            '[[group]]\nname = "hand"\nmembers = ["*"]\n[[group]]\nname = "b"\nmembers = ["t*", "g*"]',
            "member of 'hand'",
        ),
    ],
)
def test_faulty_group_is_refused_with_its_reason(tables, fault):
    """A group has a body's name, an unknown member, a single member, or a member (the thumb) of another group."""
    with pytest.raises(SceneError, match=fault):
        parse_scene(THREE_BODIES + tables)


OWN_SCENE = """
[scene]
name = "own"
[[body]]
id = "glass"
mass = 0.2
[[body]]
id = "lid"
[[effect]]
kind = "contact"
between = ["glass", "lid"]
"""


def recording_of_a_hand(scene):
    """A session of thumb, index and glass, at rest in two frames, with this scene."""
    at_rest = (np.zeros((2, 3)), np.tile([0.0, 0, 0, 1], (2, 1)))
    return Session.from_arrays([0, 1], dict.fromkeys(("thumb", "index", "glass"), at_rest), {}, scene)


def test_scene_without_bodies_adds_to_the_recorded(tmp_path):
    """The recorded scene has a name, a mass and an effect, which stay; a second file adds a group and pairs with it."""
    own = parse_scene(OWN_SCENE)
    added = tmp_path / "added.toml"
    added.write_text('[[group]]\nname = "hand"\nmembers = ["thumb", "index"]\n[[pair]]\nbetween = ["hand", "glass"]')
    scene = with_scene(recording_of_a_hand(own), added).scene
    assert scene.name == "own"
    assert scene.body("glass").extra == {"mass": 0.2}
    assert scene.effects == own.effects
    assert scene.groups == (SceneGroup("hand", ("thumb", "index")),)
    assert scene.pairs == (("thumb", "glass"), ("index", "glass"))
    assert replace(parse_scene(scene_to_toml(scene)), text="") == scene


def test_added_group_of_unrecorded_bodies_is_refused(tmp_path):
    """The second file has a group with a palm, which is neither recorded nor declared."""
    added = tmp_path / "added.toml"
    added.write_text('[[group]]\nname = "hand"\nmembers = ["thumb", "palm"]')
    with pytest.raises(SceneError, match="no body is 'palm'"):
        with_scene(recording_of_a_hand(parse_scene(OWN_SCENE)), added)


HAND = SceneGroup("hand", ("thumb", "index"))


def test_groups_of_a_recording_stay_where_a_scene_has_none():
    """A hand of thumb and index is recorded; a scene without groups gets it, and the index as a body."""
    scene = Scene(bodies=(SceneBody("glass"), SceneBody("thumb")))
    extended = with_recorded_groups(scene, Scene(groups=(HAND,)))
    assert [body.id for body in extended.bodies] == ["glass", "thumb", "index"]
    assert extended.groups == (HAND,)


@pytest.mark.parametrize(
    ("scene", "recorded"),
    [
        pytest.param(Scene(groups=(SceneGroup("pair", ("glass", "lid")),)), Scene(groups=(HAND,)), id="own groups"),
        pytest.param(Scene(bodies=(SceneBody("glass"),)), Scene(), id="no groups at all"),
    ],
)
def test_scene_without_need_of_recorded_groups_is_unchanged(scene, recorded):
    """A scene has groups of its own, or none were recorded."""
    assert with_recorded_groups(scene, recorded) is scene
