"""Each error says what it is and descends from its root, and whoever knows only builtins can catch it."""

import pytest

import cdcore.errors
import replay.errors
import sessions.errors

ROOTS = {
    cdcore.errors: cdcore.errors.CollisionCoreError,
    sessions.errors: sessions.errors.SessionError,
    replay.errors: replay.errors.ReplayError,
}
"""Of each package: the error from which all of its errors descend."""

ERRORS_AND_ROOTS = [
    (error, root)
    for module, root in ROOTS.items()
    for error in vars(module).values()
    if isinstance(error, type) and error.__module__ == module.__name__
]


def test_every_error_descends_from_its_root_and_shows_its_message():
    """All errors of the three packages, made with a message and without one."""
    assert ERRORS_AND_ROOTS
    for error, root in ERRORS_AND_ROOTS:
        assert issubclass(error, root), error
        assert str(error("say what to do")) == "say what to do", error
        assert str(error()) == "", error


def test_every_error_has_a_docstring_of_its_own():
    """All errors of the three packages; ``vars`` has the docstring of the class itself, and None where it has none."""
    assert ERRORS_AND_ROOTS
    assert not [error for error, _ in ERRORS_AND_ROOTS if not vars(error)["__doc__"]]


@pytest.mark.parametrize(
    ("error", "wider_error"),
    [
        (cdcore.errors.InvalidMeshError, ValueError),
        (cdcore.errors.InvalidPoseError, ValueError),
        (cdcore.errors.InvalidSettingError, ValueError),
        (cdcore.errors.UnknownDetectorError, KeyError),
        (cdcore.errors.NotRecordedError, LookupError),
        (sessions.errors.TornFileError, sessions.errors.SessionFileError),
    ],
)
def test_wider_error_catches_the_narrower(error, wider_error):
    """``except`` with a builtin error, or the package's wider one, catches the error."""
    assert issubclass(error, wider_error)
