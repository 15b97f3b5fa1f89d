"""Says once, on a machine that has not compiled the kernels yet, why the first answer takes seconds."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Final, Protocol, runtime_checkable

from replay import words

NOTICE_INTERVAL_S: Final = 10.0
"""Seconds of compiling between two sentences about it."""


@runtime_checkable
class Speaker(Protocol):
    """Passes sentences on to people."""

    def say(self, sentence: str) -> None:
        """Pass one sentence on, at once."""
        ...


@cache
def compile_beside() -> None:
    """Start, once, a process that compiles the kernels of the search and of ``exact``, those needed last first.

    On 2 cores the first demo on a machine takes 13 s instead of 22 s of work (2026-11). Frames timed meanwhile are
    slower: those of the search took 0.07 ms instead of 0.03 in the mean, the others the same.
    The process is ended with this one; killed at any moment, it leaves whole files only.
    """
    if (os.cpu_count() or 1) < 2 or not sys.executable:
        return
    paths = os.pathsep.join(folder or str(Path.cwd()) for folder in sys.path)
    with suppress(OSError):  # a machine that lets nobody start a process compiles everything here
        compiler_process = subprocess.Popen(
            [sys.executable, "-P", "-m", "cdcore.detectors.compile_beside"],
            env=os.environ | {"PYTHONPATH": paths},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        atexit.register(compiler_process.kill)


@contextmanager
def compiling_announced(listener: object, *, is_alone: bool = False) -> Iterator[None]:
    """Announce to a ``Speaker`` that kernels are compiled meanwhile; other listeners hear nothing.

    ``is_alone``: no second process compiles beside; for those who compare clocks.
    Loads the compiler: enter it only where kernels will run anyway.
    """
    if not isinstance(listener, Speaker):
        yield
        return
    from cdcore.kernels.compiling import compiling_reported

    announced_at = -NOTICE_INTERVAL_S

    def tell(seconds: float) -> None:
        nonlocal announced_at
        if not is_alone and not compiled.engine:
            compile_beside()
        if seconds - announced_at >= NOTICE_INTERVAL_S:
            announced_at = seconds
            so_far = f" ({words.decimal(seconds, 0)} s so far)" if seconds >= 1 else ""
            kernels_text = f"{compiled.engine}'s kernels" if compiled.engine else "kernels"
            minutes = "; this can take minutes" if compiled.engine else ""
            listener.say(f"Compiling {kernels_text} for this machine, once{minutes}{so_far}")

    with compiling_reported(tell) as compiled:
        yield
    if compiled.kernels:
        kept_text = f"later starts load it from {compiled.folder}"
        storage_text = kept_text if compiled.folder else "no folder to keep it could be written"
        listener.say(f"Compiled in {words.decimal(compiled.seconds, 0)} s; {storage_text}")
        if not is_alone:
            listener.say("Times of this run may be too long: run again for reliable times")
