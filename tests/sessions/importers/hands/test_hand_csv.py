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
from sessions.importers.hands.hand_checks import (
    SAMPLES,
    examined_samples,
    exchanged_joints,
    hand_size,
    side_by_bend,
    stuck_joint,
)
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
"""Angle of each joint of a finger, radians, which closes and opens."""
SIDES = {"left": -0.3, "right": 0.3}
"""Side -> x of its wrist at the start, metres."""
BONES = 21
"""Of a hand whose joints are all known."""


def moving_hand(side="left", size=1.0):
    """Joint -> positions (20, 3) of a hand that moves along a line and closes and opens."""
    path = np.stack([SIDES[side] + 0.2 * TIMES, 1.0 + 0.1 * TIMES, -0.3 * TIMES], axis=1)
    return made_hand(CURL, path, side, size)


def moving_hands():
    """Side -> joint -> positions (20, 3) of both hands."""
    return {side: moving_hand(side) for side in SIDES}


def left_hand(size=1.0):
    """Side -> joint -> positions (20, 3) of a left hand alone: where the side does not matter, half the work."""
    return {"left": moving_hand("left", size)}


def only_joints(hands, joints):
    """The hands without all joints but these."""
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
        ("quest", BONES),
        ("apple", BONES),
        ("webxr", BONES),
        ("numbered", BONES),
        ("unity-numbered", BONES),
        ("mediapipe", 20),  # a bone from the wrist to each of four fingers, and none within the palm
        ("leap", 19),  # no wrist
    ],
)
def test_exporters_write_the_same_hands(tmp_path, exporter, bones):
    """Two moving hands are written as an exporter does; the CSV is recognised, and each bone becomes a body.

    Finger tips come back to 0.1 um, no row is lost, and each body has a mesh. ``bones``: of one hand.
    """
    hands = moving_hands()
    path = write_export(exporter, tmp_path / "take.csv", hands)
    recognised, _reason = recognised_format(path)
    assert recognised == "hands"
    session = import_session("hands", path)
    assert [(group.name, len(group.members)) for group in session.scene.groups] == [
        ("left hand", bones),
        ("right hand", bones),
    ]
    for side, joints in hands.items():
        for finger in ("thumb", "index", "middle", "ring", "little"):
            track = session.tracks[f"{side} {finger} tip"]
            np.testing.assert_allclose(track.positions, joints[f"{finger} tip"], atol=1e-7)
            assert track.valid.all(), (side, finger)
    assert {*session.meshes} == {*session.names}
    ledger = [*ledger_of(session.facts)]
    assert ledger
    for entry in ledger:
        assert entry.read == entry.kept
        assert not entry.dropped
        assert not entry.merged


def test_hands_come_back_from_the_file_of_their_session(tmp_path):
    """Every stamp, number and name of two hands of a Leap is the same in the session read from its own file."""
    session = import_session("hands", write_leap(tmp_path / "take.csv", TIMES, moving_hands()))
    round_trips(session, tmp_path)


def test_a_csv_of_hands_needs_no_name_of_its_format(tmp_path):
    """The user imports a "csv"; it is taken for hands by the names of its columns, and the session says so."""
    session = import_session("csv", write_wide(tmp_path / "take.csv", TIMES, left_hand()))
    assert session.facts["taken_for"].startswith("hands, because its columns")


def write_in_axes(path, hands, axes, unit):
    """Writes a CSV of hands with positions in the axes of a program and in a unit, and returns its path."""
    metres = {"m": 1.0, "cm": 0.01, "mm": 0.001}[unit]
    source = {
        side: {joint: CONVENTIONS[axes].source_points(points) / metres for joint, points in joints.items()}
        for side, joints in hands.items()
    }
    return write_wide(path, TIMES, source)


