"""Hands of several exporters are the same hands; broken files end in one sentence; no row is lost in silence."""

import re
from pathlib import Path

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
from support.mutants import assert_import_refused, round_trips

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_columns_and_units import CsvLayout
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.csv_head import CsvHead
from sessions.importers.hands.hand_checks import exchanged_joints, hand_size, side_by_bend, stuck_joint
from sessions.importers.hands.hand_columns import MOST_LISTED, hand_layout, unknown_joints
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


def moving_hand(side="left", size=1.0):
    """Joint -> positions (20, 3) of a hand that moves along a line and closes and opens."""
    path = np.stack([SIDES[side] + 0.2 * TIMES, 1.0 + 0.1 * TIMES, -0.3 * TIMES], axis=1)
    return made_hand(CURL, path, side, size)


def moving_hands():
    """Side -> joint -> positions (20, 3) of both hands."""
    return {side: moving_hand(side) for side in SIDES}


def left_hand(size=1.0):
    """The same for one hand: where the side does not matter, half the work."""
    return {"left": moving_hand("left", size)}


def only_joints(hands, joints):
    """The same hands without the other joints."""
    return {side: {joint: positions[joint] for joint in joints} for side, positions in hands.items()}


def assumption_about(session, subject):
    """The assumption that a session records about a subject."""
    return next(row for row in assumptions_of(session.facts) if row.subject is subject)


def write_export(exporter, path, hands):
    """The CSV that an exporter writes of these hands."""
    if exporter == "quest":
        return write_wide(path, TIMES, hands)
    if exporter == "apple":
        return write_wide(path, TIMES, hands, name=lambda side, joint: f"{side}Hand{camel(joint)}", axes="_pos_")
    if exporter == "mediapipe":
        name = lambda side, joint: f"{side.upper()}_{MEDIAPIPE[joint]}"  # noqa: E731
        return write_wide(path, TIMES, only_joints(hands, MEDIAPIPE), name=name, axes="")
    if exporter == "webxr":
        return write_long(path, TIMES, only_joints(hands, WEBXR), name=WEBXR.get)
    if exporter == "leap":
        return write_leap(path, TIMES, hands)
    order = JOINTS if exporter == "numbered" else UNITY_JOINTS
    first = 0 if exporter == "numbered" else 1
    return write_long(path, TIMES, hands, name=lambda joint: str(first + order.index(joint)))


