"""The one way to open a file that somebody names: a regular file, or one sentence that says what else stands there.

A device such as ``/dev/zero`` never ends, and a FIFO waits for a writer who may never come. So what a path leads to is
looked at before anything is read of it.
"""

import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

_KINDS = {"d": "a folder", "p": "a FIFO (named pipe)", "s": "a socket", "c": "a device", "b": "a device"}
"""First letter of a file's mode, as `ls -l` prints it -> what stands there."""


def _as_path(path: str | Path) -> Path:
    return Path(path) if isinstance(path, str) else path


def special_kind(path: str | Path) -> str:
    """The kind of what a path leads to where it is no regular file, such as "a device"; else empty."""
    try:
        mode = _as_path(path).stat().st_mode
    except (OSError, ValueError):
        return ""
    letter = stat.filemode(mode)[0]
    return "" if letter == "-" else _KINDS.get(letter, "no regular file")


def check_regular(path: str | Path, what: str, error: type[Exception]) -> None:
    """Refuse a folder, a device, a FIFO or a socket by name; ``what`` is what the file should be, such as "scene"."""
    kind = special_kind(path)
    if kind:
        raise error(f"{what} {path} is {kind}; name a regular file")


@contextmanager
def opened(path: str | Path, what: str, error: type[Exception]) -> Iterator[BinaryIO]:
    """A file open for reading; ``error``, one sentence, for whatever the system says while it is read."""
    check_regular(path, what, error)
    try:
        with _as_path(path).open("rb") as stream:
            yield stream
    except FileNotFoundError:
        raise error(f"{what} {path} does not exist; check the path") from None
    except OSError as reason:
        raise error(
            f"{what} {path} cannot be read ({reason.strerror or reason}); check what it is and who may read it"
        ) from None


def read_bytes(path: str | Path, what: str, error: type[Exception]) -> bytes:
    """All bytes of a file."""
    with opened(path, what, error) as stream:
        return stream.read()


def read_text(path: str | Path, what: str, error: type[Exception]) -> str:
    """The text of a UTF-8 file, without a byte order mark."""
    try:
        return read_bytes(path, what, error).decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise error(f"{what} {path} is not UTF-8 text; save it as UTF-8") from None
