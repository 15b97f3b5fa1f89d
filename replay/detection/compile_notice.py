"""Says once, on a machine that has not compiled the kernels yet, why the first answer takes seconds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol, runtime_checkable


@runtime_checkable
class Speaker(Protocol):
    """Passes sentences on to people."""

    def say(self, sentence: str) -> None:
        """Pass one sentence on, at once."""
        ...


@contextmanager
def compiling_announced(listener: object) -> Iterator[None]:
    """Announce to a ``Speaker`` each family of kernels that is compiled meanwhile; other listeners hear nothing.

    Loads the compiler: enter it only where kernels will run anyway.
    """
    if not isinstance(listener, Speaker):
        yield
        return
    from cdcore.kernels.compiling import compiling_reported

    def tell(family: str, seconds: float) -> None:
        so_far = f" ({seconds:.0f} s so far)" if seconds >= 1 else ""
        listener.say(f"compiling for this machine, once: {family}{so_far}")

    with compiling_reported(tell) as compiled:
        yield
    if compiled.families:
        kept = f"later starts load it from {compiled.folder}"
        where = kept if compiled.folder else "no folder to keep it could be written"
        listener.say(f"compiled in {compiled.seconds:.0f} s; {where}")
