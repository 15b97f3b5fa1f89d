import gzip
import struct
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mutants import assert_import_refused, ledger_text
from support.second_opinions import UNITY, has_poses
from support.session_files import TRANSFORM_OUTLET, chunk, offsets, samples, stream_header, xdf_file

from sessions.errors import ImportFileError
from sessions.importers import import_session, xdf

pytest.importorskip("pyxdf")

COUNT = 40
STAMPS = 152_000.5 + np.arange(COUNT) / 64
"""Seconds of the clock of a computer that has run for two days; 64 Hz, so that they are exact in float64."""
RNG = np.random.default_rng(3)
POSITIONS = {name: RNG.normal(size=(COUNT, 3)) for name in ("Rod", "Cup")}
ROTATIONS = {name: Rotation.random(COUNT, random_state=seed) for seed, name in enumerate(POSITIONS)}
# OrientationA is the scalar of a quaternion: w, and B, C, D are x, y, z.
TYPES = ("PositionX", "PositionY", "PositionZ", "OrientationA", "OrientationB", "OrientationC", "OrientationD")


def channel_headers(unit="meters", types=TYPES, names=tuple(POSITIONS), **more):
    """Headers of channels: one a body and kind of number."""
    return [
        {"label": f"{name}_{kind}", "object": name, "type": kind, "unit": unit, **more}
        for name in names
        for kind in types
    ]


def rows_of_both_bodies():
    """Positions, and quaternions with w first, as the channels of ``TYPES`` have them, (COUNT, 14)."""
    return np.concatenate(
        [np.concatenate([POSITIONS[n], ROTATIONS[n].as_quat()[:, [3, 0, 1, 2]]], axis=1) for n in POSITIONS], axis=1
    )


def mocap_chunks(*, unit="meters", scale=1.0, pairs=(), head=None):
    """A stream of both bodies in two chunks of samples, with ``pairs`` of stamps and clock offsets between them."""
    rows = rows_of_both_bodies()
    rows[:, [0, 1, 2, 7, 8, 9]] *= scale
    half = COUNT // 2
    head = stream_header(number=1, name="Mocap", kind="MoCap", channels=channel_headers(unit)) if head is None else head
    return (
        head,
        samples(number=1, stamps=STAMPS[:half], rows=rows[:half]),
        offsets(number=1, pairs=pairs),
        samples(number=1, stamps=STAMPS[half:], rows=rows[half:]),
    )


@pytest.mark.parametrize(("unit", "scale"), [("meters", 1.0), ("mm", 1000.0), ("centimeters", 100.0), ("", 1.0)])
def test_objects_of_a_mocap_stream_arrive_in_metres(tmp_path, unit, scale):
    """A stream has 40 poses of Rod and Cup, ``scale`` times as large as in metres, and its channels name ``unit``."""
    session = import_session("xdf", xdf_file(tmp_path, *mocap_chunks(unit=unit, scale=scale)))
    assert set(session.names) == {"Rod", "Cup"}
    for name in POSITIONS:
        assert has_poses(session.tracks[name], POSITIONS[name], ROTATIONS[name], stamps=np.rint(1e9 * STAMPS)), name


@pytest.mark.parametrize(("unit", "is_unit_assumed"), [("meters", False), ("", True)])
def test_axes_and_absent_units_and_offsets_are_named_as_assumed(tmp_path, unit, is_unit_assumed):
    """A stream of poses says nothing of its axes and has no clock offsets; its channels name ``unit``, or none."""
    facts = import_session("xdf", xdf_file(tmp_path, *mocap_chunks(unit=unit))).facts
    assert facts["assumed"].startswith("axes openxr (right-handed, +Y up, -Z forward)")
    assert ("lengths in m" in facts["assumed"]) == is_unit_assumed
    assert "stream 'Mocap': no clock offsets" in facts["assumed"]
    assert facts["clock"] == "LSL clock of the recording computer, s"


POSE_OUTLET = [{"label": label} for label in ("PosX", "PosY", "PosZ", "RotX", "RotY", "RotZ", "RotW")]
CHANNELS_WITHOUT_NAMES = [
    {"label": label, "type": kind} for kind, labels in (("position", "xyz"), ("quaternion", "xyzw")) for label in labels
]


