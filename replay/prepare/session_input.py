"""What may be given for a session."""

from os import PathLike

from replay.errors import WrongInputError
from sessions import Session


def require_session(given: object, *, path: bool = True) -> None:
    """Refuse what is neither a session nor, where ``path``, the path of one, with a ``WrongInputError``."""
    # A path of another file system (universal-pathlib) is no PathLike.
    place = isinstance(given, str | PathLike) or hasattr(given, "joinpath")
    if isinstance(given, Session) or (path and place):
        return
    wanted = "a session or the path of one" if path else "a session"
    how = "of arrays make one with replay.Session.from_arrays(times_ns, {body: (positions, quaternions_xyzw)}, meshes)"
    if place:
        how = "read the file with replay.read_session(path)"
    raise WrongInputError(f"{wanted} is needed, not {type(given).__name__}; {how}")
