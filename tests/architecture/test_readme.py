"""What the README shows works: its Python runs, its commands run on the files they name, its TOML is understood."""

import json
import re
import shlex
from pathlib import Path

import pytest
from small_worlds import cube, cubes

from replay.cli.main import main
from sessions import write_session
from sessions.glb import mesh_to_glb

README = (Path(__file__).resolve().parents[2] / "README.md").read_text("utf-8")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)

INTERACTIVE = {"view"}
"""Verbs that open a window and wait for a person."""


def blocks(language):
    found = [text for name, text in BLOCK.findall(README) if name == language]
    assert found, f"the README has no {language} block"
    return found


def commands(block):
    """The ``replay`` commands of a shell block as lists of words; what installs, tests or opens a window is not."""
    joined = block.replace("\\\n", " ")
    parts = [part for line in joined.splitlines() for part in line.split("&&")]
    words = [shlex.split(part, comments=True) for part in parts]
    return [word for word in words if word[:1] == ["replay"] and word[1] not in INTERACTIVE]


def runnable():
    return [pytest.param(found, id=" ".join(found[0][:3])) for found in map(commands, blocks("bash")) if found]


def unity_csv(bodies):
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value\n"
    rows = [
        f"pose,{0.011 * frame:.6f},{body},{0.5 * number + 0.01 * frame * number},1,0,0,0,0,1,1,,"
        for frame in range(30)
        for number, body in enumerate(bodies)
    ]
    return head + "\n".join(rows) + "\n"


def aframe():
    def pose(frame, x):
        place = {"x": x + 0.01 * frame * x, "y": 1.0, "z": 0.0}
        return {"timestamp": 11.0 * frame, "position": place, "rotation": {"x": 0, "y": 0, "z": 0}}

    return {name: {"poses": [pose(frame, x) for frame in range(30)]} for name, x in (("left", 0.0), ("right", 0.5))}


def python_files():
    """The Python blocks that are files: file name -> text."""
    named = {re.match(r"# (\w+\.py)\n", text): text for text in blocks("python")}
    return {match[1]: text for match, text in named.items() if match}


def lay_out_inputs(folder, made):
    """Every input file that the README's commands name, except those a block makes itself."""
    for name, text in python_files().items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "engine.csv").write_text("time,a,b,what\n7.02,a,b,begin\n7.02,a,b,end\n7.07,a,b,begin\n7.07,a,b,end\n")
    for name in ("beaker", "hand", "wand", "cup"):
        (folder / f"{name}.glb").write_bytes(mesh_to_glb(cube(0.1), name))
    (folder / "session.csv").write_text(unity_csv(["Beaker", "LeftHand"]))
    (folder / "recording.json").write_text(json.dumps(aframe()))
    for name in {"session.mcap", "mine.mcap"} - made:
        write_session(cubes({"a": [0] * 30, "b": [3, 2, 0.9, 2, 3] * 6}), folder / name)


@pytest.mark.slow
@pytest.mark.parametrize("found", runnable())
def test_every_command_of_a_shell_block_succeeds_on_the_files_it_names(found, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made = {words[words.index("-o") + 1] for words in found if "-o" in words}
    lay_out_inputs(tmp_path, made)
    for words in found:
        assert main(words[1:]) == 0, (" ".join(words), capsys.readouterr().err)


@pytest.mark.parametrize("block", [text for text in blocks("python") if text not in python_files().values()])
def test_every_python_block_runs(block, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lay_out_inputs(tmp_path, made={"session.mcap", "mine.mcap"})
    exec(compile(block, "README.md", "exec"), {"__name__": "readme"})
    assert capsys.readouterr().out, "a block that prints nothing shows nothing"


@pytest.mark.parametrize("block", blocks("toml"))
def test_every_toml_block_is_understood(block, tmp_path):
    from sessions.importers.csv_mapping import read_mapping
    from sessions.scene_toml import parse_scene

    if "[[body]]" in block:
        assert parse_scene(block).bodies
    else:
        (tmp_path / "columns.toml").write_text(block, encoding="utf-8")
        assert read_mapping(tmp_path / "columns.toml").convention


def test_the_detector_of_ones_own_takes_fifteen_lines():
    lines = [line for line in python_files()["my_engine.py"].splitlines()[1:] if line.strip()]
    assert len(lines) <= 15


def test_the_verbs_that_the_readme_names_are_those_there_are():
    from replay.cli.commands import COMMANDS

    named = set(re.findall(r"`?replay ([a-z]+)\b", "\n".join(blocks("bash"))))
    assert named <= set(COMMANDS) and {"demo", "run", "view", "import"} <= named


@pytest.mark.slow
def test_the_scenes_of_the_table_declare_what_it_says():
    from sessions.synthetic.scenes import SCENES, make_scene_session

    rows = dict(re.findall(r"^\| `([a-z-]+)` \| [^|]* \| ([a-z, -]+?)(?::[^|]*)? \|$", README, re.MULTILINE))
    assert {name: rows.get(name) for name in SCENES} == {
        name: ", ".join(dict.fromkeys(effect.kind for effect in make_scene_session(name)[0].scene.effects))
        for name in SCENES
    }


def test_the_pictures_of_the_readme_are_there():
    root = Path(__file__).resolve().parents[2]
    named = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README)
    assert named and [path for path in named if not (root / path).is_file()] == []


def test_shell_and_powershell_install_the_same_and_tests_are_one_command():
    shell, power = blocks("bash")[0], blocks("powershell")[0]
    for words in ('pip install -e ".[test]"', "replay demo -o"):
        assert words in shell and words in power
    assert "python -m pytest\n" in blocks("bash")
