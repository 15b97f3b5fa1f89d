"""USD layers that a scene may not read, parts that contain themselves, and scenes that would fill the memory."""

import builtins
import os
import runpy
import subprocess
import sys
import zipfile

import pytest

from sessions.errors import SceneSourceError
from sessions.scene_formats import usd_trial
from sessions.scene_formats.scene_source import read_scene_source

Usd = pytest.importorskip("pxr.Usd")

BALL = 'def Sphere "ball" (prepend apiSchemas = ["PhysicsCollisionAPI"])\n{\n}\n'
"""Lines of a USD file: a sphere that collides."""
HEAD = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n)\n'
"""First lines of a USD file."""


def usda_file(folder, text, *, head=HEAD):
    """Writes scene.usda."""
    folder.mkdir(exist_ok=True)
    path = folder / "scene.usda"
    path.write_text(head + text)
    return path


def named_by(arc, name):
    """Text and head of a scene with a ball that names another layer by an arc of composition."""
    if arc == "sublayer":
        return BALL, HEAD.replace(")\n", f"    subLayers = [@{name}@]\n)\n")
    if arc == "variant":
        inner = f'variantSet "v" = {{\n"a" {{\n}}\n"b" (references = @{name}@) {{\n}}\n}}\n'
        more = 'variants = {\nstring v = "a"\n}\nprepend variantSets = "v"'
        return BALL + f'def "other" (\n{more}\n)\n{{\n{inner}}}\n', HEAD
    return BALL + f'def "other" ({arc} = @{name}@)\n{{\n}}\n', HEAD


@pytest.fixture(autouse=True)
def without_trial(monkeypatch):
    """Binary layers are read at once: none of these files ends the library, and another process takes 0.4 s."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.try_scene", lambda path, root: None)


ARCS = ["references", "payload", "sublayer", "variant"]
"""Ways by which a layer, a file of USD, takes in another one."""


@pytest.mark.parametrize(
    ("name", "refusal"),
    [
        pytest.param("../secret.usda", "lies outside", id="a folder above"),
        pytest.param("secret/../../secret.usda", "lies outside", id="a folder above, by a detour"),
        pytest.param("/etc/passwd", "lies outside", id="a file of the system"),
        pytest.param("link.usda", "lies outside", id="a link to a file outside"),
        pytest.param("loop.usda", "a link to itself", id="a link to itself"),
        pytest.param("https://a.example/b.usda", "by an address", id="another machine"),
        pytest.param("file:/etc/passwd", "by an address", id="a file by its address"),
        pytest.param("`${NAME}`", "by an expression", id="an expression"),
        pytest.param("notes.txt", "is no USD file", id="no file of USD"),
        pytest.param("broken.usda", "is no readable USD", id="text that ends early"),
        pytest.param("empty.usdc", "is no readable USD", id="binary file of zeros"),
        pytest.param("broken.usdz", "is no readable USD", id="no archive"),
        pytest.param("chain.usda", "lies outside", id="a file that refers to one outside"),
    ],
)
def test_layer_that_a_scene_may_not_read(tmp_path, capfd, name, refusal):
    """A scene refers to another layer by ``name``; ``refusal``: of the sentence that refuses it."""
    assert_layer_is_refused(tmp_path, capfd, arc="references", name=name, refusal=refusal)


@pytest.mark.parametrize("arc", ["payload", "sublayer", "variant"])
@pytest.mark.parametrize(("name", "refusal"), [("../secret.usda", "lies outside"), ("loop.usda", "a link to itself")])
def test_every_other_arc_refuses_outside_layers_and_loops(tmp_path, capfd, arc, name, refusal):
    """``secret.usda`` stands beside the scene's folder; ``loop.usda``, in the folder, is a link to itself."""
    assert_layer_is_refused(tmp_path, capfd, arc, name, refusal)


def assert_layer_is_refused(tmp_path, capfd, arc, name, refusal):
    """Fails unless a scene that names a layer by this arc is refused, and nothing of the layer is printed."""
    (tmp_path / "secret.usda").write_text(HEAD + BALL)
    folder = tmp_path / "scene"
    text, head = named_by(arc, name)
    path = usda_file(folder, text, head=head)
    (folder / "link.usda").symlink_to(tmp_path / "secret.usda")
    (folder / "loop.usda").symlink_to(folder / "loop.usda")
    (folder / "notes.txt").write_text("#usda 1.0\n")
    (folder / "broken.usda").write_text("#usda 1.0\ndef {")
    (folder / "empty.usdc").write_bytes(b"PXR-USDC" + b"\x00" * 100)
    (folder / "broken.usdz").write_bytes(b"PK\x03\x04 no archive")
    (folder / "chain.usda").write_text(HEAD + 'def "a" (references = @../secret.usda@)\n{\n}\n')
    with pytest.raises(SceneSourceError, match=refusal) as refused:
        read_scene_source(path)
    assert "\n" not in str(refused.value)
    assert capfd.readouterr() == ("", "")  # the library prints nothing beside the sentence


