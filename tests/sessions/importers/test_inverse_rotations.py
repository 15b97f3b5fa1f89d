"""Rotations written from the world to the body come in as poses: each file is written twice, inverted by SciPy."""

import json
from inspect import signature

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.session_files import samples, stream_header, xdf_file

from replay.cli.main import main
from sessions import read_session
from sessions.doctor.finding import CODES
from sessions.errors import ImportFileError
from sessions.importers import IMPORTERS, import_session
from sessions.importers.importing import INVERTED, ROTATIONS, WORLD_TO_BODY, _importer

COUNT = 12
TIMES = 1.0 + np.arange(COUNT) / 90
POSITIONS = np.random.default_rng(1).normal(size=(COUNT, 3))
TRUE_ROTATIONS = Rotation.random(COUNT, rng=2)
SCENES = ("mjcf", "usd")
"""Formats whose rotations are those of a scene's own hierarchy."""


def lines_of(head, *columns):
    """A CSV of this header."""
    return "\n".join([head, *(",".join(map(repr, map(float, row))) for row in np.column_stack(columns)), ""])


def write_csv(folder, rotations, key=""):
    """A wide table with w first, and its mapping."""
    table = lines_of("t,x,y,z,qw,qx,qy,qz", TIMES, POSITIONS, np.roll(rotations.as_quat(), 1, axis=1))
    (folder / "take.csv").write_text(table)
    (folder / "map.toml").write_text(
        f'convention = "unity"\n{key}[time]\ncolumn = "t"\nunit = "s"\n[bodies.cup]\nposition = ["x", "y", "z"]\n'
        'quaternion_wxyz = ["qw", "qx", "qy", "qz"]\n'
    )
    return folder / "take.csv", {"mapping": folder / "map.toml"}


def write_optitrack(folder, rotations):
    """A rigid body with the lines that Motive writes above it."""
    axes = ",".join(["Frame", "Time (Seconds)", *"XYZWXYZ"])
    head = ["Format Version,1.23,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global", ""]
    head += [f",{word}{f',{cell}' * 7}" for word, cell in (("Type", "Rigid Body"), ("Name", "cup"), ("ID", "A"))]
    head += [f",{',Rotation' * 4}{',Position' * 3}"]
    path = folder / "take.csv"
    path.write_text("\n".join([*head, lines_of(axes, np.arange(COUNT), TIMES, rotations.as_quat(), POSITIONS)]))
    return path, {}


def write_uxf(folder, rotations):
    """A tracker with Unity's angles: about z, then x, then y."""
    angles = rotations.as_euler("zxy", degrees=True)[:, [1, 2, 0]]
    head = "time,pos_x,pos_y,pos_z,rot_x,rot_y,rot_z"
    (folder / "cup_movement_T001.csv").write_text(lines_of(head, TIMES, POSITIONS, angles))
    return folder, {}


def write_aframe(folder, rotations):
    """A device with angles in degrees, applied as YXZ."""
    angles = rotations.as_euler("YXZ", degrees=True)[:, [1, 0, 2]]
    poses = [
        {
            "timestamp": 1e3 * time,
            "position": dict(zip("xyz", position, strict=True)),
            "rotation": dict(zip("xyz", angle, strict=True)),
        }
        for time, position, angle in zip(TIMES, POSITIONS.tolist(), angles.tolist(), strict=True)
    ]
    (folder / "take.json").write_text(json.dumps({"cup": {"poses": poses}}))
    return folder / "take.json", {}


def write_xdf(folder, rotations):
    """A MoCap stream of one object."""
    kinds = [*(f"Position{axis}" for axis in "XYZ"), *(f"Orientation{letter}" for letter in "BCDA")]
    channels = [{"type": kind, "object": "cup", "unit": "meters"} for kind in kinds]
    return xdf_file(
        folder,
        stream_header(number=1, name="Mocap", kind="MoCap", channels=channels),
        samples(number=1, stamps=TIMES, rows=np.column_stack([POSITIONS, rotations.as_quat()])),
    ), {}


