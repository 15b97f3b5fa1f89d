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
    """All errors of three packages, made with a message and without one."""
    for error, root in ERRORS_AND_ROOTS:
        assert issubclass(error, root), error
        assert str(error("say what to do")) == "say what to do" and str(error()) == "", error


def test_every_error_has_a_docstring_of_its_own():
    """``__doc__`` of a class without a docstring is None; it is not inherited in ``vars``."""
    assert not [error for error, _ in ERRORS_AND_ROOTS if not vars(error)["__doc__"]]


@pytest.mark.parametrize(
    ("error", "builtin_or_wider_error"),
    [
        (cdcore.errors.InvalidMeshError, ValueError),
        (cdcore.errors.InvalidPoseError, ValueError),
        (cdcore.errors.InvalidSettingError, ValueError),
        (cdcore.errors.UnknownDetectorError, KeyError),
        (cdcore.errors.NotRecordedError, LookupError),
        (sessions.errors.TornFileError, sessions.errors.SessionFileError),
    ],
)
def test_wider_error_catches_the_narrower(error, builtin_or_wider_error):
    assert issubclass(error, builtin_or_wider_error)
