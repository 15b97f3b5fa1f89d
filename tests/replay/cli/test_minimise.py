import json
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from support.small_worlds import STEP_NS, cube

from replay.cli.main import main
from replay.cli.minimise import LIMIT
from sessions import Event, GazeTrack, HandTrack, Interval, LiveContact, ScalarTrack, Session, Track, write_session
from sessions.scene_files.scene_toml import parse_scene

SERIAL, NAME, FOLDER = "LHR-0A1B2C3D", "Zoe Quimby", "C:/Users/quimby/lab"
SECRETS = ("0a1b2c3d", "zoe", "quimby", "c:/users")
SCENE = f"""# by {NAME}
[scene]
name = "{NAME}"
[[body]]
id = "{SERIAL}"
mesh = "{FOLDER}/a.glb"
tags = ["hand", "{NAME}"]
group = "{NAME}"
[[body]]
id = "beaker"
[[effect]]
kind = "contact"
between = ["{SERIAL}", "beaker"]
"""


def told():
    """A session that says a serial, a name and a path wherever one can be said."""
    stamps = 1_700_000_000 * 10**9 + np.arange(6) * STEP_NS
    places = {SERIAL: [0.0] * 6, "beaker": [3, 0.9, 0.9, 1.0, 3, 3], "headset": [20.0] * 6}
    poses = {name: (np.outer(x, [0.6, 0.0, 0.8]), np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))) for name, x in places.items()}
    scene = parse_scene(SCENE)
    start, hand = int(stamps[0]), f"{NAME}/left"
    facts = dict.fromkeys(
        ("devices", "pseudonym", "conversions", "clock", "vr_type", NAME), f"{NAME} {SERIAL} {FOLDER}"
    )
    made = Session.from_arrays(
        stamps, poses, {SERIAL: cube(), "beaker": cube()}, scene,
        events=[Event(start, f"{NAME} came", f"{NAME} at {FOLDER}", SERIAL)],
        intervals=[Interval(start, start + STEP_NS, "task", f"task of {NAME}", {NAME: SERIAL})],
        facts={**facts, "consent": "share"},
    )  # fmt: skip
    return replace(
        made, colliders={SERIAL: (cube(),)}, live_contacts=(LiveContact(start, SERIAL, "beaker", "enter"),),
        hands={hand: HandTrack(stamps, buttons=(NAME,))},
        gaze={NAME: GazeTrack(stamps[:1], [[0.0] * 3], [[1.0, 0.0, 0.0]], bodies=[SERIAL])},
        scalars={f"heart rate {NAME}": ScalarTrack(stamps[:1], [70.0], NAME)},
        fast_tracks={SERIAL: Track(stamps, *poses[SERIAL])},
    )  # fmt: skip


def found_in(path):
    """Which secrets the bytes of a file hold, as they are or unpacked, in whatever letters."""
    with path.open("rb") as file:
        reader = make_reader(file)
        parts = [path.read_bytes(), repr(reader.get_summary()).encode()]
        parts += [message.data + channel.topic.encode() for _, channel, message in reader.iter_messages()]
        parts += [one.data + one.name.encode() for one in reader.iter_attachments()]
        parts += [repr(one).encode() for one in reader.iter_metadata()]
    return {word for word in SECRETS if any(word.encode() in part.lower() for part in parts)}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("told") / "zoe-quimby.mcap"
    write_session(told(), path)
    return path


@pytest.mark.parametrize("more", [[], ["--keep", "time", "--keep", "place"], ["--drop", "head", "--drop", "height"]])
@pytest.mark.parametrize("form", ["text", "json"])
def test_no_serial_name_or_path_is_in_any_output(recording, tmp_path, capsys, more, form):
    assert found_in(recording) == {*SECRETS}
    out = tmp_path / "small.mcap"
    assert main(["minimise", str(recording), "-o", str(out), "--format", form, *more]) == 0
    said = capsys.readouterr()
    assert found_in(out) == set()
    assert not [word for word in SECRETS if word in (said.out + said.err).lower()]
    assert "anonym" not in (said.out + said.err).lower()
    if form == "json":
        plain = json.loads(said.out)
        assert plain["limit"] == LIMIT and plain["contacts"]["pair_frames"] == 6
        assert plain["contacts"]["contacts"] == 3
    else:
        assert "of 6 pair-frames differ; 3 were contact" in said.out and " ".join(said.out.split()).endswith(LIMIT)
        assert "new names: 1 of kind body, 1 of kind tag, 1 of kind group" in said.out
        assert "taken out: 6 facts, 2 texts of events and intervals" in said.out


def test_an_allowed_name_stays_and_a_file_is_replaced_only_with_force(recording, tmp_path, capsys):
    out = tmp_path / "small.mcap"
    call = ["minimise", str(recording), "-o", str(out), "--allow", SERIAL, "-q"]
    assert main(call) == 0 and found_in(out) == {"0a1b2c3d"}
    assert main(call) == 1 and "--force" in capsys.readouterr().err
    assert main([*call, "--force"]) == 0


def test_a_recording_without_pairs_is_written_and_says_that_nothing_was_compared(tmp_path, capsys):
    write_session(replace(told(), meshes={}, colliders={}), tmp_path / "bare.mcap")
    assert main(["minimise", str(tmp_path / "bare.mcap"), "-o", str(tmp_path / "out.mcap")]) == 0
    assert "contacts by exact: not compared; no pair of bodies can be asked" in capsys.readouterr().out


def test_the_limit_is_the_published_one():
    assert "94 % of 55,541 users" in LIMIT and "Nair et al., USENIX Security 2023" in LIMIT and "100 s" in LIMIT