def write_mcap(folder, rotations):
    """A cup that hangs from a hand, both moving: transforms are inverted before they are composed."""
    from mcap.writer import Writer

    with (folder / "take.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/tf", "json", writer.register_schema("FrameTransform", "jsonschema", b"{}"))
        for row, (time, position) in enumerate(zip(TIMES, POSITIONS.tolist(), strict=True)):
            for parent, child, at in (("world", "hand", row), ("hand", "cup", -1 - row)):
                message = {
                    "timestamp": {"sec": 1, "nsec": round(1e9 * (time - 1.0))},
                    "parent_frame_id": parent,
                    "child_frame_id": child,
                    "translation": dict(zip("xyz", position, strict=True)),
                    "rotation": dict(zip("xyzw", rotations[at].as_quat().tolist(), strict=True)),
                }
                writer.add_message(channel, row, json.dumps(message).encode(), row)
        writer.finish()
    return folder / "take.mcap", {}


WRITERS = {
    "csv": write_csv,
    "optitrack": write_optitrack,
    "uxf": write_uxf,
    "aframe": write_aframe,
    "xdf": write_xdf,
    "mcap": write_mcap,
}


@pytest.mark.parametrize("name", WRITERS)
def test_inverse_rotations_come_in_as_poses(tmp_path, name):
    """A cup's 12 random poses are written plainly, and with inverted rotations, from the world to the body.

    The inverted file, read with the option ``rotations`` that says so, has the same poses: the cosine of quaternions is
    1 or -1. Read without the option some rotation differs, by a cosine below 0.9.
    """
    if name == "xdf":
        pytest.importorskip("pyxdf")
    sessions = []
    for folder, rotations, direction in (
        ("a", TRUE_ROTATIONS, {}),
        ("b", TRUE_ROTATIONS.inv(), {"rotations": WORLD_TO_BODY}),
    ):
        (tmp_path / folder).mkdir()
        source, options = WRITERS[name](tmp_path / folder, rotations)
        sessions.append(import_session(name, source, **options, **direction))
    plain, inverted = sessions
    misread = import_session(name, source, **options)
    assert INVERTED in inverted.facts["conversions"] and INVERTED not in plain.facts["conversions"]
    for body, track in plain.tracks.items():
        np.testing.assert_allclose(inverted.tracks[body].positions, track.positions, atol=1e-9)
        cosine = (inverted.tracks[body].quaternions_xyzw * track.quaternions_xyzw).sum(axis=1)
        assert np.abs(cosine) == pytest.approx(np.ones(COUNT), abs=1e-9), body
        assert np.abs((misread.tracks[body].quaternions_xyzw * track.quaternions_xyzw).sum(axis=1)).min() < 0.9, body


def test_importers_of_tracked_poses_take_the_direction_of_rotations():
    """All importers have the option ``rotations`` but those of scenes, whose hierarchy has no direction to choose."""
    importers = {name for name in IMPORTERS if "rotations" in signature(_importer(name)).parameters}
    assert importers == {*IMPORTERS} - {*SCENES}


def test_a_mapping_and_the_command_undo_inverse_rotations(tmp_path, capsys):
    """Inverted rotations come right by the key ``rotations`` of a mapping and by an option, which the doctor names.

    The poses are in Unity's axes, so that z is mirrored. A word that is no direction is refused with those there are.
    """
    source, options = write_csv(tmp_path, TRUE_ROTATIONS.inv(), key=f'rotations = "{WORLD_TO_BODY}"\n')
    by_key = import_session("csv", source, **options)
    write_csv(tmp_path, TRUE_ROTATIONS.inv())
    out = tmp_path / "take.mcap"
    files = [str(source), "--mapping", str(tmp_path / "map.toml"), "-o", str(out)]
    assert main(["import", "csv", *files, "--rotations", WORLD_TO_BODY]) == 0
    assert INVERTED in " ".join(capsys.readouterr().err.split())
    expected = TRUE_ROTATIONS.as_quat() * [-1, -1, 1, 1]  # Unity's frame mirrored in z
    for session in (by_key, read_session(out)):
        cosine = (session.tracks["cup"].quaternions_xyzw * expected).sum(axis=1)
        assert np.abs(cosine) == pytest.approx(np.ones(COUNT), abs=1e-9)
    assert f"--rotations {WORLD_TO_BODY}" in CODES["rotation-inverse"].fix
    with pytest.raises(ImportFileError, match="no rotations 'inverse'; there are: " + ", ".join(ROTATIONS)):
        import_session("csv", source, **options, rotations="inverse")
