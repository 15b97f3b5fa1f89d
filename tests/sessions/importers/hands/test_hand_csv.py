"""Hands of several exporters are the same hands; broken files end in one sentence; the books add up."""

import numpy as np
import pytest
from support.made_hands import (
    MEDIAPIPE,
    WEBXR,
    camel,
    made_hand,
    write_leap,
    write_long,
    write_rows,
    write_wide,
)
from support.mutants import refused, round_trips

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.hands.hand_columns import MOST_LISTED, unknown_joints
from sessions.importers.hands.joint_names import JOINTS, RADII_M, UNITY_JOINTS
from sessions.importers.ledger import ledger_of
from sessions.importers.recognition import recognised_format
from sessions.meshes.conventions import CONVENTIONS
from sessions.model.assumption import Confidence, Origin, Subject, assumptions_of

TIMES = np.arange(20) / 45
STILL = TIMES[:6]
"""Enough times for hands that keep their shape."""
CURL = 0.3 + 0.4 * np.sin(3.0 * TIMES) ** 2
SIDES = {"left": -0.3, "right": 0.3}


def hands(size=1.0):
    path = np.stack([0.2 * TIMES, 1.0 + 0.1 * TIMES, -0.3 * TIMES], axis=1)
    return {side: made_hand(CURL, path + np.array([x, 0.0, 0.0]), side, size) for side, x in SIDES.items()}


def some(joints_of, joints):
    return {side: {joint: of[joint] for joint in joints} for side, of in joints_of.items()}


def row_of(session, subject):
    return next(row for row in assumptions_of(session.facts) if row.subject is subject)


def written(kind, path, joints_of):
    if kind == "quest":
        return write_wide(path, TIMES, joints_of)
    if kind == "apple":
        return write_wide(path, TIMES, joints_of, name=lambda side, joint: f"{side}Hand{camel(joint)}", axes="_pos_")
    if kind == "mediapipe":
        name = lambda side, joint: f"{side.upper()}_{MEDIAPIPE[joint]}"  # noqa: E731
        return write_wide(path, TIMES, some(joints_of, MEDIAPIPE), name=name, axes="")
    if kind == "webxr":
        return write_long(path, TIMES, some(joints_of, WEBXR), name=WEBXR.get)
    if kind == "leap":
        return write_leap(path, TIMES, joints_of)
    order = JOINTS if kind == "numbered" else UNITY_JOINTS
    first = 0 if kind == "numbered" else 1
    return write_long(path, TIMES, joints_of, name=lambda joint: str(first + order.index(joint)))


@pytest.mark.parametrize(
    ("kind", "bones"),
    [
        ("quest", 21),
        ("apple", 21),
        ("mediapipe", 20),
        ("webxr", 21),
        ("leap", 19),
        ("numbered", 21),
        ("unity-numbered", 21),
    ],
)
def test_exporters_write_the_same_hands(tmp_path, kind, bones):
    joints_of = hands()
    path = written(kind, tmp_path / "take.csv", joints_of)
    assert recognised_format(path)[0] == "hands"
    session = import_session("auto", path)
    assert [(group.name, len(group.members)) for group in session.scene.groups] == [
        ("left hand", bones),
        ("right hand", bones),
    ]
    for side, joints in joints_of.items():
        for finger in ("thumb", "index", "middle", "ring", "little"):
            track = session.tracks[f"{side} {finger} tip"]
            np.testing.assert_allclose(track.positions, joints[f"{finger} tip"], atol=1e-7)
            assert track.valid.all()
    assert {*session.meshes} == {*session.names} and "taken_for" in session.facts
    for entry in ledger_of(session.facts):
        assert entry.read == entry.kept and not entry.dropped and not entry.merged
    round_trips(session, tmp_path)


def test_a_csv_of_hands_needs_no_name_of_its_format(tmp_path):
    session = import_session("csv", write_wide(tmp_path / "take.csv", TIMES, hands()))
    assert session.facts["taken_for"].startswith("hands, because its columns")


