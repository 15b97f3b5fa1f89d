"""Progress of long work, reported through a protocol, because modules that compute do not know the terminal."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

Advance = Callable[[int], None]
"""Called with the number of units (frames) just done."""


def ignore_progress(_: int) -> None:
    """Discards progress."""


class Progress(Protocol):
    """Receives reports of progress."""

    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> AbstractContextManager[Advance]:
        """Begin a piece of work of ``total`` units; the value of the ``with`` is called with the units just done."""
        ...


class Silent:
    """Ignores all progress."""

    @contextmanager
    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> Iterator[Advance]:
        """Begin a piece of work without a report."""
        del name, total, unit
        yield ignore_progress