@pytest.mark.parametrize("arc", ARCS)
def test_missing_layer_is_named(tmp_path, capfd, arc):
    """A ball, and a prim that names gone.usda by this arc: the ball is read, and the layer listed as missing.

    The library prints nothing of its own.
    """
    text, head = named_by(arc, "gone.usda")
    scene = read_scene_source(usda_file(tmp_path, text, head=head))
    assert [*scene.bodies] == ["ball"]
    assert scene.left_out == ("the layer 'gone.usda', which is missing",)
    assert capfd.readouterr() == ("", "")


@pytest.fixture
def scene_with_layer_elsewhere(tmp_path):
    """A scene that refers to found.usda, and the folder of that file, which is not the scene's."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "found.usda").write_text(HEAD + BALL)
    scene = usda_file(tmp_path / "scene", BALL + 'def "other" (references = @found.usda@</ball>)\n{\n}\n')
    return scene, elsewhere


def test_layer_of_the_working_folder_is_refused(scene_with_layer_elsewhere, monkeypatch):
    """The scene names a layer that stands in the working folder, where USD's library looks too, and not beside it."""
    scene, elsewhere = scene_with_layer_elsewhere
    monkeypatch.chdir(elsewhere)
    with pytest.raises(SceneSourceError, match="lies outside"):
        read_scene_source(scene)


@pytest.mark.slow
def test_layer_of_the_search_path_is_refused(scene_with_layer_elsewhere):
    """The scene names a layer in the folder of USD's search path, a variable of the environment.

    The library looks at the variable once, when it is loaded: so another process reads the scene.
    """
    scene, elsewhere = scene_with_layer_elsewhere
    code = f"from sessions.scene_formats.scene_source import read_scene_source; read_scene_source({str(scene)!r})"
    environment = {**os.environ, "PXR_AR_DEFAULT_SEARCH_PATH": str(elsewhere)}
    ended = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert "SceneSourceError" in ended.stderr and "lies outside" in ended.stderr


def test_reference_to_no_prim_is_named_in_a_line(tmp_path, monkeypatch):
    """The prim "other" refers to "nowhere", which is none: the ball is read, and the library's reason names both.

    The reason is not cut here, for it has the path of the test's folder.
    """
    monkeypatch.setattr("sessions.scene_formats.usd_layers.LONGEST_REASON", 10_000)
    scene = read_scene_source(usda_file(tmp_path, BALL + 'def "other" (references = </nowhere>)\n{\n}\n'))
    assert [*scene.bodies] == ["ball"]
    assert "</nowhere>" in scene.left_out[0] and scene.left_out[0].endswith("</other>")


def test_long_reason_of_the_library_is_cut(tmp_path, monkeypatch):
    """A reason may have 20 letters: the rest, with the prim "nowhere", is three dots."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.LONGEST_REASON", 20)
    scene = read_scene_source(usda_file(tmp_path, BALL + 'def "other" (references = </nowhere>)\n{\n}\n'))
    assert "</nowhere>" not in scene.left_out[0] and scene.left_out[0].endswith(": Unresolved reference ...")


@pytest.mark.parametrize("arc", ["references", "inherits"])
def test_prims_that_contain_each_other_are_refused(tmp_path, arc):
    """The prims a and b of a scene are each made of the other, by ``arc``."""
    text = BALL + f'def "a" ({arc} = </b>)\n{{\n}}\ndef "b" ({arc} = </a>)\n{{\n}}\n'
    with pytest.raises(SceneSourceError, match="contains itself"):
        read_scene_source(usda_file(tmp_path, text))


def test_layer_that_is_its_own_sublayer_is_refused(tmp_path):
    """The head of scene.usda names scene.usda as a layer below it."""
    head = HEAD.replace(")\n", "    subLayers = [@scene.usda@]\n)\n")
    with pytest.raises(SceneSourceError, match="contains itself"):
        read_scene_source(usda_file(tmp_path, BALL, head=head))


def test_files_that_contain_each_other_are_refused(tmp_path):
    """The prim a of scene.usda is b of other.usda, and that is a of scene.usda."""
    (tmp_path / "other.usda").write_text(HEAD + 'def "b" (references = @scene.usda@</a>)\n{\n}\n')
    text = BALL + 'def "a" (references = @other.usda@</b>)\n{\n}\n'
    with pytest.raises(SceneSourceError, match="contains itself"):
        read_scene_source(usda_file(tmp_path, text))


@pytest.mark.parametrize("arc", ["references", "inherits", "specializes", "payload"])
def test_few_lines_that_ask_for_many_prims_are_refused(tmp_path, monkeypatch, arc):
    """Each of 20 levels has ten children, each the next level by ``arc``: 10^20 prims, of which 1,000 are allowed."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.MOST_PRIMS", 1_000)
    levels = []
    for level in range(20):
        children = "".join(f'def "c{child}" ({arc} = </level{level + 1}>)\n{{\n}}\n' for child in range(10))
        levels.append(f'def "level{level}"\n{{\n{children}}}\n')
    text = BALL + "".join(levels) + 'def Sphere "level20"\n{\n}\n'
    with pytest.raises(SceneSourceError, match=r"composes more than 1,000 prims"):
        read_scene_source(usda_file(tmp_path, text))


