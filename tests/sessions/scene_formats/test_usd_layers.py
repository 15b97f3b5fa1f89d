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
HEAD = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n)\n'


def usda_file(folder, text, *, head=HEAD):
    """Writes scene.usda."""
    folder.mkdir(exist_ok=True)
    path = folder / "scene.usda"
    path.write_text(head + text)
    return path


def named_by(arc, name):
    """A scene with a ball that names another layer by an arc of composition."""
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


@pytest.mark.parametrize(
    ("name", "refusal"),
    [
        ("../secret.usda", "lies outside"),
        ("secret/../../secret.usda", "lies outside"),
        ("/etc/passwd", "lies outside"),
        ("link.usda", "lies outside"),
        ("loop.usda", "a link to itself"),
        ("https://a.example/b.usda", "by an address"),
        ("file:/etc/passwd", "by an address"),
        ("`${NAME}`", "by an expression"),
        ("notes.txt", "is no USD file"),
        ("broken.usda", "is no readable USD"),
        ("empty.usdc", "is no readable USD"),
        ("broken.usdz", "is no readable USD"),
        ("chain.usda", "lies outside"),
    ],
)
def test_layer_that_a_scene_may_not_read(tmp_path, capfd, name, refusal):
    """``name``: of the layer, by which a scene refers to it; ``refusal``: of the sentence that refuses it."""
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
    """A ball, and a prim that names gone.usda by this arc: the ball is read."""
    text, head = named_by(arc, "gone.usda")
    scene_source = read_scene_source(usda_file(tmp_path, text, head=head))
    assert [*scene_source.bodies] == ["ball"] and scene_source.left_out == ("the layer 'gone.usda', which is missing",)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("where", ["working folder", pytest.param("environment", marks=pytest.mark.slow)])
def test_layer_of_another_folder_is_refused(tmp_path, monkeypatch, where):
    """found.usda stands in the working folder, or in the folder of USD's search path, and not beside the scene."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "found.usda").write_text(HEAD + BALL)
    path = usda_file(tmp_path / "scene", BALL + 'def "other" (references = @found.usda@</ball>)\n{\n}\n')
    if where == "working folder":
        monkeypatch.chdir(elsewhere)
        with pytest.raises(SceneSourceError, match="lies outside"):
            read_scene_source(path)
    else:
        # The library looks at its variable once, when it is loaded.
        code = f"from sessions.scene_formats.scene_source import read_scene_source; read_scene_source({str(path)!r})"
        environment = {**os.environ, "PXR_AR_DEFAULT_SEARCH_PATH": str(elsewhere)}
        ran = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
        assert "lies outside" in ran.stderr


@pytest.mark.parametrize(("longest", "ending"), [(20, ": Unresolved reference ..."), (10_000, "</other>")])
def test_reference_to_no_prim_is_named_in_a_line(tmp_path, monkeypatch, longest, ending):
    """The library's reason is cut after ``longest`` letters: whole, it names both prims."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.LONGEST_REASON", longest)
    scene_source = read_scene_source(usda_file(tmp_path, BALL + 'def "other" (references = </nowhere>)\n{\n}\n'))
    assert [*scene_source.bodies] == ["ball"] and scene_source.left_out[0].endswith(ending)
    assert ("</nowhere>" in scene_source.left_out[0]) == (longest > 20)


@pytest.mark.parametrize("kind", ["references", "inherits", "sublayer", "two files"])
def test_arcs_that_contain_themselves_are_refused(tmp_path, kind):
    """Two prims that refer to each other, a layer that is its own sublayer, and two files."""
    head, text = HEAD, BALL
    if kind == "sublayer":
        head = HEAD.replace(")\n", "    subLayers = [@scene.usda@]\n)\n")
    elif kind == "two files":
        text += 'def "a" (references = @other.usda@</b>)\n{\n}\n'
        (tmp_path / "other.usda").write_text(HEAD + 'def "b" (references = @scene.usda@</a>)\n{\n}\n')
    else:
        text += f'def "a" ({kind} = </b>)\n{{\n}}\ndef "b" ({kind} = </a>)\n{{\n}}\n'
    with pytest.raises(SceneSourceError, match="contains itself"):
        read_scene_source(usda_file(tmp_path, text, head=head))


@pytest.mark.parametrize("arc", ["references", "inherits", "specializes", "payload"])
def test_few_lines_that_ask_for_many_prims_are_refused(tmp_path, monkeypatch, arc):
    """Each of 20 levels has ten of the next: 10^20 prims, of which 1,000 are allowed."""
    monkeypatch.setattr("sessions.scene_formats.usd_layers.MOST_PRIMS", 1_000)
    levels = [
        f'def "level{k}"\n{{\n' + "".join(f'def "c{j}" ({arc} = </level{k + 1}>)\n{{\n}}\n' for j in range(10)) + "}\n"
        for k in range(20)
    ]
    text = BALL + "".join(levels) + 'def Sphere "level20"\n{\n}\n'
    with pytest.raises(SceneSourceError, match=r"composes more than 1,000 prims"):
        read_scene_source(usda_file(tmp_path, text))


def test_layers_beside_each_other_may_name_each_other(tmp_path):
    """ "a" is b of the other file, and b is the first file's ball: no prim contains itself."""
    (tmp_path / "other.usda").write_text(HEAD + 'def "b" (references = @scene.usda@</ball>)\n{\n}\n')
    text = BALL + 'def "a" (references = @other.usda@</b>)\n{\n}\n'
    assert [*read_scene_source(usda_file(tmp_path, text)).bodies] == ["ball", "a"]