@pytest.mark.sampled(7)
@pytest.mark.parametrize(
    ("exporter", "bones"),
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
def test_exporters_write_the_same_hands(tmp_path, exporter, bones):
    """``bones``: how many of a hand an exporter's joints make. Finger tips come back to 0.1 um, and no row is lost."""
    hands = moving_hands()
    path = write_export(exporter, tmp_path / "take.csv", hands)
    assert recognised_format(path)[0] == "hands"
    session = import_session("hands", path)
    assert [(group.name, len(group.members)) for group in session.scene.groups] == [
        ("left hand", bones),
        ("right hand", bones),
    ]
    for side, joints in hands.items():
        for finger in ("thumb", "index", "middle", "ring", "little"):
            track = session.tracks[f"{side} {finger} tip"]
            np.testing.assert_allclose(track.positions, joints[f"{finger} tip"], atol=1e-7)
            assert track.valid.all()
    assert {*session.meshes} == {*session.names}
    for entry in ledger_of(session.facts):
        assert entry.read == entry.kept and not entry.dropped and not entry.merged
    if exporter == "leap":
        round_trips(session, tmp_path)


def test_a_csv_of_hands_needs_no_name_of_its_format(tmp_path):
    """It is imported as any CSV and taken for hands by the names of its columns."""
    session = import_session("csv", write_wide(tmp_path / "take.csv", TIMES, left_hand()))
    assert session.facts["taken_for"].startswith("hands, because its columns")


def write_in_axes(path, hands, axes, unit):
    """A CSV of hands whose positions are in the axes of a program and in a unit."""
    metres = {"m": 1.0, "cm": 0.01, "mm": 0.001}[unit]
    source = {
        side: {joint: CONVENTIONS[axes].source_points(points) / metres for joint, points in joints.items()}
        for side, joints in hands.items()
    }
    return write_wide(path, TIMES, source)


@pytest.mark.slow
@pytest.mark.parametrize(("axes", "unit"), [("unreal", "cm"), ("ros", "mm")])
def test_named_axes_and_unit_by_size_give_positions(tmp_path, axes, unit):
    """The user names the axes; the unit follows from the size of the hands. Positions are in metres again."""
    hands = moving_hands()
    session = import_session(
        "hands", write_in_axes(tmp_path / "take.csv", hands=hands, axes=axes, unit=unit), convention=axes
    )
    assert assumption_about(session, Subject.LENGTH_UNIT).value == unit
    assert assumption_about(session, Subject.POSE_AXES).origin is Origin.USER
    for side, joints in hands.items():
        np.testing.assert_allclose(session.tracks[f"{side} ring tip"].positions, joints["ring tip"], atol=2e-7)


def test_unit_in_the_names_of_columns_is_no_guess(tmp_path):
    """Columns of positions are called ..._Px (cm) and so on."""
    take = write_in_axes(tmp_path / "take.csv", hands=left_hand(), axes="openxr", unit="cm")
    names, _, rows = take.read_text().partition("\n")
    take.write_text(re.sub(r"(_P[xyz])", r"\1 (cm)", names) + "\n" + rows)
    unit = assumption_about(import_session("hands", take, convention="openxr"), Subject.LENGTH_UNIT)
    assert (unit.value, unit.origin) == ("cm", Origin.FILE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axes", "alternatives"), [("unity", {"unity", "unreal"}), ("openxr", {"openxr", "ros", "z-up"})]
)
def test_bending_fingers_say_the_handedness_of_the_axes(tmp_path, axes, alternatives):
    """The left hand is in axes that nobody names, Unity's (left-handed) or OpenXR's; so are all alternatives."""
    session = import_session("hands", write_in_axes(tmp_path / "take.csv", hands=left_hand(), axes=axes, unit="m"))
    guess = assumption_about(session, Subject.POSE_AXES)
    assert guess.origin is Origin.GUESS
    assert CONVENTIONS[guess.value].handedness == CONVENTIONS[axes].handedness
    # Fingers do not say which axis points up: with +Z up the guess is wrong, so it is never sure.
    assert guess.confidence is Confidence.OPEN and "fingers bend; +Y up is a guess" in guess.reason
    assert {*guess.alternatives} == alternatives


def test_straight_fingers_leave_the_axes_open(tmp_path):
    """Fingers that are bent by 0.02 rad do not say to which side they bend."""
    straight = {"left": made_hand(np.full(len(TIMES), 0.02), side="left")}
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, straight))
    assert assumption_about(session, Subject.POSE_AXES).confidence is Confidence.OPEN


@pytest.mark.parametrize(("convention", "mirrored"), [("unity", True), ("openxr", False)])
def test_axes_that_mirror_the_hands_are_named(tmp_path, convention, mirrored):
    """The hand is written in OpenXR's axes; read in Unity's, which are left-handed, its fingers bend backwards."""
    path = write_wide(tmp_path / "take.csv", TIMES, left_hand())
    session = import_session("hands", path, convention=convention)
    assert ("bend backwards" in session.facts.get("assumed", "")) == mirrored


def test_radii_are_the_files_or_a_guess_with_source(tmp_path):
    """Radii of the file, or for a hand of half the size half of the usual ones."""
    radii = {joint: 0.004 + 0.0005 * number for number, joint in enumerate(JOINTS)}
    stated = import_session("hands", write_long(tmp_path / "stated.csv", TIMES, left_hand(), radii=radii))
    assert assumption_about(stated, Subject.JOINT_RADII).origin is Origin.FILE
    top = stated.meshes["left middle tip"].vertices[:, 1].max()
    assert top == pytest.approx(radii["middle tip"], abs=1e-9)
    half = import_session("hands", write_long(tmp_path / "half.csv", TIMES, left_hand(size=0.5)))
    row = assumption_about(half, Subject.JOINT_RADII)
    assert row.origin is Origin.GUESS and "IWER" in row.reason and "MIT" in row.reason
    radius = half.meshes["left middle tip"].vertices[:, 1].max()
    assert radius == pytest.approx(RADII_M["middle tip"] * 0.5, rel=0.1)


