"""How far long work has come, told to whoever listens: what computes knows no terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

Advance = Callable[[int], None]
"""Called with the number of units (frames) just done."""


class Progress(Protocol):
    """Somebody who wants to know."""

    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> AbstractContextManager[Advance]:
        """Enter a piece of work of ``total`` units; the value of the ``with`` is to be called with units done."""
        ...


def _unheard(done: int) -> None:
    del done


class Silent:
    """Nobody wants to know."""

    @contextmanager
    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> Iterator[Advance]:
        """Tell no one."""
        del name, total, unit
        yield _unheard
