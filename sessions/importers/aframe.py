"""A-Frame motion captures: headset and controllers as JSON, plain or below ``recording``.

The frame is canonical already (WebXR: right-handed, +Y up, -Z forward, metres); rotations are Euler angles in degrees,
order YXZ about the body's own axes, as three.js has them; stamps are milliseconds of a monotonic clock.

Source: the format of aframe-motion-capture-components (``poses``, ``events``, ``gamepad`` per device).
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.file_kinds import JSON
from sessions.importers.importing import (
    PoseTable,
    SourceFrame,
    is_inverse,
    number,
    numbered_name,
    session_of_tables,
)
from sessions.importers.ledger import Ledger, Numbers, last_of_each_stamp, stamps_of
from sessions.importers.unstated_units import degrees_by_format
from sessions.input_files import kind_of_file
from sessions.meshes.conventions import Convention, quaternion_from_euler
from sessions.model.event import Event
from sessions.model.session import HandTrack, Session
from sessions.names import side_of

OPENVR_GAMEPAD: Final = "OpenVR Gamepad"
PRESSES: Final = {"buttondown": 1.0, "buttonup": 0.0}
TRIGGER: Final = 1
"""The button of a VIVE wand. Source: A-Frame's vive-controls (idPrefix ``OpenVR Gamepad``)."""

JSON_LINES: Final = re.compile(r"\s*\{.*\}[ \t]*\r?\n\s*\{")
"""An object that ends in its line, and another one below it."""

JSON_CURE: Final = "write its poses as CSV, a row for each body and time and a column for each number"
"""What to do with JSON of another shape."""

WITHOUT_POSES: Final = "without a list of poses"

AXES: Final = Convention("webxr", (0, 1, 2), (1, 1, 1), "right-handed, +Y up, -Z forward")


def read_aframe(source: Path, *, rotations: str | None = None) -> Session:
    """Poses, events and triggers of an A-Frame motion capture.

    Parameters
    ----------
    rotations : their direction, of ``ROTATIONS``; ``None``: that of a pose.
    """
    ledger = Ledger(source)
    devices = _devices(source, ledger)
    tables: dict[str, PoseTable] = {}
    angles = list[Numbers]()
    events: list[Event] = []
    hands: dict[str, HandTrack] = {}
    for name, device in devices.items():
        _refuse_quaternions(device["poses"], f"{source}: {name}: poses")
        numbers = np.array([_row(pose) for pose in device["poses"]], dtype=np.float64).reshape(-1, 7)
        stamps = stamps_of(numbers[:, 0], 1e6, f"{source}: {name}: poses")
        angles.append(numbers[:, 4:])
        quaternions = quaternion_from_euler(np.radians(numbers[:, [5, 4, 6]]), "YXZ")
        tables[name] = PoseTable(stamps, numbers[:, 1:4], quaternions)
        happened = list(_events(name, device.get("events") or [], source))
        events += [event for event, _ in happened]
        presses = [event for event, button in happened if button == TRIGGER and event.name in PRESSES]
        if presses and _is_vive(device):
            hand = numbered_name(f"student/{side_of(name) or name}", hands)
            stamps = np.array([event.time_ns for event in presses], dtype=np.int64)
            pressed = np.array([PRESSES[event.name] for event in presses])
            rows = last_of_each_stamp(f"trigger {hand}", stamps, ledger)
            hands[hand] = HandTrack(stamps[rows], pressed[rows])
    clock = "performance clock of the browser, ms"
    frame = SourceFrame(AXES, "m", clock, others=(degrees_by_format(angles),), inverse_rotations=is_inverse(rotations))
    samples = session_of_tables(
        tables, frame, ledger, ["rotations from Euler angles YXZ in degrees to unit quaternions"]
    )
    return replace(samples, events=tuple(events), hands=hands)


def _devices(source: Path, ledger: Ledger) -> dict[str, dict[str, Any]]:
    repeated = list[str]()

    def members(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        """A JSON object; of members of one name, of which JSON's reader keeps the last, the names are noted."""
        table = dict(pairs)
        if len(table) < len(pairs):
            repeated.extend(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        return table

    text = ""
    try:
        text = source.read_text(encoding="utf-8-sig")
        data = json.loads(text, object_pairs_hook=members)
    except (ValueError, RecursionError) as error:
        if JSON_LINES.match(text):
            raise ImportFileError(f"{source}: it is JSON Lines, an object a line; {JSON_CURE}") from None
        kind = kind_of_file(source)
        reason = f": {error}; export the recording again" if kind in (None, JSON) else f" but {kind}"
        raise ImportFileError(f"{source}: this is not JSON{reason}") from None
    if repeated:
        raise ImportFileError(f"{source}: {repeated[0]!r} stands twice in one object; rename or remove one of them")
    if isinstance(data, dict) and isinstance(data.get("recording"), dict):
        data = data["recording"]
    entries = data if isinstance(data, dict) else {}
    members_of = {name: value for name, value in entries.items() if isinstance(value, dict)}
    devices = {name: value for name, value in members_of.items() if isinstance(value.get("poses"), list)}
    if not devices:
        raise ImportFileError(
            f"{source}: no device with a list of poses; this is no A-Frame motion capture; {JSON_CURE}"
        )
    without = {WITHOUT_POSES: len(members_of) - len(devices)}
    ledger.book("names", read=len(members_of), kept=len(devices), dropped=without)
    return devices


def _row(pose: Any) -> list[float]:
    """Time, position and Euler angles of one pose; what is missing is NaN."""
    return [_number(pose, "timestamp")] + [
        _number(pose.get(key), axis) if isinstance(pose, dict) else math.nan
        for key in ("position", "rotation")
        for axis in "xyz"
    ]


def _refuse_quaternions(poses: Sequence[Any], where: str) -> None:
    """Refuse rotations of four numbers, of which three would be taken for angles."""
    rotations = (pose.get("rotation") for pose in poses if isinstance(pose, dict))
    if any(isinstance(rotation, dict) and "w" in rotation for rotation in rotations):
        raise ImportFileError(f"{where}: a rotation has a w: it is a quaternion; write Euler angles in degrees")


def _number(value: Any, key: str) -> float:
    return number(value.get(key)) if isinstance(value, dict) else math.nan


def _events(name: str, events: object, source: Path) -> Iterator[tuple[Event, object]]:
    """Each event, and the button that it is about."""
    if not isinstance(events, list):
        raise ImportFileError(f"{source}: {name}: events are no list; repair or remove them")
    times = np.array([_number(event, "timestamp") for event in events])
    for event, stamp in zip(events, stamps_of(times, 1e6, f"{source}: {name}: events").tolist(), strict=True):
        detail = event.get("detail")
        message = json.dumps(detail, ensure_ascii=False, sort_keys=True) if detail else ""
        button = detail.get("id") if isinstance(detail, dict) else None
        yield Event(stamp, str(event.get("name", "event")), message, name), button


def _is_vive(device: dict[str, Any]) -> bool:
    """Whether it is a VIVE wand; of other devices nobody knows which button is the trigger."""
    gamepad = device.get("gamepad")
    return isinstance(gamepad, dict) and str(gamepad.get("id", "")).startswith(OPENVR_GAMEPAD)
