import json
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from support.small_worlds import STEP_NS, cube

from replay.cli.main import main
from replay.cli.minimise import LIMIT_SENTENCE
from replay.engine import compute
from replay.studies.minimise import minimise, pseudonym
from sessions import (
    Event,
    GazeTrack,
    HandTrack,
    Interval,
    LiveContact,
    ScalarTrack,
    Session,
    Track,
    read_session,
    write_session,
)
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
    positions = {SERIAL: [0.0] * 6, "beaker": [3, 0.9, 0.9, 1.0, 3, 3], "headset": [20.0] * 6}
    poses = {
        name: (np.outer(x, [0.6, 0.0, 0.8]), np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))) for name, x in positions.items()
    }
    scene = parse_scene(SCENE)
    start, hand = int(stamps[0]), f"{NAME}/left"
    facts = dict.fromkeys(
        ("devices", "pseudonym", "conversions", "clock", "vr_type", NAME), f"{NAME} {SERIAL} {FOLDER}"
    )
    made = Session.from_arrays(
        stamps,
        poses,
        {SERIAL: cube(), "beaker": cube()},
        scene,
        events=[Event(start, f"{NAME} came", f"{NAME} at {FOLDER}", SERIAL)],
        intervals=[Interval(start, start + STEP_NS, "task", f"task of {NAME}", {NAME: SERIAL})],
        facts={**facts, "consent": "share"},
    )
    return replace(
        made,
        colliders={SERIAL: (cube(),)},
        live_contacts=(LiveContact(start, SERIAL, "beaker", "enter"),),
        hands={hand: HandTrack(stamps, buttons=(NAME,))},
        gaze={NAME: GazeTrack(stamps[:1], [[0.0] * 3], [[1.0, 0.0, 0.0]], bodies=[SERIAL])},
        scalars={f"heart rate {NAME}": ScalarTrack(stamps[:1], [70.0], NAME)},
        fast_tracks={SERIAL: Track(stamps, *poses[SERIAL])},
    )


def detected_in(path):
    """Secrets that the bytes of a file hold, as they are or unpacked, in whatever letters."""
    with path.open("rb") as file:
        reader = make_reader(file)
        pieces = [path.read_bytes(), repr(reader.get_summary()).encode()]
        pieces += [message.data + channel.topic.encode() for _, channel, message in reader.iter_messages()]
        pieces += [item.data + item.name.encode() for item in reader.iter_attachments()]
        pieces += [repr(item).encode() for item in reader.iter_metadata()]
    return {word for word in SECRETS if any(word.encode() in piece.lower() for piece in pieces)}


@pytest.fixture(scope="module")
def revealing_file(tmp_path_factory):
    """A recording that names a person in its file name, its facts and its events."""
    path = tmp_path_factory.mktemp("told") / "zoe-quimby.mcap"
    write_session(told(), path)
    return path


@pytest.mark.parametrize("form", ["text", "json"])
def test_no_serial_name_or_path_is_in_any_output(revealing_file, tmp_path, capsys, form):
    """Neither in the file nor in text or JSON about it. It is called anonymous nowhere."""
    assert detected_in(revealing_file) == {*SECRETS}
    out = tmp_path / "small.mcap"
    assert main(["minimise", str(revealing_file), "-o", str(out), "--format", form]) == 0
    output = capsys.readouterr()
    assert detected_in(out) == set()
    assert not [word for word in SECRETS if word in (output.out + output.err).lower()]
    assert "anonym" not in (output.out + output.err).lower()
    if form == "json":
        plain = json.loads(output.out)
        assert plain["limit"] == LIMIT_SENTENCE and "1 of 1 effect" in plain["kept"]
    else:
        assert "1 interval" in output.out and " ".join(output.out.split()).endswith(LIMIT_SENTENCE)


