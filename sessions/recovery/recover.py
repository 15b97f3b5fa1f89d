"""``recover``: every whole message of every readable chunk of a damaged file, in a file that is whole.

The result and the new file's metadata name what is lost. Data that cannot be trusted is not kept.
"""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Attachment
from mcap.writer import Writer

from sessions.errors import SessionError, SessionFileError
from sessions.input_files import opened
from sessions.mcap_format import metadata
from sessions.mcap_format.catalogue import Catalogue
from sessions.mcap_format.container import add, bytes_at, finish, parsed, started_writer
from sessions.mcap_format.reader import load_parts, read_session
from sessions.mcap_format.refusals import brief
from sessions.mcap_format.schemas import PROFILE, PROFILE_FAMILY, TF, channel_spec
from sessions.mcap_format.writer import SCENE_FILE
from sessions.recovery.file_scan import FileScan, scan_file
from sessions.recovery.lost import Recovery
from sessions.whole_files import whole_file

NOT_SMALL = (Opcode.CHUNK, Opcode.MESSAGE, Opcode.ATTACHMENT)
RECOVERED = "recovered"  # The fact that says what a recovered file lacks


def recover(path: str | Path, out: str | Path, *, overwrite: bool = False) -> Recovery:
    """Save what can be read of a session file that was cut short or damaged.

    Takes time in proportion to the file's size and the memory of one chunk; what the file declares cannot raise either.

    Parameters
    ----------
    path : the damaged file; it is only read.
    out : the file to write, whole and indexed.
    overwrite : replace a file of that name.

    Raises ``SessionFileError``: ``path`` cannot be read, holds nothing that can be saved, or is ``out``; ``out`` exists
    or cannot be written.
    """
    source, target = Path(path), Path(out)
    if target.exists():
        if source.exists() and target.samefile(source):
            raise SessionFileError(f"{out} is the damaged file itself; name another file to write")
        if not overwrite:
            raise SessionFileError(f"{out} is there already; name another file to write")
    with opened(source, "session file", SessionFileError) as stream:
        found = scan_file(source, stream)
        if not found.parts and not found.declared.attachments:
            first = f"its first chunk is {found.lost[0].why}, and no other is whole" if found.lost else ""
            raise _nothing(source, first or "there is no chunk in it")
        return _write(found, stream, target, overwrite=overwrite)


def _nothing(source: Path, why: str) -> SessionFileError:
    return SessionFileError(f"nothing in {source} can be saved: {why}")


def _write(found: FileScan, stream: BinaryIO, target: Path, *, overwrite: bool) -> Recovery:
    declared, records = found.declared, dict(found.declared.metadata)
    session = records.get(metadata.SESSION_RECORD)
    own = any(word.startswith(PROFILE_FAMILY) for word in (declared.profile, (session or {}).get(metadata.FORMAT, "")))
    listed = _listed_names(records.get(metadata.BODIES_RECORD), declared.path)
    profile = _profile(found, session, own=own)
    held = set(found.names)
    keep, lost = _attachments(declared, stream, session or {})
    unread = len({fault.start for fault in declared.faults if fault.opcode not in NOT_SMALL})
    result = Recovery(
        out=target, messages=0, frames=found.frames, first_ns=found.first_ns, last_ns=found.last_ns,
        chunks=tuple(found.lost), bytes_skipped=found.bytes_skipped, closed=found.closed, attachments=lost,
        bodies=tuple(name for name in listed if name not in held),
        notes=(f"{unread} records make no sense",) if unread else (), left_out=found.left_out,
    )  # fmt: skip
    with whole_file(target, SessionFileError, overwrite=overwrite) as file:
        writer = started_writer(file, profile)
        for name, made in keep.items():
            writer.add_attachment(made.create_time, made.log_time, name, made.media_type, made.data)
        if own:
            facts = {**metadata.metadata_of(session or {})[0], RECOVERED: "; ".join(result.sentences())}
            meshes = {body: made.data for file, made in keep.items() if (body := metadata.mesh_name(file)) is not None}
            hashes = {body: hashlib.sha256(data).hexdigest() for body, data in meshes.items()}
            writer.add_metadata(metadata.SESSION_RECORD, metadata.session_record(facts, hashes))
            bodies = tuple(dict.fromkeys([*listed, *found.names]))
            writer.add_metadata(
                metadata.BODIES_RECORD,
                metadata.bodies_record(bodies if len(bodies) <= metadata.MAX_BODIES else found.names),
            )
        for name, values in declared.metadata:
            if name not in (metadata.SESSION_RECORD, metadata.BODIES_RECORD) or not own:
                writer.add_metadata(name, values)
        if not found.frames and (own or declared.ids(TF)):
            spec = channel_spec(TF)  # without a channel of poses a reader refuses the file
            writer.register_channel(
                TF, "protobuf", writer.register_schema(spec.schema, "protobuf", spec.descriptor_set)
            )
        kept, unknown = _messages(found, stream, writer)
        finish(writer)
        file.flush()
        if why := refusal_of(Path(file.name)):
            raise _nothing(declared.path, why)
    result = replace(result, messages=kept, unknown=unknown)
    why = refusal_of(declared.path) if result.whole else ""
    return replace(result, mended=(f"mended what no reader takes: {why}",)) if why else result