@pytest.mark.parametrize(
    ("axes", "unit"),
    [("unity", "m"), ("unreal", "cm"), ("ros", "mm"), ("openxr", "m")],
)
def test_axes_and_units_are_as_named_or_as_hands_say(tmp_path, axes, unit):
    convention, joints_of = CONVENTIONS[axes], hands()
    metres = {"m": 1.0, "cm": 0.01, "mm": 0.001}[unit]
    source = {
        side: {joint: convention.source_points(points) / metres for joint, points in joints.items()}
        for side, joints in joints_of.items()
    }
    path = write_wide(tmp_path / "take.csv", TIMES, source)
    session = import_session("hands", path, convention=axes)
    assert (
        row_of(session, Subject.LENGTH_UNIT).value == unit and row_of(session, Subject.POSE_AXES).origin is Origin.USER
    )
    for side, joints in joints_of.items():
        np.testing.assert_allclose(session.tracks[f"{side} ring tip"].positions, joints["ring tip"], atol=2e-7)
    guessed = row_of(import_session("hands", path), Subject.POSE_AXES)
    assert guessed.origin is Origin.GUESS and CONVENTIONS[guessed.value].handedness == convention.handedness
    # Fingers do not say which axis points up: with +Z up the guess is wrong, so it is never sure.
    assert guessed.confidence is Confidence.OPEN and "fingers bend; +Y up is a guess" in guessed.reason
    others = {"right": {"openxr", "ros", "z-up"}, "left": {"unity", "unreal"}}
    assert {*guessed.alternatives} == others[convention.handedness]


def test_straight_fingers_leave_the_axes_open(tmp_path):
    straight = {side: made_hand(np.full(len(TIMES), 0.02), side=side) for side in SIDES}
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, straight))
    assert row_of(session, Subject.POSE_AXES).confidence is Confidence.OPEN


def test_axes_that_mirror_the_hands_are_named(tmp_path):
    path = write_wide(tmp_path / "take.csv", TIMES, hands())
    assert "bend backwards" in import_session("hands", path, convention="unity").facts["assumed"]
    assert "assumed" not in import_session("hands", path, convention="openxr").facts or (
        "backwards" not in import_session("hands", path, convention="openxr").facts["assumed"]
    )


def test_radii_are_the_files_or_a_guess_with_source(tmp_path):
    radii = {joint: 0.004 + 0.0005 * number for number, joint in enumerate(JOINTS)}
    stated = import_session("hands", write_long(tmp_path / "stated.csv", TIMES, hands(), radii=radii))
    assert row_of(stated, Subject.JOINT_RADII).origin is Origin.FILE
    top = stated.meshes["left middle tip"].vertices[:, 1].max()
    assert top == pytest.approx(radii["middle tip"], abs=1e-9)
    half = import_session("hands", write_long(tmp_path / "half.csv", TIMES, hands(size=0.5)))
    row = row_of(half, Subject.JOINT_RADII)
    assert row.origin is Origin.GUESS and "IWER" in row.reason and "MIT" in row.reason
    radius = half.meshes["left middle tip"].vertices[:, 1].max()
    assert radius == pytest.approx(RADII_M["middle tip"] * 0.5, rel=0.1)


@pytest.mark.parametrize("radius", [0.0, float("nan"), 5.0])
def test_impossible_radii_are_guessed(tmp_path, radius):
    radii = dict.fromkeys(JOINTS, 0.008) | {"index tip": radius}
    session = import_session("hands", write_long(tmp_path / "take.csv", TIMES, hands(), radii=radii))
    row = row_of(session, Subject.JOINT_RADII)
    assert row.origin is Origin.GUESS and "index tip" in row.value


def test_widths_of_leap_are_twice_the_radii(tmp_path):
    session = import_session("hands", write_leap(tmp_path / "leap.csv", TIMES, hands()))
    assert row_of(session, Subject.JOINT_RADII).origin is Origin.FILE
    assert session.meshes["left index tip"].vertices[:, 1].max() == pytest.approx(0.008, abs=1e-9)
    assert row_of(session, Subject.LENGTH_UNIT).value == "mm"


