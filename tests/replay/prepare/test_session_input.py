"""Accepted arguments for sessions and run folders, and the hint that each wrong argument gets."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from support.small_worlds import unit_cubes_on_x

from replay.errors import WrongInputError
from replay.prepare.session_input import require_folder, require_session

REMOTE = SimpleNamespace(joinpath=None)
"""A path of a remote file system is no PathLike, but joins further names."""


@pytest.mark.parametrize(
    ("given", "path", "hint"),
    [
        (unit_cubes_on_x({"a": [0]}), False, None),
        (unit_cubes_on_x({"a": [0]}), True, None),
        ("s.mcap", True, None),
        (REMOTE, True, None),
        ("s.mcap", False, "read_session"),
        (3, True, "from_arrays"),
        (3, False, "from_arrays"),
    ],
)
def test_session_or_its_path_is_accepted(given, path, hint):
    """``path``: whether a path is allowed too. A wrong argument gets a hint of the function that makes a session."""
    if hint is None:
        require_session(given, path=path)
    else:
        with pytest.raises(WrongInputError, match=hint):
            require_session(given, path=path)


def test_path_of_a_run_folder_is_accepted():
    """A text becomes a path, a remote path stays; a number is refused."""
    assert require_folder("run") == Path("run") and require_folder(REMOTE) is REMOTE
    with pytest.raises(WrongInputError, match="path of a run folder"):
        require_folder(3)
