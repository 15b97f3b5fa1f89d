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


def revealing_session():
    """A session with a serial number, a name and a path wherever a recording can have one."""
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


def secrets_in(path):
    """Secrets that are in the bytes of a file, as they are or unpacked, in upper or lower case."""
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
    path = tmp_path_factory.mktemp("revealing") / "zoe-quimby.mcap"
    write_session(revealing_session(), path)
    return path


@pytest.mark.parametrize("form", ["text", "json"])
def test_no_serial_name_or_path_is_in_any_output(revealing_file, tmp_path, capsys, form):
    """A recording has a serial number, a name and a path in its file name, facts, scene, events and topics.

    `replay minimise` leaves none of them in the file that it writes, nor in its own text or JSON, whose last sentence
    says what it cannot do; neither calls the recording anonymous.
    """
    assert secrets_in(revealing_file) == {*SECRETS}
    out = tmp_path / "small.mcap"
    assert main(["minimise", str(revealing_file), "-o", str(out), "--format", form]) == 0
    output = capsys.readouterr()
    assert secrets_in(out) == set()
    assert not [word for word in SECRETS if word in (output.out + output.err).lower()]
    assert "anonym" not in (output.out + output.err).lower()
    if form == "json":
        reported = json.loads(output.out)
        assert reported["limit"] == LIMIT_SENTENCE and "1 of 1 effect" in reported["kept"]
    else:
        assert "1 interval" in output.out and " ".join(output.out.split()).endswith(LIMIT_SENTENCE)


@pytest.fixture(scope="module")
def before_and_after(revealing_file, tmp_path_factory):
    """The recording that names a person, and what `replay minimise` makes of it."""
    out = tmp_path_factory.mktemp("minimised") / "small.mcap"
    assert main(["minimise", str(revealing_file), "-o", str(out)]) == 0
    return read_session(revealing_file), read_session(out)


def test_minimised_recording_preserves_poses_meshes_and_contacts(before_and_after):
    """Poses are those of the recording before, bit by bit, and so are contacts of a run over it.

    Both bodies' meshes and the only recorded collider are there; hands, gaze and scalars are gone.
    """
    before, after = before_and_after
    assert after.frames.position.tobytes() == before.frames.position.tobytes()
    assert after.frames.quaternion_xyzw.tobytes() == before.frames.quaternion_xyzw.tobytes()
    assert len(after.meshes) == 2 and len(after.colliders) == 1
    assert not (after.hands or after.gaze or after.scalars)
    verdict_before, verdict_after = (
        compute(session, detectors="exact", oracle="none").detections["exact"].verdict for session in before_and_after
    )
    assert verdict_before.any() and verdict_after.tobytes() == verdict_before.tobytes()


def test_minimised_recording_starts_in_2000_with_its_steps_of_time(before_and_after):
    """Its only interval is still from the first frame on, for a step between two frames."""
    before, after = before_and_after
    assert np.array_equal(np.diff(after.frames.stamp_ns), np.diff(before.frames.stamp_ns))
    start = np.datetime64(0, "s") + np.timedelta64(int(after.frames.stamp_ns[0]), "ns")
    assert str(start).startswith("2000-01-01T00:00:00")
    for session in before_and_after:
        (interval,) = session.intervals
        assert interval.start_ns == session.frames.stamp_ns[0] and interval.end_ns - interval.start_ns == STEP_NS


@pytest.mark.parametrize(
    ("facts", "expected"),
    [
        ({"pseudonym": "s07"}, {"pseudonym": pseudonym("participant", "s07")}),
        ({"pseudonym": "not stated"}, {}),
        ({}, {}),
    ],
    ids=["stated", "not stated", "absent"],
)
def test_participant_that_is_stated_gets_another_pseudonym(facts, expected):
    """``facts``: of a recording, which may name its participant by a pseudonym, s07."""
    minimised = minimise(replace(revealing_session(), facts=facts))
    assert minimised.facts == expected
    assert "s07" not in str(minimised.facts)


def moments(session):
    """Nanoseconds from the first frame to every event and to every pose of a fast track."""
    times = [event.time_ns for event in session.events]
    times += [time for track in session.fast_tracks.values() for time in track.times_ns]
    return [int(time - session.frames.stamp_ns[0]) for time in times]


def test_minimised_session_keeps_mass_and_moments_under_numbered_names():
    """Bodies of 0.2 kg, of which a headset has its kind in its name; moments from the first frame on stay as well.

    They are those of an event, in the first frame, and of six poses of a track of its own, a step from each other.
    """
    session = revealing_session()
    scene = replace(session.scene, bodies=tuple(replace(body, extra={"mass": 0.2}) for body in session.scene.bodies))
    before = replace(session, scene=scene)
    after = minimise(before)
    assert after.names == ("body-1", "body-2", "headset-body-3")
    assert [body.extra for body in after.scene.bodies] == [{"mass": 0.2}] * 2
    assert moments(after) == moments(before) == [0, *(STEP_NS * np.arange(6)).tolist()]


def test_minimise_keeps_roles_of_effects_and_renames_bodies(revealing_file, tmp_path):
    """The scene declares contact between ``tag:hand``, a role, and ``beaker``, a body: the role stays.

    The body has another name, which is that of a body of the scene.
    """
    with_role = SCENE.replace(f'["{SERIAL}", "beaker"]', '["tag:hand", "beaker"]')
    source, out = tmp_path / "roles.mcap", tmp_path / "small.mcap"
    write_session(replace(read_session(revealing_file), scene=parse_scene(with_role)), source)
    assert main(["minimise", str(source), "-o", str(out)]) == 0
    (effect,) = read_session(out).scene.effects
    role, body = effect.settings["between"]
    assert role == "tag:hand" and body in {body.id for body in read_session(out).scene.bodies}


def test_minimised_device_stamps_stay_beside_their_frames(revealing_file, tmp_path):
    """Poses of the first body were stamped by its device 5 ms before their frames, those of the second 3 h before.

    The 5 ms stay; 3 h would say when it was, so the stamp of the frame stands for the device's.
    """
    ms, hour = 10**6, 3600 * 10**9
    before = read_session(revealing_file)
    device_ns = before.frames.stamp_ns[:, None] - np.array([5 * ms, 3 * hour, 0])
    source, out = tmp_path / "stamped.mcap", tmp_path / "small.mcap"
    write_session(replace(before, source=replace(before.frames, sample_ns=device_ns)), source)
    assert main(["minimise", str(source), "-o", str(out)]) == 0
    frames = read_session(out).frames
    ns_before_frame = frames.stamp_ns[:, None] - frames.sample_ns
    assert (ns_before_frame[:, :2] == [5 * ms, 0]).all()
