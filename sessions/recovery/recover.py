"""``recover``: every whole message of every readable chunk of a damaged file, in a file that is whole.

What is lost is said, in the result and in the new file's facts; what cannot be believed is not kept.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from sessions.errors import SessionError, SessionFileError
from sessions.mcap_format.container import MAGIC, ContainerWriter
from sessions.mcap_format.facts import (
    BODIES_RECORD,
    MESH_HASH,
    SESSION_RECORD,
    bodies_record,
    facts_of,
    names_of,
    session_record,
)
from sessions.mcap_format.record_block import RecordBlock
from sessions.mcap_format.schemas import PROFILE, PROFILE_FAMILY, TF
from sessions.mcap_format.unpacking import MessageTable
from sessions.mcap_format.writer import CHUNK_BYTES, MESH_FOLDER, MESH_TYPE, SCENE_FILE, replaced
from sessions.recovery.lost import Recovery
from sessions.recovery.survey import Survey, survey

RECOVERED = "recovered"
"""The fact that says what a recovered file lacks."""


def recover(path: str | Path, out: str | Path, *, overwrite: bool = False) -> Recovery:
    """Save what can be read of a session file that was cut short or damaged.

    Takes time in proportion to the file's size and the memory of one chunk, whatever the file declares.

    Parameters
    ----------
    path : the damaged file; it is only read.
    out : the file to write, whole and indexed.
    overwrite : replace a file of that name.

    Raises
    ------
    SessionFileError
        ``path`` cannot be read, holds nothing that can be saved, or is ``out``; ``out`` exists or cannot be written.
    """
    source, target = Path(path), Path(out)
    if target.exists():
        if source.exists() and target.samefile(source):
            raise SessionFileError(f"{out} is the damaged file itself; name another file to write")
        if not overwrite:
            raise SessionFileError(f"{out} is there already; name another file to write")
    try:
        with source.open("rb") as stream:
            found = survey(source, stream)
            if not found.parts and not found.attachments:
                raise SessionFileError(f"nothing in {path} can be saved: {_why_nothing(stream)}")
            return _write(found, stream, target)
    except OSError as error:
        raise SessionFileError(
            f"session file {path} cannot be read ({error.strerror or error}); check the path and who may read it"
        ) from None


def _why_nothing(stream: BinaryIO) -> str:
    stream.seek(0)
    begin = stream.read(len(MAGIC))
    if not begin:
        return "it is empty"
    return "no chunk of it is whole" if begin == MAGIC else "it is not an MCAP file"


def _write(found: Survey, stream: BinaryIO, target: Path) -> Recovery:
    records = dict(found.declared.metadata)
    session = records.get(SESSION_RECORD)
    profile = found.declared.profile
    own = session is not None or profile.startswith(PROFILE_FAMILY)
    listed = _listed_names(records.get(BODIES_RECORD))
    unread = f"{found.declared.unread} records make no sense" if found.declared.unread else ""
    result = Recovery(
        target, 0, found.frames, found.first_ns, found.last_ns, tuple(found.lost), found.bytes_skipped,
        tuple(name for name in listed if name not in found.names), (), 0, (unread,) if unread else (),
    )  # fmt: skip
    keep, lost = _attachments(found, session or {})
    result = replace(result, attachments=lost)
    with replaced(target) as file:
        writer = ContainerWriter(file, (profile if profile.startswith(PROFILE_FAMILY) else PROFILE) if own else profile,
                                 CHUNK_BYTES)  # fmt: skip
        for name, data in keep.items():
            made = found.attachments[name]
            writer.attachment(name, made.media_type, data, made.log_time)
        if own:
            facts, _ = facts_of(session or {})
            told = "; ".join(result.sentences())
            writer.metadata(SESSION_RECORD, session_record({**facts, RECOVERED: told}, _hashes(keep)))
            names = tuple(dict.fromkeys([*listed, *found.names]))
            writer.metadata(BODIES_RECORD, bodies_record(names))
        for name, values in found.declared.metadata:
            if name not in (SESSION_RECORD, BODIES_RECORD) or not own:
                writer.metadata(name, values)
        if own and not found.frames:
            writer.channel(TF)  # a session without a frame is one all the same, and can be read
        kept, unknown = _messages(found, stream, writer)
        writer.finish()
    return replace(result, messages=kept, unknown=unknown)


def _messages(found: Survey, stream: BinaryIO, writer: ContainerWriter) -> tuple[int, int]:
    """Copy the messages, payloads as they are; how many, and how many nobody declares."""
    kept = unknown = 0
    numbers: dict[int, int] = {}
    for table in found.tables(stream):
        for channel in sorted(set(table.channel.tolist())):
            made = found.declared.raw_channels.get(channel)
            if made is not None and channel not in numbers:
                numbers[channel] = writer.adopt(made, found.declared.raw_schemas.get(made.schema_id))
        rows = table.of_channels(set(numbers))
        unknown += len(table.channel) - len(rows)
        kept += len(rows)
        writer.messages(_block(table, rows.tolist(), numbers))
    return kept, unknown


def _block(table: MessageTable, rows: list[int], numbers: dict[int, int]) -> RecordBlock:
    return RecordBlock.of(
        (
            numbers[int(table.channel[row])], int(table.sequence[row]), int(table.log_ns[row]),
            int(table.publish_ns[row]), table.payload(row),
        )
        for row in rows
    )  # fmt: skip


def _attachments(found: Survey, session: dict[str, str]) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """Attachments to keep, and those that are lost: damaged, named by a hash and absent, or unreadable."""
    keep: dict[str, bytes] = {}
    lost = list(found.lost_attachments)
    for name, made in found.attachments.items():
        stated = session.get(MESH_HASH + name.removeprefix(MESH_FOLDER).removesuffix(MESH_TYPE))
        other = name not in found.checked and stated not in (None, hashlib.sha256(made.data).hexdigest())
        if _reads(name, made.data) and not other:
            keep[name] = made.data
        else:
            lost.append(name)
    named = (f"{MESH_FOLDER}{key.removeprefix(MESH_HASH)}{MESH_TYPE}" for key in session if key.startswith(MESH_HASH))
    lost += [name for name in named if name not in keep]
    return keep, tuple(dict.fromkeys(lost))


def _reads(name: str, data: bytes) -> bool:
    """Whether a reader of sessions can make something of an attachment that it will look at."""
    from sessions.meshes import mesh_from_bytes
    from sessions.scene_toml import parse_scene

    try:
        if name == SCENE_FILE:
            parse_scene(data.decode("utf-8"), SCENE_FILE)
        elif name.startswith(MESH_FOLDER) and name.endswith(MESH_TYPE):
            mesh_from_bytes(data, "glb")
    except (SessionError, UnicodeDecodeError):
        return False
    return True


def _hashes(keep: dict[str, bytes]) -> dict[str, str]:
    return {
        name.removeprefix(MESH_FOLDER).removesuffix(MESH_TYPE): hashlib.sha256(data).hexdigest()
        for name, data in keep.items()
        if name.startswith(MESH_FOLDER) and name.endswith(MESH_TYPE)
    }


def _listed_names(record: dict[str, str] | None) -> tuple[str, ...]:
    try:
        return names_of(record) if record is not None else ()
    except SessionError:
        return ()
