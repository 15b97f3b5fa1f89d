"""Files of machine code, verified before numba loads them.

numba unpickles what it reads and hands it to LLVM: one flipped bit in a file ended the process with a signal in 8 of 60
damaged folders (2026-11). Here an index begins with the checksum of its content and of its own name, and it holds the
checksum of each file of machine code. What does not match was damaged, cut, swapped or left by another version: it
counts as absent, and numba compiles again. A checksum notices accidents; it keeps nobody out who writes a new one.

Cost: SHA-256 of what is loaded, 1 ms a megabyte; all kernels of all detectors are 5 MB.
"""

import pickle
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import numba
from numba.core import serialize

DIGEST_BYTES: Final = 32
NAME_DIGITS: Final = 16
"""Hexadecimal digits of a checksum in the name of a file."""

Index = dict[Any, str]
"""A signature, as numba keys it (types, processor, bytecode), and the SHA-256 of its machine code in hexadecimal."""


class MachineCodeFiles:
    """The machine code of one kernel: an index, and a file for each signature. Takes the place of numba's own.

    A file is named by its checksum: of two processes that compile the same kernel at once neither replaces what the
    other's index names.
    """

    def __init__(self, folder: Path, name: str, source_stamp: Any) -> None:
        self._folder = folder
        self._name = name
        # Kernels of two modules may have one name; numba gives each module a folder.
        self._identity = repr((numba.__version__, folder.name, name, source_stamp)).encode()

    def load(self, key: Any) -> Any | None:
        """Return what was saved for this key; ``None`` if there is nothing, or nothing whole."""
        digest = self._read_index().get(key)
        if digest is None:
            return None
        try:
            content = self._file(digest).read_bytes()
        except OSError:
            return None
        if sha256(content).hexdigest() != digest:
            return None
        return pickle.loads(content)

    def save(self, key: Any, data: Any) -> None:
        """Write machine code first and then the index that names it, each under a temporary name."""
        content = _pickled(data)
        index = self._read_index()
        replaced = index.get(key)
        digest = index[key] = sha256(content).hexdigest()
        with _written_whole(self._file(digest)) as file:
            file.write_bytes(content)
        self._write_index(index)
        if replaced is not None and replaced != digest:
            self._file(replaced).unlink(missing_ok=True)

    def flush(self) -> None:
        """Forget every signature."""
        self._write_index({})

    @property
    def _index_file(self) -> Path:
        return self._folder / f"{self._name}.nbi"

    def _file(self, digest: str) -> Path:
        return self._folder / f"{self._name}.{digest[:NAME_DIGITS]}.nbc"

    def _read_index(self) -> Index:
        with suppress(OSError):
            content = self._index_file.read_bytes()
            digest, pickled = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
            if digest == self._digest_of_index(pickled):
                index: Index = pickle.loads(pickled)
                return index
        return {}

    def _write_index(self, index: Index) -> None:
        pickled = _pickled(index)
        with _written_whole(self._index_file) as file:
            file.write_bytes(self._digest_of_index(pickled) + pickled)

    def _digest_of_index(self, pickled: bytes) -> bytes:
        return sha256(self._identity + pickled).digest()


def _pickled(data: Any) -> bytes:
    # numba's pickler: the index is keyed by types of numba, which the standard one does not take.
    dumps: Any = serialize.dumps
    return bytes(dumps(data))


@contextmanager
def _written_whole(file: Path) -> Iterator[Path]:
    """Give a temporary path; rename it to ``file`` at the end, or remove it where the writing failed."""
    temporary = file.with_name(f"{file.name}.tmp.{uuid4().hex[:16]}")
    try:
        yield temporary
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)