def test_value_clips_are_refused(tmp_path):
    """A clip names a file outside the scene, by which USD takes values from it."""
    clips = 'clips = {\ndictionary default = {\nasset[] assetPaths = [@/etc/passwd@]\nstring primPath = "/a"\n}\n}'
    with pytest.raises(SceneSourceError, match="value clips"):
        read_scene_source(usda_file(tmp_path, BALL + f'def "a" (\n{clips}\n)\n{{\n}}\n'))


@pytest.mark.parametrize("inner", ["part.usda", "../secret.usda"])
def test_usdz_package_reads_only_layers_inside_the_package(tmp_path, inner):
    """The package has scene.usda and part.usda.

    A layer beside the package gives no body, whether it is refused or left out.
    """
    (tmp_path / "secret.usda").write_text(HEAD + BALL)
    folder = tmp_path / "scene"
    folder.mkdir()
    path = folder / "scene.usdz"
    with zipfile.ZipFile(path, "w") as package:
        text = BALL + f'def "a" (references = @{inner}@</ball>)\n{{\n}}\n'
        package.writestr("scene.usda", HEAD + text)
        package.writestr("part.usda", HEAD + BALL)
    if inner.startswith(".."):
        try:
            assert [*read_scene_source(path).bodies] == ["ball"]
        except SceneSourceError as refused:
            assert "\n" not in str(refused)
    else:
        assert [*read_scene_source(path).bodies] == ["ball", "a"]


@pytest.mark.parametrize(
    ("lines", "refusal"),
    [
        ("matrix4d xformOp:transform = ((0,0,0,0),(0,0,0,0),(0,0,0,0),(0,0,0,1))", "a scale of 0"),
        ("matrix4d xformOp:transform = ((nan,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))", "no number"),
        ("matrix4d xformOp:transform = ((1,0,0,0),(0,1,0,0),(0,0,1,0),(inf,0,0,1))", "no number"),
    ],
)
def test_transform_of_zero_scale_or_non_finite_numbers_is_refused(tmp_path, lines, refusal):
    """``lines``: the pose of the ball as a matrix of four rows; the last row is its translation."""
    text = BALL.replace("{\n}", f'{{\n{lines}\nuniform token[] xformOpOrder = ["xformOp:transform"]\n}}')
    with pytest.raises(SceneSourceError, match=refusal):
        read_scene_source(usda_file(tmp_path, text))


@pytest.mark.parametrize("line", ["double radius = nan", "double radius = -1", "double radius = 0"])
def test_sphere_without_a_positive_radius_is_named_as_ignored(tmp_path, line):
    """The sphere is the only collider of the scene: without it no body is left, and the refusal names the sphere."""
    usd_file = usda_file(tmp_path, BALL.replace("{\n}", f"{{\n{line}\n}}"))
    with pytest.raises(SceneSourceError, match=r"no body that collides; not taken: the .*'/ball'"):
        read_scene_source(usd_file)


@pytest.mark.parametrize("length_unit", ["0", "-1", "inf", "nan"])
def test_usd_scene_needs_positive_finite_metres_per_unit(tmp_path, length_unit):
    """``length_unit``: metres per unit in the head of the file."""
    header = HEAD.replace("metersPerUnit = 1", f"metersPerUnit = {length_unit}")
    usd_file = usda_file(tmp_path, BALL, head=header)
    with pytest.raises(SceneSourceError, match="metersPerUnit"):
        read_scene_source(usd_file)


def test_absence_of_the_library_is_explained(tmp_path, monkeypatch):
    """The import of ``pxr`` fails."""
    own = builtins.__import__

    def without(name, *more, **keys):
        if name == "pxr":
            raise ImportError(name)
        return own(name, *more, **keys)

    monkeypatch.setattr(builtins, "__import__", without)
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
    """The program is run with a scene and its root; the reader gets both."""
    monkeypatch.setitem(sys.modules, "resource", None)  # else the memory of the tests would be bounded too
    scenes = []
    monkeypatch.setattr(
        "sessions.scene_formats.usd_physics.read_usd_motion",
        lambda path, files, *_, **__: scenes.append((path, files.root)),
    )
    monkeypatch.setattr(sys, "argv", ["usd_trial", str(tmp_path / "s.usdc"), str(tmp_path)])
    runpy.run_path(usd_trial.__file__, run_name="__main__")
    assert scenes == [(tmp_path / "s.usdc", tmp_path.resolve())]


@pytest.mark.slow
def test_trial_reads_as_an_import_does(tmp_path, monkeypatch):
    """A scene with a binary layer is tried once, with its root; the trial itself accepts it.

    Without such a layer none is tried.
    """
    layer = Usd.Stage.CreateNew(str(tmp_path / "part.usdc"))
    layer.DefinePrim("/a", "Sphere")
    layer.Save()
    tried = []
    monkeypatch.setattr("sessions.scene_formats.usd_layers.try_scene", lambda *given: tried.append(given))
    path = usda_file(tmp_path, BALL + 'def "other" (references = @part.usdc@</a>)\n{\n}\n')
    assert [*read_scene_source(path).bodies] == ["ball"] and tried == [(path, tmp_path.resolve())]
    usd_trial.try_scene(path, tmp_path)
    assert [*read_scene_source(usda_file(tmp_path, BALL)).bodies] == ["ball"] and len(tried) == 1