def test_layers_beside_each_other_may_name_each_other(tmp_path):
    """The prim a is b of the other file, and b is the ball of the first: files go round, but no prim holds itself."""
    (tmp_path / "other.usda").write_text(HEAD + 'def "b" (references = @scene.usda@</ball>)\n{\n}\n')
    text = BALL + 'def "a" (references = @other.usda@</b>)\n{\n}\n'
    assert [*read_scene_source(usda_file(tmp_path, text)).bodies] == ["ball", "a"]


def test_value_clips_are_refused(tmp_path):
    """A value clip names a file, here one of the system, from which USD takes values over time."""
    clips = 'clips = {\ndictionary default = {\nasset[] assetPaths = [@/etc/passwd@]\nstring primPath = "/a"\n}\n}'
    with pytest.raises(SceneSourceError, match="value clips"):
        read_scene_source(usda_file(tmp_path, BALL + f'def "a" (\n{clips}\n)\n{{\n}}\n'))


def usdz_package(folder, reference):
    """A package with scene.usda, which has a ball and a prim that refers to a ball of another file, and part.usda."""
    folder.mkdir()
    path = folder / "scene.usdz"
    with zipfile.ZipFile(path, "w") as package:
        text = BALL + f'def "a" (references = @{reference}@</ball>)\n{{\n}}\n'
        package.writestr("scene.usda", HEAD + text)
        package.writestr("part.usda", HEAD + BALL)
    return path


def test_usdz_package_reads_layers_inside_the_package(tmp_path):
    """The prim a is the ball of part.usda, which is in the package."""
    assert [*read_scene_source(usdz_package(tmp_path / "scene", "part.usda")).bodies] == ["ball", "a"]


def test_usdz_package_reads_no_layer_beside_the_package(tmp_path):
    """A layer beside the package gives no body, whether the library takes it for missing or it is refused."""
    (tmp_path / "secret.usda").write_text(HEAD + BALL)
    path = usdz_package(tmp_path / "scene", "../secret.usda")
    try:
        bodies = [*read_scene_source(path).bodies]
    except SceneSourceError as refused:
        assert "\n" not in str(refused)
    else:
        assert bodies == ["ball"]


@pytest.mark.parametrize(
    ("matrix", "refusal"),
    [
        pytest.param("((0,0,0,0),(0,0,0,0),(0,0,0,0),(0,0,0,1))", "a scale of 0", id="scale of 0"),
        pytest.param("((nan,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))", "no number", id="rotation of NaN"),
        pytest.param("((1,0,0,0),(0,1,0,0),(0,0,1,0),(inf,0,0,1))", "no number", id="infinitely far away"),
    ],
)
def test_transform_of_zero_scale_or_non_finite_numbers_is_refused(tmp_path, matrix, refusal):
    """``matrix``: the pose of the ball, four rows of which the last is its translation."""
    lines = f'matrix4d xformOp:transform = {matrix}\nuniform token[] xformOpOrder = ["xformOp:transform"]'
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(usda_file(tmp_path, BALL.replace("{\n}", f"{{\n{lines}\n}}")))


@pytest.mark.parametrize("radius", ["nan", "-1", "0"])
def test_sphere_without_a_positive_radius_is_named_as_ignored(tmp_path, radius):
    """The sphere is the only collider of the scene: without it no body is left, and the refusal names the sphere."""
    usd_file = usda_file(tmp_path, BALL.replace("{\n}", f"{{\ndouble radius = {radius}\n}}"))
    with pytest.raises(SceneSourceError, match=r"no body that collides; not taken: the .*'/ball'"):
        read_scene_source(usd_file)