def test_bodies_beside_the_hands_come_along(tmp_path):
    path = [("cup_pos_x", TIMES), ("cup_pos_y", 1.0 + 0 * TIMES), ("cup_pos_z", 0 * TIMES)]
    path += [(f"cup_rot_{axis}", np.full(len(TIMES), float(axis == "w"))) for axis in "xyzw"]
    session = import_session("auto", write_wide(tmp_path / "take.csv", TIMES, hands(), more=path))
    assert "cup" in session.names and len(session.names) == 43
    np.testing.assert_allclose(session.tracks["cup"].positions[:, 0], TIMES, atol=1e-7)


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        (["head_pos_x", "head_pos_y", "head_pos_z", "head_rot_x", "head_rot_y", "head_rot_z"], "is in angles"),
        (["head_pos_x", "head_pos_y", "head_pos_z", "head_yaw", "head_pitch", "head_roll"], "is in angles"),
        (["head_pos_x", "head_pos_y", "head_pos_z"], "it has no rotation"),
        (["head_rot_x", "head_rot_y", "head_rot_z", "head_rot_w"], "it has no position"),
        (["head_pos_x", "head_pos_y", "head_pos_z", *(f"head_quat_{k}" for k in range(4))], "without names of axes"),
    ],
)
@pytest.mark.parametrize("kind", ["wide", pytest.param("long", marks=pytest.mark.slow)])
def test_bodies_that_are_not_taken_beside_hands_are_named(tmp_path, columns, reason, kind):
    more = [(column, 0.1 + 0 * TIMES) for column in columns]
    path = write_wide(tmp_path / "take.csv", TIMES, hands(), more=more)
    if kind == "long":
        path = write_long(tmp_path / "take.csv", TIMES, hands())
        head, *rows = path.read_text().splitlines()
        lines = [f"{head},{','.join(columns)}", *(row + ",0.1" * len(columns) for row in rows)]
        path.write_text("\n".join(lines) + "\n")
        reason = "repeat in the rows of joints"
    session = import_session("hands", path)
    conversions = session.facts["conversions"]
    assert "head" not in session.names
    assert f"head: not taken beside hands, for {reason}" in conversions or f"{reason}; import it" in conversions


SWAPS = [
    ("index tip", "index distal"), ("index tip", "ring tip"), ("thumb tip", "little tip"),
    ("ring proximal", "ring intermediate"), ("wrist", "middle tip"), ("index proximal", "little proximal"),
    ("middle metacarpal", "middle proximal"), ("thumb proximal", "index proximal"),
]  # fmt: skip


CURLS = (0.05, 0.6, 1.1)
"""Angle of each joint of a finger, radians: straight, half bent, a fist."""


def still_hands(curl):
    return {side: made_hand(np.full(len(STILL), curl), side=side) for side in SIDES}


@pytest.mark.parametrize("curl", CURLS)
def test_joints_in_their_order_are_accepted(tmp_path, curl):
    session = import_session("hands", write_wide(tmp_path / "take.csv", STILL, still_hands(curl)))
    assert len(session.names) == 42


@pytest.mark.parametrize("number", range(len(SWAPS)), ids=lambda number: " and ".join(SWAPS[number]))
def test_exchanged_joints_are_named(tmp_path, number):
    (first, second), curl = SWAPS[number], CURLS[number % len(CURLS)]
    hands_of = still_hands(curl)
    hands_of["left"][first], hands_of["left"][second] = hands_of["left"][second], hands_of["left"][first]
    path = write_wide(tmp_path / "take.csv", STILL, hands_of)
    refused("hands", path, f"({first} and {second}|{second} and {first}) of the left hand are exchanged")


def test_two_hands_of_the_same_side_are_refused(tmp_path):
    """Columns say left and right, but the joints of both form a left hand."""
    joints_of = {side: made_hand(CURL, [x, 0, 0], "left") for side, x in SIDES.items()}
    refused("hands", write_wide(tmp_path / "take.csv", TIMES, joints_of), "both hands are of one side")


def test_joints_without_a_position_end_no_capsule(tmp_path):
    joints_of = hands()
    joints_of["left"]["index tip"] = np.full_like(joints_of["left"]["index tip"], np.nan)
    del joints_of["right"]["ring distal"]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, joints_of))
    assert "left index tip" not in session.names and "left index intermediate" in session.names
    assert (
        not {"right ring intermediate", "right ring tip"} & {*session.names} and "right ring proximal" in session.names
    )
    done = session.facts["conversions"]
    assert "left index tip: no row has both of its joints" in done
    assert "right hand: no capsule ends at joints that the file lacks: ring distal" in done


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e6, 0.0])
def test_a_joint_that_flies_off_is_lost_alone(tmp_path, wrong):
    joints_of = hands()
    joints_of["left"]["index tip"] = joints_of["left"]["index tip"].copy()
    joints_of["left"]["index tip"][7:9] = wrong
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, joints_of))
    valid = session.tracks["left index tip"].valid
    assert [*np.flatnonzero(~valid)] == [7, 8] and session.tracks["left index intermediate"].valid.all()


def test_a_hand_that_is_not_tracked_is_lost(tmp_path):
    flag = [("left_is_tracked", (TIMES > 0.1).astype(int).astype(str)), ("right_is_tracked", ["1"] * len(TIMES))]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands(), more=flag))
    assert (session.tracks["left thumb tip"].valid == (TIMES > 0.1)).all()
    assert session.tracks["right thumb tip"].valid.all()


