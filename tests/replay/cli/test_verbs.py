"""Every verb's answer, sentences, exit code and files, whole, in the order of a day's work.

A row is a command, or several one after the other; rows share their folder, and need nothing of one another.
"""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.mutants import chunks, flipped
from support.planted_faults import FAULTS, clean_draft
from support.report_states import with_steady_times
from support.session_files import protobuf_messages, write_foreign
from support.small_worlds import MEET_IN_4_AND_8_TO_10, cube, session_of_frames, unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.engine import compute
from replay.running import runner
from replay.show.rerun_log import web_viewer
from sessions import Event, GazeTrack, Interval, ScalarTrack, Scene, Session, Track, write_session
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import SceneBody
from sessions.scene_files.scene_toml import parse_scene

EFFECTS = """
[scene]
name = "lab"
[[body]]
id = "a"
tags = ["glass"]
[[body]]
id = "b"
[[effect]]
kind = "breakage"
between = ["tag:glass", "b"]
speed_m_s = 1.0
"""
THIRD = """
[[body]]
id = "c"
[[body]]
id = "bench"
fixed = {}
[[effect]]
kind = "contact"
between = ["a", "c"]
"""
GOOD = "n = 52\n[reliability]\nitems = 19\nalpha = 0.9\nkmo = 0.8\nchi_square = 443.843\ndf = 171\np = 0.0\n"
ENGINE = "time,a,b,what\n100.04,a,b,begin\n100.05,a,b,end\n100.08,b,a,begin\n100.11,b,a,end\n100.2,a,Floor,begin\n"
UNITY = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value\npose,0,Cup,0,0,0,0,0,0,1,1,,\n"
STL = (
    "solid m\nfacet normal 0 x 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid m\n"
)
SLOW = "--detectors slow=discrete[rate_hz=20]"
PROJECTS = (
    'detectors = ["slow=discrete[rate_hz=20]", "sphere"]\nseed = 3\n[gates]\nmax-missed = 0\n', "step-rate = 25",
    'detector = "aabb"', "[gates]\nmax_missed = 0", "gates = 1", "[gates]\nmax-missed = 2", 'start = "soon"',
    "end = true", "end = [1, 2]", 'out = "runs"', "wings = 2", "a = [", 'detectors = "planted:Detector"',
    'oracle = "planted:Detector"',
)  # fmt: skip
"""Texts of ``replay.toml``: each stands beside a recording in a folder of its number."""
UNNAMEABLE = ("...mcap", "..mcap", "batch.json.mcap", "Batch.JSON.mcap")
FAULTY = Path(__file__).with_name("faulty.toml").read_text("utf-8")
RUN = "run s.mcap --no-picture --out out"
MANY = f"run apart.mcap p.mcap --no-picture {SLOW}"
OTHERS = "run apart.mcap p.mcap -o m3 --no-picture --detectors hybrid --oracle none"
UNREADABLE = "run text.mcap apart.mcap --detectors hybrid --oracle none"
UNDECIDED = "run p.mcap --detector it=support.planted_detectors:Undecided"
VERBS = (
    "", "rum; xyzzy; run; rum --format json", "view here --miss 0", "run missing.mcap --out x",
    "info .; tradeoff .; info missing.mcap --format=json",
    "info told.mcap", "info told.mcap --format json", "info text.mcap", "info text.mcap --format json",
    "; ".join(f"info {name}.mcap --format json" for name in ("lost", "twice", "none", "three")),
    "doctor clean.mcap frozen.mcap", "doctor clean.mcap -v", "doctor clean.mcap frozen.mcap --format json",
    "doctor clean.mcap --fail-on note; doctor clean.mcap --fail-on warning",
    "doctor frozen.mcap --fail-on warning; doctor frozen.mcap --fail-on error",
    "import aframe m.json -o new/m.mcap --mesh left=wand.glb --mesh right=wand.glb", "import auto m.json -o m1.mcap",
    "import auto m.json -o m2.mcap --format json",
    "import aframe m.json -o m3.mcap --mesh left=big.glb",
    "import aframe m.json -o text.mcap; import aframe m.json -o old.mcap --force",
    "import aframe m.json -o x.mcap --mesh left; import aframe m.json -o x.mcap --mesh left=nowhere.glb; "
    "import aframe m.json -o x.mcap --convention unity; import fbx m.json -o x.mcap; "
    "import contacts m.json -o x.mcap",
    "scene check lab.toml", "scene check lab.toml --format json", "scene check text.toml",
    "scene check s.mcap", "scene check told.mcap",
    "scene check faulty.toml", "scene check faulty.toml --format json", "doctor faulty.toml --format json",
    "run p.mcap --scene faulty.toml",
    "scene new p.mcap; scene check p.toml; run p.mcap --scene p.toml --detectors exact",
    "scene new three.mcap; scene check three.toml; run three.mcap --scene three.toml --detectors exact -v",
    "scene new s.mcap -o bench.toml", "scene new s.mcap -o lab.toml",
    "mesh repair open.glb -o m.glb; mesh repair open.glb -o j.glb --format json",
    "mesh repair s.mcap -o a.glb --body a; mesh repair s.mcap -o x.glb; mesh repair s.mcap -o x.glb --body c",
    "mesh repair open.glb -o open.glb; mesh repair open.glb -o named.glb --body cup",
    "diff before after", "diff before after --different-sessions", "diff slow fast", "diff slow fast --format json",
    "diff slow lab.toml", "study check --strict", "study check good.toml --strict",
    "stress --detector hybrid --family 1,10 --pairs 10 --seed 7", "stress --detector hybrid --case 28,32",
    "stress --detectors exact,hybrid,exact, --family 3 --pairs 5 --format json",
    "stress --detectors exact,sphere --family 1-2 --pairs 10",
    "stress --detectors , --pairs 1; stress --detector spoon --pairs 1; stress --family 44; stress --case 40",
    "share slow -o sent", "shrink slow --miss 9; shrink slow", "view slow --miss 9; view slow",
    "; ".join(
        f"{RUN} --detectors {wrong}"
        for wrong in ("hybird", "hybrid[speed=3]", "discrete[rate_hz=-1]", "discrete[rate_hz=fast]", "hybrid[",
                      "hybrid,hybrid")
    ),
    "; ".join(
        f"{RUN} {wrong}"
        for wrong in ("--start 99", "--end -1", "--oracle nobody", "--start nan", "--end 1e308",
                      "--policy frozen=hold:1e308", "--policy tracking-lost=wish", "--step-rate 25 --detectors exact",
                      "--max-missed nan", "--max-missed 50", "--max-p99-ms inf", "--tau 1e99")
    ),
    "run lost.mcap --no-picture --out out --policy tracking-lost=refuse", "run text.mcap; run empty.mcap",
    "run torn.mcap", "run bare.mcap", "run none.mcap", "tradeoff lost.mcap --out out --policy tracking-lost=refuse",
    "run nan.mcap --no-picture --out out", "run wand.mcap --detectors hybrid --oracle none",
    "run twice.mcap --no-picture --out r1 --detectors hybrid",
    f"run p.mcap {SLOW} --out r2; view r2 --miss 1; view r2 --false 2 --by slow; view r2 r2; share r2 -o r3; "
    "share r2 -o r3 --anyway; share r2 -o r3 --anyway; share r2 -o r3 --anyway --force; "
    "share r2 -o mine --anyway --force",
    f"run p.mcap {SLOW} --detector sphere --oracle hybrid -o r4 --no-picture -q --format json --start 0.02 --end 0.05 "
    "--seed 9; view r4; share r4 -o r5 --anyway",
    "view p.mcap; view text.mcap",
    f"audit p.mcap {SLOW} --max-missed 0.01 --max-p99-ms 10000", "run p.mcap --detector hybrid --max-p99-ms 0.000001",
    f"{UNDECIDED} --max-missed 1 --max-false 1", "run p.mcap --max-invented 0.5",
    "run p.mcap --detector support.planted_detectors:Raising; "
    "run p.mcap --detector support.planted_detectors:Unmade",
    "run p.mcap --step-rate 25",
    "run p.mcap --detectors box=collider[shape=box,skin_m=2.1]; run p.mcap --detectors exact -o r6",
    f"run p.mcap {SLOW},sphere --max-missed 0 --format markdown", "run p.mcap --detectors hybrid --format markdown",
    f"{MANY} -o m1 --format json; {MANY} -o m1; {MANY} -o m1 --format markdown",
    "run apart.mcap twice.mcap --no-picture --detectors hybrid",
    f"{UNREADABLE}; {UNREADABLE} --format json",
    "run several/0 -o m2 --detectors hybrid --no-picture", "run mine",
    f"{OTHERS}; {OTHERS} --seed 1; {OTHERS} --seed 1 --force; {OTHERS} --seed 1",
    "; ".join(f"run odd/{name} p.mcap --out out --no-picture" for name in UNNAMEABLE),
    "run several/0; run several/0/p.mcap -q --detectors hybrid; run several/0 several/1",
    "run several/1/p.mcap; run several/1/p.mcap --detectors hybrid",
    "; ".join(f"run several/{number}/p.mcap" for number in range(2, len(PROJECTS))),
    "recover torn.mcap h1.mcap --format json", "recover flipped.mcap h2.mcap; info h2.mcap",
    "recover p.mcap h3.mcap; recover p.mcap h3.mcap; recover p.mcap h3.mcap --force", "doctor m.stl",
    "import mcap foreign.mcap -o f.mcap --topic /tf; import mcap foreign.mcap -o f.mcap --force --convention openxr",
    "import mcap foreign.mcap -o x.mcap --topic /other",
    "import csv unity.csv -o u1.mcap; import csv quiet.csv -o u2.mcap",
    "import contacts engine.csv --session p.mcap -o c.mcap; info c.mcap",
    "stress --detector hybrid --family 16 --pairs 20 --out g",
    "guide glosary; guide nonsense; guide glossary --script",
    "tradeoff p.mcap --engine unity --detectors exact",
    "demo --class 5 --session-only -o d",
    "demo --scene fast-ball --session-only -o d.mcap; demo --scene fast-ball --session-only -o d.mcap; info d.mcap",
    "demo --scene fast-ball --session-only -o e.mcap; demo --scene fast-ball --session-only -o e.mcap --force",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a file of each kind that the commands of this test read."""
    day = tmp_path_factory.mktemp("day")
    scene = Scene(name="two-cubes", bodies=(SceneBody("a", proxy=True),))
    events, spans = [Event(5, "press"), Event(9, "press")], [Interval(20_000_000, 90_000_000, "task", "stir")]
    folders = {"a": range(200), "b": [9] * 200}
    reported = unit_cubes_on_x(folders, first_ns=10**7, scene=scene, events=events, intervals=spans)
    still = np.zeros((200, 3))
    sampled = GazeTrack(10_000_000 * np.arange(200), still, still - (0, 0, 1), np.arange(200) > 49)
    heart = ScalarTrack([0, 10**9, 5 * 10**9, 6 * 10**9], [70, np.nan, 72.5, 68], "1/min")
    scalars = {"heart rate": heart, "one": ScalarTrack([5], [1]), "none": ScalarTrack([5, 6], [np.nan] * 2, "K")}
    facts = {"vr_type": "immersive", "synthetic": "cubes"}
    open_cube = MeshData(cube().vertices, [face for face in cube().faces if cube().vertices[face, 0].min() < 0.5])
    kept = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=parse_scene(EFFECTS))
    kept.meshes["a"] = open_cube
    status = [[1, 1]] * 6 + [[1, 2]] * 2 + [[1, 0], [3, 1], [1, 1], [1, 1]]
    for name, session in {
        "told": replace(reported, gaze={"anna": sampled}, scalars=scalars, facts=facts),
        "s": kept,
        "lost": session_of_frames([10 * k for k in range(12)], status),
        "bare": replace(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), meshes={}),
        "p": unit_cubes_on_x(MEET_IN_4_AND_8_TO_10),
        "apart": unit_cubes_on_x({"a": [0] * 12, "b": [3.0 + k / 10 for k in range(12)]}),
        "twice": session_of_frames([0, 10, 10, 20], [[1, 1]] * 4),
        "wand": replace(
            unit_cubes_on_x(MEET_IN_4_AND_8_TO_10 | {"wand": [5] * 12}), meshes=dict.fromkeys("ab", cube())
        ),
        "three": unit_cubes_on_x(MEET_IN_4_AND_8_TO_10 | {"c": [9] * 12}, scene=parse_scene(EFFECTS + THIRD)),
        "none": Session.from_tracks({"a": Track([], np.zeros((0, 3)), np.zeros((0, 4)))}, {"a": cube()}),
    }.items():
        write_session(session, day / f"{name}.mcap")
    rounded, frozen = clean_draft(), clean_draft()
    rounded.arrays["quaternion_xyzw"][:, 0] *= 1 + 1e-5
    FAULTS["frozen pose"](frozen, body=1, frame=300)
    rounded.write(day / "clean.mcap")
    frozen.write(day / "frozen.mcap")
    FAULTS["nan position"](frozen, body=0, frame=500)
    frozen.write(day / "nan.mcap")
    whole, recorded = (day / "clean.mcap").read_bytes(), (day / "p.mcap").read_bytes()
    first, last = chunks(whole)[1]
    (day / "flipped.mcap").write_bytes(flipped(whole, first + 60, last, count=9, seed=0))
    (day / "torn.mcap").write_bytes((day / "s.mcap").read_bytes()[:-200])
    (day / "odd").mkdir()
    for name in UNNAMEABLE:
        (day / "odd" / name).write_bytes(recorded)
    write_foreign(day / "foreign.mcap", protobuf_messages(unit_cubes_on_x({"cup": [0, 1, 2]}).frames))
    for number, text in enumerate(PROJECTS):
        (beside := day / "several" / str(number)).mkdir(parents=True)
        (beside / "replay.toml").write_text(text, "utf-8")
        (beside / "p.mcap").write_bytes(recorded)
    (day / "mine").mkdir()
    for name, text in {
        **dict.fromkeys(("text.mcap", "text.toml", "old.mcap", "e.truth.json", "mine/letter.txt"), "[[hello"),
        "empty.mcap": "", "lab.toml": EFFECTS, "faulty.toml": FAULTY, "good.toml": GOOD, "m.stl": STL,
        "engine.csv": ENGINE, "quiet.csv": UNITY, "unity.csv": UNITY + "enter,0,Cup,,,,,,,,,Hand,\n",
        "planted.py": "raise SystemExit('ran')\n",
    }.items():  # fmt: skip
        (day / name).write_text(text, "utf-8")
    (day / "open.glb").write_bytes(mesh_to_glb(open_cube, "a"))
    for name, edge in (("wand", 0.1), ("big", 10.0)):
        (day / f"{name}.glb").write_bytes(mesh_to_glb(cube(edge), name))
    pose = {"position": {"x": 0.5, "y": 1.0, "z": 0.0}, "rotation": {"x": 0, "y": 10, "z": 0}}
    poses = {"poses": [{"timestamp": 1000.0 + 11.1 * k, **pose} for k in range(20)]}
    (day / "m.json").write_text(json.dumps({"left": poses, "right": poses}), "utf-8")
    many = {"a": [0] * 80, "b": [3, 0.9] * 40}, {"a": [0] * 80, "b": [3, 2] * 40}
    few = {"a": [0] * 20, "b": [3, 3, 0.9, 0.9, 3, 0.9, 3, 3, 3, 3, 0.9, 0.9, 0.9, 3, 3, 3, 3, 3, 3, 3]}
    for name, folders, requested in (
        ("before", many[0], {"detectors": "hybrid", "oracle": "none"}),
        ("after", many[1], {"detectors": "hybrid", "oracle": "none"}),
        ("slow", few, {"detectors": "it=discrete[rate_hz=25]"}),
        ("fast", few, {"detectors": "it=discrete[rate_hz=100]"}),
    ):
        with_steady_times(replay.run(unit_cubes_on_x(folders), **requested)).write(day / name, picture=False)
    return day


class Window:
    """Stands in for the viewer's window: says what it was opened with, and that somebody waited for its end."""

    def __init__(self, *runs, miss, false, by):
        print("window of", *runs, miss, false, by)
        self.process = self

    def __enter__(self):
        return self

    def __exit__(self, *error):
        print("closed")

    def wait(self):
        print("waited")


MASKED = {
    # while kernels compile, or a stage takes long: a line each, and its folded rest
    r"(?m)^(Compil(ing kernels|ed in)|Times of this run may|[A-Z][^:\n]*: +(\d+ %  )?\d+ s).*\n(  .*\n)*": "",
    # the path before a name says where a line is folded
    r"text: Session(.|\n +)*": lambda match: re.sub(r"\n +", " ", match[0]),
    r"(?<=byte )\d+|(?<=\.py, line )\d+": "",
    r"\S*/(?=planted_detectors)|\S*/replay-\w+/files": "",
    r'\n( *)"(seconds|versions|machine|recording)": {\n(?:\1 .*\n)*\1}': r'\n\1"\2": {}',
    r", about .* a minute|(?<=part-00000-)\w+": "",
    r"\d+\.\d{10,}(e-\d+)?": lambda match: f"{float(match[0]):.9g}",
}
"""What is of this machine, or of its last bit."""


def files_in(folder):
    """Paths of all files below a folder, as text: to make an object of each path takes longer than most verbs."""
    return {f"{parent}/{name}" for parent, _folders, names in os.walk(folder) for name in names}


@pytest.mark.parametrize("arguments", VERBS, ids=str)
def test_output_of_a_verb_is_unchanged(arguments, folder, monkeypatch, capsys, snapshot):
    """``arguments``: of `replay` in a folder with a file of each kind, several calls with "; " between.

    Exit code, both streams and names of new files equal a stored text. What is of this machine or its last bit is
    masked, times of detectors are steady, and windows of the viewer are stand-ins that print how they were opened.
    """
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(runner, "compute", lambda *session, **how: with_steady_times(compute(*session, **how)))
    monkeypatch.setattr("replay.show.rerun_log.viewer.open_viewer", Window)
    monkeypatch.setattr(web_viewer, "web_viewer", lambda: {web_viewer.SCRIPT_FILE: b"", web_viewer.PROGRAM_FILE: b""})
    files_before, text = files_in(folder), ""
    for command in arguments.split("; "):
        code = main(command.split())
        output = capsys.readouterr()
        assert "Traceback" not in output.err
        text += f"exit {code}\n{output.out}----\n{output.err}"
    new_files = sorted(Path(file).relative_to(folder).as_posix() for file in files_in(folder) - files_before)
    text = re.sub(rf"{folder}\S*/", "", "\n".join([text, *new_files]) if new_files else text)
    for pattern, mask in MASKED.items():
        text = re.sub(pattern, mask, text)
    assert text == snapshot
