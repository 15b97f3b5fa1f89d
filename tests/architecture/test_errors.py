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
NAMED = [
    (one, root)
    for module, root in ROOTS.items()
    for one in vars(module).values()
    if isinstance(one, type) and one.__module__ == module.__name__
]


def test_every_error_descends_from_its_root_and_shows_its_message():
    for error, root in NAMED:
        assert issubclass(error, root) and "__doc__" in vars(error), error
        assert str(error("say what to do")) == "say what to do" and str(error()) == "", error


@pytest.mark.parametrize(
    ("error", "known"),
    [
        (cdcore.errors.InvalidMeshError, ValueError),
        (cdcore.errors.InvalidPoseError, ValueError),
        (cdcore.errors.InvalidSettingError, ValueError),
        (cdcore.errors.UnknownDetectorError, KeyError),
        (cdcore.errors.NotRecordedError, LookupError),
        (sessions.errors.TornFileError, sessions.errors.SessionFileError),
    ],
)
def test_own_errors_are_subclasses_of_the_builtin_errors(error, known):
    assert issubclass(error, known)
