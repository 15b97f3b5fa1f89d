"""Files and folders here or elsewhere: a path, or a URL of fsspec.

The tool works on files of this machine alone: what lies elsewhere is fetched before, what is made is put there after.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from replay.errors import PlaceError, ReplayError
from replay.outputs.results.run_folder import SUMMARY, check_target


def place(name: Any) -> Path:
    """A path; of a URL like ``s3://bucket/runs`` what acts like one. ``PlaceError``: nobody here reads such URLs."""
    if far(name) or "://" not in str(name):
        return name if far(name) else Path(name)
    try:
        from upath import UPath

        found: Any = UPath(name, use_listings_cache=False)  # others write there too
        _ = found.fs
    except (ImportError, ValueError) as error:
        missing = isinstance(error, ImportError) and error.name in ("upath", "fsspec")
        todo = "install what fsspec needs for it, or name a folder"
        if missing:
            todo = 'pip install "vrlab-replay[cluster]"'
        raise PlaceError(f"{name} cannot be reached ({error}); {todo}") from error
    return found


def far(given: Any) -> bool:
    """Whether this is what ``place`` makes of a URL."""
    return hasattr(given, "fs")


@contextmanager
def reaching(where: Any) -> Iterator[None]:
    """What goes wrong in the block as ``PlaceError`` if the place is far: each kind of store has errors of its own."""
    try:
        yield
    except Exception as error:
        if not far(where) or isinstance(error, ReplayError):
            raise
        what = f"{type(error).__name__}: {error}"
        todo = "check the address, the network and who may read and write there"
        raise PlaceError(f"{where} cannot be reached ({what}); {todo}") from error


def check_place(out: Path | None, *, force: bool) -> None:
    """Refuse a run folder that is in the way, as ``check_target``, before the work is done and not after."""
    if out is not None:
        with reaching(out):
            check_target(out, force=force)


@contextmanager
def near(given: Any, out: Path | None) -> Iterator[tuple[Any, Path | None]]:
    """A session and a run folder to work with: copies here of what lies elsewhere, kept until the block ends.

    The folder is put where it belongs when the block ends well, its summary last: a folder without was begun by one
    who was killed, and is taken over.
    """
    if not far(given) and not far(out):
        yield given, out
        return
    with TemporaryDirectory(prefix="replay-") as folder:
        here, made = given, out
        if far(given):
            here = Path(folder) / given.name
            with reaching(given):
                given.fs.get_file(given.path, str(here))
        if out is not None and far(out):
            made = Path(folder) / "runs" / out.name
        yield here, made
        if made is not None and far(out) and made.is_dir():
            with reaching(out):
                _put(made, out)


def _put(folder: Path, out: Any) -> None:
    (out / SUMMARY).unlink(missing_ok=True)
    out.fs.makedirs(out.path, exist_ok=True)
    for file in sorted(folder.iterdir(), key=lambda one: one.name == SUMMARY):
        out.fs.put_file(str(file), (out / file.name).path)