def tool_chunks(kind, channels):
    """A stream "tool" with the cup's poses: channels of position and quaternion, or of Unity's transform outlet.

    That has the quaternion first, then angles about an axis, here zeros, and then the position.
    """
    position, quaternion = POSITIONS["Cup"], ROTATIONS["Cup"].as_quat()
    columns = [quaternion, 0 * position, position] if channels is TRANSFORM_OUTLET else [position, quaternion]
    return (
        stream_header(number=1, name="tool", kind=kind, channels=channels),
        samples(number=1, stamps=STAMPS, rows=np.column_stack(columns)),
    )


@pytest.mark.parametrize(
    ("kind", "channels", "axes", "assumed"),
    [
        pytest.param("Controller", CHANNELS_WITHOUT_NAMES, np.eye(3), "axes openxr", id="another program"),
        pytest.param("VR", TRANSFORM_OUTLET, UNITY, "axes unity (left-handed, +Y up, +Z forward)", id="LSL4Unity"),
        pytest.param(
            "Unity.Transform", POSE_OUTLET, UNITY, "axes unity (left-handed, +Y up, +Z forward)", id="a newer LSL4Unity"
        ),
    ],
)
def test_controller_outlets_are_bodies_and_lsl4unity_uses_its_axes(tmp_path, kind, channels, axes, assumed):
    """A stream "tool" has a controller's poses, here those of "Cup"; LSL4Unity writes them in Unity's axes, z reversed.

    LSL4Unity is known by the names of its channels, and a newer one by a kind of stream that begins with "Unity.".
    A stream of one number beside it, "Pupil", is a scalar and no body.
    """
    pupil = (
        stream_header(number=3, name="Pupil", kind="Unity.Float", channels=[{"label": "mm"}]),
        samples(number=3, stamps=STAMPS, rows=np.ones((COUNT, 1))),
    )
    session = import_session("xdf", xdf_file(tmp_path, *tool_chunks(kind, channels), *pupil))
    assert session.names == ("tool",)
    assert list(session.scalars) == ["Pupil"]
    assert has_poses(session.tracks["tool"], POSITIONS["Cup"], ROTATIONS["Cup"], axes)
    assert assumed in session.facts["assumed"]


@pytest.mark.parametrize(("kind", "channels"), [("VR", TRANSFORM_OUTLET), ("Unity.Transform", POSE_OUTLET)])
def test_poses_of_unity_and_others_need_named_axes(tmp_path, kind, channels):
    """LSL4Unity's stream is in Unity's axes; beside it is a stream of motion capture, whose axes nobody knows."""
    mocap = stream_header(number=4, name="M", kind="MoCap", channels=channel_headers())
    path = xdf_file(tmp_path, *tool_chunks(kind, channels), mocap)
    assert_import_refused("xdf", path, "poses of Unity and others are in it; name the axes of all by --conv")


STREAM_MAP = """
convention = "unity"
units = "mm"
[bodies.left]
stream = "Controllers"
position = ["l_px", "l_py", "l_pz"]
euler = {x = "l_ex", y = "l_ey", z = "l_ez"}
order = "zxy"
valid = "l_seen"
"""


VISIBLE_ROWS = np.arange(COUNT) != 7  # all but one


@pytest.fixture
def controllers_xdf(tmp_path):
    """A stream "Controllers" of the cup's poses in mm and degrees, and a flag that is 0 in row 7 alone."""
    labels = [{"label": f"l_{item}"} for item in ("px", "py", "pz", "ez", "ex", "ey", "seen")]
    angles = ROTATIONS["Cup"].as_euler("zxy", degrees=True)
    rows = np.column_stack([1000 * POSITIONS["Cup"], angles, VISIBLE_ROWS])
    return xdf_file(
        tmp_path,
        stream_header(number=1, name="Controllers", kind="VR", channels=labels),
        samples(number=1, stamps=STAMPS, rows=rows),
    )


def test_mapping_says_which_channels_are_a_pose(controllers_xdf, tmp_path):
    """STREAM_MAP names the stream, its channels, unit and axes; the pose whose flag is 0 is lost."""
    (tmp_path / "map.toml").write_text(STREAM_MAP)
    track = import_session("xdf", controllers_xdf, mapping=tmp_path / "map.toml").tracks["left"]
    assert track.valid.tolist() == VISIBLE_ROWS.tolist()
    as_if_all_visible = replace(track, valid=None)
    assert has_poses(as_if_all_visible, POSITIONS["Cup"], ROTATIONS["Cup"], UNITY)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("Controllers", "Controler", "no stream 'Controler'; did you mean 'Controllers'"),
        ('"l_px"', '"l_qx"', "stream 'Controllers': no channel 'l_qx'; did you mean 'l_"),
        ('units = "mm"', 'units = "feet"\nmore = 1', "units is 'feet'.*unknown key 'more'"),
    ],
)
def test_mistakes_in_a_stream_mapping_are_named(controllers_xdf, tmp_path, old, new, text):
    """In STREAM_MAP, the right mapping of the recording, ``old`` is replaced by ``new``."""
    (tmp_path / "map.toml").write_text(STREAM_MAP.replace(old, new))
    with pytest.raises(ImportFileError, match=text):
        import_session("xdf", controllers_xdf, mapping=tmp_path / "map.toml")