@pytest.mark.slow
@pytest.mark.parametrize(("axes", "unit"), [("unreal", "cm"), ("ros", "mm")])
def test_named_axes_and_unit_by_size_give_positions(tmp_path, axes, unit):
    """Two hands are written in axes that the user names, and in a unit that nobody names: it follows from their size.

    The ring finger's tip is again where it was, in metres and the session's axes, to 0.2 um.
    """
    hands = moving_hands()
    session = import_session(
        "hands", write_in_axes(tmp_path / "take.csv", hands=hands, axes=axes, unit=unit), convention=axes
    )
    assert assumption_about(session, Subject.LENGTH_UNIT).value == unit
    assert assumption_about(session, Subject.POSE_AXES).origin is Origin.USER
    for side, joints in hands.items():
        np.testing.assert_allclose(session.tracks[f"{side} ring tip"].positions, joints["ring tip"], atol=2e-7)


def test_unit_in_the_names_of_columns_is_no_guess(tmp_path):
    """A hand is written in centimetres, and columns of positions are called ..._Px (cm) and so on."""
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
    """A left hand is in axes that nobody names, Unity's (left-handed) or OpenXR's (right-handed).

    In a mirror it would be a right hand: the guess, and all alternatives, have the handedness of its axes. Fingers do
    not say which axis points up, so that the guess stays an open question.
    """
    session = import_session("hands", write_in_axes(tmp_path / "take.csv", hands=left_hand(), axes=axes, unit="m"))
    guess = assumption_about(session, Subject.POSE_AXES)
    assert guess.origin is Origin.GUESS
    assert CONVENTIONS[guess.value].handedness == CONVENTIONS[axes].handedness
    assert {*guess.alternatives} == alternatives
    assert guess.confidence is Confidence.OPEN
    assert "fingers bend; +Y up is a guess" in guess.reason


def test_straight_fingers_leave_the_axes_open(tmp_path):
    """Joints are bent by 0.02 rad, about a degree, which is too little to say to which side they bend."""
    straight = {"left": made_hand(curl=np.full(len(TIMES), 0.02), side="left")}
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, straight))
    assert assumption_about(session, Subject.POSE_AXES).confidence is Confidence.OPEN


@pytest.mark.parametrize(("convention", "is_mirrored"), [("unity", True), ("openxr", False)])
def test_axes_that_mirror_the_hands_are_named(tmp_path, convention, is_mirrored):
    """The hand is written in OpenXR's axes; read in Unity's, which are left-handed, its fingers bend backwards."""
    path = write_wide(tmp_path / "take.csv", TIMES, left_hand())
    session = import_session("hands", path, convention=convention)
    assert ("bend backwards" in session.facts.get("assumed", "")) == is_mirrored


def radius_at_tip(session, finger):
    """The radius of the capsule that ends in a left finger's tip: its origin is there, and it goes on along +Y."""
    return session.meshes[f"left {finger} tip"].vertices[:, 1].max()


def test_radii_of_a_file_are_those_of_the_capsules(tmp_path):
    """A file has a radius for each joint, from 4 mm on in steps of 0.5 mm: a capsule ends with that of its joint."""
    radii = {joint: 0.004 + 0.0005 * number for number, joint in enumerate(JOINTS)}
    session = import_session("hands", write_long(tmp_path / "take.csv", TIMES, left_hand(), radii=radii))
    assert assumption_about(session, Subject.JOINT_RADII).origin is Origin.FILE
    assert radius_at_tip(session, "middle") == pytest.approx(radii["middle tip"], abs=1e-9)


def test_guessed_radii_fit_the_size_of_the_hand(tmp_path):
    """A file without radii has a hand of half the usual size: radii are half the usual ones, within a tenth.

    The usual ones come from a table whose source and licence, IWER and MIT, are named.
    """
    session = import_session("hands", write_long(tmp_path / "take.csv", TIMES, left_hand(size=0.5)))
    guess = assumption_about(session, Subject.JOINT_RADII)
    assert guess.origin is Origin.GUESS
    assert "IWER" in guess.reason
    assert "MIT" in guess.reason
    assert radius_at_tip(session, "middle") == pytest.approx(RADII_M["middle tip"] * 0.5, rel=0.1)


