"""A body keeps its name and its poses where a part of the name is also a word for what a column holds."""

import numpy as np
import pytest

from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError, plain_poses

STYLES = {
    "px": ["_px", "_py", "_pz", "_qx", "_qy", "_qz", "_qw"],
    "dots": [".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"],
    "words": [" pos x", " pos y", " pos z", " rot x", " rot y", " rot z", " rot w"],
    "camel": ["PosX", "PosY", "PosZ", "RotX", "RotY", "RotZ", "RotW"],
}
BODIES = [
    ["HandL", "HandR"],
    ["Cup_R", "Cup_L"],
    ["Cup_a", "Cup_b", "Pen"],
    ["PenA", "PenB", "PenC", "PenD", "PenE", "Cup"],
    ["ArmP", "ArmQ", "ArmX", "ArmW", "Cup"],
    ["Mag stirrer", "Linear actuator"],
    ["a", "b", "p", "q", "x", "w"],
]


@pytest.mark.parametrize("style", STYLES)
def test_every_body_has_the_columns_of_its_name(style):
    """For each set of BODIES seven columns a body are written in this style and found again by their names."""
    for names in BODIES:
        columns = {name: [name + ending for ending in STYLES[style]] for name in names}
        poses = plain_poses([column for of_body in columns.values() for column in of_body])
        assert {name: [*row.position, *row.rotation] for name, row in poses.items()} == columns


@pytest.mark.parametrize("style", STYLES)
def test_bodies_with_similar_names_keep_their_positions(tmp_path, style):
    """Names differ in the last letter, which is also an ending of columns in some styles; bodies are 1 m apart."""
    names = ["PenA", "PenB", "PenR"]
    header = ",".join(["t", *(name + ending for name in names for ending in STYLES[style])])
    rows = [
        ",".join([f"{frame / 90:.6f}", *(f"{offset},{frame / 90},0,0,0,0,1" for offset in range(3))])
        for frame in range(9)
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    with pytest.raises(UnknownColumnsError) as error:
        import_session("csv", path)
    mapping = tmp_path / "columns.toml"
    mapping.write_text(error.value.draft_with_axes("openxr"), encoding="utf-8")
    session = import_session("csv", path, mapping=mapping)
    assert [*session.names] == names
    assert np.allclose(session.frames.position[0, :, 0], [0, 1, 2])


def test_prefix_of_an_axis_tells_the_kind_of_a_column():
    """p is a position, q a quaternion, and v a velocity, which is no part of a pose."""
    positions, rotations = [f"cup_p_{axis}" for axis in "xyz"], [f"cup_q_{axis}" for axis in "xyzw"]
    poses = plain_poses([*positions, *rotations, *(f"cup_v_{axis}" for axis in "xyz")])
    assert list(poses) == ["cup"] and [*poses["cup"].position] == positions and [*poses["cup"].rotation] == rotations
