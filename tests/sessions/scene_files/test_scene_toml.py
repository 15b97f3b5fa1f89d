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
    """Every kind of table of BENCH_TOML: bodies with fixed pose, offset and own keys, pairs, and an effect."""
    scene = parse_scene(BENCH_TOML)
    assert scene.name == "bench"
    assert [body.id for body in scene.bodies] == ["table", "beaker", "flask"]
    assert scene.bodies[0].fixed == Pose((0.0, 0.88, 0.0))
    assert scene.bodies[1].offset.quaternion_xyzw == pytest.approx((0.5**0.5, 0, 0, 0.5**0.5))
    assert scene.bodies[1].extra == {"mass": 0.1, "faces": 800}
    assert scene.bodies[2].extra == {"properties": {"fill_ml": 25.0}}
    assert scene.pairs == (("beaker", "table"), ("flask", "table"))
    assert scene.ignore == (("beaker", "flask"),)
    assert scene.effects == (SceneEffect("contact", {"between": ["tag:glass", "tag:support"]}),)
    assert scene.text == BENCH_TOML


def test_the_space_of_a_scene_has_a_radius():
    """1,000 m unless [space] says 5 m, which is written again."""
    assert parse_scene(BENCH_TOML).space_radius == 1000.0
    scene = parse_scene("[space]\nradius_m = 5\n" + BENCH_TOML)
    assert scene.space_radius == 5.0 and parse_scene(scene_to_toml(scene)).space_radius == 5.0


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
    """FAULTY has five faults: three unknown keys, a missing id and a scale in words."""
    with pytest.raises(SceneError) as caught:
        parse_scene(FAULTY, "lab.toml")
    faults = caught.value.faults
    for arguments in (
        "[scene]: unknown key 'nam'",
        "[[body]] 1 ('table') offset: unknown key 'turn'",
        "[[body]] 2: id is missing",
        "[[body]] 2 (''): scale is 'feet'",
        "unknown key 'sapce'",
    ):
        assert sum(item.startswith(f"lab.toml: {arguments}") for item in faults) == 1, (arguments, faults)
    assert len(faults) == 5
    assert str(caught.value) == f"{faults[0]}; and more: `replay scene check` lists every fault"


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
    """Random names, up to four random bodies, and effects that are absent or an empty list."""
    scene = Scene(name=name, bodies=tuple(declared), effects=effects)
    back = parse_scene(scene_to_toml(scene))
    assert (back.name, back.bodies, back.pairs, back.effects) == (name, tuple(declared), None, effects)
    assert scene_to_toml(back) == scene_to_toml(scene)


@given(
    st.text(CHARACTERS, max_size=200) | st.lists(st.sampled_from(BENCH_TOML.splitlines()), max_size=30).map("\n".join)
)
def test_any_text_ends_in_scene_or_named_error(text):
    """Random characters, and random lines of a good scene."""
    try:
        parse_scene(text)
    except SceneError as error:
        assert str(error).startswith("scene.toml: ")


TRIANGLE = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_files_shapes_and_instruments_become_meshes(tmp_path):
    """Requested face counts are met roughly; a body without a mesh of any kind has none."""
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
    """The cup's file does not exist; a scene without a name is "scene"."""
    with pytest.raises(SceneError) as caught:
        scene_meshes(Scene(name, bodies=(SceneBody("cup", mesh="none.obj"),)), tmp_path)
    (fault,) = caught.value.faults
    assert fault.startswith(start)


def test_check_lists_each_fault_of_a_body_once(tmp_path):
    """The cup's scale and file are wrong, the rod is shorter than its round ends, a side of the lid is below 0."""
    text = """
        body = [
            {id = "cup", mesh = "none.obj", scale = -1.0},
            {id = "rod", shape = "capsule", radius = 1.0, length = 0.5},
            {id = "lid", shape = "box", size = [1.0, -1.0, 1.0]},
        ]"""
    _, _, faults = checked_scene(text, "lab.toml", lambda scene: [], tmp_path)
    wrong = ["cup.*scale is -1.0", "lid.*a box needs size", "cup.*none.obj does not exist", "rod.*shorter than its two"]
    assert len(faults) == len(wrong)
    assert all(re.search(pattern, fault) for pattern, fault in zip(wrong, faults, strict=True))
    # Effects that repeat a fault, or cannot use a faulty body as a vessel, add none.
    of_effects = [
        faults[0],
        "lab.toml: body 'cup' has a cavity that cannot be made: it has no mesh",
        "an effect is wrong",
    ]
    assert checked_scene(text, "lab.toml", lambda scene: of_effects, tmp_path)[2] == [*faults, "an effect is wrong"]


def test_scene_text_omits_meshes_that_bodies_already_have():
    """The scene's text says that a is a box. A recorded triangle takes its place: neither shape nor text is kept."""
    scene = parse_scene('[[body]]\nid = "a"\nshape = "box"\nsize = [1, 1, 1]')
    still = Session.from_arrays([0], {"a": ([[0, 0, 0]], [[0, 0, 0, 1]])}, scene=scene)
    known = with_meshes(still, {"a": TRIANGLE}, []).scene
    assert (known.bodies[0].shape, known.text) == ("", "") and with_meshes(still, {}, []).scene is scene


THREE_BODIES = """
[[body]]
id = "thumb"
[[body]]
id = "index"
[[body]]
id = "glass"
"""


def test_group_takes_its_members_by_name_and_pattern():
    """ "in*" is the index; a pair with the group is a pair with each member; the scene is written and read again."""
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
    """A body's name, an unknown member, a single member, and a member of two groups (thumb)."""
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


def test_scene_without_bodies_adds_to_the_recorded(tmp_path):
    """The recorded scene has a name, a mass and an effect, which stay; a second file adds a group and a pair with it.

    A member that is neither recorded nor declared is refused.
    """
    names = ("thumb", "index", "glass")
    still = (np.zeros((2, 3)), np.tile([0.0, 0, 0, 1], (2, 1)))
    own = parse_scene(OWN_SCENE)
    session = Session.from_arrays([0, 1], dict.fromkeys(names, still), {}, own)
    small = tmp_path / "small.toml"
    small.write_text('[[group]]\nname = "hand"\nmembers = ["thumb", "index"]\n[[pair]]\nbetween = ["hand", "glass"]')
    scene = with_scene(session, small).scene
    assert scene.body("glass").extra == {"mass": 0.2} and scene.name == "own" and scene.effects == own.effects
    assert scene.groups == (SceneGroup("hand", ("thumb", "index")),) and len(scene.pairs) == 2
    assert replace(parse_scene(scene_to_toml(scene)), text="") == scene
    small.write_text('[[group]]\nname = "hand"\nmembers = ["thumb", "palm"]')
    with pytest.raises(SceneError, match="no body is 'palm'"):
        with_scene(session, small)


def test_groups_of_a_recording_stay_where_a_scene_has_none():
    """The recorded hand is thumb and index.

    A scene without groups gets it, and index as a body; one with groups is kept.
    """
    hand, pair = SceneGroup("hand", ("thumb", "index")), SceneGroup("pair", ("glass", "lid"))
    recorded = Scene(groups=(hand,))
    extended = with_recorded_groups(Scene(bodies=(SceneBody("glass"), SceneBody("thumb"))), recorded)
    assert [body.id for body in extended.bodies] == ["glass", "thumb", "index"] and extended.groups == (hand,)
    grouped, plain = Scene(groups=(pair,)), Scene(bodies=(SceneBody("glass"),))
    assert with_recorded_groups(grouped, recorded) is grouped and with_recorded_groups(plain, Scene()) is plain
