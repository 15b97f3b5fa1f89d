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
# Seconds of the clock of a computer that runs for two days.
STAMPS = 152_000.5 + np.arange(COUNT) / 64  # exact in float64
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
    """A stream that names no unit is taken to be in metres, and the session says so."""
    session = import_session("xdf", xdf_file(tmp_path, *mocap_chunks(unit=unit, scale=scale)))
    assert set(session.names) == {"Rod", "Cup"}
    for name in POSITIONS:
        assert has_poses(session.tracks[name], POSITIONS[name], ROTATIONS[name], stamps=np.rint(1e9 * STAMPS))
    assumed = session.facts["assumed"]
    assert assumed.startswith("axes openxr (right-handed, +Y up, -Z forward)")
    assert ("lengths in m" in assumed) == (unit == "")
    assert "stream 'Mocap': no clock offsets" in assumed
    assert session.facts["clock"] == "LSL clock of the recording computer, s"


POSE_OUTLET = [{"label": label} for label in ("PosX", "PosY", "PosZ", "RotX", "RotY", "RotZ", "RotW")]
CHANNELS_WITHOUT_NAMES = [
    {"label": label, "type": kind} for kind, labels in (("position", "xyz"), ("quaternion", "xyzw")) for label in labels
]


@pytest.mark.parametrize(
    ("kind", "described", "axes"),
    [
        ("Controller", CHANNELS_WITHOUT_NAMES, np.eye(3)),
        ("VR", TRANSFORM_OUTLET, UNITY),
        ("Unity.Transform", POSE_OUTLET, UNITY),
    ],
)
def test_controller_outlets_are_bodies_and_lsl4unity_uses_its_axes(tmp_path, kind, described, axes):
    """LSL4Unity writes a rotation before positions or after them; a stream of scalars is no body.

    Where it wrote the only poses, Unity's axes are assumed; with a stream of another kind beside it they must be named.
    """
    position, rotation = POSITIONS["Cup"], ROTATIONS["Cup"].as_quat()
    rows = [rotation, 0 * position, position] if described is TRANSFORM_OUTLET else [position, rotation]
    pieces = (
        stream_header(number=1, name="tool", kind=kind, channels=described),
        samples(number=1, stamps=STAMPS, rows=np.column_stack(rows)),
        stream_header(number=3, name="Pupil", kind="Unity.Float", channels=[{"label": "mm"}]),
        samples(number=3, stamps=STAMPS, rows=position[:, :1]),
    )
    session = import_session("xdf", xdf_file(tmp_path, *pieces))
    assert session.names == ("tool",) and list(session.scalars) == ["Pupil"]
    assert has_poses(session.tracks["tool"], position, ROTATIONS["Cup"], axes)
    if axes is UNITY:
        assert "axes unity (left-handed, +Y up, +Z forward)" in session.facts["assumed"]
        mixed = xdf_file(tmp_path, *pieces, stream_header(number=4, name="M", kind="MoCap", channels=channel_headers()))
        assert_import_refused("xdf", mixed, "poses of Unity and others are in it; name the axes of all by --conv")


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


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("Controllers", "Controler", "no stream 'Controler'; did you mean 'Controllers'"),
        ('"l_px"', '"l_qx"', "stream 'Controllers': no channel 'l_qx'; did you mean 'l_"),
        ('units = "mm"', 'units = "feet"\nmore = 1', "units is 'feet'.*unknown key 'more'"),
        ("", "", ""),
    ],
)
def test_mistakes_in_a_stream_mapping_are_named(tmp_path, old, new, text):
    """A text of the mapping is replaced by another; without a replacement it is read."""
    labels = [{"label": f"l_{item}"} for item in ("px", "py", "pz", "ez", "ex", "ey", "seen")]
    angles = ROTATIONS["Cup"].as_euler("zxy", degrees=True)
    rows = np.column_stack([1000 * POSITIONS["Cup"], angles, np.arange(COUNT) != 7])
    path = xdf_file(
        tmp_path,
        stream_header(number=1, name="Controllers", kind="VR", channels=labels),
        samples(number=1, stamps=STAMPS, rows=rows),
    )
    (tmp_path / "map.toml").write_text(STREAM_MAP.replace(old, new) if old else STREAM_MAP)
    if text:
        with pytest.raises(ImportFileError, match=text):
            import_session("xdf", path, mapping=tmp_path / "map.toml")
        return
    track = import_session("xdf", path, mapping=tmp_path / "map.toml").tracks["left"]
    assert np.flatnonzero(~track.valid).tolist() == [7]
    assert has_poses(replace(track, valid=None), POSITIONS["Cup"], ROTATIONS["Cup"], UNITY)