@pytest.mark.parametrize("scale", [0.2, 0.03, 40.0])
def test_hands_of_no_human_size_are_refused(tmp_path, scale):
    refused("hands", write_wide(tmp_path / "take.csv", TIMES, hands(scale)), "fits neither m, cm nor mm")


def test_positions_in_a_picture_are_refused(tmp_path):
    joints_of = {
        side: {joint: points * np.linspace(0.5, 2.0, len(TIMES))[:, None] for joint, points in joints.items()}
        for side, joints in hands().items()
    }
    refused("hands", write_wide(tmp_path / "take.csv", TIMES, joints_of), "change their length by .* picture")


def test_message_lists_some_unknown_joints_and_counts_the_rest():
    names = [f"IndexFoo{number}" for number in range(MOST_LISTED + 3)]
    assert f"{names[MOST_LISTED - 1]!r} and 3 more are no known joints" in unknown_joints(names)
    assert "more" not in unknown_joints(names[:MOST_LISTED])


def test_mapping_names_joints_that_the_importer_does_not_know(tmp_path):
    name = lambda joint: "IndexFoo" if joint == "index tip" else camel(joint)  # noqa: E731
    path = write_long(tmp_path / "take.csv", TIMES, hands(), name=name)
    with pytest.raises(UnknownColumnsError) as caught:
        import_session("auto", path)
    assert any("'IndexFoo' is no known joint" in gap for gap in caught.value.unknown) and caught.value.format == "hands"
    mapping = tmp_path / "take.columns.toml"
    mapping.write_text(caught.value.draft.replace('# "IndexFoo" = ""', '"IndexFoo" = "index tip"'))
    assert len(import_session("hands", path, mapping=mapping).names) == 42
    mapping.write_text('[joints]\nIndexFoo = ""\n')
    session = import_session("hands", path, mapping=mapping)
    assert "left index tip" not in session.names
    assert (
        "40 of 1,040 rows dropped: of joints that no capsule needs: 'IndexFoo'" in ledger_of(session.facts).sentences()
    )
    mapping.write_text('[joints]\nIndexFoo = "index tipp"\n')
    with pytest.raises(ImportFileError, match=r"take.columns.toml: .*which is no joint; did you mean 'index tip'"):
        import_session("hands", path, mapping=mapping)


def test_file_without_time_is_read_with_a_rate(tmp_path):
    path = write_wide(tmp_path / "take.csv", TIMES, hands())
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line.partition(",")[2] for line in lines) + "\n")
    with pytest.raises(UnknownColumnsError, match="describe them with --mapping"):
        import_session("auto", path)
    mapping = tmp_path / "rate.toml"
    mapping.write_text("[time]\nrate_hz = 90\n")
    session = import_session("hands", path, mapping=mapping)
    assert len(session.frames) == len(TIMES)


def test_names_of_no_exporter_are_mapped(tmp_path):
    joints = JOINTS[1:]
    path = write_wide(
        tmp_path / "take.csv", TIMES, hands(), name=lambda side, joint: f"{side}_j{JOINTS.index(joint):02d}"
    )
    refused("hands", path, "there are no joints of a hand in it")
    mapping = tmp_path / "joints.toml"
    lines = [f'{side}_j{number:02d} = "{side} {joint}"' for side in SIDES for number, joint in enumerate(joints, 1)]
    mapping.write_text("\n".join(["[joints]", *lines]))
    assert len(import_session("hands", path, mapping=mapping).names) == 42


def test_rows_that_repeat_or_go_back_are_in_the_books(tmp_path):
    path = write_long(tmp_path / "take.csv", TIMES, hands())
    head, *rows = path.read_text().splitlines()
    other = rows[6].split(",")
    other[3] = "0.5"
    rows = [*rows[:10], rows[5], ",".join(other), *rows[10:]]
    path.write_text("\n".join([head, *rows]) + "\n")
    session = import_session("hands", path)
    books = [*ledger_of(session.facts)]
    assert sum(sum(entry.merged.values()) for entry in books) == 1 and sum(entry.lost for entry in books) == 1
    for entry in books:
        assert entry.read == entry.kept + entry.lost + sum(entry.merged.values())


@pytest.mark.parametrize("first", ["1", "right index tip"])
def test_table_of_poses_is_not_recognised_as_hands(tmp_path, first):
    """A body may be called like a joint; columns of rigid poses make the table an ordinary CSV."""
    head = ["time", "body", "x", "y", "z", "qx", "qy", "qz", "qw"]
    path = write_rows(tmp_path / "take.csv", head, [[0.0, first, 0, 0, 0, 0, 0, 0, 1]])
    assert recognised_format(path)[0] == "csv"