def test_text_streams_are_events_and_number_streams_scalars(tmp_path):
    """Beside the poses are a stream of two texts, one of two channels of numbers, one of one, and one without labels.

    A scalar is called STREAM/CHANNEL, by the channel's label or number, or STREAM where it has one channel.
    """
    rng = np.random.default_rng(8)
    brain, heart = rng.normal(size=(COUNT, 2)), 70 + rng.normal(size=(COUNT, 1))
    pieces = (
        stream_header(number=2, name="Stim", kind="Markers", channels=[], form="string"),
        samples(number=2, stamps=[STAMPS[3], STAMPS[9]], rows=["grasp", "pour"]),
        stream_header(
            number=3, name="Cap", kind="EEG", channels=[{"label": item, "unit": "microvolts"} for item in ("Fz", "Cz")]
        ),
        samples(number=3, stamps=STAMPS, rows=brain),
        stream_header(number=4, name="Heart rate", kind="HR", channels=[{"label": "rate", "unit": "1/min"}]),
        samples(number=4, stamps=STAMPS, rows=heart),
        stream_header(number=5, name="Bare", kind="Markers", channels=[{}, {}]),
        samples(number=5, stamps=STAMPS[:2], rows=[[1, 2], [3, 4]]),
    )
    session = import_session("xdf", xdf_file(tmp_path, *pieces, *mocap_chunks()))
    assert session.names == ("Rod", "Cup")
    assert [(event.time_ns, event.name, event.message) for event in session.events] == [
        (round(STAMPS[3] * 1e9), "Stim", "grasp"),
        (round(STAMPS[9] * 1e9), "Stim", "pour"),
    ]
    values = {name: scalar.values.tolist() for name, scalar in session.scalars.items()}
    assert values == {
        "Cap/Fz": brain[:, 0].tolist(),
        "Cap/Cz": brain[:, 1].tolist(),
        "Heart rate": heart[:, 0].tolist(),
        "Bare/1": [1.0, 3.0],
        "Bare/2": [2.0, 4.0],
    }
    assert [scalar.unit for scalar in session.scalars.values()] == ["microvolts", "microvolts", "1/min", "", ""]


def test_clock_offsets_of_a_stream_are_added_to_its_stamps(tmp_path):
    """LSL measures how far a stream's clock is behind that of the recording computer, and writes it beside the samples.

    "Cap" is always 0.5 s behind, "Mocap" 0.25 s and 20 us more each second, measured five times from 0 to 4 s.
    """
    constant = [(STAMPS[0], 0.5), (STAMPS[-1], 0.5)]
    growing = [(STAMPS[0] + second, 0.25 + 20e-6 * second) for second in range(5)]
    cap = (
        stream_header(number=3, name="Cap", kind="EEG", channels=[{"label": "Fz"}]),
        samples(number=3, stamps=STAMPS, rows=np.ones((COUNT, 1))),
        offsets(number=3, pairs=constant),
    )
    session = import_session("xdf", xdf_file(tmp_path, *cap, *mocap_chunks(pairs=growing)))
    microsecond = 1e-6
    assert np.abs(session.scalars["Cap"].times_ns / 1e9 - (STAMPS + 0.5)).max() < microsecond
    mocap_stamps = STAMPS + 0.25 + 20e-6 * (STAMPS - STAMPS[0])
    assert np.abs(session.tracks["Cup"].times_ns / 1e9 - mocap_stamps).max() < microsecond
    assert "stream 'Mocap': 5 clock offsets applied, 0.250000 to 0.250080 s" in session.facts["conversions"]


def test_axes_named_by_the_user_are_no_assumption(tmp_path):
    """The recording says nothing of its axes, the option ``convention`` says Unity's, which are left-handed."""
    facts = import_session("xdf", xdf_file(tmp_path, *mocap_chunks()), convention="unity").facts
    assert facts["handedness"] == "left"
    assert "axes" not in facts["assumed"]