def test_text_streams_are_events_and_number_streams_scalars(tmp_path):
    """A text stream "Stim" of two markers beside streams of numbers of one and two channels, and one of no names.

    Clock offsets are added: 0.5 s to "Cap", 0.25 s and 20 us a second to "Mocap".
    """
    rng = np.random.default_rng(8)
    brain, heart = rng.normal(size=(COUNT, 2)), 70 + rng.normal(size=(COUNT, 1))
    ahead = [(STAMPS[0] + k, 0.25 + 2e-5 * k) for k in range(5)]
    pieces = (
        stream_header(number=2, name="Stim", kind="Markers", channels=[], form="string"),
        samples(number=2, stamps=[STAMPS[3], STAMPS[9]], rows=["grasp", "pour"]),
        stream_header(
            number=3, name="Cap", kind="EEG", channels=[{"label": item, "unit": "microvolts"} for item in ("Fz", "Cz")]
        ),
        samples(number=3, stamps=STAMPS, rows=brain),
        offsets(number=3, pairs=[(STAMPS[0], 0.5), (STAMPS[-1], 0.5)]),
        stream_header(number=4, name="Heart rate", kind="HR", channels=[{"label": "rate", "unit": "1/min"}]),
        samples(number=4, stamps=STAMPS, rows=heart),
        stream_header(number=5, name="Bare", kind="Markers", channels=[{}, {}]),
        samples(number=5, stamps=STAMPS[:2], rows=[[1, 2], [3, 4]]),
    )
    session = import_session("xdf", xdf_file(tmp_path, *pieces, *mocap_chunks(pairs=ahead)), convention="unity")
    assert session.names == ("Rod", "Cup") and session.facts["handedness"] == "left"
    assert [(item.time_ns, item.name, item.message) for item in session.events] == [
        (round(STAMPS[3] * 1e9), "Stim", "grasp"),
        (round(STAMPS[9] * 1e9), "Stim", "pour"),
    ]
    assert list(session.scalars) == ["Cap/Fz", "Cap/Cz", "Heart rate", "Bare/1", "Bare/2"]
    for column, name in enumerate(("Cap/Fz", "Cap/Cz")):
        scalar = session.scalars[name]
        assert scalar.unit == "microvolts" and scalar.values.tolist() == brain[:, column].tolist()
        assert np.abs(scalar.times_ns / 1e9 - STAMPS - 0.5).max() < 1e-6
    assert session.scalars["Heart rate"].values.tolist() == heart[:, 0].tolist()
    expected = STAMPS + 0.25 + 2e-5 * (STAMPS - STAMPS[0])
    assert np.abs(session.tracks["Cup"].times_ns / 1e9 - expected).max() < 1e-6
    assert "stream 'Mocap': 5 clock offsets applied, 0.250000 to 0.250080 s" in session.facts["conversions"]
    assert "axes" not in session.facts["assumed"]


def test_rows_of_confidence_0_are_lost(tmp_path):
    """The eighth channel, Confidence, is 0 and 1 in turn."""
    rod_poses = rows_of_both_bodies()[:, :7]
    confidence = np.arange(COUNT) % 2  # 0, 1, 0, 1 ...
    rows = np.column_stack([rod_poses, confidence])
    head = stream_header(
        number=1, name="M", kind="MoCap", channels=channel_headers(names=("Rod",), types=(*TYPES, "Confidence"))
    )
    track = import_session("xdf", xdf_file(tmp_path, head, samples(number=1, stamps=STAMPS, rows=rows))).tracks["Rod"]
    assert track.valid.tolist() == (confidence == 1).tolist()


SAMPLE_BYTES = 1 + 8 + 14 * 8
"""Of a row: that a stamp follows, the stamp, and 14 numbers."""