def test_impossible_radii_are_guessed(tmp_path):
    """A file has radii of 8 mm, but 0 m, no number and 5 m for three joints, which the text on the guess names."""
    impossible = {"index tip": 0.0, "ring tip": float("nan"), "thumb tip": 5.0}
    radii = dict.fromkeys(JOINTS, 0.008) | impossible
    session = import_session("hands", write_long(tmp_path / "take.csv", TIMES, left_hand(), radii=radii))
    guess = assumption_about(session, Subject.JOINT_RADII)
    assert guess.origin is Origin.GUESS
    assert guess.value.endswith("mm of index tip, ring tip, thumb tip")


def test_widths_of_leap_are_twice_the_radii(tmp_path):
    """A Leap's file is in millimetres; its index finger is 16 mm wide, so that the radius is 8 mm."""
    session = import_session("hands", write_leap(tmp_path / "leap.csv", TIMES, left_hand()))
    assert assumption_about(session, Subject.LENGTH_UNIT).value == "mm"
    assert assumption_about(session, Subject.JOINT_RADII).origin is Origin.FILE
    assert radius_at_tip(session, "index") == pytest.approx(0.008, abs=1e-9)


def test_bodies_beside_the_hands_come_along(tmp_path):
    """Beside a hand's joints the CSV has a cup's position, whose x is the time, and its quaternion."""
    cup = [("cup_pos_x", TIMES), ("cup_pos_y", 1.0 + 0 * TIMES), ("cup_pos_z", 0 * TIMES)]
    cup += [(f"cup_rot_{axis}", np.full(len(TIMES), float(axis == "w"))) for axis in "xyzw"]
    session = import_session("auto", write_wide(tmp_path / "take.csv", TIMES, left_hand(), more=cup))
    assert "cup" in session.names
    assert len(session.names) == BONES + 1
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
    """Beside a hand's joints the CSV has columns of five bodies that are no whole pose in axes that are known.

    NOT_TAKEN has the columns of each body, and the reason that the import gives.
    """
    columns = [(f"{body}_{name}", 0.1 + 0 * TIMES) for body, (names, _) in NOT_TAKEN.items() for name in names.split()]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, left_hand(), more=columns))
    assert not {*NOT_TAKEN} & {*session.names}
    for body, (_, reason) in NOT_TAKEN.items():
        assert re.search(rf"{body}[a-z, ]*: not taken beside hands, for [^;]*{reason}", session.facts["conversions"])


def test_body_in_rows_of_joints_is_not_taken(tmp_path):
    """A row holds a joint at a time; a head's position, in columns behind, repeats in all rows of that time."""
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
    """Joint -> positions (6, 3) of a left hand in which each joint of a finger keeps this angle, in radians."""
    return made_hand(np.full(len(STILL), curl), side="left")


def test_joints_in_their_order_are_accepted():
    """A straight hand, a half bent one and a fist (CURLS) have no two joints that are exchanged."""
    for curl in CURLS:
        assert exchanged_joints(still_hand(curl)) is None, curl


def with_exchanged(joints, first, second):
    """The joints of a hand in which two have the positions of each other."""
    return joints | {first: joints[second], second: joints[first]}


def test_exchanged_joints_are_named():
    """Each two joints of SWAPS are exchanged, in turn in a hand that is straight, half bent and a fist."""
    for number, (first, second) in enumerate(SWAPS):
        joints = with_exchanged(still_hand(CURLS[number % len(CURLS)]), first, second)
        assert {*exchanged_joints(joints)} == {first, second}


def test_file_with_exchanged_joints_is_refused(tmp_path):
    """The columns of the index finger's tip have the positions of the ring finger's, and the other way round."""
    joints = with_exchanged(still_hand(curl=0.6), "index tip", "ring tip")
    path = write_wide(tmp_path / "take.csv", STILL, {"left": joints})
    assert_import_refused("hands", path, "(index|ring) tip and (index|ring) tip of the left hand are exchanged")


