import inspect

from replay import errors


def test_every_error_hangs_in_the_tree_that_the_module_draws():
    for name, item in inspect.getmembers(errors, inspect.isclass):
        assert issubclass(item, errors.ReplayError)
        assert name in errors.__doc__ or item is errors.ReplayError