@pytest.mark.parametrize(
    ("cut", "kept", "skipped"),
    [
        (SAMPLE_BYTES - 21, COUNT, False),  # within the last sample, which pyxdf hands out all the same
        (SAMPLE_BYTES + 9, COUNT // 2, True),  # within the last but one: pyxdf skips the whole chunk, the later half
    ],
)
def test_truncated_file_loses_and_reports_its_last_sample(tmp_path, cut, kept, skipped):
    """The last sample that pyxdf hands out is half its own and half the one before."""
    path = xdf_file(tmp_path, *mocap_chunks())
    path.write_bytes(path.read_bytes()[:-cut])
    session = import_session("xdf", path)
    assert session.tracks["Cup"].valid.tolist() == [True] * (kept - 1) + [False]
    text = session.facts["conversions"]
    assert "the file is cut short or damaged: the last pose of each body is flagged as lost" in text
    assert "the end of the file: 1 of 1 samples dropped: cut off, and perhaps more" in ledger_text(session)
    assert ("damaged places: 1 of 1 samples dropped" in ledger_text(session)) == skipped


def chunks_of_cup(number, first, last, *, name="Mocap", kind="MoCap", body="Cup", shift=0.0):
    """Samples ``first`` to before ``last`` as a stream of its own, of the same name and channels as the others."""
    rows = np.concatenate([POSITIONS["Cup"], ROTATIONS["Cup"].as_quat()[:, [3, 0, 1, 2]]], axis=1)[first:last]
    head = stream_header(number, name, kind, channel_headers(names=(body,)))
    return head, samples(number, STAMPS[first:last] + shift, rows)


# Number of the stream, its first sample, the one after its last.
PARTS_OF_A_STREAM = {
    "two parts": [(1, 0, 15), (2, 15, COUNT)],
    "three parts": [(1, 0, 10), (2, 10, 25), (3, 25, COUNT)],
    "the later part first": [(1, 20, COUNT), (2, 0, 20)],
    "a part without samples": [(1, 0, 20), (2, 20, 20), (3, 20, COUNT)],
}


@pytest.mark.parametrize("kind", PARTS_OF_A_STREAM)
@pytest.mark.parametrize("mapped", [False, True])
def test_segments_of_an_interrupted_stream_are_a_single_body(tmp_path, kind, mapped):
    """A stream that was interrupted goes on under the same name, with or without a mapping."""
    pieces = [piece for part in PARTS_OF_A_STREAM[kind] for piece in chunks_of_cup(*part)]
    path, options = xdf_file(tmp_path, *pieces), {}
    if mapped:
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
    """A row of SEPARATE: streams at once, or of other names or kinds, are other bodies called Cup."""
    streams, names = SEPARATE[kind]
    pieces = [piece for number, first, last, more in streams for piece in chunks_of_cup(number, first, last, **more)]
    session = import_session("xdf", xdf_file(tmp_path, *pieces))
    assert {*session.names} == names and ledger_text(session) == ""
    assert sum(map(len, session.tracks.values())) == sum(last - first for _, first, last, _ in streams)
    assert "another body of the name Cup" in session.facts["conversions"]


def test_mapping_of_simultaneous_equal_streams_is_refused(tmp_path):
    """Two streams "Mocap" last equally long, the second 4 ms later."""
    (tmp_path / "map.toml").write_text(STREAM_MAP.replace("Controllers", "Mocap"))
    pieces = [*chunks_of_cup(number=1, first=0, last=COUNT), *chunks_of_cup(number=2, first=0, last=COUNT, shift=0.004)]
    with pytest.raises(ImportFileError, match="2 streams are called 'Mocap' and differ in channels or overlap in time"):
        import_session("xdf", xdf_file(tmp_path, *pieces), mapping=tmp_path / "map.toml")


def mocap_with(*types, **more):
    """A recording of motion capture whose channels have these types."""
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
    """The file, packed by gzip, gives the same poses.

    With 1 MB of zeros behind it, and 1,000 bytes allowed, it is refused.
    """
    path = xdf_file(tmp_path, *mocap_chunks())
    expected, packed = import_session("xdf", path), path.with_suffix(ending)
    packed.write_bytes(gzip.compress(path.read_bytes()))
    result = import_session("auto", packed)
    for name, track in expected.tracks.items():
        assert result.tracks[name].times_ns.tolist() == track.times_ns.tolist()
        np.testing.assert_array_equal(result.tracks[name].positions, track.positions)
    packed.write_bytes(gzip.compress(path.read_bytes() + bytes(1_000_000)))
    monkeypatch.setattr(xdf, "MOST_UNPACKED", 1000)
    assert_import_refused("auto", packed, r"unpacks to more than [0-9,]+ bytes, as no .*; unpack it with gzip -d")


def test_other_files_and_missing_library_are_refused_in_a_sentence(tmp_path, monkeypatch):
    """A CSV called x.xdf; then ``None`` in sys.modules makes the import of pyxdf fail."""
    path = tmp_path / "x.xdf"
    path.write_text("time,x,y\n")
    assert_import_refused("xdf", path, "is no whole XDF file")
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
    """Scale: as many of the unit make a metre."""
    (tmp_path / "map.toml").write_text(CUP_MAP)
    path = xdf_file(tmp_path, *mocap_chunks(unit=unit, scale=scale))
    session = import_session("xdf", path, mapping=tmp_path / "map.toml", convention="openxr")
    assert has_poses(session.tracks["Cup"], POSITIONS["Cup"], ROTATIONS["Cup"])


def test_mapping_that_contradicts_the_units_of_channels_is_refused(tmp_path):
    """Channels say mm, the mapping m."""
    (tmp_path / "map.toml").write_text('units = "m"' + CUP_MAP)
    with pytest.raises(ImportFileError, match='channels state lengths in mm, and the mapping says units = "m"'):
        import_session("xdf", xdf_file(tmp_path, *mocap_chunks(unit="mm")), mapping=tmp_path / "map.toml")


def test_positions_in_mixed_units_are_refused(tmp_path):
    """The channel of the rod's y says mm, all others metres."""
    described = channel_headers()
    described[1]["unit"] = "mm"
    path = xdf_file(
        tmp_path, *mocap_chunks(head=stream_header(number=1, name="Mocap", kind="MoCap", channels=described))
    )
    assert_import_refused("xdf", path, "lengths are in meters, mm")


def test_channels_beside_poses_that_are_not_read_are_named(tmp_path):
    """The cup's x is of another object, so that the rod alone has a whole pose."""
    described = channel_headers()
    described[7]["object"] = "Other"  # of the cup's place X, so that neither has a whole pose
    path = xdf_file(
        tmp_path, *mocap_chunks(head=stream_header(number=1, name="Mocap", kind="MoCap", channels=described))
    )
    session = import_session("xdf", path)
    assert session.names == ("Rod",)
    assert "stream 'Mocap': channels that are not read: Cup_PositionX, Cup_PositionY" in session.facts["conversions"]