def test_impossible_radii_are_guessed(tmp_path):
    """The file has radii of 8 mm, but 0 m, none and 5 m for three joints."""
    impossible = {"index tip": 0.0, "ring tip": float("nan"), "thumb tip": 5.0}
    radii = dict.fromkeys(JOINTS, 0.008) | impossible
    session = import_session("hands", write_long(tmp_path / "take.csv", TIMES, left_hand(), radii=radii))
    row = assumption_about(session, Subject.JOINT_RADII)
    assert row.origin is Origin.GUESS and row.value.endswith("mm of index tip, ring tip, thumb tip")


def test_widths_of_leap_are_twice_the_radii(tmp_path):
    """The file has widths of 16 mm, in millimetres as all its lengths, so that radii are 8 mm."""
    session = import_session("hands", write_leap(tmp_path / "leap.csv", TIMES, left_hand()))
    assert assumption_about(session, Subject.JOINT_RADII).origin is Origin.FILE
    assert session.meshes["left index tip"].vertices[:, 1].max() == pytest.approx(0.008, abs=1e-9)
    assert assumption_about(session, Subject.LENGTH_UNIT).value == "mm"


def test_bodies_beside_the_hands_come_along(tmp_path):
    """Beside the 21 bones of a hand the CSV has a cup's position and quaternion."""
    path = [("cup_pos_x", TIMES), ("cup_pos_y", 1.0 + 0 * TIMES), ("cup_pos_z", 0 * TIMES)]
    path += [(f"cup_rot_{axis}", np.full(len(TIMES), float(axis == "w"))) for axis in "xyzw"]
    session = import_session("auto", write_wide(tmp_path / "take.csv", TIMES, left_hand(), more=path))
    assert "cup" in session.names and len(session.names) == 22
    np.testing.assert_allclose(session.tracks["cup"].positions[:, 0], TIMES, atol=1e-7)


NOT_TAKEN = {
    "head": ("pos_x pos_y pos_z rot_x rot_y rot_z", "is in angles"),
    "tool": ("pos_x pos_y pos_z yaw pitch roll", "is in angles"),
    "lamp": ("pos_x pos_y pos_z", "it has no rotation"),
    "tray": ("rot_x rot_y rot_z rot_w", "it has no position"),
    "rack": ("pos_x pos_y pos_z quat_0 quat_1 quat_2 quat_3", "without names of axes"),
}
"""Body -> its columns beside the hands, and why it is not taken."""


def test_bodies_that_are_not_taken_beside_hands_are_named(tmp_path):
    """NOT_TAKEN has the columns of each body, and the reason that the import gives."""
    columns = [(f"{body}_{name}", 0.1 + 0 * TIMES) for body, (names, _) in NOT_TAKEN.items() for name in names.split()]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, left_hand(), more=columns))
    assert not {*NOT_TAKEN} & {*session.names}
    for body, (_, reason) in NOT_TAKEN.items():
        assert re.search(rf"{body}[a-z, ]*: not taken beside hands, for [^;]*{reason}", session.facts["conversions"])


def test_body_in_rows_of_joints_is_not_taken(tmp_path):
    """A row is a joint and a time, so that a head's position would repeat in all rows of a time."""
    path = write_long(tmp_path / "take.csv", TIMES, left_hand())
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([f"{head},head_pos_x,head_pos_y,head_pos_z", *(f"{row},0.1,0.1,0.1" for row in rows)]))
    session = import_session("hands", path)
    assert "head" not in session.names
    assert "repeat in the rows of joints; import it" in session.facts["conversions"]


SWAPS = [
    ("index tip", "index distal"), ("index tip", "ring tip"), ("thumb tip", "little tip"),
    ("ring proximal", "ring intermediate"), ("wrist", "middle tip"), ("index proximal", "little proximal"),
    ("middle metacarpal", "middle proximal"), ("thumb proximal", "index proximal"),
]  # fmt: skip
"""Joints whose columns are exchanged: neighbours, other fingers, roots."""