def test_short_finger_that_folds_back_names_its_joints():
    """The little finger's last bone has 0.4 of its length, in a half bent hand a metre behind the origin.

    So short a bone is accepted; with its two joints exchanged it points back at the wrist, which says that they are.
    """
    half_bent = np.full(len(STILL), 0.6)
    joints = made_hand(half_bent, wrist=(0.0, 0.0, 1.0), side="left")
    distal, tip = joints["little distal"], joints["little tip"]
    near_tip = distal + 0.4 * (tip - distal)
    assert exchanged_joints(joints | {"little tip": near_tip}) is None
    exchanged = joints | {"little distal": near_tip, "little tip": distal}
    assert exchanged_joints(exchanged) == ("little distal", "little tip")


def without_joints(hand, *parts):
    """The joints of a hand whose names contain none of these parts."""
    return {joint: positions for joint, positions in hand.items() if not any(part in joint for part in parts)}


def test_joint_is_stuck_only_beside_a_moving_wrist():
    """The index tip of a moving hand is at the origin in all samples, which is wrong.

    Without a wrist, or in a hand at rest, no joint ("") is said to be stuck.
    """
    hand = moving_hand() | {"index tip": np.zeros((len(TIMES), 3))}
    assert stuck_joint(hand) == "index tip"
    assert stuck_joint(without_joints(hand, "wrist")) == ""
    assert stuck_joint(still_hand(curl=0.6)) == ""


def test_bend_of_fingers_says_the_side_wherever_a_hand_is():
    """A half bent left hand is a metre from the origin, along each axis both ways: it is a left hand in all places."""
    for offset in [*np.eye(3), *-np.eye(3)]:
        hand = {joint: positions + offset for joint, positions in still_hand(curl=0.6).items()}
        assert side_by_bend(hand) == "left", offset


def test_side_of_a_hand_needs_tips_and_a_root():
    """Four tips of a left hand are enough, and metacarpals in place of a wrist; without any tip or root none is known.

    Nor is it known of a hand without a sample.
    """
    hand = still_hand(curl=0.6)
    for joints in (without_joints(hand, "ring tip"), without_joints(hand, "wrist")):
        assert side_by_bend(joints) == "left", [*joints]
    without_samples = {joint: positions[:0] for joint, positions in hand.items()}
    for joints in (without_joints(hand, "tip"), without_joints(hand, "wrist", "metacarpal"), without_samples):
        assert side_by_bend(joints) == "", [*joints]


def test_size_of_a_hand_needs_bones_and_samples():
    """A single joint makes no bone, and a hand without samples no length: NaN says that the size is not known."""
    hand = still_hand(curl=0.6)
    without_samples = {joint: positions[:0] for joint, positions in hand.items()}
    assert np.isnan(hand_size({"index tip": hand["index tip"]}))
    assert np.isnan(hand_size(without_samples))


def test_samples_of_an_untracked_hand_are_not_examined():
    """In sample 2 all joints lie in one point beside the origin, and in sample 4 the palm has no position."""
    hand = still_hand(curl=0.6)
    for positions in hand.values():
        positions[2] = [1.0, 2.0, 3.0]
    hand["palm"][4] = np.nan
    examined = examined_samples(hand)
    assert all(np.array_equal(examined[joint], positions[[0, 1, 3, 5]]) for joint, positions in hand.items())


def test_some_samples_of_a_long_recording_are_examined():
    """64 of 200 samples, evenly spread, with the first and the last: steps of 3 or 4 (199 / 63 = 3.2).

    The wrist moves by 1 m a sample, so that its x is the number of the sample.
    """
    path = np.arange(200.0)[:, None] * [1.0, 0.0, 0.0]
    wrist = examined_samples(made_hand(np.full(200, 0.6), path))["wrist"][:, 0]
    assert len(wrist) == SAMPLES == 64 and (wrist[0], wrist[-1]) == (0.0, 199.0)
    assert {*np.diff(wrist)} == {3.0, 4.0}


