"""Accepted arguments for a session, and for a run folder."""

from os import PathLike
from pathlib import Path
from typing import Any

from replay.errors import WrongInputError
from sessions import Session


def require_session(given: object, *, path: bool = True) -> None:
    """Refuse what is neither a session nor, where ``path``, the path of one, with a ``WrongInputError``."""
    is_path = _is_path(given)
    if isinstance(given, Session) or (path and is_path):
        return
    expected_text = "a session or the path of one" if path else "a session"
    array_hint = (
        "of arrays make one with replay.Session.from_arrays(times_ns, {body: (positions, quaternions_xyzw)}, meshes)"
    )
    if is_path:
        array_hint = "read the file with replay.read_session(path)"
    raise WrongInputError(f"{expected_text} is needed, not {type(given).__name__}; {array_hint}")


def require_folder(given: Any) -> Path:
    """The path that is given for a run folder; ``WrongInputError`` where it is none."""
    if not _is_path(given):
        type_name = type(given).__name__
        raise WrongInputError(
            f"the path of a run folder is needed, not {type_name}; make one with replay.run(..., out=folder)"
        )
    return Path(given) if isinstance(given, str) else given


def _is_path(given: object) -> bool:
    # A path of another file system (universal-pathlib) is no PathLike.
    return isinstance(given, str | PathLike) or hasattr(given, "joinpath")