CURLS = (0.05, 0.6, 1.1)
"""Angle of each joint of a finger, radians: straight, half bent, a fist."""


def still_hand(curl):
    """Joint -> positions (6, 3) of a left hand whose fingers keep this angle."""
    return made_hand(np.full(len(STILL), curl), side="left")


@pytest.mark.parametrize("curl", CURLS)
def test_joints_in_their_order_are_accepted(curl):
    """``curl``: the angle of each joint of a finger; None: no two joints are exchanged."""
    assert exchanged_joints(still_hand(curl)) is None


@pytest.mark.parametrize("number", range(len(SWAPS)), ids=lambda number: " and ".join(SWAPS[number]))
def test_exchanged_joints_are_named(tmp_path, number):
    """Columns of two joints (SWAPS) are exchanged in a hand that is straight, half bent or a fist."""
    (first, second), curl = SWAPS[number], CURLS[number % len(CURLS)]
    joints = still_hand(curl)
    joints[first], joints[second] = joints[second], joints[first]
    path = write_wide(tmp_path / "take.csv", STILL, {"left": joints})
    assert_import_refused("hands", path, f"({first} and {second}|{second} and {first}) of the left hand are exchanged")


def test_short_finger_that_folds_back_names_its_joints():
    """The last bone is too short for its length to say so; the wrist is a metre behind the origin."""
    joints = made_hand(np.full(len(STILL), 0.6), wrist=(0.0, 0.0, 1.0), side="left")
    distal, tip = joints["little distal"], joints["little tip"]
    near_tip = distal + 0.4 * (tip - distal)
    assert exchanged_joints(joints | {"little tip": near_tip}) is None
    folded = joints | {"little distal": near_tip, "little tip": distal}
    assert exchanged_joints(folded) == ("little distal", "little tip")


def without_joints(hand, *parts):
    """The joints of a hand whose names contain none of these parts."""
    return {joint: positions for joint, positions in hand.items() if not any(part in joint for part in parts)}


def test_joint_is_stuck_only_beside_a_moving_wrist():
    """The index tip is at the origin in all samples. Without a wrist, or in a hand at rest, no joint is stuck."""
    hand = moving_hand() | {"index tip": np.zeros((len(TIMES), 3))}
    assert stuck_joint(hand) == "index tip"
    assert stuck_joint(without_joints(hand, "wrist")) == stuck_joint(still_hand(curl=0.6)) == ""


def test_side_and_size_need_two_fingers_and_a_root():
    """Wherever a hand is, the bend of its fingers says its side: with four tips, and with metacarpals and no wrist.

    Without tips, without any root, or without a sample it says none, and no size is known.
    """
    hand = still_hand(curl=0.6)
    for offset in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]):
        assert side_by_bend({joint: positions + offset for joint, positions in hand.items()}) == "left"
    for joints in (hand, without_joints(hand, "ring tip"), without_joints(hand, "wrist")):
        assert side_by_bend(joints) == "left"
    in_no_row = {joint: positions[:0] for joint, positions in hand.items()}
    for joints in (without_joints(hand, "tip"), without_joints(hand, "wrist", "metacarpal"), in_no_row):
        assert side_by_bend(joints) == ""
    assert np.isnan(hand_size({"index tip": hand["index tip"]})) and np.isnan(hand_size(in_no_row))


def test_joint_that_stays_behind_a_moving_wrist_is_refused(tmp_path):
    """The tip of the index finger is at the origin in all samples."""
    hands = left_hand()
    hands["left"]["index tip"] = np.zeros_like(hands["left"]["wrist"])
    path = write_wide(tmp_path / "take.csv", TIMES, hands)
    assert_import_refused("hands", path, "the index tip of the left hand stays at one place in every row")


@pytest.mark.parametrize(("lost", "is_named"), [(TIMES > 0.2, True), (TIMES < 0, False)])
def test_column_of_confidence_is_named_as_unread(tmp_path, lost, is_named):
    """A confidence of 0 after 0.2 s would say that the hand is lost; one that is always 1 says nothing."""
    more = [("left_confidence", np.where(lost, 0.0, 1.0))]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, left_hand(), more=more))
    assert ("and are not read: left_confidence" in session.facts["conversions"]) == is_named


