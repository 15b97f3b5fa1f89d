"""The trees of errors are those their modules draw, and whoever knows only builtins can catch them."""

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
    (one, module, root) for module, root in ROOTS.items() for one in vars(module).values()
    if isinstance(one, type) and one.__module__ == module.__name__
]  # fmt: skip


@pytest.mark.parametrize(("error", "module", "root"), NAMED, ids=lambda item: getattr(item, "__name__", ""))
def test_every_error_descends_from_its_root_stands_in_the_drawing_and_shows_its_message(error, module, root):
    assert issubclass(error, root) and (error.__name__ in module.__doc__.split() or error is root)
    assert str(error("say what to do")) == "say what to do" and str(error()) == ""


@pytest.mark.parametrize(
    ("error", "known"),
    [
        (cdcore.errors.InvalidMeshError, ValueError), (cdcore.errors.InvalidPoseError, ValueError),
        (cdcore.errors.InvalidSettingError, ValueError), (cdcore.errors.UnknownDetectorError, KeyError),
        (cdcore.errors.NotRecordedError, LookupError),
        (sessions.errors.TornFileError, sessions.errors.SessionFileError),
    ],
)  # fmt: skip
def test_who_knows_only_the_wider_error_can_catch_it(error, known):
    assert issubclass(error, known)
