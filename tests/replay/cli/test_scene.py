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
    """Random changes of a scene file: it is read, or refused by faults that begin with its name."""
    path = tmp_path / "rich.toml"
    faulty = OTHER + Path(__file__).with_name("faulty.toml").read_text("utf-8")
    path.write_text(scene_to_toml(make_scene_session("titration")[0].scene) if count > 15 else faulty)

    def read():
        text = read_text(path, "scene", SceneError)
        faults = checked_scene(text, str(path), plan_faults, tmp_path)[2]
        assert all(item.isprintable() and item.startswith(str(path)) for item in faults), faults
        read_scene(path)

    tried(path, count, read, path.name)


def test_a_wrong_instrument_of_a_vessel_is_named_once():
    """The body and the effect on it both read the instrument."""
    text = """
[[body]]
id = "flask"
instrument = "erlenmeyer_flas"
properties = { liquid = { volume_ml = 25.0 } }
[[effect]]
kind = "mixing"
in = ["flask"]
"""
    (fault,) = checked_scene(text, "scene.toml", plan_faults)[2]
    assert fault.endswith("no instrument 'erlenmeyer_flas'; did you mean 'erlenmeyer_flask'?")


def test_given_scene_replaces_all_of_the_recorded_scene(session_and_scene):
    """Its effects, pairs and bodies too. Written with a session, the scene is the recording's own."""
    own, other = (
        replay.run(session_and_scene / "s.mcap", detectors="exact", oracle="none", **more)
        for more in ({}, {"scene": session_and_scene / "other.toml"})
    )
    assert own.document.session.scene == "own" and other.document.session.scene == "other"
    assert [pair.name for pair in own.document.pairs] == ["a-c"]
    assert [pair.name for pair in other.document.pairs] == ["a-b"]
    assert other.session.scene.effects is None and other.session.scene.body("c") is None
    assert other.document.session.facts["scene_file"] == "other.toml"
    assert "scene_file" not in own.document.session.facts
    # Of meshes a scene replaces those that it declares: half the edge, so that 0.9 m is no contact.
    assert own.session.meshes["b"].bounds[1, 0] == 0.5 and other.session.meshes["b"].bounds[1, 0] == 0.25
    assert not other.episodes["exact"]
    write_session(other.session, session_and_scene / "kept.mcap")  # now that scene is the recording's own
    assert read_session(session_and_scene / "kept.mcap").scene.name == "other" and "scene_file" in other.session.facts
    assert "scene_file" not in read_session(session_and_scene / "kept.mcap").facts
    kept = replay.run(
        read_session(session_and_scene / "s.mcap"),
        detectors="exact",
        oracle="none",
        scene=session_and_scene / "other.toml",
    )
    assert kept.detections["exact"].digest == other.detections["exact"].digest


