"""Seals of numba's cache files: a damaged, foreign or outdated file is noticed and removed before numba loads it.

numba unpickles what it reads and hands it to LLVM: one flipped bit in a file ended the process with a signal in 8 of 60
damaged folders (2026-11). It also looks at the file in which a kernel stands only, and kernels call each other across
files. So a seal stands beside the files of each kernel, with their checksums and that of all sources of kernels. Files
that do not match their seal are removed, and numba compiles again. A checksum notices accidents; it keeps nobody out
who writes a new one.

Cost: SHA-256 of what may be loaded, 1 ms a megabyte; all kernels of all detectors are 5 MB.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from time import monotonic, sleep
from typing import Any, Final, TextIO
from uuid import uuid4

import numba

try:
    import fcntl
except ImportError:  # Windows: each process compiles for itself
    fcntl = None  # type: ignore[assignment]

SOURCES: Final = (
    "kernels/*.py",
    "poses/*.py",
    "triangles/*.py",
    "image_space/*.py",
    "broad/*.py",
    "narrow/**/*.py",
    "containment/*.py",
    "search/*.py",
    "numerics.py",
    "tolerances.py",
    "protocol/verdict.py",
)
"""Files of kernels and of the constants that become part of them."""

PACKAGE: Final = Path(__file__).parents[1]
PYTHON: Final = f".py{sys.version_info.major}{sys.version_info.minor}"
"""What numba writes into the name of each file: versions of Python share folders."""
SEAL: Final = ".seal"
LONGEST_WAIT: Final = 120.0
"""Seconds to wait for another process that compiles the same kernel; then it is thought to be stopped."""
POLL_INTERVAL: Final = 0.02
"""Seconds between two attempts meanwhile."""


@cache
def sources_digest() -> str:
    """The SHA-256 of all sources of kernels, in hexadecimal."""
    sources = sorted(file for name in SOURCES for file in PACKAGE.glob(name))
    return sha256(b"".join(file.read_bytes() for file in sources)).hexdigest()


@dataclass(frozen=True)
class KernelCache:
    """The cache files of one kernel: numba's index, its machine code by signature, and their seal."""

    folder: Path
    source: str
    """Stem of the file in which the kernel stands."""
    line: int
    """Where it begins there."""

    @staticmethod
    def of(function: Callable[..., Any], folder: str) -> "KernelCache":
        """The files that numba keeps of a function in a folder."""
        code = function.__code__
        return KernelCache(folder=Path(folder), source=Path(code.co_filename).stem, line=code.co_firstlineno)

    def remove_unless_intact(self) -> bool:
        """Remove files that do not match their seal; returns whether numba may use what is left.

        False: damaged files are left, since the folder cannot be changed.
        """
        remove_outdated(self.folder)
        try:
            if self._seal_of_content() != self._written_seal():
                for file in self._files("nb?"):
                    file.unlink(missing_ok=True)
        except OSError:
            return False
        return True

    def seal(self) -> None:
        """Write down the checksums of the files as they are now; nothing where the disk refuses."""
        with suppress(OSError):
            indices = self._files("nbi")
            if not indices:
                return
            seal = indices[0].with_suffix(SEAL)
            temporary = seal.with_name(f"{seal.name}.{uuid4().hex[:16]}")
            try:
                temporary.write_text(self._seal_of_content(), encoding="utf-8")
                temporary.replace(seal)
            finally:
                temporary.unlink(missing_ok=True)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Wait until no other process loads or compiles this kernel, and let others wait meanwhile.

        Of two processes that need a kernel one compiles and the other loads it. No lock where the folder or the system
        has none; the system gives a lock back when its process ends.
        """
        file: TextIO | None = None
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            file = (self.folder / f"{self.source}-{self.line}{PYTHON}.lock").open("w")
        try:
            if file is not None and fcntl is not None:
                _lock(file)
            yield
        finally:
            if file is not None:
                file.close()

    def _files(self, suffix: str) -> list[Path]:
        return sorted(self.folder.glob(f"{self.source}.*-{self.line}{PYTHON}*.{suffix}"))

    def _written_seal(self) -> str:
        seals = self._files(SEAL.removeprefix("."))
        return seals[0].read_text(encoding="utf-8", errors="replace") if seals else ""

    def _seal_of_content(self) -> str:
        digests = [f"{sha256(file.read_bytes()).hexdigest()} {file.name}" for file in self._files("nb?")]
        return "\n".join([_identity(self.folder), *digests])


def _lock(file: TextIO) -> None:
    """Lock a file for this process, within ``LONGEST_WAIT``."""
    end = monotonic() + LONGEST_WAIT
    while True:
        try:
            return fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if monotonic() > end:
                return None
            sleep(POLL_INTERVAL)
        except OSError:  # a file system without locks
            return None


def _identity(folder: Path) -> str:
    """The first line of every seal in a folder."""
    return f"numba {numba.__version__}, {folder.name}, sources {sources_digest()}"


@cache
def remove_outdated(folder: Path) -> None:
    """Remove what earlier sources, or another numba, left in a folder."""
    with suppress(OSError):
        for seal in folder.glob(f"*{PYTHON}*{SEAL}"):
            written = seal.read_text(encoding="utf-8", errors="replace")
            if written.partition("\n")[0] != _identity(folder):
                for file in folder.glob(f"{seal.stem}.*"):
                    file.unlink(missing_ok=True)
