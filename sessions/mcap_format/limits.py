"""What a file may hold, by its size: bounds on counts that no declared number can raise."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sessions.mcap_format.refusals import refused

if TYPE_CHECKING:
    from sessions.mcap_format.catalogue import Region

# A file of n bytes may unpack to so much, hold so many messages, and so many samples (frames times bodies), so that
# reading costs at most 100 MB + 50 n. A minute of twelve bodies at rest unpacks to 24 n, with n / 25 messages and n / 4
# samples; no session comes near.
MOST_UNPACKED, UNPACKED_PER_BYTE = 32 << 20, 100
MOST_MESSAGES, BYTES_PER_MESSAGE = 100_000, 4
MOST_SAMPLES = 250_000
MOST_CHANNELS = 2048


@dataclass
class Room:
    """The room that a file of ``size`` bytes has; ``unpacked`` and ``messages`` are of the regions read so far."""

    path: Path
    size: int = 0
    unpacked: int = 0
    messages: int = 0

    @property
    def most_samples(self) -> int:
        """Frames times bodies that the file may hold."""
        return MOST_SAMPLES + self.size

    @property
    def messages_left(self) -> int:
        """Messages that the regions not yet read may hold."""
        return MOST_MESSAGES + self.size // BYTES_PER_MESSAGE - self.messages

    def check_unpacked(self, region: "Region") -> None:
        """Refuse a region with which the file unpacks to more than a recording does."""
        if region.messages is None and self.unpacked + region.size > MOST_UNPACKED + UNPACKED_PER_BYTE * self.size:
            most = MOST_UNPACKED + UNPACKED_PER_BYTE * self.size
            raise refused(self.path, "too-much", f"its {self.size:,} bytes unpack to more than the {most:,} allowed")

    def note(self, region: "Region", messages: int) -> None:
        """Count what a region holds, once."""
        if region.messages is None:
            region.messages = messages
            self.unpacked += region.size
            self.messages += messages
