"""``recover`` saves every whole message of every readable chunk of a damaged file, in a file that is whole.

A chunk whose checksum is wrong is not read at all, because nobody can say which of its bytes changed. What follows a
record that is not whole is lost: nothing is guessed among bytes without records. The result and the new file's
metadata name what is lost.
"""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Attachment
from mcap.writer import Writer
from numpy.typing import NDArray

from sessions.errors import SessionError, SessionFileError
from sessions.input_files import open_input
from sessions.mcap import metadata
from sessions.mcap.container import (
    Catalogue,
    Region,
    add,
    bytes_at,
    finish,
    parse_record,
    read_catalogue,
    started_writer,
)
from sessions.mcap.frame_codec import MESSAGE_BYTES, FrameDecoder
from sessions.mcap.reader import is_session_topic, load_streams, read_session, read_topic
from sessions.mcap.refusals import brief
from sessions.mcap.schemas import PROFILE, PROFILE_FAMILY, TF, TRACKING, channel_spec
from sessions.mcap.unpacking import MessageTable, read_region
from sessions.mcap.writer import SCENE_FILE
from sessions.whole_files import check_free, whole_file

OF_MESSAGES = (Opcode.CHUNK, Opcode.MESSAGE)
WITH_SENTENCES = (*OF_MESSAGES, Opcode.ATTACHMENT)
RECOVERED = "recovered"  # The fact that says what a recovered file lacks


