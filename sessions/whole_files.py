"""Files and folders that stand under their name whole or not at all, whoever else writes there.

What is being written has a random name beside its target and is created exclusively: two writers never share one, and
no link is followed. The writer holds a lock on it, which the system drops with the process. So the next writer of that
name can tell what a killed one left from what a living one writes, and removes it.
"""

import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import EEXIST, ENOTEMPTY
from glob import escape
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4

PARTIAL, FOLDER, OLD = ".partial", ".folder", ".old"

Listed = Callable[[Path], Sequence[str]]
"""Names of the files in a folder that its writer made, and may delete; an error where the folder is none of its own."""


def check_free(target: Path, error: type[Exception], *, force: bool) -> None:
    """Refuse a file that is there already, before the work is done and not after."""
    if not force and os.path.lexists(target):
        raise error(f"{target} exists; name another file, or replace it with --force")


@contextmanager
def whole_file(
    target: Path, error: type[Exception], *, overwrite: bool = True, parents: bool = False
) -> Iterator[BinaryIO]:
    """A stream whose content stands at ``target`` when the block ends well, and nowhere when it does not.

    Without ``overwrite`` a file that is there by then stays; with ``parents`` folders above it are made. Raises
    ``error``, one sentence, for what the system says.
    """
    with _reserved_file(target, error, parents=parents) as (partial, stream):
        yield stream
        stream.flush()
        if sys.platform == "win32":  # which renames no open file
            stream.close()
        move_to_target(partial, target, overwrite=overwrite)


@contextmanager
def whole_folder(target: Path, error: type[Exception], listed: Listed | None = None) -> Iterator[Path]:
    """A temporary folder that takes the name ``target`` when the block ends well, and is gone when it does not.

    ``listed``: an earlier folder of that name is replaced; only the files that it lists are deleted, others stay in
    the folder. ``None``: nothing is replaced. Raises ``error``, one sentence, for what the system says.
    """
    with _reserved_file(target, error, listed, parents=True) as (partial, _):
        folder, old = partial.with_suffix(FOLDER), partial.with_suffix(OLD)
        folder.mkdir()
        try:
            yield folder
            if listed is not None and target.exists():
                listed(target)
                target.rename(old)
            # A rename replaces an empty folder at most.
            folder.rename(target)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            _settle(old, target, listed)


@contextmanager
def _reserved_file(
    target: Path, error: type[Exception], listed: Listed | None = None, *, parents: bool
) -> Iterator[tuple[Path, BinaryIO]]:
    """A new file beside the target, held by this process; it is gone when the block ends."""
    try:
        if parents:
            target.parent.mkdir(parents=True, exist_ok=True)
        remove_abandoned(target, listed)
        partial, stream = _create_file(target)
        try:
            with stream:
                yield partial, stream
        finally:
            partial.unlink(missing_ok=True)
    except error:
        raise
    except OSError as problem:
        if problem.errno in (EEXIST, ENOTEMPTY) and os.path.lexists(target):
            raise error(f"{target} was written by another program meanwhile; name another") from problem
        why = problem.strerror or problem
        todo = "check the folder, the space left and who may write there"
        raise error(f"{target} cannot be written ({why}); {todo}") from problem


def _create_file(target: Path) -> tuple[Path, BinaryIO]:
    while True:
        partial = target.with_name(f".{target.name}.{uuid4().hex[:8]}{PARTIAL}")
        stream = partial.open("xb")
        # Another writer may have swept it away before it was locked.
        if locks(stream) and partial.exists():
            return partial, stream
        stream.close()


def locks(stream: BinaryIO, *, otherwise: bool = True) -> bool:
    """Whether this process holds the file now; ``otherwise`` where the file system knows no locks."""
    if sys.platform == "win32":  # which removes no open file: that is lock enough
        return True
    import fcntl

    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return otherwise
    return True


def is_abandoned(partial: Path, *, otherwise: bool = True) -> bool:
    """Whether there is such a file and no living process holds it; ``otherwise`` where nobody knows."""
    if not partial.is_file() or partial.is_symlink():
        return partial.is_symlink()
    with partial.open("rb") as stream:
        return locks(stream, otherwise=otherwise)


def remove_abandoned(target: Path, listed: Listed | None) -> None:
    """Remove what killed writers of the target left beside it."""
    for partial in target.parent.glob(f".{escape(target.name)}.????????{PARTIAL}"):
        with suppress(OSError):
            if is_abandoned(partial, otherwise=False):
                shutil.rmtree(partial.with_suffix(FOLDER), ignore_errors=True)
                _settle(partial.with_suffix(OLD), target, listed)
                partial.unlink()


def _settle(old: Path, target: Path, listed: Listed | None) -> None:
    """Give a folder that was moved aside its name back or, where its successor has it, delete the files it lists."""
    if not old.exists():
        return
    if not target.exists():
        old.rename(target)
    elif listed is not None:
        names = listed(old)
        for entry in [item for item in old.iterdir() if item.name not in names]:
            if not (target / entry.name).exists():
                entry.rename(target / entry.name)
        # In this order: as long as anything is left, the list is.
        for name in names:
            (old / name).unlink(missing_ok=True)
        with suppress(OSError):
            old.rmdir()


def move_to_target(partial: Path, target: Path, *, overwrite: bool) -> None:
    """Give a file its name; without ``overwrite`` an error where there is one of that name by then."""
    if overwrite:
        partial.replace(target)
        return
    try:
        os.link(partial, target)  # a rename would replace it
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        if os.path.lexists(target):
            raise FileExistsError(EEXIST, os.strerror(EEXIST), str(target)) from None
        partial.rename(target)
    else:
        partial.unlink()
