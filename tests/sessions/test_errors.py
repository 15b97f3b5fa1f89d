import inspect

import sessions.errors as errors


def classes():
    return [one for _, one in inspect.getmembers(errors, inspect.isclass)]


def test_every_error_of_sessions_can_be_caught_as_one():
    assert classes() and all(issubclass(one, errors.SessionError) for one in classes())


def test_the_tree_in_the_docstring_names_every_error():
    assert {one.__name__ for one in classes()} <= set(errors.__doc__.split())


def test_a_torn_file_is_a_file_that_cannot_be_read():
    assert issubclass(errors.TornFileError, errors.SessionFileError)
