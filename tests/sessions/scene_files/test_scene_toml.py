import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import SceneError
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_meshes import scene_meshes
from sessions.scene_files.scene_toml import parse_scene, read_scene, scene_to_toml
from sessions.scene_files.toml_table import TomlTable, is_number, nearest, parse_toml

BENCH = """
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
    scene = parse_scene(BENCH)
    assert scene.name == "bench"
    assert [body.id for body in scene.bodies] == ["table", "beaker", "flask"]
    assert scene.bodies[0].fixed == Pose((0.0, 0.88, 0.0))
    assert scene.bodies[1].offset.quaternion_xyzw == pytest.approx((0.5**0.5, 0, 0, 0.5**0.5))
    assert scene.bodies[1].extra == {"mass": 0.1, "faces": 800}
    assert scene.bodies[2].extra == {"properties": {"fill_ml": 25.0}}
    assert scene.pairs == (("beaker", "table"), ("flask", "table"))
    assert scene.ignore == (("beaker", "flask"),)
    assert scene.effects == (SceneEffect("contact", {"between": ["tag:glass", "tag:support"]}),)
    assert scene.text == BENCH


def test_units_are_another_word_for_scale_and_a_and_b_for_between():
    other = BENCH.replace("scale = 0.01", 'units = "cm"').replace(
        'between = ["tag:glass", "table"]', 'a = "tag:glass"\nb = "table"'
    )
    assert other != BENCH
    one, two = parse_scene(BENCH), parse_scene(other)
    assert (one.bodies, one.pairs, one.ignore) == (two.bodies, two.pairs, two.ignore)


def test_the_space_of_a_scene_has_a_radius():
    assert parse_scene(BENCH).space_radius == 1000.0
    scene = parse_scene("[space]\nradius_m = 5\n" + BENCH)
    assert scene.space_radius == 5.0 and parse_scene(scene_to_toml(scene)).space_radius == 5.0
    for line in ("radius_m = 0", "radius_m = inf", "radius = 5"):
        with pytest.raises(SceneError, match=r"scene.toml: \[space\]: .*radius"):
            parse_scene(f"[space]\n{line}\n")


def test_declaring_no_effect_differs_from_not_declaring_any():
    assert parse_scene("").effects is None
    assert parse_scene("effect = []").effects == ()
    assert parse_scene("pair = []").pairs == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass = 0.1", "masss = 0.1", r"\[\[body\]\] 2 \('beaker'\): unknown key 'masss'; did you mean 'mass'"),
        ("[[pair]]", "[[pear]]", r"scene.toml: unknown key 'pear'; did you mean 'pair'"),
        ('name = "bench"', 'title = "bench"', r"\[scene\]: unknown key 'title'"),
        ('shape = "box"', 'shape = "boxx"', "shape is 'boxx'; did you mean 'box'"),
        ("size = [1.2, 0.04, 0.7]", "size = [1.2, 0.04]", "size is .* give 3 finite numbers"),
        ("size = [1.2, 0.04, 0.7]", "", r"a box needs size = \[x, y, z\]"),
        ('"beaker_250"', '"beaker_25"', "no instrument 'beaker_25'; did you mean 'beaker_250'"),
        ('id = "flask"', 'id = "beaker"', "the id is taken by"),
        ('id = "flask"', "", r"\[\[body\]\] 3: id is missing"),
        ('parent = "beaker"', 'parent = "baeker"', "no parent 'baeker'; did you mean 'beaker'"),
        ('group = "glasses"', 'parent = "flask"', "its parents lead back to itself"),
        ('between = ["beaker", "flask"]', 'between = ["beaker", "glask"]', "no body is 'glask'; did you mean 'flask'"),
        ('between = ["beaker", "flask"]', 'between = ["beaker", "beaker"]', "paired with itself"),
        ('between = ["beaker", "flask"]', 'between = ["beaker"]', "between has 1 entries; give 2"),
        ('"tag:support"]', '"tag:suport"]', "no body is 'tag:suport'; did you mean 'tag:support'"),
        ("mass = 0.1", "mass = -1", "mass is -1; give a finite number above 0"),
        ("mass = 0.1", "mass = nan", "mass is nan"),
        ("mass = 0.1", 'mass = "heavy"', "mass is 'heavy'"),
        ("mass = 0.1", "mass = " + "9" * 400, r"mass is 9+\.\.\.; give a finite number"),
        ("mass = 0.1", "mass = " + "9" * 5000, "a number has thousands of digits"),
        ("mass = 0.1", "mass = 0x" + "f" * 5000, "mass is a number of thousands of digits"),
        ("faces = 800", "options = { faces = 800 }", r"\[\[body\]\] 2 \('beaker'\) options: unknown key 'faces'"),
        ("faces = 800", "faces = 800.5", "faces is 800.5; give a whole number from 4 to 1000000"),
        ("faces = 800", "faces = 100000000000", "faces is 100000000000; give a whole number"),
        ("fill_ml = 25.0", "fill_ml = nan", r"properties: fill_ml is nan; give finite numbers"),
        ('kind = "contact"', 'kind = "contact"\nhold_s = inf', "hold_s is inf; give finite numbers"),
        ("scale = 0.01", 'units = "feet"', "units is 'feet'; there are: cm, in, m, mm"),
        ("scale = 0.01", 'units = "cm"\nscale = 0.01', "it has units and scale; give one of them"),
        ('between = ["beaker", "flask"]', 'a = "beaker"', "b is missing"),
        ('between = ["beaker", "flask"]', 'betwene = ["beaker", "flask"]', "key 'betwene'; did you mean 'between'"),
        ("euler_deg = [90, 0, 0]", 'euler_deg = [90, 0, 0], order = "xxy"', "no Euler order 'xxy'"),
        ("scale = 0.01", 'scale = 0.01\nshape = "box"\nsize = [1, 1, 1]', "it has mesh and shape; give one"),
        ("fixed = {", "fixed = { quaternion_xyzw = [0, 0, 0, 0],", "norm 0, not 1"),
        ("fixed = {", "fixed = { place = 1,", r"fixed: unknown key 'place'"),
        ('kind = "contact"', "", r"\[\[effect\]\] 1: kind is missing"),
        ("[scene]", "[scene", "this is not TOML"),
    ],
)
def test_a_mistake_is_named_with_file_table_and_key(old, new, message):
    assert old in BENCH
    with pytest.raises(SceneError, match=message) as caught:
        parse_scene(BENCH.replace(old, new, 1))
    assert str(caught.value).startswith("scene.toml: ")
    assert "\n" not in str(caught.value)


FAULTY = """
[scene]
nam = "bench"
[[body]]
id = "table"
shape = "box"
size = [1, 2]
offset = { position = [0, 0, 0], turn = 3 }
[[body]]
id = "beaker"
instrument = "beaker_250"
options = { wall_mm = 2 }
masss = 1
mass = "heavy"
[[body]]
mesh = "a.glb"
units = "feet"
[[pair]]
between = ["beaker", "tabel"]
[[ignore]]
betwen = ["beaker", "table"]
[[effect]]
between = ["beaker"]
[sapce]
"""


def test_every_fault_of_a_scene_is_named_not_only_the_first():
    with pytest.raises(SceneError) as caught:
        parse_scene(FAULTY, "lab.toml")
    faults = caught.value.faults
    for place, key in [
        ("[scene]", "'nam'; did you mean 'name'"), ("[[body]] 1 ('table')", "size is [1, 2]"),
        ("[[body]] 1 ('table')", "a box needs size"), ("[[body]] 1 ('table') offset", "'turn'"),
        ("[[body]] 2 ('beaker') options", "'wall_mm'"), ("[[body]] 2 ('beaker')", "'masss'; did you mean 'mass'"),
        ("[[body]] 2 ('beaker')", "mass is 'heavy'"), ("[[body]] 3", "id is missing"),
        ("[[body]] 3 ('')", "units is 'feet'"), ("[[pair]] 1", "'tabel'; did you mean 'table'"),
        ("[[ignore]] 1", "'betwen'; did you mean 'between'"), ("[[effect]] 1", "kind is missing"),
        ("[[effect]] 1 ('')", "between has 1 entries"), ("", "'sapce'; did you mean 'space'"),
    ]:  # fmt: skip
        head = f"lab.toml: {place}: " if place else "lab.toml: unknown key"
        assert sum(one.startswith(head) and key in one for one in faults) == 1, (place, key, faults)
    assert len(faults) == 14
    assert str(caught.value) == f"{faults[0]}; and more: `replay scene check` lists every fault"


def test_a_missing_file_and_one_that_is_no_text_are_one_sentence(tmp_path):
    with pytest.raises(SceneError, match="does not exist"):
        read_scene(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="is not UTF-8 text"):
        read_scene(bad)
    with pytest.raises(SceneError, match="is a folder"):
        read_scene(tmp_path)


numbers = st.floats(-1e6, 1e6)
names = st.text(min_size=1, max_size=8)
poses = st.builds(Pose, st.tuples(numbers, numbers, numbers))
extras = {"mass": st.floats(1e-3, 10), "properties": st.dictionaries(names, names)}
bodies = st.builds(
    SceneBody, id=names, mesh=st.just("") | names, scale=st.floats(1e-6, 1e6), group=st.text(max_size=5),
    offset=poses, fixed=st.none() | poses, tags=st.lists(names, max_size=2).map(tuple), proxy=st.booleans(),
    extra=st.fixed_dictionaries({}, optional=extras),
)  # fmt: skip


@given(st.text(max_size=8), st.lists(bodies, max_size=4, unique_by=lambda body: body.id), st.none() | st.just(()))
def test_a_scene_written_as_toml_reads_back_the_same(name, found, effects):
    scene = Scene(name=name, bodies=tuple(found), effects=effects)
    back = parse_scene(scene_to_toml(scene))
    assert (back.name, back.bodies, back.pairs, back.effects) == (name, tuple(found), None, effects)
    assert scene_to_toml(back) == scene_to_toml(scene)


@given(st.text(max_size=200) | st.lists(st.sampled_from(BENCH.splitlines()), max_size=30).map("\n".join))
def test_no_text_ends_in_anything_but_a_scene_or_one_named_error(text):
    try:
        parse_scene(text)
    except SceneError as error:
        assert str(error).startswith("scene.toml: ")


def test_what_nobody_asked_for_is_unknown_and_the_nearest_asked_for_is_named():
    table = TomlTable({"colour": "red", "sise": 1}, "f.toml", "[x]", SceneError)
    assert table.text("colour") == "red"
    table.number("size", 0.0)
    with pytest.raises(SceneError, match=r"f.toml: \[x\]: unknown key 'sise'; did you mean 'size'\?"):
        table.done()


def test_true_is_no_number_and_infinity_neither():
    assert is_number(1)
    assert is_number(1.5)
    assert not any(is_number(value) for value in (True, float("inf"), float("nan"), "1", None, 10**400))


def test_without_a_near_name_all_are_listed():
    assert nearest("zzz", ["b", "a"]) == "; there are: a, b"
    assert nearest("zzz", []) == "; there are none"


def test_a_hostile_nesting_is_an_error_and_no_crash():
    with pytest.raises(SceneError, match=r"nested too deeply|not TOML"):
        parse_toml("a = " + "[" * 100_000, "f.toml", SceneError)


TRIANGLE = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_files_shapes_and_instruments_become_meshes(tmp_path):
    (tmp_path / "t.glb").write_bytes(mesh_to_glb(TRIANGLE, "t"))
    bodies = (
        SceneBody("file", mesh="t.glb", scale=0.5),
        SceneBody("shape", shape="sphere", size={"radius": 0.1}, extra={"faces": 500}),
        SceneBody("glass", instrument="beaker_100", extra={"faces": 600}), SceneBody("tracked"),
    )  # fmt: skip
    meshes = scene_meshes(Scene(bodies=bodies), tmp_path)
    assert list(meshes) == ["file", "shape", "glass"]
    assert np.array_equal(meshes["file"].vertices, TRIANGLE.vertices * 0.5)
    assert 300 < len(meshes["shape"].faces) < 700
    assert 400 < len(meshes["glass"].faces) < 900


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (SceneBody("m", mesh="absent.glb"), "body 'm': mesh file .*absent.glb does not exist"),
        (SceneBody("i", instrument="beaker_100", extra={"faces": 7}), "body 'i': beaker_100 with 7 faces"),
        (SceneBody("o", instrument="bench", extra={"options": {"colour": 1}}), "body 'o': bench has no option colour"),
        (SceneBody("w", instrument="bench", extra={"options": {"width": "wide"}}), "body 'w': "),
        (SceneBody("n", mesh="a\0.glb"), "body 'n': .*null"),
    ],
)
def test_a_mesh_that_cannot_be_made_names_its_body(body, message, tmp_path):
    with pytest.raises(SceneError, match=message):
        scene_meshes(Scene(bodies=(body,)), tmp_path)
