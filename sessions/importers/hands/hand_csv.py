"""Imports a CSV of tracked hands: joints over time become capsules, a group for each hand.

A body lies between two joints and has the name of its bone, such as ``left index tip``. Rotations of joints are not
read: the two ends of a bone say where it points. Bodies in other columns of a wide table come along.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sessions.importers.csv_columns_and_units import CLOCK_NS, VOCABULARY, name_tokens_of, unit_in_name
from sessions.importers.csv_head import CsvHead, read_head
from sessions.importers.csv_table import CsvTable
from sessions.importers.hands import hand_checks
from sessions.importers.hands.capsules import BoneMotion, bone_motion, capsule_mesh
from sessions.importers.hands.hand_columns import HandLayout, hand_layout, unknown_joints
from sessions.importers.hands.hand_joints import HandJoints, read_joints
from sessions.importers.hands.hand_mapping import HandMapping, hand_draft, hand_file_error, read_hand_mapping
from sessions.importers.hands.joint_names import PALM, RADII_M, RADII_SOURCE, Bone, bones_of, side_in
from sessions.importers.importing import METRES_PER_UNIT, SourceFrame, is_inverse, session_of_tables
from sessions.importers.ledger import FLAGGED, POSES, Ledger
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.conventions import convention as convention_named
from sessions.model.assumption import Assumption, Confidence, Origin, Subject
from sessions.model.scene import Scene, SceneBody, SceneGroup
from sessions.model.session import Session

LOSS_TOKENS: Final = frozenset(VOCABULARY["seen"])
LARGEST_RADIUS_M: Final = 0.1
JOINTS_ODD: Final = "whose joints are too near or too far from each other"
JOINT_MISSING: Final = "of which a joint has no position"
"""A radius above it is that of no hand; it is left out, as one that is not above 0."""


def read_hands(
    source: Path,
    *,
    mapping: str | Path | None = None,
    convention: str | None = None,
    rotations: str | None = None,
) -> Session:
    """The hands of a CSV as capsules between their joints.

    Parameters
    ----------
    mapping : a TOML file as `hand_mapping` describes it, for what the columns do not say.
    convention : axes of the positions; ``None``: the mapping's, else those in which fingers bend towards the palm.
    rotations : their direction for bodies beside the hands, of ``ROTATIONS``; ``None``: the mapping's.

    Raises ImportFileError: no hands, joints that are none or exchanged, or no clock; names file and column.
    """
    given = read_hand_mapping(mapping) if mapping is not None else HandMapping()
    head = read_head(source)
    layout = hand_layout(head, given.joints)
    if layout is None:
        raise hand_file_error(
            source,
            "there are no joints of a hand in it, neither in names of columns nor in a column of names; say in a "
            'mapping under [joints] which joint each is, such as "Bone_07" = "left index tip"',
        )
    layout = _completed_layout(head, layout, given)
    ledger = Ledger(source)
    text = replace(head.layout, rate_hz=given.rate_hz, format=layout.clock.format)
    table = CsvTable(source, ledger, text)
    hands = read_joints(table, layout, ledger)
    _check_hands(source, hands)
    frame = _source_frame(table, layout, hands, given, convention)
    tables = {
        name: table.poses(columns, table.stamps(layout.clock.column, layout.clock.unit))
        for name, columns in layout.bodies.items()
    }
    notes = [*table.notes, *_unread_flags(table, layout)]
    moved = {hand.name: _in_metres(hand, frame) for hand in hands}
    motions = {hand.name: _motions(moved[hand.name], notes, ledger) for hand in hands}
    if not any(motions.values()):
        raise hand_file_error(source, "no two neighbouring joints of a hand have positions in one row")
    radii = {hand.name: _radii(moved[hand.name], motions[hand.name]) for hand in hands}
    frame = replace(
        frame,
        others=(*frame.others, *_radii_assumptions(moved, radii)),
        inverse_rotations=is_inverse(rotations or given.rotations),
    )
    notes.append("joints of hands to capsules between neighbours; rotations of joints are not needed")
    notes += (
        f"{name or 'a pose without a name'}: not taken beside hands, for {reason}; import it from a CSV of its own"
        for name, reason in layout.left_out.items()
    )
    tracks = {body: motion.track for bones in motions.values() for body, motion in bones.items()}
    session = session_of_tables(tables, frame, ledger, notes, made=tracks)
    return replace(session, meshes=_meshes(motions, radii), scene=_scene(motions))


def _unread_flags(table: CsvTable, layout: HandLayout) -> Iterator[str]:
    """Yields a sentence on columns that are not read, and that may say in which rows a hand was not seen."""
    columns = [
        column
        for column in table.columns
        if not LOSS_TOKENS.isdisjoint(token.lower() for token in name_tokens_of(column))
        and column not in layout.valid.values()
        and table.count_different(column) > 1
    ]
    if columns:
        yield f"columns that may say which poses are lost, and are not read: {', '.join(columns)}"


def _completed_layout(head: CsvHead, layout: HandLayout, given: HandMapping) -> HandLayout:
    """The layout with what a mapping says of time; an error with a draft where something is not known."""
    clock = layout.clock
    if given.rate_hz:
        clock = clock._replace(column="", unit="s")
    elif given.time:
        clock = clock._replace(column=given.time, unit=given.time_unit or clock.unit)
    elif given.time_unit:
        clock = clock._replace(unit=given.time_unit)
    gaps = []
    if not clock.column and not given.rate_hz:
        gaps.append("the time (column, or rate_hz)")
    elif not clock.unit:
        gaps.append("the unit of time")
    if not clock.column and given.rate_hz and layout.joint:
        raise hand_file_error(head.source, "rows of joints need a column of time; rate_hz is for a row of all joints")
    if layout.unknown:
        gaps.append(f"which joints these are ({unknown_joints(layout.unknown)})")
    layout = replace(layout, clock=clock)
    if gaps:
        raise hand_draft(head, layout, gaps)
    return layout


def _check_hands(source: Path, hands: list[HandJoints]) -> None:
    """Refuse joints that are exchanged, that are nowhere, or that no hand has."""
    if not hands:
        raise hand_file_error(source, "no row of it is of a hand")
    for hand in hands:
        missing = [joint for joint, positions in hand.positions.items() if not np.isfinite(positions).all(axis=1).any()]
        present = {joint: positions for joint, positions in hand.positions.items() if joint not in missing}
        if not bones_of(present):
            raise hand_file_error(source, f"the {hand.name} has no two neighbouring joints with positions")
        examined = hand_checks.examined_samples(present)
        if not len(next(iter(examined.values()))):
            continue
        change = hand_checks.length_change(examined)
        if change > hand_checks.LARGEST_CHANGE:
            raise hand_file_error(
                source,
                f"the bones of the {hand.name} change their length by {100 * change:.0f} %: these are no positions of "
                "joints in space (coordinates in a picture?), or joints are named wrongly",
            )
        stuck = hand_checks.stuck_joint(examined)
        if stuck:
            raise hand_file_error(
                source,
                f"the {stuck} of the {hand.name} stays at one place in every row, and its wrist moves: it was not "
                'tracked; leave it out by a mapping: under [joints] the name of its columns = ""',
            )
        exchanged = hand_checks.exchanged_joints(examined)
        if exchanged is not None:
            raise hand_file_error(
                source,
                f"{exchanged[0]} and {exchanged[1]} of the {hand.name} are exchanged: the other way round its bones "
                "have the lengths of a hand's in nearly every row; correct the columns, or say in a mapping under "
                "[joints] which is which",
            )


def _source_frame(
    table: CsvTable, layout: HandLayout, hands: list[HandJoints], given: HandMapping, convention: str | None
) -> SourceFrame:
    """Units, axes and clock, and who says them."""
    examined = {hand.name: hand_checks.examined_samples(hand.positions) for hand in hands}
    sizes = [size for joints in examined.values() if np.isfinite(size := hand_checks.hand_size(joints))]
    units, units_origin, units_reason = _units(table, layout, sizes, given)
    sides = {hand.side: hand_checks.side_by_bend(examined[hand.name]) for hand in hands if hand.side}
    mirrored = {side: by_bend != side for side, by_bend in sides.items() if by_bend}
    if len({*mirrored.values()}) > 1:
        raise hand_file_error(
            table.source,
            "by the way their fingers bend, both hands are of one side; correct the column of the side, or the names",
        )
    named = convention or given.convention
    is_mirrored = any(mirrored.values())
    axes = convention_named(named) if named else CONVENTIONS["unity" if is_mirrored else "openxr"]
    assumed = list[str]()
    if named and mirrored and is_mirrored is (axes.handedness == "right"):
        assumed.append(f"axes {axes.name}, in which the fingers bend backwards: hands or axes are mirrored")
    if not named:
        assumed.append(f"axes {axes.name} ({axes.description})")
    if units_origin is Origin.GUESS:
        assumed.append(f"lengths in {units}")
    clock = layout.clock
    return SourceFrame(
        axes=axes,
        units=units,
        clock=f"column {clock.column}, {clock.unit}" if clock.column else f"{given.rate_hz:g} rows a second",
        assumed=tuple(assumed),
        axes_origin=Origin.USER if named else Origin.GUESS,
        axes_confidence=Confidence.SURE if named else Confidence.OPEN,
        # Fingers say which hand is left, and nothing of which axis points up.
        axes_reason=(
            f"{axes.handedness}-handed by the side to which the fingers bend; +Y up is a guess"
            if mirrored
            else "usual for tracked hands; +Y up is a guess"
        ),
        handedness_is_known=bool(mirrored),
        units_origin=units_origin,
        units_reason=units_reason,
        clock_origin=Origin.USER if given.time or given.rate_hz else Origin.FILE,
        others=tuple(_time_unit(table, layout, given)),
    )


def _units(table: CsvTable, layout: HandLayout, sizes: list[float], given: HandMapping) -> tuple[str, Origin, str]:
    """The unit of lengths, who says it, and why it was guessed."""
    if given.units:
        return given.units, Origin.USER, ""
    stated = {unit_in_name(column) or table.unit(column) for column in layout.positions}
    if len(stated) == 1 and (unit := stated.pop()) in METRES_PER_UNIT:
        return unit, Origin.FILE, ""
    if not sizes:
        return "m", Origin.GUESS, "no row has all joints of a hand"
    units = {hand_checks.unit_of_size(size) for size in sizes}
    unit = units.pop() if len(units) == 1 else ""
    if not unit:
        raise hand_file_error(
            table.source,
            f"hands in it are {', '.join(f'{size:.3g}' for size in sizes)} times as large as an adult one's in metres, "
            "which fits neither m, cm nor mm; say units in a mapping if they are right",
        )
    return unit, Origin.GUESS, f"a hand is then {sizes[0] * METRES_PER_UNIT[unit]:.2f} times as large as an adult one's"


def _time_unit(table: CsvTable, layout: HandLayout, given: HandMapping) -> Iterator[Assumption]:
    """The unit of the clock, and the meaning of numbers that stand for joints."""
    clock = layout.clock
    if not clock.column or clock.unit not in CLOCK_NS:
        return
    is_stated = clock.unit in (unit_in_name(clock.column), table.unit(clock.column))
    origin = Origin.USER if given.time_unit else Origin.FILE if is_stated else Origin.GUESS
    yield Assumption(
        Subject.TIME_UNIT, clock.unit, origin, reason="by the steps between rows" if origin is Origin.GUESS else ""
    )
    if layout.numbered:
        yield Assumption(
            Subject.COLUMNS, f"joints {layout.numbered}", Origin.GUESS, reason="by how many joints are numbered"
        )


def _in_metres(hand: HandJoints, frame: SourceFrame) -> HandJoints:
    """The joints of a hand in the canonical frame, metres."""
    metres = METRES_PER_UNIT[frame.units]
    positions = {joint: frame.axes.points(points) * metres for joint, points in hand.positions.items()}
    radii = {joint: radius * metres for joint, radius in hand.radii.items()}
    return replace(hand, positions=positions, radii=radii)


def _body(hand: HandJoints, bone: Bone) -> str:
    return f"{hand.side} {bone.name}".strip()


def _motions(hand: HandJoints, notes: list[str], ledger: Ledger) -> dict[str, BoneMotion]:
    """Body -> motion of its capsule; ``notes`` gets what is missing, ``ledger`` the poses of the hand's capsules."""
    motions = dict[str, BoneMotion]()
    for bone in bones_of(hand.positions):
        motion = bone_motion(hand.times_ns, hand.positions[bone.parent], hand.positions[bone.child], hand.valid)
        if motion is None:
            notes.append(f"{_body(hand, bone)}: no row has both of its joints, so that it has no capsule")
            continue
        motions[_body(hand, bone)] = motion
        kept, untracked = int(motion.track.valid.sum()), int((~hand.valid).sum())
        unplaced = len(hand.valid) - kept - untracked - motion.lost
        lost = {FLAGGED: untracked, JOINTS_ODD: motion.lost, JOINT_MISSING: unplaced}
        ledger.book(POSES, hand.name, read=len(hand.valid), kept=kept, dropped=lost)
    missing = _missing_joints(hand)
    if missing:
        notes.append(f"{hand.name}: no capsule ends at joints that the file lacks: {', '.join(missing)}")
    change = max((motion.change for motion in motions.values()), default=0.0)
    notes.append(f"{hand.name}: capsules have the median length of their bones, which change by {1e3 * change:.1f} mm")
    return motions