def test_small_scene_names_a_group_for_pairs(session_and_scene, capsys):
    """A scene without bodies adds to the recorded one: ``ha*`` matches its group ``hand``."""
    small = session_and_scene / "small.toml"
    small.write_text('[[group]]\nname = "hand"\nmembers = ["b", "c"]')
    command = [
        "run",
        str(session_and_scene / "s.mcap"),
        "--scene",
        str(small),
        "--pairs",
        "ha*:a",
        "--format",
        "json",
        "-q",
    ]
    assert main([*command, "--detectors", "hybrid,exact"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [pair["name"] for pair in document["pairs"]] == ["a-b", "a-c", "a-hand"]
    assert document["audit"]["hybrid"]["contacts"] == 1  # b in frame 2, c in frame 3
    assert document["session"]["scene"] == "own"  # and what it declares stays
    assert main([*command[:5], "hand"]) == 2
    assert "write two names with a colon between" in capsys.readouterr().err


def test_imported_scene_without_bodies_adds_to_the_recording(tmp_path):
    """Cup and rod come from the log, the group from the scene."""
    log, scene, out = tmp_path / "log.csv", tmp_path / "scene.toml", tmp_path / "s.mcap"
    rows = [f"pose,0,{name},0,0,0,0,0,0,1,1,," for name in ("cup", "rod")]
    log.write_text("\n".join(["kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value", *rows, ""]))
    scene.write_text('[[group]]\nname = "glass"\nmembers = ["cup", "rod"]')
    assert main(["import", "csv", str(log), "-o", str(out), "--convention", "openxr", "--scene", str(scene)]) == 0
    assert [group.members for group in read_session(out).scene.groups] == [("cup", "rod")]


def test_folder_meshes_reach_their_bodies_in_import_and_draft(session_and_scene, capsys):
    """A cube with edges of 10 units, taken for cm, or mm by option, and a tenth of an edge off on x."""
    folder, out = session_and_scene / "meshes", session_and_scene / "csv.mcap"
    folder.mkdir()
    for name, edge in (("a", 10.0), ("B (Clone)", 0.1)):
        corners = edge * (cube().vertices + np.array([0.1, 0, 0]))
        lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a} {b} {c}" for a, b, c in cube().faces + 1]
        (folder / f"{name}.obj").write_text("\n".join(lines))
    rows = [f"{t},{name},{t},0,0,0,0,0,1" for t in (0, 0.1) for name in ("a", "b", "c")]
    (session_and_scene / "x.csv").write_text("\n".join(["time,body,px,py,pz,qx,qy,qz,qw", *rows, ""]))
    (session_and_scene / "map.toml").write_text(
        '[time]\ncolumn = "time"\nunit = "s"\n[body]\nname = "body"\nposition = ["px", "py", "pz"]\n'
        'quaternion_xyzw = ["qx", "qy", "qz", "qw"]\n'
    )
    given = ["--mapping", str(session_and_scene / "map.toml"), "--convention", "openxr", "--meshes", str(folder)]
    assert main(["import", "csv", str(session_and_scene / "x.csv"), "-o", str(out), *given]) == 0
    text = "a: a.obj; a.obj is 10 units long, taken for cm: 100 mm; b: B (Clone).obj; no mesh is named like: c"
    assert text in " ".join(capsys.readouterr().err.split())
    session = read_session(out)
    assert session.facts["conversions"].endswith(text) and {*session.meshes} == {"a", "b"}
    placed = [[-0.04, -0.05, -0.05], [0.06, 0.05, 0.05]]
    assert np.allclose(session.meshes["a"].bounds, placed, rtol=0, atol=1e-12)
    assert (
        main(["scene", "new", str(out), "--meshes", str(folder), "-o", str(session_and_scene / "deep" / "new.toml")])
        == 0
    )
    scene = parse_scene((session_and_scene / "deep" / "new.toml").read_text())
    assert (scene.body("a").mesh, scene.body("a").scale) == ("../meshes/a.obj", 0.01)
    assert main(["scene", "check", str(session_and_scene / "deep" / "new.toml")]) == 0
    kept = read_session(out, scene=session_and_scene / "deep" / "new.toml").meshes["a"].bounds
    assert np.allclose(kept, placed, rtol=0, atol=1e-12)
    how = ["--mesh-units", "mm", "--mesh-axes", "x-flipped"]
    assert (
        main(
            ["import", "csv", str(session_and_scene / "x.csv"), "-o", str(session_and_scene / "mm.mcap"), *given, *how]
        )
        == 0
    )
    assert read_session(session_and_scene / "mm.mcap").meshes["a"].bounds[:, 0] == pytest.approx([-0.006, 0.004])


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SCENES, *CAPTURES])
def test_drafted_scene_of_every_recording_runs_unchanged(name, tmp_path):
    """Synthetic scenes, and captures where they are here; every pair that touches is in the draft."""
    file = tmp_path / "s.mcap"
    if name in SCENES:
        write_session(make_scene_session(name)[0], file)
    elif not DATA.is_dir():
        pytest.skip("the recordings are not here")
    else:
        write_session(import_session("aframe", DATA / f"{name}.json"), file)
    assert main(["scene", "new", str(file), "-q"]) == 0
    assert main(["scene", "check", str(tmp_path / "s.toml")]) == 0
    with_it = replay.run(file, scene=tmp_path / "s.toml", detectors="exact", oracle="none")
    own = replay.run(file, detectors="exact", oracle="none")
    # Nothing that touches in the recording is left out of it: pairs that it does not list never come near.
    touched = {frozenset(own.assembly.pairs[item.pair].tolist()) for item in own.episodes["exact"]}
    listed = {frozenset(pair) for pair in with_it.assembly.pairs.tolist()}
    assert own.assembly.names == with_it.assembly.names and touched <= listed and listed


def test_plan_gives_a_reason_for_each_item():
    """A reason of one word is an effect; a sentence stands as it is."""
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
