"""What a verb says, whole: its answer, its sentences, its exit code; in the order of a day's work."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from support.planted_faults import FAULTS, clean
from support.report_states import with_steady_times
from support.small_worlds import cube, cubes, framed

import replay
from replay.cli.main import main
from sessions import Event, GazeTrack, Interval, ScalarTrack, Scene, Session, Track, write_session
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import SceneBody
from sessions.scene_files.scene_toml import parse_scene

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
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
GOOD = "n = 52\n[reliability]\nitems = 19\nalpha = 0.9\nkmo = 0.8\nchi_square = 443.843\ndf = 171\np = 0.0\n"
ONE = "run s.mcap --no-picture --out out"
VERBS = (
    "", "rum", "xyzzy", "run", "view here --miss 0", "run missing.mcap --out x", "info .", "tradeoff .",
    "info missing.mcap --format=json", "rum --format json",
    "info told.mcap", "info told.mcap --format json", "info text.mcap", "info text.mcap --format json",
    "doctor clean.mcap frozen.mcap", "doctor clean.mcap -v", "doctor clean.mcap frozen.mcap --format json",
    "doctor clean.mcap --fail-on note", "doctor clean.mcap --fail-on warning", "doctor frozen.mcap --fail-on warning",
    "doctor frozen.mcap --fail-on error",
    "import aframe m.json -o new/m.mcap --mesh left=wand.glb --mesh right=wand.glb", "import auto m.json -o m1.mcap",
    "import auto m.json -o m2.mcap --format json",
    "import aframe m.json -o m3.mcap --mesh left=big.glb", "import aframe m.json -o text.mcap",
    "import aframe m.json -o old.mcap --force", "import aframe m.json -o x.mcap --mesh left",
    "import aframe m.json -o x.mcap --mesh left=nowhere.glb", "import aframe m.json -o x.mcap --convention unity",
    "import fbx m.json -o x.mcap", "import contacts m.json -o x.mcap",
    "scene check lab.toml", "scene check lab.toml --format json", "scene check text.toml",
    "scene check s.mcap", "scene check told.mcap",
    "scene new s.mcap -o bench.toml", "scene new s.mcap -o lab.toml",
    "mesh repair open.glb -o m.glb", "mesh repair open.glb -o j.glb --format json", "mesh repair s.mcap -o x.glb",
    "mesh repair s.mcap -o a.glb --body a", "mesh repair s.mcap -o x.glb --body c", "mesh repair open.glb -o open.glb",
    "diff before after", "diff before after --different-sessions", "diff slow fast", "diff slow fast --format json",
    "diff slow lab.toml", "study check --strict", "study check good.toml --strict",
    "stress --detector hybrid --family 1,10 --pairs 50 --seed 7", "stress --detector hybrid --case 28,32",
    "stress --detectors exact,hybrid,exact, --family 3 --pairs 5 --format json", "stress --detectors , --pairs 1",
    "stress --detector spoon --pairs 1", "stress --family 44", "stress --case 40",
    "share slow -o sent", "shrink slow --miss 9", "shrink slow", "view slow --miss 9", "view slow",
    f"{ONE} --detectors hybird", f"{ONE} --detectors hybrid[speed=3]", f"{ONE} --detectors discrete[rate_hz=-1]",
    f"{ONE} --detectors discrete[rate_hz=fast]", f"{ONE} --detectors hybrid[", f"{ONE} --detectors hybrid,hybrid",
    f"{ONE} --start 99", f"{ONE} --end -1", f"{ONE} --oracle nobody", f"{ONE} --start nan", f"{ONE} --end 1e308",
    f"{ONE} --policy frozen=hold:1e308", f"{ONE} --policy tracking-lost=wish",
    f"{ONE} --step-rate 25 --detectors exact",
    f"{ONE} --max-missed nan", f"{ONE} --max-missed 50", f"{ONE} --max-p99-ms inf", f"{ONE} --tau 1e99",
    "run lost.mcap --no-picture --out out --policy tracking-lost=refuse", "run text.mcap", "run torn.mcap",
    "run bare.mcap",
    "run none.mcap", "run empty.mcap", "tradeoff lost.mcap --out out --policy tracking-lost=refuse",
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("day")
    scene = Scene(name="two-cubes", bodies=(SceneBody("a", proxy=True),))
    events, spans = [Event(5, "press"), Event(9, "press")], [Interval(20_000_000, 90_000_000, "task", "stir")]
    told = cubes({"a": range(200), "b": [9] * 200}, scene=scene, events=events, intervals=spans)
    still = np.zeros((200, 3))
    looked = GazeTrack(10_000_000 * np.arange(200), still, still - (0, 0, 1), np.arange(200) > 49)
    heart = ScalarTrack([0, 10**9, 5 * 10**9, 6 * 10**9], [70, np.nan, 72.5, 68], "1/min")
    scalars = {"heart rate": heart, "one": ScalarTrack([5], [1]), "none": ScalarTrack([5, 6], [np.nan] * 2, "K")}
    facts = {"vr_type": "immersive", "synthetic": "cubes"}
    open_cube = MeshData(cube().vertices, [face for face in cube().faces if cube().vertices[face, 0].min() < 0.5])
    held = cubes(PLACES, scene=parse_scene(EFFECTS))
    held.meshes["a"] = open_cube
    status = [[1, 1]] * 6 + [[1, 2]] * 2 + [[1, 1]] * 4
    for name, session in {
        "told": replace(told, gaze={"anna": looked}, scalars=scalars, facts=facts), "s": held,
        "lost": framed([10 * k for k in range(12)], status), "bare": replace(cubes(PLACES), meshes={}),
        "none": Session.from_tracks({"a": Track([], np.zeros((0, 3)), np.zeros((0, 4)))}, {"a": cube()}),
    }.items():  # fmt: skip
        write_session(session, place / f"{name}.mcap")
    rounded, frozen = clean(), clean()
    rounded.arrays["quaternion_xyzw"][:, 0] *= 1 + 1e-5
    FAULTS["frozen pose"](frozen, 1, 300)
    rounded.write(place / "clean.mcap")
    frozen.write(place / "frozen.mcap")
    (place / "torn.mcap").write_bytes((place / "s.mcap").read_bytes()[:-200])
    for name in ("text.mcap", "text.toml", "old.mcap"):
        (place / name).write_text("[[hello", "utf-8")
    (place / "empty.mcap").touch()
    (place / "lab.toml").write_text(EFFECTS, "utf-8")
    (place / "good.toml").write_text(GOOD, "utf-8")
    (place / "open.glb").write_bytes(mesh_to_glb(open_cube, "a"))
    for name, edge in (("wand", 0.1), ("big", 10.0)):
        (place / f"{name}.glb").write_bytes(mesh_to_glb(cube(edge), name))
    pose = {"position": {"x": 0.5, "y": 1.0, "z": 0.0}, "rotation": {"x": 0, "y": 10, "z": 0}}
    poses = {"poses": [{"timestamp": 1000.0 + 11.1 * k, **pose} for k in range(20)]}
    (place / "m.json").write_text(json.dumps({"left": poses, "right": poses}), "utf-8")
    many = {"a": [0] * 80, "b": [3, 0.9] * 40}, {"a": [0] * 80, "b": [3, 2] * 40}
    few = {"a": [0] * 20, "b": [3, 3, 0.9, 0.9, 3, 0.9, 3, 3, 3, 3, 0.9, 0.9, 0.9, 3, 3, 3, 3, 3, 3, 3]}
    for name, places, asked in (
        ("before", many[0], {"detectors": "hybrid", "oracle": "none"}),
        ("after", many[1], {"detectors": "hybrid", "oracle": "none"}),
        ("slow", few, {"detectors": "it=discrete[rate_hz=25]"}),
        ("fast", few, {"detectors": "it=discrete[rate_hz=100]"}),
    ):  # fmt: skip
        with_steady_times(replay.run(cubes(places), **asked)).write(place / name, picture=False)
    return place


@pytest.mark.parametrize("words", VERBS)
def test_a_verb_says_what_it_said(words, folder, monkeypatch, capsys, snapshot):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "100")
    code = main(words.split())
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    text = re.sub(rf"{folder}\S*/|(?<=at byte )\d+", "", f"exit {code}\n{said.out}----\n{said.err}")
    assert text == snapshot
