"""`replay scene`, and `--scene` on every verb that reads a session."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.mutants import MUTANTS, tried
from support.optional import DATA
from support.small_worlds import cube, unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.cli.scene import ALL_PAIRS, plan_lines
from replay.effects.effect_plan import plan_faults
from sessions import import_session, read_session, write_session
from sessions.errors import SceneError
from sessions.input_files import read_text
from sessions.scene_files.scene_meshes import checked_scene
from sessions.scene_files.scene_toml import parse_scene, read_scene, scene_to_toml
from sessions.synthetic.scenes import SCENES, make_scene_session

CAPTURES = (
    "aframe-motion-capture/grabLeft",
    "aframe-motion-capture/grabRight",
    "aframe-motion-capture/tracked-recording",
    "a-saturday-night/dance",
)
POSITIONS = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3], "c": [9, 9, 9, 0.8, 9, 9]}
OWN = """
[scene]
name = "own"
[[body]]
id = "a"
group = "all"
[[body]]
id = "b"
[[body]]
id = "c"
group = "all"
[[effect]]
kind = "contact"
between = ["a", "c"]
"""
OTHER = """
[scene]
name = "other"
[[body]]
id = "a"
[[body]]
id = "b"
shape = "box"
size = [0.5, 0.5, 0.5]
[[pair]]
between = ["a", "b"]
"""


@pytest.fixture
def session_and_scene(tmp_path):
    """A folder with s.mcap, which has a scene of its own, and other.toml."""
    session = unit_cubes_on_x(POSITIONS, scene=parse_scene(OWN))
    write_session(session, tmp_path / "s.mcap")
    (tmp_path / "other.toml").write_text(OTHER)
    return tmp_path


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_end_in_a_scene_or_in_named_faults(tmp_path, count):
    """``count`` times a scene file is damaged at random: a faulty file in the quick run (3 times), else a whole one.

    It is read, or refused by faults that can be printed and begin with its name; nothing else may happen.
    """
    path = tmp_path / "rich.toml"
    faulty = OTHER + Path(__file__).with_name("faulty.toml").read_text("utf-8")
    is_quick = count == 3
    path.write_text(faulty if is_quick else scene_to_toml(make_scene_session("titration")[0].scene))

    def read():
        text = read_text(path, "scene", SceneError)
        _scene, _meshes, faults = checked_scene(text, str(path), plan_faults, tmp_path)
        assert all(fault.isprintable() and fault.startswith(str(path)) for fault in faults), faults
        read_scene(path)

    tried(path, count, read, path.name)


def test_a_wrong_instrument_of_a_vessel_is_named_once():
    """A flask of a scene is an unknown instrument, which both the body and the effect on it read: one fault."""
    text = """