def test_rows_of_confidence_0_are_lost(tmp_path):
    """A stream has seven channels of the rod's pose, and an eighth, Confidence, that is 0 and 1 in turn."""
    rod_poses = rows_of_both_bodies()[:, :7]
    confidence = np.arange(COUNT) % 2
    rows = np.column_stack([rod_poses, confidence])
    head = stream_header(
        number=1, name="M", kind="MoCap", channels=channel_headers(names=("Rod",), types=(*TYPES, "Confidence"))
    )
    track = import_session("xdf", xdf_file(tmp_path, head, samples(number=1, stamps=STAMPS, rows=rows))).tracks["Rod"]
    assert track.valid.tolist() == (confidence == 1).tolist()


SAMPLE_BYTES = 1 + 8 + 14 * 8
"""Of a row: that a stamp follows, the stamp, and 14 numbers."""


@pytest.mark.parametrize(
    ("bytes_cut_off", "samples_read", "is_chunk_skipped"),
    [
        pytest.param(SAMPLE_BYTES - 21, COUNT, False, id="within the last sample"),
        pytest.param(SAMPLE_BYTES + 9, COUNT // 2, True, id="within the last but one"),
    ],
)
def test_truncated_file_loses_and_reports_its_last_sample(tmp_path, bytes_cut_off, samples_read, is_chunk_skipped):
    """The library pyxdf gives a last sample that is cut short all the same, half its own and half the one before.

    Where more is cut off, it skips the whole chunk, the later half of the samples. The last pose read is then lost.
    """
    path = xdf_file(tmp_path, *mocap_chunks())
    path.write_bytes(path.read_bytes()[:-bytes_cut_off])
    session = import_session("xdf", path)
    assert session.tracks["Cup"].valid.tolist() == [True] * (samples_read - 1) + [False]
    text = session.facts["conversions"]
    assert "the file is cut short or damaged: the last pose of each body is flagged as lost" in text
    assert "the end of the file: 1 of 1 samples dropped: cut off, and perhaps more" in ledger_text(session)
    assert ("damaged places: 1 of 1 samples dropped" in ledger_text(session)) == is_chunk_skipped


def chunks_of_cup(number, first, last, *, name="Mocap", kind="MoCap", body="Cup", shift=0.0):
    """The cup's samples ``first`` to before ``last`` as a stream of its own, stamped ``shift`` seconds later."""
    rows = np.concatenate([POSITIONS["Cup"], ROTATIONS["Cup"].as_quat()[:, [3, 0, 1, 2]]], axis=1)[first:last]
    head = stream_header(number, name, kind, channel_headers(names=(body,)))
    return head, samples(number, STAMPS[first:last] + shift, rows)


# Number of the stream, its first sample, the sample after its last.
PARTS_OF_A_STREAM = {
    "two parts": [(1, 0, 15), (2, 15, COUNT)],
    "three parts": [(1, 0, 10), (2, 10, 25), (3, 25, COUNT)],
    "the later part first": [(1, 20, COUNT), (2, 0, 20)],
    "a part without samples": [(1, 0, 20), (2, 20, 20), (3, 20, COUNT)],
}


@pytest.mark.parametrize("kind", PARTS_OF_A_STREAM)
@pytest.mark.parametrize("is_mapped", [False, True])
def test_segments_of_an_interrupted_stream_are_a_single_body(tmp_path, kind, is_mapped):
    """The cup's 40 samples are in several streams of one name, a row of PARTS_OF_A_STREAM, as after an interruption.

    With a mapping, which names the stream and the channels of the pose, and without, they are one cup.
    """
    pieces = [piece for part in PARTS_OF_A_STREAM[kind] for piece in chunks_of_cup(*part)]
    path, options = xdf_file(tmp_path, *pieces), {}
    if is_mapped:
        quaternion_xyzw = [f"Cup_Orientation{letter}" for letter in "BCDA"]
        positions = [f"Cup_Position{axis}" for axis in "XYZ"]
        text = f'[bodies.Cup]\nstream = "Mocap"\nposition = {positions}\nquaternion_xyzw = {quaternion_xyzw}\n'
        (tmp_path / "map.toml").write_text(text)
        options = {"mapping": tmp_path / "map.toml"}
    session = import_session("xdf", path, convention="openxr", **options)
    assert session.names == ("Cup",)
    assert has_poses(session.tracks["Cup"], POSITIONS["Cup"], ROTATIONS["Cup"], stamps=np.rint(1e9 * STAMPS))
    count = len(PARTS_OF_A_STREAM[kind])
    assert ledger_text(session) == f"{count - 1} of {count} streams merged: that go on with a stream of the same name"


# Parts as above and what is different of each -> names of the bodies.
SEPARATE = {
    "at once": ([(1, 0, COUNT, {}), (2, 0, COUNT, {"shift": 0.004})], {"Cup", "Mocap/Cup"}),
    "three at once": ([(k, 0, COUNT, {"shift": 0.004 * k}) for k in (1, 2, 3)], {"Cup", "Mocap/Cup", "Mocap/Cup (2)"}),
    "two names": ([(1, 0, 20, {}), (2, 20, COUNT, {"name": "Other"})], {"Cup", "Other/Cup"}),
    "two kinds": ([(1, 0, 20, {}), (2, 20, COUNT, {"kind": "Mocap"})], {"Cup", "Mocap/Cup"}),
}


@pytest.mark.parametrize("kind", SEPARATE)
def test_separate_streams_of_a_body_are_numbered(tmp_path, kind):
    """A row of SEPARATE: streams that last at once, or have other names or kinds, are other bodies called Cup.

    No sample of any is lost.
    """
    streams, names = SEPARATE[kind]
    pieces = [piece for number, first, last, more in streams for piece in chunks_of_cup(number, first, last, **more)]
    session = import_session("xdf", xdf_file(tmp_path, *pieces))
    assert {*session.names} == names
    assert ledger_text(session) == ""
    samples_written = sum(last - first for _number, first, last, _more in streams)
    assert sum(map(len, session.tracks.values())) == samples_written
    assert "another body of the name Cup" in session.facts["conversions"]


def test_mapping_of_simultaneous_equal_streams_is_refused(tmp_path):
    """The mapping is of a stream "Mocap"; there are two of that name at once, the second stamped 4 ms later."""
    (tmp_path / "map.toml").write_text(STREAM_MAP.replace("Controllers", "Mocap"))
    pieces = [*chunks_of_cup(number=1, first=0, last=COUNT), *chunks_of_cup(number=2, first=0, last=COUNT, shift=0.004)]
    with pytest.raises(ImportFileError, match="2 streams are called 'Mocap' and differ in channels or overlap in time"):
        import_session("xdf", xdf_file(tmp_path, *pieces), mapping=tmp_path / "map.toml")


def mocap_with(*types, **more):
    """A function that makes a recording of motion capture whose channels have these types."""
    return lambda: mocap_chunks(
        head=stream_header(number=1, name="M", kind="MoCap", channels=channel_headers(types=types, **more))
    )


BROKEN = {
    "no objects": (mocap_with(*TYPES, object=""), "'M' has two channels PositionX; name an <object>"),
    "angles": (mocap_with("PositionX", "PositionY", "PositionZ", "OrientationP", "OrientationH", "OrientationR", "x"),
               r"no stream of type MoCap .*there are: M \(MoCap\); say which channels are a pose with --mapping"),
    "a stamp": (lambda: (stream_header(number=1, name="M", kind="MoCap", channels=channel_headers()),
                         samples(number=1, stamps=[np.nan], rows=rows_of_both_bodies()[:1])),
                "stream 'M': row 1 has no time"),
    "bad xml": (lambda: [chunk(tag=2, content=struct.pack("<I", 1) + b"<info>")], "is no whole XDF file"),
    "poses of text": (lambda: [stream_header(
                                   number=1, name="M", kind="MoCap", channels=channel_headers(), form="string"),
                               samples(number=1, stamps=[1.0], rows=["a"])],
                      "stream 'M': its samples are not the numbers its channels describe"),
    "a claim": (lambda: [chunk(tag=3, content=struct.pack("<IBI", 1, 4, 5_000_000) + bytes(9))],
                r"a chunk claims 5,000,000 samples of at least a byte.; record it again"),
    "two units": (lambda: mocap_chunks(head=stream_header(
                      number=1, name="M", kind="MoCap", channels=channel_headers("m")[:7] + channel_headers("mm")[7:])),
                  "lengths are in m, mm; record all in one of m, cm, mm"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_file_is_refused_in_a_sentence(tmp_path, name):
    """A row of BROKEN: a function that makes the chunks of a file, and words of the refusal."""
    pieces, text = BROKEN[name]
    assert_import_refused("xdf", xdf_file(tmp_path, *pieces()), text)


@pytest.mark.parametrize("ending", [".xdfz", ".xdf.gz"])
def test_compressed_file_is_read_and_decompression_bomb_refused(tmp_path, ending, monkeypatch):
    """Packed by gzip, a file of 40 poses of Rod and Cup gives them as they are.

    With 1 MB of zeros behind it, and 1,000 bytes allowed, it is refused.
    """
    path = xdf_file(tmp_path, *mocap_chunks())
    packed = path.with_suffix(ending)
    packed.write_bytes(gzip.compress(path.read_bytes()))
    session = import_session("auto", packed)
    assert set(session.names) == {"Rod", "Cup"}
    for name in POSITIONS:
        assert has_poses(session.tracks[name], POSITIONS[name], ROTATIONS[name], stamps=np.rint(1e9 * STAMPS)), name

    packed.write_bytes(gzip.compress(path.read_bytes() + bytes(1_000_000)))
    monkeypatch.setattr(xdf, "MOST_UNPACKED", 1000)
    assert_import_refused("auto", packed, r"unpacks to more than [0-9,]+ bytes, as no .*; unpack it with gzip -d")


def test_file_of_another_format_is_no_xdf(tmp_path):
    """A CSV is called x.xdf: it does not begin as an XDF file, and is refused."""
    path = tmp_path / "x.xdf"
    path.write_text("time,x,y\n")
    assert_import_refused("xdf", path, "is no whole XDF file")


def test_missing_library_of_xdf_is_named_with_its_installation(tmp_path, monkeypatch):
    """``None`` in sys.modules makes the import of pyxdf fail: the error says what to install for XDF."""
    path = xdf_file(tmp_path, *mocap_chunks())
    monkeypatch.setitem(sys.modules, "pyxdf", None)
    with pytest.raises(ImportFileError, match=r'XDF needs pyxdf; install it: pip install "vrlab-replay\[formats\]"'):
        import_session("xdf", path)


CUP_MAP = """
[bodies.Cup]
stream = "Mocap"
position = ["Cup_PositionX", "Cup_PositionY", "Cup_PositionZ"]
quaternion_wxyz = ["Cup_OrientationA", "Cup_OrientationB", "Cup_OrientationC", "Cup_OrientationD"]
"""


@pytest.mark.parametrize(("unit", "scale"), [("mm", 1000.0), ("centimeters", 100.0), ("inches", 1 / 0.0254)])
def test_lengths_use_the_unit_stated_by_xdf_channels(tmp_path, unit, scale):
    """A mapping says which channels are the cup's pose, and no unit: the channels state it; a metre is ``scale``."""
    (tmp_path / "map.toml").write_text(CUP_MAP)
    path = xdf_file(tmp_path, *mocap_chunks(unit=unit, scale=scale))
    session = import_session("xdf", path, mapping=tmp_path / "map.toml", convention="openxr")
    assert has_poses(session.tracks["Cup"], POSITIONS["Cup"], ROTATIONS["Cup"])


def test_mapping_that_contradicts_the_units_of_channels_is_refused(tmp_path):
    """Channels of positions state mm, the mapping m."""
    (tmp_path / "map.toml").write_text('units = "m"' + CUP_MAP)
    with pytest.raises(ImportFileError, match='channels state lengths in mm, and the mapping says units = "m"'):
        import_session("xdf", xdf_file(tmp_path, *mocap_chunks(unit="mm")), mapping=tmp_path / "map.toml")


def test_positions_in_mixed_units_are_refused(tmp_path):
    """The channel of the rod's y says mm, all others metres: the import refuses to scale each by itself."""
    described = channel_headers()
    described[1]["unit"] = "mm"
    path = xdf_file(
        tmp_path, *mocap_chunks(head=stream_header(number=1, name="Mocap", kind="MoCap", channels=described))
    )
    assert_import_refused("xdf", path, "lengths are in meters, mm")


def test_channels_beside_poses_that_are_not_read_are_named(tmp_path):
    """Seven channels of the rod stand before seven of the cup, whose first, its x, is said to be of another object.

    Neither the cup nor the other object then has a whole pose.
    """
    described = channel_headers()
    x_of_cup = described[len(TYPES)]
    x_of_cup["object"] = "Other"
    path = xdf_file(
        tmp_path, *mocap_chunks(head=stream_header(number=1, name="Mocap", kind="MoCap", channels=described))
    )
    session = import_session("xdf", path)
    assert session.names == ("Rod",)
    assert "stream 'Mocap': channels that are not read: Cup_PositionX, Cup_PositionY" in session.facts["conversions"]