def test_joint_that_stays_behind_a_moving_wrist_is_refused(tmp_path):
    """A hand moves in a CSV, and the tip of its index finger is at the origin in all 20 rows."""
    hands = left_hand()
    hands["left"]["index tip"] = np.zeros_like(hands["left"]["wrist"])
    path = write_wide(tmp_path / "take.csv", TIMES, hands)
    assert_import_refused("hands", path, "the index tip of the left hand stays at one place in every row")


def test_column_of_confidence_is_named_as_unread(tmp_path):
    """Beside the joints are two columns of confidence, which the import does not read.

    The left one is 0 after 0.2 s, which may say that the hand is lost: it is named. The other is always 1: it is not.
    """
    more = [("left_confidence", np.where(TIMES > 0.2, 0.0, 1.0)), ("mean_confidence", np.ones(len(TIMES)))]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, left_hand(), more=more))
    assert re.search("and are not read: left_confidence(;|$)", session.facts["conversions"])  # alone in its list


def test_two_hands_of_the_same_side_are_refused(tmp_path):
    """Columns say left and right, but the joints of both form a left hand."""
    hands = {side: made_hand(CURL, wrist=[x, 0, 0], side="left") for side, x in SIDES.items()}
    assert_import_refused("hands", write_wide(tmp_path / "take.csv", TIMES, hands), "both hands are of one side")


def test_joint_without_a_position_ends_no_capsule(tmp_path):
    """The left index tip has no number in any row: no bone ends there, the bone before it is a body."""
    hands = left_hand()
    hands["left"]["index tip"] = np.full_like(hands["left"]["index tip"], np.nan)
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands))
    assert "left index tip" not in session.names
    assert "left index intermediate" in session.names
    assert "left index tip: no row has both of its joints" in session.facts["conversions"]


def test_joint_without_columns_ends_no_capsule(tmp_path):
    """The file has no columns of the ring finger's distal joint: the bones to it and from it to the tip are none."""
    hands = {"right": moving_hand("right")}
    del hands["right"]["ring distal"]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands))
    ring_bones = [name for name in session.names if "ring" in name]
    assert "right ring proximal" in ring_bones
    assert not {"right ring intermediate", "right ring tip"} & {*ring_bones}
    text = "right hand: no capsule ends at joints that the file lacks: ring distal"
    assert text in session.facts["conversions"]


def test_a_joint_that_flies_off_is_lost_alone(tmp_path):
    """Four fingertips are wrong in samples 7 and 8; there the bone that ends in each is lost, and no other bone."""
    hands = left_hand()
    wrong = {"index tip": np.nan, "ring tip": np.inf, "little tip": 1e6, "middle tip": 0.0}
    for joint, value in wrong.items():
        hands["left"][joint] = hands["left"][joint].copy()
        hands["left"][joint][7:9] = value
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands))
    lost_samples = {name: np.flatnonzero(~track.valid).tolist() for name, track in session.tracks.items()}
    assert len(lost_samples) == BONES
    assert {name: lost for name, lost in lost_samples.items() if lost} == {f"left {joint}": [7, 8] for joint in wrong}


def test_hand_of_sentinels_is_lost(tmp_path):
    """All joints are at -9999, which stands for no number, in samples 7 and 8: all 21 bones are lost there."""
    hands = left_hand()
    for positions in hands["left"].values():
        positions[7:9] = -9999
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, hands))
    lost_samples = [np.flatnonzero(~track.valid).tolist() for track in session.tracks.values()]
    assert lost_samples == [[7, 8]] * BONES
    assert "-9999 counts as a missing number in" in session.facts["conversions"]