def test_two_hands_of_the_same_side_are_refused(tmp_path):
    """Columns say left and right, but the joints of both form a left hand."""
    joints_of = {side: made_hand(CURL, [x, 0, 0], "left") for side, x in SIDES.items()}
    assert_import_refused("hands", write_wide(tmp_path / "take.csv", TIMES, joints_of), "both hands are of one side")


def test_joints_without_a_position_end_no_capsule(tmp_path):
    """The left index tip has no number in any row; the right hand has no columns of its ring distal joint."""
    joints_of = moving_hands()
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


def test_a_joint_that_flies_off_is_lost_alone(tmp_path):
    """Four fingertips are wrong in samples 7 and 8; each loses one bone of 21."""
    hands = left_hand()
    wrong = {"index tip": np.nan, "ring tip": np.inf, "little tip": 1e6, "middle tip": 0.0}
    for joint, value in wrong.items():
        hands["left"][joint] = hands["left"][joint].copy()
        hands["left"][joint][7:9] = value
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands))
    for joint in wrong:
        assert [*np.flatnonzero(~session.tracks[f"left {joint}"].valid)] == [7, 8]
    others = {name: track for name, track in session.tracks.items() if name.removeprefix("left ") not in wrong}
    assert all(track.valid.all() for track in others.values()) and len(others) == 21 - len(wrong)


def test_hand_of_sentinels_is_lost(tmp_path):
    """All joints are at -9999 in samples 7 and 8."""
    hands = left_hand()
    for positions in hands["left"].values():
        positions[7:9] = -9999
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands))
    assert all([*np.flatnonzero(~track.valid)] == [7, 8] for track in session.tracks.values())
    assert "-9999 counts as a missing number in" in session.facts["conversions"]


def test_a_hand_that_is_not_tracked_is_lost(tmp_path):
    """The left hand's flag is 0 up to 0.1 s, the right hand's is always 1."""
    flag = [("left_is_tracked", (TIMES > 0.1).astype(int).astype(str)), ("right_is_tracked", ["1"] * len(TIMES))]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, moving_hands(), more=flag))
    assert (session.tracks["left thumb tip"].valid == (TIMES > 0.1)).all()
    assert session.tracks["right thumb tip"].valid.all()


@pytest.mark.parametrize("scale", [0.2, 0.03, 40.0])
def test_hands_of_no_human_size_are_refused(tmp_path, scale):
    """``scale``: of a hand in metres; one in centimetres or millimetres would be accepted."""
    assert_import_refused(
        "hands", write_wide(tmp_path / "take.csv", TIMES, left_hand(scale)), "fits neither m, cm nor mm"
    )


def test_positions_in_a_picture_are_refused(tmp_path):
    """The hand grows from 0.5 to 2 times its size, as in a picture when it comes nearer."""
    joints_of = {
        side: {joint: points * np.linspace(0.5, 2.0, len(TIMES))[:, None] for joint, points in joints.items()}
        for side, joints in left_hand().items()
    }
    assert_import_refused(
        "hands", write_wide(tmp_path / "take.csv", TIMES, joints_of), "change their length by .* picture"
    )


def test_columns_of_a_joint_are_its_first_three_axes():
    """The wrist has only two axes, and the tip of the index finger has columns under two names."""
    names = [f"left {joint}" for joint in JOINTS] + ["L_XRHand_IndexTip"]
    columns = [f"{name} {axis}" for name in names for axis in "xyz"]
    columns.remove("left wrist z")
    layout = hand_layout(CsvHead(Path("take.csv"), CsvLayout(), ("time", *columns)))
    assert [*layout.wide] == [name for name in names[:-1] if name != "left wrist"]
    assert layout.wide["left palm"].position == ("left palm x", "left palm y", "left palm z")


def test_message_lists_some_unknown_joints_and_counts_the_rest():
    """MOST_LISTED names are listed; there are three more, and then none."""
    names = [f"IndexFoo{number}" for number in range(MOST_LISTED + 3)]
    assert f"{names[MOST_LISTED - 1]!r} and 3 more are no known joints" in unknown_joints(names)
    assert "more" not in unknown_joints(names[:MOST_LISTED])


