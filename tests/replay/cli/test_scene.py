"""`replay scene`, and `--scene` on every verb that reads a session."""

import json

import click
import pytest
from support.small_worlds import cubes

import replay
from replay.cli.commands import COMMANDS
from replay.cli.main import cli, main
from sessions import read_session, write_session
from sessions.errors import SceneError
from sessions.scene_files.scene_toml import parse_scene

PLACES = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3], "c": [9, 9, 9, 0.8, 9, 9]}
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
FAULTY = """
[[body]]
id = "cup"
masss = 0.1
cavity = { capcity_ml = 1.0 }
[[body]]
id = "jar"
mesh = "none.glb"
[[body]]
id = "lid"
shape = "box"
size = [0, 1, 1]
[[pair]]
between = ["cup", "jag"]
[[effect]]
kind = "contct"
[[effect]]
kind = "contact"
between = ["cup", "jag"]
betwen = 1
"""
FAULTS = [
    "[[body]] 1 ('cup'): unknown key 'masss'; did you mean 'mass'?",
    "[[body]] 3 ('lid'): a box needs size = [x, y, z] in metres, each above 0",
    "[[pair]] 1: no body is 'jag'; did you mean 'jar'?",
    "[[effect]] 2 ('contact'): no body is 'jag'; did you mean 'jar'?",
    "body 'jar': mesh file {folder}/none.glb does not exist; check the path",
    "[[effect]] 1: no effect of kind 'contct'; did you mean 'contact'?",
    "[[effect]] 2 ('contact'): unknown key 'betwen'; did you mean 'between'?",
    "[[body]] 1 ('cup') cavity: unknown key 'capcity_ml'; did you mean 'capacity_ml'?",
]


@pytest.fixture
def files(tmp_path):
    session = cubes(PLACES, scene=parse_scene(OWN))
    write_session(session, tmp_path / "s.mcap")
    (tmp_path / "other.toml").write_text(OTHER)
    (tmp_path / "faulty.toml").write_text(FAULTY)
    return tmp_path


def test_a_check_names_every_fault_of_text_meshes_and_effects_once(files, capsys):
    assert main(["scene", "check", str(files / "faulty.toml")]) == 1
    assert capsys.readouterr().out.splitlines() == [f"faulty.toml: {fault.format(folder=files)}" for fault in FAULTS]
    assert main(["scene", "check", str(files / "faulty.toml"), "--json"]) == 1
    assert len(json.loads(capsys.readouterr().out)["faults"]) == len(FAULTS)
    assert main(["scene", "check", str(files / "other.toml")]) == 0
    assert capsys.readouterr().out == "other.toml: no fault in 2 bodies and 0 effects\n"
    (files / "torn.toml").write_text("[[body]")
    assert main(["scene", "check", str(files / "torn.toml")]) == 1
    assert "this is not TOML" in capsys.readouterr().out


def test_the_doctor_names_the_same_faults_and_a_plan_the_first(files, capsys):
    assert main(["doctor", str(files / "faulty.toml"), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    said = [one["message"] for one in found["findings"] if one["code"] == "bad-scene"]
    assert sorted(said) == sorted(f"faulty.toml: {fault.format(folder=files)}" for fault in FAULTS)
    assert main(["plan", str(files / "faulty.toml")]) == 1
    assert f"faulty.toml: {FAULTS[0]}; 3 more: `replay scene check` lists them" in capsys.readouterr().err


def test_a_key_deep_in_a_scene_that_a_recording_carries_is_found_by_doctor_and_plan(files, capsys):
    deep = OWN.replace('id = "b"', 'id = "b"\nproperties = { liquid = { volum_ml = 1.0 } }')
    write_session(cubes(PLACES, scene=parse_scene(deep)), files / "deep.mcap")
    fault = "[[body]] 2 ('b') properties liquid: unknown key 'volum_ml'; did you mean 'volume_ml'?"
    assert main(["doctor", str(files / "deep.mcap"), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert [one["message"] for one in found["findings"] if one["code"] == "bad-scene"] == [f"scene.toml: {fault}"]
    assert main(["plan", str(files / "deep.mcap")]) == 1
    assert fault in capsys.readouterr().err
    # Another scene in its place mends both.
    assert main(["doctor", str(files / "deep.mcap"), "--scene", str(files / "other.toml"), "--fail-on", "error"]) == 0
    assert main(["plan", str(files / "deep.mcap"), "--scene", str(files / "other.toml")]) == 0


def test_every_verb_that_reads_a_session_takes_a_scene():
    silent = {"recover", "demo", "diff", "view", "stress", "paper", "bench", "guide", "scene"}
    for verb in COMMANDS.keys() - silent:
        found = cli.get_command(click.Context(cli), verb)
        found = found.commands["run"] if isinstance(found, click.Group) else found
        assert "--scene" in {flag for option in found.params for flag in option.opts}, verb


def test_a_scene_that_is_given_replaces_the_sessions_own_and_keeps_nothing_of_it(files):
    own, other = (replay.run(files / "s.mcap", detectors="exact", oracle="none", **more)
                  for more in ({}, {"scene": files / "other.toml"}))  # fmt: skip
    assert own.summary["session"]["scene"] == "own" and other.summary["session"]["scene"] == "other"
    assert [pair["name"] for pair in own.summary["pairs"]] == ["a-c"]
    assert [pair["name"] for pair in other.summary["pairs"]] == ["a-b"]
    assert other.session.scene.effects is None and other.session.scene.body("c") is None
    assert other.summary["session"]["facts"]["scene_file"] == "other.toml"
    assert "scene_file" not in own.summary["session"]["facts"]
    # Of meshes a scene replaces those that it declares: half the edge, so that 0.9 m is no contact.
    assert own.session.meshes["b"].bounds[1, 0] == 0.5 and other.session.meshes["b"].bounds[1, 0] == 0.25
    assert not other.episodes["exact"]
    held = replay.run(read_session(files / "s.mcap"), detectors="exact", oracle="none", scene=files / "other.toml")
    assert held.detections["exact"].digest == other.detections["exact"].digest


def test_a_scene_that_cannot_be_read_is_not_even_looked_at_where_another_replaces_it(files):
    data = (files / "s.mcap").read_bytes()
    assert data.count(b'group = "all"') == 2
    (files / "bad.mcap").write_bytes(data.replace(b'group = "all"', b'gruop = "all"'))
    with pytest.raises(Exception, match=r"gruop|damaged"):
        read_session(files / "bad.mcap")
    assert read_session(files / "bad.mcap", scene=files / "other.toml").scene.name == "other"
    with pytest.raises(SceneError, match=r"faulty.toml: .*masss"):
        read_session(files / "s.mcap", scene=files / "faulty.toml")