def test_a_hand_that_is_not_tracked_is_lost(tmp_path):
    """The left hand's flag is 0 up to 0.1 s, the right hand's is always 1."""
    flag = [("left_is_tracked", (TIMES > 0.1).astype(int).astype(str)), ("right_is_tracked", ["1"] * len(TIMES))]
    session = import_session("hands", write_wide(tmp_path / "take.csv", TIMES, moving_hands(), more=flag))
    assert (session.tracks["left thumb tip"].valid == (TIMES > 0.1)).all()
    assert session.tracks["right thumb tip"].valid.all()


@pytest.mark.parametrize("scale", [0.2, 0.03, 40.0])
def test_hands_of_no_human_size_are_refused(tmp_path, scale):
    """A hand is ``scale`` times as large as an adult's in metres; hands have 0.5 to 1.6 of that size.

    0.2 and 0.03 are too small in any unit; 40 is too large in metres, and in centimetres 0.4, too small. 100 would fit.
    """
    assert_import_refused(
        "hands", write_wide(tmp_path / "take.csv", TIMES, left_hand(scale)), "fits neither m, cm nor mm"
    )


def test_positions_in_a_picture_are_refused(tmp_path):
    """The hand grows from 0.5 to 2 times its size, as in a picture when it comes nearer; bones keep their length."""
    sizes = np.linspace(0.5, 2.0, len(TIMES))[:, None]
    hands = {"left": {joint: sizes * positions for joint, positions in moving_hand("left").items()}}
    assert_import_refused("hands", write_wide(tmp_path / "take.csv", TIMES, hands), "change their length by .* picture")


def test_columns_of_a_joint_are_its_first_three_axes():
    """The wrist has columns x and y alone and is none; of two names for the index finger's tip the first counts."""
    names = [f"left {joint}" for joint in JOINTS] + ["L_XRHand_IndexTip"]
    columns = [f"{name} {axis}" for name in names for axis in "xyz"]
    columns.remove("left wrist z")
    layout = hand_layout(CsvHead(Path("take.csv"), CsvLayout(), ("time", *columns)))
    assert [*layout.wide] == [name for name in names[:-1] if name != "left wrist"]
    assert layout.wide["left palm"].position == ("left palm x", "left palm y", "left palm z")


def test_message_lists_some_unknown_joints_and_counts_the_rest():
    """Three names more than MOST_LISTED are no joints: the last three are counted. MOST_LISTED are all listed."""
    names = [f"IndexFoo{number}" for number in range(MOST_LISTED + 3)]
    assert f"{names[MOST_LISTED - 1]!r} and 3 more are no known joints" in unknown_joints(names)
    assert "more" not in unknown_joints(names[:MOST_LISTED])


@pytest.fixture
def hand_with_foo(tmp_path):
    """The path of a CSV with a row for each joint and time, in which the index tip is called IndexFoo."""
    name = lambda joint: "IndexFoo" if joint == "index tip" else camel(joint)  # noqa: E731
    return write_long(tmp_path / "take.csv", TIMES, left_hand(), name=name)


def test_draft_asks_for_joints_that_the_importer_does_not_know(hand_with_foo, tmp_path):
    """The draft of a mapping, which says what the names of a file mean, has IndexFoo as a question.

    Answered with "index tip" all 21 bones are there.
    """
    with pytest.raises(UnknownColumnsError) as caught:
        import_session("auto", hand_with_foo)
    assert caught.value.format == "hands"
    assert "'IndexFoo' is no known joint" in " ".join(caught.value.unknown)
    mapping = tmp_path / "take.columns.toml"
    mapping.write_text(caught.value.draft.replace('# "IndexFoo" = ""', '"IndexFoo" = "index tip"'))
    assert len(import_session("hands", hand_with_foo, mapping=mapping).names) == BONES


