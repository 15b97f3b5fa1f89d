"""Accepted arguments for sessions and run folders, and the hint that each wrong argument gets."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from support.small_worlds import unit_cubes_on_x

from replay.errors import WrongInputError
from replay.prepare.session_input import require_folder, require_session

SESSION = unit_cubes_on_x({"a": [0]})

REMOTE = SimpleNamespace(joinpath=None)
"""A path of a remote file system is no PathLike, but joins further names."""


@pytest.mark.parametrize(
    ("argument", "path_is_allowed"),
    [
        pytest.param(SESSION, False, id="a session"),
        pytest.param(SESSION, True, id="a session where a path may stand too"),
        pytest.param("s.mcap", True, id="a path as text"),
        pytest.param(REMOTE, True, id="a remote path"),
    ],
)
def test_session_or_its_path_is_accepted(argument, path_is_allowed):
    """No error is raised; whether the path leads to a file is not looked at."""
    require_session(argument, path=path_is_allowed)


@pytest.mark.parametrize(
    ("argument", "path_is_allowed", "function"),
    [
        pytest.param("s.mcap", False, "read_session", id="a path where none is allowed"),
        pytest.param(3, True, "from_arrays", id="a number"),
        pytest.param(3, False, "from_arrays", id="a number where no path is allowed"),
    ],
)
def test_wrong_session_is_refused_with_a_function_that_helps(argument, path_is_allowed, function):
    """A path can be read, anything else must be built from arrays: the error names the function that does it."""
    with pytest.raises(WrongInputError, match=function):
        require_session(argument, path=path_is_allowed)


def test_path_of_a_run_folder_is_accepted():
    """A text becomes a path, a remote path stays; a number is refused."""
    assert require_folder("run") == Path("run")
    assert require_folder(REMOTE) is REMOTE
    with pytest.raises(WrongInputError, match="path of a run folder"):
        require_folder(3)