def refusal_of(path: Path) -> str:
    """Why a reader that asks for everything refuses a session file, or ``""``."""
    try:
        session = read_session(path)
        for _ in session.blocks():
            pass
        load_parts(session)
    except SessionFileError as error:
        return brief(error)
    return ""


def _profile(found: FileScan, session: dict[str, str] | None, *, own: bool) -> str:
    """The profile of the file to write; a refusal where no reader of this version takes what is there."""
    declared = found.declared
    if not own:
        declared.check_pose_channels()
        return declared.profile
    # The head may be what is damaged: the facts repeat the profile.
    if session is None or session.get(metadata.FORMAT) != PROFILE:
        metadata.check_version(declared.profile, declared.path)
    return PROFILE


def _messages(found: FileScan, stream: BinaryIO, writer: Writer) -> tuple[int, int]:
    """Copy the messages, payloads as they are; how many, and how many nobody declares."""
    kept = unknown = 0
    numbers: dict[int, int] = {}
    schemas = {0: 0}
    known = found.declared.channels
    for table in found.tables(stream):
        for channel in sorted(set(table.channel.tolist()) & known.keys() - numbers.keys()):
            made, schema = known[channel]
            if schema is not None and schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            where = schemas.get(made.schema_id, 0)
            numbers[channel] = writer.register_channel(made.topic, made.message_encoding, where, made.metadata)
        rows = table.of_channels(set(numbers))
        unknown += len(table.channel) - len(rows)
        kept += len(rows)
        part = table.part(rows)
        channels = [numbers[channel] for channel in part.channel.tolist()]
        stamps = (column.tolist() for column in (part.sequence, part.log_ns, part.publish_ns))
        payloads = map(table.payload, rows.tolist())
        for record in zip(channels, *stamps, payloads, strict=True):
            add(writer, record)
    return kept, unknown


def _attachments(
    declared: Catalogue, stream: BinaryIO, session: dict[str, str]
) -> tuple[dict[str, Attachment], tuple[str, ...]]:
    """Attachments to keep, and those that are lost: damaged, named by a hash and absent, or unreadable."""
    keep: dict[str, Attachment] = {}
    lost = [fault.name for fault in declared.faults if fault.opcode == Opcode.ATTACHMENT]
    hashes = {metadata.mesh_file(name): stated for name, stated in metadata.metadata_of(session)[1].items()}
    for name, place in declared.attachments.items():
        content = bytes_at(stream, place)
        made = parsed(content)
        assert isinstance(made, Attachment)
        right = any(content[-4:]) or hashes.get(name) in (None, hashlib.sha256(made.data).hexdigest())
        if right and _reads(name, made.data):
            keep[name] = made
        else:
            lost.append(name)
    lost += [name for name in hashes if name not in keep]
    return keep, tuple(dict.fromkeys(lost))


def _reads(name: str, data: bytes) -> bool:
    """Whether a reader of sessions accepts an attachment that it will look at."""
    from sessions.meshes.mesh_files import mesh_from_bytes
    from sessions.scene_files.scene_toml import parse_scene

    try:
        if name == SCENE_FILE:
            parse_scene(data.decode("utf-8"), SCENE_FILE)
        elif metadata.mesh_name(name) is not None or metadata.collider_name(name) is not None:
            mesh_from_bytes(data, "glb")
    except (SessionError, UnicodeDecodeError):
        return False
    return True


def _listed_names(record: dict[str, str] | None, path: Path) -> tuple[str, ...]:
    try:
        return metadata.names_of(record, path)
    except SessionError:
        return ()
