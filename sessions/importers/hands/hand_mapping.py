"""A mapping for hands that columns do not describe by themselves, and the draft of one.

It is a TOML file: ``convention``, ``units``, ``[time]`` with ``column`` and ``unit``, and under ``[joints]`` a joint
for each name in the file, such as ``"Bone_07" = "left index tip"``; ``""`` leaves a name out.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import (
    CLOCK_NS,
    LENGTHS,
    TEXT,
    convention_key,
    mapping_table,
    rotations_key,
)
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.csv_head import CsvHead
from sessions.importers.hands.hand_columns import HandLayout
from sessions.importers.hands.joint_names import JOINTS, NamedJoint
from sessions.input_files import TomlTable, nearest

SIDES: Final = ("left", "right")


@dataclass(frozen=True)
class HandMapping:
    """Statements of a user about a file of hands; ``""`` and nothing where the file says it.

    Parameters
    ----------
    joints : name in the file -> joint.
    """

    convention: str = ""
    units: str = ""
    time: str = ""
    time_unit: str = ""
    rate_hz: float = 0.0
    rotations: str = ""
    joints: Mapping[str, NamedJoint] = field(default_factory=dict)


def read_hand_mapping(path: str | Path) -> HandMapping:
    """The mapping of a TOML file.

    Raises ``ImportFileError``: all faults at once, each with file, table and key.
    """
    with mapping_table(path) as whole:
        clock = whole.table("time") or whole.within({}, "[time]")
        rate = clock.number("rate_hz", 0.0)
        time, unit = clock.text("column"), clock.text("unit", "", (*CLOCK_NS, TEXT))
        clock.done()
        joints = whole.table("joints") or whole.within({}, "[joints]")
        named = {str(name): _joint(joints, str(name), text) for name, text in joints.rest().items()}
        return HandMapping(
            convention=convention_key(whole),
            units=whole.text("units", "", LENGTHS),
            time=time,
            time_unit=unit,
            rate_hz=rate,
            rotations=rotations_key(whole),
            joints=named,
        )


def _joint(table: TomlTable, name: str, text: object) -> NamedJoint:
    """A joint as a mapping writes it: ``left index tip``, ``index tip``, ``wrist``, or ``""``."""
    if text == "":
        return NamedJoint("", "")
    side, _, joint = text.partition(" ") if isinstance(text, str) else ("", "", "")
    if side not in SIDES:
        side, joint = "", str(text)
    if joint not in JOINTS:
        table.refuse(f"{name!r} is {joint[:40]!r}, which is no joint{nearest(joint, JOINTS)}")
    return NamedJoint(side, joint)


def hand_draft(head: CsvHead, layout: HandLayout, gaps: Sequence[str]) -> UnknownColumnsError:
    """The error that says what a file of hands leaves open, with a draft of its mapping."""
    lines = [f"# How to read {head.source.name}, a file of tracked hands: complete what is commented."]
    lines.append('# convention = "unity"   # axes: openxr, unity, unreal, ..., or words such as "x right, y up"')
    lines.append('# units = "m"   # m, cm or mm')
    lines += ["", "[time]"]
    if layout.clock.column:
        lines += [f"column = {json.dumps(layout.clock.column)}", '# unit = "s"   # s, ms, us, ns or ticks (.NET)']
    else:
        lines.append("# rate_hz = 90   # rows a second; no column is called like a time")
    if layout.unknown:
        lines += ["", "[joints]", '# "left index tip", "index tip" (the side is in a column), "" to leave one out']
        lines += [f'# {json.dumps(name)} = ""' for name in layout.unknown]
    return UnknownColumnsError(head.source, head.columns, "\n".join([*lines, ""]), gaps, "hands")


def hand_file_error(source: Path, message: str) -> ImportFileError:
    """The error of a file of hands."""
    return ImportFileError(f"{source}: {message}")