@pytest.mark.parametrize("metres_per_unit", ["0", "-1", "inf", "nan"])
def test_usd_scene_needs_positive_finite_metres_per_unit(tmp_path, metres_per_unit):
    """The head of a file with a ball says its unit of length as 0, -1, inf or nan metres."""
    head = HEAD.replace("metersPerUnit = 1", f"metersPerUnit = {metres_per_unit}")
    with pytest.raises(SceneSourceError, match="metersPerUnit"):
        read_scene_source(usda_file(tmp_path, BALL, head=head))


def test_absence_of_the_library_is_explained(tmp_path, monkeypatch):
    """The import of ``pxr``, USD's library, fails: the error says what to install."""
    usual_import = builtins.__import__

    def import_without_pxr(name, *more, **keys):
        if name == "pxr":
            raise ImportError(name)
        return usual_import(name, *more, **keys)

    monkeypatch.setattr(builtins, "__import__", import_without_pxr)
    with pytest.raises(SceneSourceError, match=r'USD needs usd-core; install it: pip install "vrlab-replay\[usd\]"'):
        read_scene_source(usda_file(tmp_path, BALL))


def test_binary_layer_that_ends_the_library_is_refused(tmp_path, monkeypatch):
    """Binary layers are tried in another process, here one that ends by SIGABRT as the library may."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.try_scene", usd_trial.try_scene)
    (tmp_path / "part.usdc").write_bytes(b"PXR-USDC")
    path = usda_file(tmp_path, BALL + 'def "other" (references = @part.usdc@)\n{\n}\n')
    # The interpreter that dies stands for the library, which does so on few mutants alone.
    dying = tmp_path / "dying"
    dying.write_text("#!/bin/sh\nkill -ABRT $$\n")
    dying.chmod(0o755)
    monkeypatch.setattr(usd_trial.sys, "executable", str(dying))
    with pytest.raises(SceneSourceError, match=r"breaks down on .*scene.usda: it is damaged") as refused:
        read_scene_source(path)
    assert "\n" not in str(refused.value)


def test_trial_program_reads_the_scene_of_its_arguments(tmp_path, monkeypatch):
    """The trial, a program of its own, is run with a scene and the folder that it may read; the reader gets both."""
    monkeypatch.setitem(sys.modules, "resource", None)  # else the memory of the tests would be bounded too
    scenes = []
    monkeypatch.setattr(
        "sessions.scene_formats.usd_physics.read_usd_motion",
        lambda path, files, *_, **__: scenes.append((path, files.root)),
    )
    monkeypatch.setattr(sys, "argv", ["usd_trial", str(tmp_path / "s.usdc"), str(tmp_path)])
    runpy.run_path(usd_trial.__file__, run_name="__main__")
    assert scenes == [(tmp_path / "s.usdc", tmp_path.resolve())]


@pytest.fixture
def tried(monkeypatch):
    """The arguments of every trial, a reading in another process that a broken layer may end; none is run."""
    trials = []
    monkeypatch.setattr("sessions.scene_formats.usd_layers.try_scene", lambda *arguments: trials.append(arguments))
    return trials


@pytest.fixture
def scene_with_binary_layer(tmp_path):
    """A scene with a ball that refers to a sphere in part.usdc, a binary layer."""
    layer = Usd.Stage.CreateNew(str(tmp_path / "part.usdc"))
    layer.DefinePrim("/a", "Sphere")
    layer.Save()
    return usda_file(tmp_path, BALL + 'def "other" (references = @part.usdc@</a>)\n{\n}\n')


def test_scene_with_a_binary_layer_is_tried_first(scene_with_binary_layer, tried):
    """A scene refers to a sphere in a binary file, which may end the library: another process tries to read it first.

    It is tried once, with the folder that it may read, and then read.
    """
    assert [*read_scene_source(scene_with_binary_layer).bodies] == ["ball"]
    assert tried == [(scene_with_binary_layer, scene_with_binary_layer.parent.resolve())]


def test_scene_of_text_alone_is_not_tried(tmp_path, tried):
    """Only binary files can end the library and are read by another process first; a ball in text is read at once."""
    assert [*read_scene_source(usda_file(tmp_path, BALL)).bodies] == ["ball"]
    assert tried == []


@pytest.mark.slow
def test_trial_accepts_a_sound_binary_layer(scene_with_binary_layer):
    """A scene refers to a sphere in a binary file: a trial reading, in another process, raises no error."""
    usd_trial.try_scene(scene_with_binary_layer, scene_with_binary_layer.parent)