def _missing_joints(hand: HandJoints) -> list[str]:
    """Joints that the hand lacks, but for the palm's, which many sources do not have."""
    has_palm = any(joint.endswith("metacarpal") and not joint.startswith("thumb") for joint in hand.positions)
    return [
        joint
        for joint in RADII_M
        if joint != PALM
        and joint not in hand.positions
        and (has_palm or joint.startswith("thumb") or not joint.endswith("metacarpal"))
    ]


def _radii(hand: HandJoints, motions: Mapping[str, BoneMotion]) -> dict[str, float]:
    """Joint -> radius in metres: that of the file if it is possible, else an adult's, scaled by the hand's size."""
    bones = [bone for bone in bones_of(hand.positions) if _body(hand, bone) in motions]
    lengths = sum(motions[_body(hand, bone)].length for bone in bones)
    size = lengths / sum(bone.length_m for bone in bones) if bones else 1.0
    return {
        joint: own if 0.0 < (own := hand.radii.get(joint, 0.0)) <= LARGEST_RADIUS_M else RADII_M[joint] * size
        for joint in hand.positions
    }


def _radii_assumptions(
    hands: Mapping[str, HandJoints], radii: Mapping[str, Mapping[str, float]]
) -> Iterator[Assumption]:
    """Whether the file says the radii of joints, or they are guessed."""
    guessed = {
        name: [joint for joint, radius in radii[name].items() if hand.radii.get(joint) != radius and joint != PALM]
        for name, hand in hands.items()
    }
    lacking = {joint for joints in guessed.values() for joint in joints}
    if not lacking:
        yield Assumption(Subject.JOINT_RADII, "by joint", Origin.FILE)
        return
    values = [1e3 * radii[name][joint] for name, joints in guessed.items() for joint in joints]
    which = "" if len(lacking) + 1 >= min(map(len, radii.values())) else f" of {', '.join(sorted(lacking))}"
    yield Assumption(
        subject=Subject.JOINT_RADII,
        value=f"{min(values):.1f} to {max(values):.1f} mm{which}",
        origin=Origin.GUESS,
        reason=f"{RADII_SOURCE}, as large as the bones are",
    )


def _meshes(
    motions: Mapping[str, Mapping[str, BoneMotion]], radii: Mapping[str, Mapping[str, float]]
) -> dict[str, MeshData]:
    """Body -> its capsule."""
    meshes = dict[str, MeshData]()
    for hand, bones in motions.items():
        by_name = {f"{side_in(hand)} {bone.name}".strip(): bone for bone in bones_of(radii[hand])}
        for body, motion in bones.items():
            bone = by_name[body]
            meshes[body] = capsule_mesh(motion.length, radii[hand][bone.child], radii[hand][bone.parent])
    return meshes


def _scene(motions: Mapping[str, Mapping[str, BoneMotion]]) -> Scene:
    """A group for each hand, of its capsules."""
    bodies = tuple(SceneBody(body) for bones in motions.values() for body in bones)
    groups = tuple(SceneGroup(hand, tuple(bones)) for hand, bones in motions.items() if len(bones) > 1)
    return Scene(bodies=bodies, groups=groups)


def is_of_hands(head: CsvHead) -> bool:
    """Whether the columns of a CSV name joints of hands."""
    return hand_layout(head) is not None
