"""The metadata records of a session file.

``vrlab.session`` holds the metadata of the session and the SHA-256 of every mesh attachment. ``vrlab.bodies`` holds
the names of the tracked bodies in the order of the frames' columns; a recorder writes it again for every new body, and
the last record counts.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path

from sessions.mcap.refusals import refusal
from sessions.mcap.schemas import PROFILE

SESSION_RECORD, BODIES_RECORD = "vrlab.session", "vrlab.bodies"
MESH_HASH = "mesh.sha256/"
FORMAT = "format"
NOT_STATED = "not stated"
SHAREABLE = "share"

DECLARED = {
    "source_units": NOT_STATED,
    "handedness": NOT_STATED,
    "conversions": "none",
    "vr_type": NOT_STATED,  # immersive, augmented, distributed or desktop
    "devices": NOT_STATED,  # device serial -> role
    "clock": NOT_STATED,
    "pseudonym": NOT_STATED,
    "consent": NOT_STATED,  # none, lab or share
}
"""Metadata that every file has; what nobody gave is written as "not stated", so that a reader sees the gap."""

MAX_BODIES = 4096  # More than any laboratory has; what a hostile file lists is bounded by it

Record = dict[str, str]


def session_record(metadata: Mapping[str, str], mesh_hashes: Mapping[str, str]) -> Record:
    """The content of ``vrlab.session``."""
    own = {key: value for key, value in metadata.items() if key != FORMAT and not key.startswith(MESH_HASH)}
    hashes = {f"{MESH_HASH}{name}": value for name, value in mesh_hashes.items()}
    return {FORMAT: PROFILE, **DECLARED, **own, **hashes}


def bodies_record(names: tuple[str, ...]) -> Record:
    """The content of ``vrlab.bodies``."""
    return {"names": json.dumps(list(names), ensure_ascii=False)}


def metadata_of(record: Mapping[str, str]) -> tuple[Record, dict[str, str]]:
    """The metadata, and mesh name -> SHA-256, of a ``vrlab.session`` record."""
    hashes = {key.removeprefix(MESH_HASH): value for key, value in record.items() if key.startswith(MESH_HASH)}
    return {key: value for key, value in record.items() if not key.startswith(MESH_HASH)}, hashes


def mesh_file(name: str) -> str:
    """The attachment that holds the mesh of a body."""
    return f"meshes/{name}.glb"


def mesh_name(attachment: str) -> str | None:
    """The body whose mesh an attachment holds, ``None`` when it holds none."""
    match = re.fullmatch(r"meshes/(.*)\.glb", attachment, re.DOTALL)
    return match and match[1]


def collider_file(name: str, number: int) -> str:
    """The attachment that holds a collider of a body."""
    return f"colliders/{number}/{name}.glb"


def collider_name(attachment: str) -> tuple[str, int] | None:
    """The body of whose colliders an attachment holds one, and its number; ``None`` when it holds none."""
    match = re.fullmatch(r"colliders/([0-9]{1,6})/(.*)\.glb", attachment, re.DOTALL)
    return None if match is None else (match[2], int(match[1]))


def names_of(record: Mapping[str, str] | None, where: Path) -> tuple[str, ...]:
    """The tracked bodies of a ``vrlab.bodies`` record; a refusal of the file when it is no list of different names."""
    if record is None:
        return ()
    try:
        names = json.loads(record.get("names", ""))
    except (ValueError, RecursionError):  # brackets may be nested deeper than the stack
        names = None
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise refusal(where, "bad-names", f"metadata {BODIES_RECORD} does not list different names")
    if len(names) > MAX_BODIES:
        what = f"metadata {BODIES_RECORD} lists {len(names)} bodies; {MAX_BODIES} are allowed"
        raise refusal(where, "too-much", what)
    return tuple(names)


def check_version(profile: str, where: Path) -> None:
    """Refuse a file of our profile that is of another version."""
    if profile != PROFILE:
        raise refusal(where, "unknown-version", f"it is of profile {profile!r} and this program reads {PROFILE!r}")