def test_joint_that_a_mapping_leaves_out_is_dropped(hand_with_foo, tmp_path):
    """The mapping says "" of IndexFoo, so that its rows, 20 of 20 times 26 joints, are of no use."""
    mapping = tmp_path / "take.columns.toml"
    mapping.write_text('[joints]\nIndexFoo = ""\n')
    session = import_session("hands", hand_with_foo, mapping=mapping)
    assert "left index tip" not in session.names
    assert "20 of 520 rows dropped: of joints that no capsule needs: 'IndexFoo'" in ledger_of(session.facts).sentences()


def test_misspelt_joint_in_a_mapping_is_refused(hand_with_foo, tmp_path):
    """The mapping says of IndexFoo that it is the "index tipp"."""
    mapping = tmp_path / "take.columns.toml"
    mapping.write_text('[joints]\nIndexFoo = "index tipp"\n')
    with pytest.raises(ImportFileError, match=r"take.columns.toml: .*which is no joint; did you mean 'index tip'"):
        import_session("hands", hand_with_foo, mapping=mapping)


def test_file_without_time_is_read_with_a_rate(tmp_path):
    """The first column, the times, is removed: the import asks for what is missing, and reads by a mapping's 90 Hz."""
    path = write_wide(tmp_path / "take.csv", TIMES, left_hand())
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line.partition(",")[2] for line in lines) + "\n")
    with pytest.raises(UnknownColumnsError, match="describe them with --mapping"):
        import_session("auto", path)
    mapping = tmp_path / "rate.toml"
    mapping.write_text("[time]\nrate_hz = 90\n")
    session = import_session("hands", path, mapping=mapping)
    assert len(session.frames) == len(TIMES)
    assert np.diff(session.frames.stamp_ns) == pytest.approx(1e9 / 90, abs=1)


def test_names_of_no_exporter_are_mapped(tmp_path):
    """Joints are called left_j00, left_j01 ...: no joints of a hand, until a mapping says which they are.

    It leaves out the first, the palm, in which no bone ends.
    """
    path = write_wide(
        tmp_path / "take.csv", TIMES, left_hand(), name=lambda side, joint: f"{side}_j{JOINTS.index(joint):02d}"
    )
    assert_import_refused("hands", path, "there are no joints of a hand in it")
    mapping = tmp_path / "joints.toml"
    lines = [f'left_j{number:02d} = "left {joint}"' for number, joint in enumerate(JOINTS) if joint != "palm"]
    mapping.write_text("\n".join(["[joints]", *lines]))
    assert len(import_session("hands", path, mapping=mapping).names) == BONES


def test_rows_that_repeat_or_go_back_are_counted(tmp_path):
    """A CSV has a row for each joint and time; row 5 stands twice, and row 6 once more with another x.

    The first is merged and the second lost; read is what was kept, lost and merged.
    """
    path = write_long(tmp_path / "take.csv", TIMES, left_hand())
    head, *rows = path.read_text().splitlines()
    other = rows[6].split(",")
    other[3] = "0.5"  # x
    rows = [*rows[:10], rows[5], ",".join(other), *rows[10:]]
    path.write_text("\n".join([head, *rows]) + "\n")
    session = import_session("hands", path)
    entries = [*ledger_of(session.facts)]
    assert sum(sum(entry.merged.values()) for entry in entries) == 1
    assert sum(entry.lost for entry in entries) == 1
    for entry in entries:
        assert entry.read == entry.kept + entry.lost + sum(entry.merged.values())


@pytest.mark.parametrize("body", ["1", "right index tip"])
def test_table_of_poses_is_not_recognised_as_hands(tmp_path, body):
    """A body may be called like a joint or its number; columns of rigid poses make the table an ordinary CSV."""
    head = ["time", "body", "x", "y", "z", "qx", "qy", "qz", "qw"]
    path = write_rows(tmp_path / "take.csv", head, [[0.0, body, 0, 0, 0, 0, 0, 0, 1]])
    recognised, _reason = recognised_format(path)
    assert recognised == "csv"
