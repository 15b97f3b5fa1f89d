"""Temporary folders that are gone when their block ends, or when the next program starts after a kill.

The owner holds a lock on a file inside, which the system drops with the process: the next program that makes such a
folder tells what a killed one left from what a living one uses, and removes it.
"""

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from sessions.whole_files import is_abandoned, locks

PREFIX: Final = "replay-"
IN_USE: Final = "in-use"
CONTENT: Final = "files"


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Give an empty folder that only this user can read; folders that killed programs left are removed before."""
    remove_leftovers()
    root, stream = _create_folder()
    try:
        content = root / CONTENT
        content.mkdir()
        yield content
    finally:
        stream.close()  # Windows removes no open file
        shutil.rmtree(root, ignore_errors=True)


def remove_leftovers() -> None:
    """Remove temporary folders of this user whose process is dead; one without a lock file belongs to others."""
    for root in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            if _is_own_folder(root) and is_abandoned(root / IN_USE, otherwise=False):
                (root / IN_USE).unlink()  # Windows refuses it while the owner lives
                shutil.rmtree(root, ignore_errors=True)


def _create_folder() -> tuple[Path, BinaryIO]:
    while True:
        root = Path(tempfile.mkdtemp(prefix=PREFIX))
        stream = (root / IN_USE).open("xb")
        # Another program may have taken it for a leftover before it was locked.
        if locks(stream) and (root / IN_USE).exists():
            return root, stream
        stream.close()
        shutil.rmtree(root, ignore_errors=True)


def _is_own_folder(root: Path) -> bool:
    if root.is_symlink() or not root.is_dir():
        return False
    return sys.platform == "win32" or root.stat().st_uid == os.getuid()