[[body]]
id = "flask"
instrument = "erlenmeyer_flas"
properties = { liquid = { volume_ml = 25.0 } }
[[effect]]
kind = "mixing"
in = ["flask"]
"""
    _scene, _meshes, (fault,) = checked_scene(text, "scene.toml", plan_faults)
    assert fault.endswith("no instrument 'erlenmeyer_flas'; did you mean 'erlenmeyer_flask'?")


def run_exact(session, **more):
    """The result of a run of a session with the exact detector alone."""
    return replay.run(session, detectors="exact", oracle="none", **more)


def test_given_scene_replaces_all_of_the_recorded_scene(session_and_scene):
    """The recording's own scene has bodies a, b, c and an effect contact between a and c; a, b are unit cubes.

    other.toml has a and b, the pair of both, and a mesh for b, a box of 0.5 m, so that b 0.9 m beside a is no contact.
    """
    own = run_exact(session_and_scene / "s.mcap")
    other = run_exact(session_and_scene / "s.mcap", scene=session_and_scene / "other.toml")
    assert own.document.session.scene == "own" and other.document.session.scene == "other"
    assert [pair.name for pair in own.document.pairs] == ["a-c"]
    assert [pair.name for pair in other.document.pairs] == ["a-b"]
    assert other.session.scene.effects is None and other.session.scene.body("c") is None
    assert other.document.session.facts["scene_file"] == "other.toml"
    assert "scene_file" not in own.document.session.facts
    largest_corner, x = 1, 0
    assert own.session.meshes["b"].bounds[largest_corner, x] == 0.5
    assert other.session.meshes["b"].bounds[largest_corner, x] == 0.25
    assert not other.episodes["exact"]


def test_given_scene_is_written_as_the_recordings_own(session_and_scene):
    """A session that was run with other.toml is written: its file has that scene, and no fact that names the file."""
    other = run_exact(session_and_scene / "s.mcap", scene=session_and_scene / "other.toml")
    assert "scene_file" in other.session.facts
    write_session(other.session, session_and_scene / "written.mcap")
    written = read_session(session_and_scene / "written.mcap")
    assert written.scene.name == "other" and "scene_file" not in written.facts


def test_given_scene_serves_a_session_in_memory_as_a_file(session_and_scene):
    """A session is run with other.toml from its file, and as an object that was read from the file: one digest."""
    file, scene = session_and_scene / "s.mcap", session_and_scene / "other.toml"
    of_file, of_session = run_exact(file, scene=scene), run_exact(read_session(file), scene=scene)
    assert of_session.detections["exact"].digest == of_file.detections["exact"].digest


def test_small_scene_names_a_group_for_pairs(session_and_scene, capsys):
    """A scene without bodies adds a group "hand" of b and c to the recorded scene "own", which stays.

    ``--pairs ha*:a`` matches the group: a pair of a with it, and with each of its members. b meets a in frame 2 and c
    in frame 3, which is one contact of the group.
    """
    small = session_and_scene / "small.toml"
    small.write_text('[[group]]\nname = "hand"\nmembers = ["b", "c"]')
    command = ["run", str(session_and_scene / "s.mcap"), "--scene", str(small), "--format", "json", "-q"]
    assert main([*command, "--pairs", "ha*:a", "--detectors", "hybrid,exact"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [pair["name"] for pair in document["pairs"]] == ["a-b", "a-c", "a-hand"]
    assert document["audit"]["hybrid"]["contacts"] == 1
    assert document["session"]["scene"] == "own"


def test_pairs_by_a_single_name_are_refused(session_and_scene, capsys):
    """``--pairs hand`` names one side only: a wrong call (2)."""
    assert main(["run", str(session_and_scene / "s.mcap"), "--pairs", "hand"]) == 2
    assert "write two names with a colon between" in capsys.readouterr().err


def test_imported_scene_without_bodies_adds_to_the_recording(tmp_path):
    """The log that is imported has poses of cup and rod, the scene beside it only a group of both."""
    log, scene, out = tmp_path / "log.csv", tmp_path / "scene.toml", tmp_path / "s.mcap"
    rows = [f"pose,0,{name},0,0,0,0,0,0,1,1,," for name in ("cup", "rod")]
    log.write_text("\n".join(["kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value", *rows, ""]))
    scene.write_text('[[group]]\nname = "glass"\nmembers = ["cup", "rod"]')
    assert main(["import", "csv", str(log), "-o", str(out), "--convention", "openxr", "--scene", str(scene)]) == 0
    assert [group.members for group in read_session(out).scene.groups] == [("cup", "rod")]


@pytest.fixture
def csv_with_meshes(tmp_path):
    """A folder with x.csv, poses of bodies a, b and c; map.toml, its columns; and meshes/, of a and of "B (Clone)".

    The mesh of a is a cube with edges of 10 units, that of b of 0.1, each a tenth of an edge off on x.
    """
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    for name, edge in (("a", 10.0), ("B (Clone)", 0.1)):
        corners = edge * (cube().vertices + np.array([0.1, 0, 0]))
        lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a} {b} {c}" for a, b, c in cube().faces + 1]
        (meshes / f"{name}.obj").write_text("\n".join(lines))
    rows = [f"{t},{name},{t},0,0,0,0,0,1" for t in (0, 0.1) for name in ("a", "b", "c")]
    (tmp_path / "x.csv").write_text("\n".join(["time,body,px,py,pz,qx,qy,qz,qw", *rows, ""]))
    (tmp_path / "map.toml").write_text(
        '[time]\ncolumn = "time"\nunit = "s"\n[body]\nname = "body"\nposition = ["px", "py", "pz"]\n'
        'quaternion_xyzw = ["qx", "qy", "qz", "qw"]\n'
    )
    return tmp_path


def import_csv_with_meshes(folder, *options):
    """The session file that `replay import csv` makes of x.csv with the meshes of the folder beside it."""
    out = folder / "csv.mcap"
    mapping = ["--mapping", str(folder / "map.toml"), "--convention", "openxr", "--meshes", str(folder / "meshes")]
    assert main(["import", "csv", str(folder / "x.csv"), "-o", str(out), *mapping, *options]) == 0
    return out


CUBE_OF_10_CM_1_CM_OFF = [[-0.04, -0.05, -0.05], [0.06, 0.05, 0.05]]
"""Smallest and largest corner in metres."""


def test_meshes_of_a_folder_reach_their_bodies_in_an_import(csv_with_meshes, capsys):
    """Meshes are named like bodies, "B (Clone)" like b; c has none. 10 units are too long for metres: taken for cm.

    The command and a fact of the recording say so.
    """
    session = read_session(import_csv_with_meshes(csv_with_meshes))
    text = "a: a.obj; a.obj is 10 units long, taken for cm: 100 mm; b: B (Clone).obj; no mesh is named like: c"
    assert text in " ".join(capsys.readouterr().err.split())
    assert session.facts["conversions"].endswith(text) and {*session.meshes} == {"a", "b"}
    assert np.allclose(session.meshes["a"].bounds, CUBE_OF_10_CM_1_CM_OFF, rtol=0, atol=1e-12)


def test_units_and_axes_of_meshes_are_options_of_an_import(csv_with_meshes):
    """The mesh of body a is a cube with edges of 10 units, which reaches from -4 to 6 on x.

    The command takes units for mm and flips x: it reaches from -6 to 4 mm.
    """
    out = import_csv_with_meshes(csv_with_meshes, "--mesh-units", "mm", "--mesh-axes", "x-flipped")
    x = 0
    assert read_session(out).meshes["a"].bounds[:, x] == pytest.approx([-0.006, 0.004])


def test_meshes_of_a_folder_reach_bodies_of_a_draft(csv_with_meshes):
    """`replay scene new` drafts a scene in another folder: it names the mesh of a from there, with a scale for cm.

    The scene has no fault, and with it the mesh is as the import had it.
    """
    session_file = import_csv_with_meshes(csv_with_meshes)
    meshes, draft = csv_with_meshes / "meshes", csv_with_meshes / "deep" / "new.toml"
    assert main(["scene", "new", str(session_file), "--meshes", str(meshes), "-o", str(draft)]) == 0
    body = parse_scene(draft.read_text()).body("a")
    assert (body.mesh, body.scale) == ("../meshes/a.obj", 0.01)
    assert main(["scene", "check", str(draft)]) == 0
    bounds = read_session(session_file, scene=draft).meshes["a"].bounds
    assert np.allclose(bounds, CUBE_OF_10_CM_1_CM_OFF, rtol=0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SCENES, *CAPTURES])
def test_drafted_scene_of_every_recording_runs_unchanged(name, tmp_path):
    """``name``: a made-up scene, or a capture, where the recordings are on this machine.

    `replay scene new` drafts a scene of the recording, which has no fault; a run with it has the same bodies, and
    every pair that touches in a run without it.
    """
    file = tmp_path / "s.mcap"
    if name in SCENES:
        write_session(make_scene_session(name)[0], file)
    elif not DATA.is_dir():
        pytest.skip("the recordings are not here")
    else:
        write_session(import_session("aframe", DATA / f"{name}.json"), file)
    assert main(["scene", "new", str(file), "-q"]) == 0
    assert main(["scene", "check", str(tmp_path / "s.toml")]) == 0
    with_draft, own = run_exact(file, scene=tmp_path / "s.toml"), run_exact(file)
    touching = {frozenset(own.assembly.pairs[contact.pair].tolist()) for contact in own.episodes["exact"]}
    listed = {frozenset(pair) for pair in with_draft.assembly.pairs.tolist()}
    assert own.assembly.names == with_draft.assembly.names
    assert listed and touching <= listed


def test_plan_gives_a_reason_for_each_item():
    """The plan of a run as text; a reason of one word is an effect, which "needs it", a sentence stands as it is."""
    fields = {
        "effects": {"pour": ["the scene declares it"]},
        "pairs": None,
        "detectors": {"exact": ["contact", "grasp"]},
        "bodies": {"cup": ["pour", "it has no mesh"]},
        "topics": {},
        "not_run": ["heat"],
    }
    assert [*plan_lines("", fields)] == [
        "scene",
        "  effects, in running order (1)",
        "    pour: because the scene declares it",
        f"  pairs: {ALL_PAIRS}",
        "  detectors (1)",
        "    exact: because contact and grasp need it",
        "  bodies (1)",
        "    cup: because it has no mesh, pour needs it",
        "  topics read: none for effects",
        "  not run: heat",
    ]
