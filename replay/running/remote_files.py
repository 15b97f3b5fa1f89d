"""Sessions and run folders at a URL of fsspec: fetched to this machine before the work, put in their place after it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from replay.errors import PlaceError, ReplayError
from sessions.temporary_folders import temporary_folder


def path_of_place(name: Any) -> Path:
    """A path; for a URL like ``s3://bucket/runs`` what acts like one. ``PlaceError``: nothing here reads such URLs."""
    if is_remote(name) or "://" not in str(name):
        return name if is_remote(name) else Path(name)
    todo = "install what fsspec needs for it, or name a folder"
    try:
        from upath import UPath

        remote_path: Any = UPath(name, use_listings_cache=False)  # others write there too
        _ = remote_path.fs
    except (ImportError, ValueError) as error:
        if isinstance(error, ImportError) and error.name in ("upath", "fsspec"):
            todo = 'pip install "vrlab-replay[cluster]"'
        raise PlaceError(f"{name} cannot be reached ({error}); {todo}") from error
    return remote_path


def is_remote(candidate: Any) -> bool:
    """Whether this is what ``path_of_place`` makes of a URL."""
    return hasattr(candidate, "fs")


@contextmanager
def store_errors(address: Any) -> Iterator[None]:
    """Turns errors at a URL into ``PlaceError``: each kind of store has errors of its own."""
    try:
        yield
    except Exception as error:
        if not is_remote(address) or isinstance(error, ReplayError):
            raise
        todo = "check the address, the network and who may read and write there"
        raise PlaceError(f"{address} cannot be reached ({type(error).__name__}: {error}); {todo}") from error


@contextmanager
def local_copy(address: Any) -> Iterator[Any]:
    """Yields the argument; for a URL, a local copy that lasts until the block ends."""
    remote_path: Any = path_of_place(address) if isinstance(address, str) else address
    if not is_remote(remote_path):
        yield address
        return
    with temporary_folder() as folder:
        copied_file = folder / remote_path.name
        with store_errors(remote_path):
            remote_path.fs.get_file(remote_path.path, str(copied_file))
        yield copied_file


@contextmanager
def run_folder_for(address: Any) -> Iterator[Any]:
    """The run folder to write; of one at a URL a folder on this machine, put there when the block ends well.

    Its summary is put last: a folder without one was begun by a process that was killed, and is made anew.
    """
    if not is_remote(address):
        yield address
        return
    from replay.show.results.run_folder import SUMMARY_FILE

    with temporary_folder() as folder:
        local_folder = folder / address.name
        yield local_folder
        with store_errors(address):
            (address / SUMMARY_FILE).unlink(missing_ok=True)
            address.fs.makedirs(address.path, exist_ok=True)
            for file in sorted(local_folder.iterdir(), key=lambda file: file.name == SUMMARY_FILE):
                address.fs.put_file(str(file), (address / file.name).path)