@dataclass(frozen=True)
class Recovery:
    """The result of recovering a file.

    Parameters
    ----------
    out : the file written.
    messages, frames : kept.
    first_ns, last_ns : frame stamps kept, 0 without any.
    lost : everything that was lost, a sentence each.
    mended : what a reader refused before although nothing of it is lost.
    """

    out: Path
    messages: int
    frames: int
    first_ns: int
    last_ns: int
    lost: tuple[str, ...]
    mended: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether nothing was lost."""
        return not self.lost

    def sentences(self) -> list[str]:
        """Sentences on what was kept and lost, for a reader."""
        return [f"kept {self.frames:,} frames and {self.messages:,} messages", *self.lost, *self.mended]


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
    if source.exists() and target.exists() and target.samefile(source):
        raise SessionFileError(f"{out} is the damaged file itself; name another file to write")
    check_free(target, SessionFileError, force=overwrite)
    with open_input(source, "session file", SessionFileError) as stream:
        declared = read_catalogue(source, stream, strict=False)
        with whole_file(target, SessionFileError, overwrite=overwrite) as file:
            result = _written(declared, stream, file, target)
    why = refusal_of(source) if result.whole else ""
    return replace(result, mended=(f"mended what no reader takes: {why}",)) if why else result


def refusal_of(path: Path) -> str:
    """Why a reader that asks for everything refuses a session file, or ``""``."""
    try:
        session = read_session(path)
        for _ in session.blocks():
            pass
        load_streams(session)
    except SessionFileError as error:
        return brief(error)
    return ""


def _written(declared: Catalogue, stream: BinaryIO, file: BinaryIO, target: Path) -> Recovery:
    """Write attachments, messages, and then the metadata, which say what was lost of all these."""
    records = dict(declared.metadata)
    session = records.get(metadata.SESSION_RECORD) or {}
    # The head may be what is damaged: the facts repeat the profile.
    own = any(word.startswith(PROFILE_FAMILY) for word in (declared.profile, session.get(metadata.FORMAT, "")))
    if own and session.get(metadata.FORMAT) != PROFILE:
        metadata.check_version(declared.profile, declared.path)
    writer = started_writer(file, PROFILE if own else declared.profile)
    hashes = {metadata.mesh_file(name): stated for name, stated in metadata.metadata_of(session)[1].items()}
    attachments = _attachments(declared, stream, hashes)
    for name, made in attachments.items():
        writer.add_attachment(made.create_time, made.log_time, name, made.media_type, made.data)
    kept = _KeptMessages(declared, writer)
    for region in declared.regions:
        kept.add(stream, region)
    if not kept.regions and not attachments:
        raise _nothing_to_save(declared.path, next(iter(kept.lost), "there is no chunk in it"))
    if not own:
        declared.check_pose_channels()
    listed: tuple[str, ...] = ()
    with suppress(SessionError):
        listed = metadata.names_of(records.get(metadata.BODIES_RECORD), declared.path)
    faulty = [fault.name for fault in declared.faults if fault.opcode == Opcode.ATTACHMENT]
    absent = dict.fromkeys(name for name in (*faulty, *declared.attachments, *hashes) if name not in attachments)
    lost = tuple(_losses(declared, kept, [name for name in listed if name not in kept.names], [*absent]))
    first_ns, last_ns = min(kept.stamps, default=0), max(kept.stamps, default=0)
    result = Recovery(target, kept.messages, len(kept.stamps), first_ns, last_ns, lost)
    rewritten = {}
    if own:
        facts = {**metadata.metadata_of(session)[0], RECOVERED: "; ".join(result.sentences())}
        meshes = {body: made.data for name, made in attachments.items() if (body := metadata.mesh_name(name))}
        written = {body: hashlib.sha256(data).hexdigest() for body, data in meshes.items()}
        names = tuple(dict.fromkeys([*listed, *kept.names]))
        rewritten[metadata.SESSION_RECORD] = metadata.session_record(facts, written)
        rewritten[metadata.BODIES_RECORD] = metadata.bodies_record(
            names if len(names) <= metadata.MAX_BODIES else kept.names
        )
    others = [(name, values) for name, values in declared.metadata if name not in rewritten]
    for name, values in (*rewritten.items(), *others):
        writer.add_metadata(name, values)
    if not kept.stamps and (own or declared.ids(TF)):
        spec = channel_spec(TF)  # without a channel of poses a reader refuses the file
        writer.register_channel(TF, "protobuf", writer.register_schema(spec.schema, "protobuf", spec.descriptor_set))
    finish(writer)
    file.flush()
    if why := refusal_of(Path(file.name)):
        raise _nothing_to_save(declared.path, why)
    return result


def _losses(
    declared: Catalogue, kept: "_KeptMessages", bodies: Sequence[str], attachments: Sequence[str]
) -> Iterator[str]:
    """The losses of a file, a sentence each."""
    yield from kept.lost
    if declared.tear is not None and (skipped := declared.size - declared.tear):
        yield f"skipped {skipped:,} bytes that are no records"
    if kept.unknown:
        yield f"left out {kept.unknown:,} messages on channels that nothing declares"
    if kept.left_out:
        yield f"left out {kept.left_out:,} messages that are not what their schema says"
    if unread := len({fault.start for fault in declared.faults if fault.opcode not in WITH_SENTENCES}):
        yield f"{unread} records make no sense"
    if bodies:
        yield f"no pose is left of: {', '.join(bodies)}"
    if attachments:
        yield f"lost attachments: {', '.join(attachments)}"
    if declared.data_end is None:
        seconds = (max(kept.stamps, default=0) - min(kept.stamps, default=0)) / 1e9
        last = f" {seconds:.3f} s, the last frame kept," if kept.stamps else " this"
        yield f"it was never closed: what was recorded after{last} may be missing"


def _nothing_to_save(source: Path, why: str) -> SessionFileError:
    return SessionFileError(f"nothing in {source} can be saved: {why}")


class _KeptMessages:
    """Copies the messages that a reader takes, region by region, and counts them and what is lost."""

    def __init__(self, declared: Catalogue, writer: Writer) -> None:
        self._declared, self._writer = declared, writer
        self._decoder = FrameDecoder(declared, None)
        self._schemas: dict[int, int] = {0: 0}
        self._numbers: dict[int, int] = {}
        self.regions = self.messages = self.unknown = self.left_out = 0
        self.stamps: list[int] = []
        """Of the frames."""
        self._began_ns = min((region.first_ns for region in declared.regions if region.is_chunk), default=0)
        self.lost: list[str] = []
        for fault in declared.faults:
            if fault.opcode in OF_MESSAGES:
                self._lose(fault.start, fault.error)

    @property
    def names(self) -> tuple[str, ...]:
        """The bodies that have poses."""
        return self._decoder.names

    def add(self, stream: BinaryIO, region: Region) -> None:
        """Keep a stretch of messages that can be read; any other is noted as lost."""
        try:
            table = read_region(stream, region, self._declared)
            kept = table.take(_readable(table, self._declared))
            decoder = self._decoder.fork()
            stamps = [stamp for frames in decoder.decode(kept) for stamp in frames.stamp_ns.tolist()]
        except SessionFileError as error:
            self._lose(region.span.start, error, region)
            return
        self._decoder = decoder
        self.stamps += stamps
        self.regions += 1
        self.left_out += len(table.channel) - len(kept.channel)
        self._copy(kept)

    def _lose(self, start: int, error: SessionFileError, region: Region | None = None) -> None:
        """Say what is lost of a region; times are seconds after the first message."""
        why = "damaged" if error.code == "damaged-chunk" else f"unreadable ({brief(error)})"
        count = "an unknown number of" if region is None or region.indexed is None else f"{region.indexed:,}"
        span = ""
        if region is not None and region.last_ns:
            first, last = ((stamp - self._began_ns) / 1e9 for stamp in (region.first_ns, region.last_ns))
            span = f", {first:.3f} s to {last:.3f} s"
        self.lost.append(f"lost {count} messages{span}: the chunk at byte {start} is {why}")

    def _copy(self, table: MessageTable) -> None:
        """Write the messages, payloads as they are, but those on channels that nothing declares."""
        for channel in sorted({*table.channel.tolist()} & self._declared.channels.keys() - self._numbers.keys()):
            record, schema = self._declared.channels[channel]
            if schema is not None and schema.id not in self._schemas:
                self._schemas[schema.id] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            where = self._schemas.get(record.schema_id, 0)
            number = self._writer.register_channel(record.topic, record.message_encoding, where, record.metadata)
            self._numbers[channel] = number
        rows = table.of_channels({*self._numbers}).tolist()
        self.unknown += len(table.channel) - len(rows)
        self.messages += len(rows)
        for row in rows:
            stamps = int(table.sequence[row]), int(table.log_ns[row]), int(table.publish_ns[row])
            add(self._writer, (self._numbers[int(table.channel[row])], *stamps, table.payload(row)))


def _readable(table: MessageTable, declared: Catalogue) -> NDArray[np.int64]:
    """Numbers of the messages that a reader of sessions takes, or does not look at."""
    keep = np.ones(len(table.channel), dtype=np.bool_)
    for number in {*table.channel.tolist()} & declared.channels.keys():
        topic = declared.channels[number].topic
        for row in table.of_channels({number}).tolist() if topic in (TF, TRACKING) or is_session_topic(topic) else ():
            keep[row] = _takes(declared.path, topic, int(table.publish_ns[row]), table.payload(row))
    return np.flatnonzero(keep)


def _takes(path: Path, topic: str, publish_ns: int, payload: bytes) -> bool:
    """Whether a message is what its schema says, and of poses no longer than a reader allows."""
    try:
        if is_session_topic(topic):
            read_topic(path, topic, [(publish_ns, payload)])
        else:
            channel_spec(topic).message.FromString(payload)
    except (DecodeError, SessionFileError):
        return False
    return is_session_topic(topic) or len(payload) <= MESSAGE_BYTES


def _attachments(declared: Catalogue, stream: BinaryIO, hashes: dict[str, str]) -> dict[str, Attachment]:
    """Attachments to keep: none that is not what its checksum, or the hash of its name, says, or that is unreadable."""
    keep = {}
    for name, record in declared.attachments.items():
        content = bytes_at(stream, record)
        made = parse_record(content)
        assert isinstance(made, Attachment)
        right = any(content[-4:]) or hashes.get(name) in (None, hashlib.sha256(made.data).hexdigest())
        if right and _reads(name, made.data):
            keep[name] = made
    return keep


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
