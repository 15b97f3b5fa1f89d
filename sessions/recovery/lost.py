"""What was lost when a damaged session file was saved: bytes, messages, spans of time, bodies, attachments."""

from dataclasses import dataclass
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

    def sentence(self, zero_ns: int | None) -> str:
        """What was lost; times are seconds after ``zero_ns``, the first frame kept, where there is one."""
        span = ""
        if zero_ns is not None and self.last_ns:
            start, end = ((stamp - zero_ns) / 1e9 for stamp in (self.first_ns, self.last_ns))
            span = f", {start:.3f} s to {end:.3f} s"
        count = "an unknown number of" if self.messages is None else f"{self.messages:,}"
        return f"lost {count} messages{span}: the chunk at byte {self.offset} is {self.why}"


@dataclass(frozen=True)
class Recovery:
    """What became of a file.

    Parameters
    ----------
    out : the file written.
    messages, frames : kept.
    first_ns, last_ns : frame stamps kept, 0 without any.
    chunks : stretches of messages that were lost.
    bodies : listed bodies of which no pose is left.
    attachments : attachments that could not be kept.
    lost : everything that was lost, a sentence each.
    mended : what a reader refused before although nothing of it is lost.
    """

    out: Path
    messages: int
    frames: int
    first_ns: int
    last_ns: int
    chunks: tuple[LostChunk, ...]
    bodies: tuple[str, ...]
    attachments: tuple[str, ...]
    lost: tuple[str, ...]
    mended: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether nothing was lost."""
        return not self.lost

    def sentences(self) -> list[str]:
        """What was kept and lost, for a reader."""
        return [f"kept {self.frames:,} frames and {self.messages:,} messages", *self.lost, *self.mended]