def test_minimised_recording_keeps_poses_meshes_contacts_and_starts_in_2000(revealing_file, tmp_path):
    """Hands, gaze and scalars are gone; steps of time and the interval's place in them are as before."""
    out = tmp_path / "small.mcap"
    assert main(["minimise", str(revealing_file), "-o", str(out)]) == 0
    before, after = read_session(revealing_file), read_session(out)
    assert after.frames.position.tobytes() == before.frames.position.tobytes()
    assert after.frames.quaternion_xyzw.tobytes() == before.frames.quaternion_xyzw.tobytes()
    assert np.array_equal(np.diff(after.frames.stamp_ns), np.diff(before.frames.stamp_ns))
    epoch = np.datetime64(0, "s") + np.timedelta64(int(after.frames.stamp_ns[0]), "ns")
    assert str(epoch).startswith("2000-01-01T00:00:00")
    offsets = [
        (interval.start_ns - int(item.frames.stamp_ns[0]), interval.end_ns - interval.start_ns)
        for item in (before, after)
        for interval in item.intervals
    ]
    assert offsets == [(0, STEP_NS)] * 2
    assert len(after.meshes) == 2 and len(after.colliders) == 1 and not (after.hands or after.gaze or after.scalars)
    runs = [compute(item, detectors="exact", oracle="none").detections["exact"] for item in (before, after)]
    assert runs[0].verdict.tobytes() == runs[1].verdict.tobytes() and runs[0].verdict.any()


@pytest.mark.parametrize("stated", ["not stated", "s07"])
def test_participant_that_is_stated_gets_another_pseudonym(stated):
    """The fact may say that none was stated, name one, or be absent."""
    session = minimise(replace(told(), facts={"pseudonym": stated}))
    assert session.facts == ({} if stated == "not stated" else {"pseudonym": pseudonym("participant", "s07")})
    assert "s07" not in str(session.facts) and not minimise(replace(told(), facts={})).facts


def moments(session):
    """Nanoseconds from the first frame to every event and to every pose of a fast track."""
    times = [event.time_ns for event in session.events]
    times += [time for track in session.fast_tracks.values() for time in track.times_ns]
    return [int(time - session.frames.stamp_ns[0]) for time in times]


def test_minimised_session_keeps_mass_and_moments_under_numbered_names():
    """Moments are those of events and of poses between frames."""
    scene = told().scene
    heavy = replace(scene, bodies=tuple(replace(body, extra={"mass": 0.2}) for body in scene.bodies))
    before = replace(told(), scene=heavy)
    after = minimise(before)
    assert after.names == ("body-1", "body-2", "headset-body-3")
    assert [body.extra for body in after.scene.bodies] == [{"mass": 0.2}] * 2
    assert moments(after) == moments(before) == [0, *(STEP_NS * np.arange(6)).tolist()]


def test_minimise_keeps_roles_of_effects_and_renames_bodies(revealing_file, tmp_path):
    """``tag:hand`` names a role, ``beaker`` a body."""
    declared = SCENE.replace(f'["{SERIAL}", "beaker"]', '["tag:hand", "beaker"]')
    source, out = tmp_path / "roles.mcap", tmp_path / "small.mcap"
    write_session(replace(read_session(revealing_file), scene=parse_scene(declared)), source)
    assert main(["minimise", str(source), "-o", str(out)]) == 0
    (effect,) = read_session(out).scene.effects
    role, body = effect.settings["between"]
    assert role == "tag:hand" and body in {body.id for body in read_session(out).scene.bodies}


def test_minimised_device_stamps_stay_beside_their_frames(revealing_file, tmp_path):
    """A stamp 5 ms late stays so; one 3 h off would say when it was: the stamp of its frame stands for it."""
    before = read_session(revealing_file)
    sample = before.frames.stamp_ns[:, None] - np.array([5_000_000, 3 * 3600 * 10**9, 0])
    before = replace(before, source=replace(before.frames, sample_ns=sample))
    source, out = tmp_path / "stamped.mcap", tmp_path / "small.mcap"
    write_session(before, source)
    assert main(["minimise", str(source), "-o", str(out)]) == 0
    frames = read_session(out).frames
    assert (frames.stamp_ns[:, None] - frames.sample_ns[:, :2] == [5_000_000, 0]).all()
