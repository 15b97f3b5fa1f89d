"""What was lost when a damaged session file was saved: bytes, messages, spans of time, bodies, attachments."""

from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class LostChunk:
    """A stretch of messages that could not be kept.

    Parameters
    ----------
    offset : its first byte in the damaged file.
    first_ns, last_ns : log times between which its messages lay, as far as the file says.
    messages : how many were lost, ``None`` where the file does not say.
    why : ``damaged`` or ``cut short``.
    """

    offset: int
    first_ns: int
    last_ns: int
    messages: int | None
    why: str


@dataclass(frozen=True)
class Recovery:
    """What became of a file.

    Parameters
    ----------
    out : the file written.
    messages, frames : kept.
    first_ns, last_ns : frame stamps kept, 0 without any.
    chunks : stretches of messages that were lost.
    bytes_skipped : bytes that belong to no record.
    bodies : listed bodies of which no pose is left.
    attachments : attachments that could not be kept.
    unknown : messages left out because nothing says what they are.
    closed : whoever wrote it came to its end; else nobody knows what is missing there.
    left_out : messages that are not what their schema says.
    mended : what a reader refused before although nothing of it is lost.
    whole : nothing at all was lost.
    """

    out: Path
    messages: int
    frames: int
    first_ns: int
    last_ns: int
    chunks: tuple[LostChunk, ...] = ()
    bytes_skipped: int = 0
    bodies: tuple[str, ...] = ()
    attachments: tuple[str, ...] = ()
    unknown: int = 0
    closed: bool = True
    notes: tuple[str, ...] = field(default_factory=tuple)
    left_out: int = 0
    mended: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether nothing was lost."""
        lost = (self.chunks, self.bytes_skipped, self.attachments, self.unknown, self.notes, self.left_out, self.bodies)
        return self.closed and not any(lost)

    def sentences(self) -> list[str]:
        """What was kept and lost, for a reader; times are seconds after the first frame kept."""
        words = [f"kept {self.frames:,} frames and {self.messages:,} messages"]
        words += [self._chunk(chunk) for chunk in self.chunks]
        for lost, said in (
            (self.bytes_skipped, f"skipped {self.bytes_skipped:,} bytes that are no records"),
            (self.unknown, f"left out {self.unknown:,} messages on channels that nothing declares"),
            (self.left_out, f"left out {self.left_out:,} messages that are not what their schema says"),
            (self.bodies, f"no pose is left of: {', '.join(self.bodies)}"),
            (self.attachments, f"lost attachments: {', '.join(self.attachments)}"),
        ):
            words += [said] if lost else []
        if not self.closed:
            last = f" {(self.last_ns - self.first_ns) / 1e9:.3f} s, the last frame kept," if self.frames else " this"
            words.append(f"it was never closed: what was recorded after{last} may be missing")
        return [*words, *self.notes, *self.mended]

    def _chunk(self, chunk: LostChunk) -> str:
        span = ""
        if self.frames and chunk.last_ns:
            start, end = ((stamp - self.first_ns) / 1e9 for stamp in (chunk.first_ns, chunk.last_ns))
            span = f", {start:.3f} s to {end:.3f} s"
        count = "an unknown number of" if chunk.messages is None else f"{chunk.messages:,}"
        return f"lost {count} messages{span}: the chunk at byte {chunk.offset} is {chunk.why}"
