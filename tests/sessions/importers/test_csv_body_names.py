"""A body keeps its name and its poses where a part of the name is also a word for what a column holds."""

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
    """Each body of a table has seven columns, called after it in this style; `plain_poses` gives them back by body.

    The endings of the names in BODIES are also words for an axis, a side or a magnitude.
    """
    for names in BODIES:
        columns_by_body = {name: [name + ending for ending in STYLES[style]] for name in names}
        poses = plain_poses([column for columns in columns_by_body.values() for column in columns])
        assert {name: [*pose.position, *pose.rotation] for name, pose in poses.items()} == columns_by_body


@pytest.mark.parametrize("style", STYLES)
def test_bodies_with_similar_names_keep_their_positions(tmp_path, style):
    """Names differ in the last letter, which is also an ending of columns; the pens lie at x = 0, 1 and 2 m.

    The table is imported by its draft of a mapping (what each column is), whose axes alone are added.
    """
    x_of_each_body = {"PenA": 0.0, "PenB": 1.0, "PenR": 2.0}
    header = ",".join(["t", *(name + ending for name in x_of_each_body for ending in STYLES[style])])
    rows = [
        ",".join([f"{frame / 90:.6f}", *(f"{x},{frame / 90},0,0,0,0,1" for x in x_of_each_body.values())])
        for frame in range(9)
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    with pytest.raises(UnknownColumnsError) as error:
        import_session("csv", path)
    mapping = tmp_path / "columns.toml"
    mapping.write_text(error.value.draft_with_axes("openxr"), encoding="utf-8")
    session = import_session("csv", path, mapping=mapping)
    x_of_first_frame = session.frames.position[0, :, 0].tolist()
    assert dict(zip(session.names, x_of_first_frame, strict=True)) == x_of_each_body


def test_prefix_of_an_axis_tells_the_kind_of_a_column():
    """cup_p_x is of a position, cup_q_x of a quaternion, and cup_v_x of a velocity, which is no part of a pose."""
    positions, rotations = [f"cup_p_{axis}" for axis in "xyz"], [f"cup_q_{axis}" for axis in "xyzw"]
    poses = plain_poses([*positions, *rotations, *(f"cup_v_{axis}" for axis in "xyz")])
    assert list(poses) == ["cup"] and [*poses["cup"].position] == positions and [*poses["cup"].rotation] == rotations
