"""The tree of errors is the one its module draws."""

import pytest

from cdcore import errors

NAMED = [item for item in vars(errors).values() if isinstance(item, type) and issubclass(item, Exception)]


@pytest.mark.parametrize("error", NAMED, ids=lambda item: item.__name__)
def test_every_error_descends_from_the_root_and_stands_in_the_drawing(error):
    assert issubclass(error, errors.CollisionCoreError)
    assert error.__name__ in errors.__doc__


@pytest.mark.parametrize("error", NAMED, ids=lambda item: item.__name__)
def test_the_message_is_shown_as_it_was_given(error):
    assert str(error("say what to do")) == "say what to do"


@pytest.mark.parametrize(
    ("error", "builtin"),
    [
        (errors.InvalidMeshError, ValueError),
        (errors.InvalidPoseError, ValueError),
        (errors.InvalidSettingError, ValueError),
        (errors.UnknownDetectorError, KeyError),
        (errors.NotRecordedError, LookupError),
    ],
)
def test_someone_who_knows_only_builtins_can_catch_it(error, builtin):
    assert issubclass(error, builtin)


def test_an_unknown_detector_without_a_message_prints_as_nothing():
    assert str(errors.UnknownDetectorError()) == ""