def test_mapping_names_joints_that_the_importer_does_not_know(tmp_path):
    """The index tip is called IndexFoo: the draft of a mapping asks for it. Answered, all 21 bones are there.

    Answered with "" its 20 rows are dropped; a misspelt joint is refused.
    """
    name = lambda joint: "IndexFoo" if joint == "index tip" else camel(joint)  # noqa: E731
    path = write_long(tmp_path / "take.csv", TIMES, left_hand(), name=name)
    with pytest.raises(UnknownColumnsError) as caught:
        import_session("auto", path)
    assert any("'IndexFoo' is no known joint" in gap for gap in caught.value.unknown) and caught.value.format == "hands"
    mapping = tmp_path / "take.columns.toml"
    mapping.write_text(caught.value.draft.replace('# "IndexFoo" = ""', '"IndexFoo" = "index tip"'))
    assert len(import_session("hands", path, mapping=mapping).names) == 21
    mapping.write_text('[joints]\nIndexFoo = ""\n')
    session = import_session("hands", path, mapping=mapping)
    assert "left index tip" not in session.names
    assert "20 of 520 rows dropped: of joints that no capsule needs: 'IndexFoo'" in ledger_of(session.facts).sentences()
    mapping.write_text('[joints]\nIndexFoo = "index tipp"\n')
    with pytest.raises(ImportFileError, match=r"take.columns.toml: .*which is no joint; did you mean 'index tip'"):
        import_session("hands", path, mapping=mapping)


def test_file_without_time_is_read_with_a_rate(tmp_path):
    """The first column, the times, is removed; the mapping says 90 Hz."""
    path = write_wide(tmp_path / "take.csv", TIMES, left_hand())
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line.partition(",")[2] for line in lines) + "\n")
    with pytest.raises(UnknownColumnsError, match="describe them with --mapping"):
        import_session("auto", path)
    mapping = tmp_path / "rate.toml"
    mapping.write_text("[time]\nrate_hz = 90\n")
    session = import_session("hands", path, mapping=mapping)
    assert len(session.frames) == len(TIMES)


def test_names_of_no_exporter_are_mapped(tmp_path):
    """Joints are called left_j01, left_j02 ...; a mapping says which they are."""
    joints = JOINTS[1:]
    path = write_wide(
        tmp_path / "take.csv", TIMES, left_hand(), name=lambda side, joint: f"{side}_j{JOINTS.index(joint):02d}"
    )
    assert_import_refused("hands", path, "there are no joints of a hand in it")
    mapping = tmp_path / "joints.toml"
    lines = [f'left_j{number:02d} = "left {joint}"' for number, joint in enumerate(joints, 1)]
    mapping.write_text("\n".join(["[joints]", *lines]))
    assert len(import_session("hands", path, mapping=mapping).names) == 21


def test_rows_that_repeat_or_go_back_are_counted(tmp_path):
    """Row 5 stands twice; row 6 stands twice with another x of 0.5 m."""
    path = write_long(tmp_path / "take.csv", TIMES, left_hand())
    head, *rows = path.read_text().splitlines()
    other = rows[6].split(",")
    other[3] = "0.5"
    rows = [*rows[:10], rows[5], ",".join(other), *rows[10:]]
    path.write_text("\n".join([head, *rows]) + "\n")
    session = import_session("hands", path)
    entries = [*ledger_of(session.facts)]
    assert sum(sum(entry.merged.values()) for entry in entries) == 1 and sum(entry.lost for entry in entries) == 1
    for entry in entries:
        assert entry.read == entry.kept + entry.lost + sum(entry.merged.values())


@pytest.mark.parametrize("first", ["1", "right index tip"])
def test_table_of_poses_is_not_recognised_as_hands(tmp_path, first):
    """A body may be called like a joint; columns of rigid poses make the table an ordinary CSV."""
    head = ["time", "body", "x", "y", "z", "qx", "qy", "qz", "qw"]
    path = write_rows(tmp_path / "take.csv", head, [[0.0, first, 0, 0, 0, 0, 0, 0, 1]])
    assert recognised_format(path)[0] == "csv"
