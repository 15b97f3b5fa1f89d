"""The module compiles kernels where it is run as a program, and nothing where it is imported."""

import gc
import runpy

import pytest


class CompilesError(Exception):
    """Raised by the first thing that the program asks of kernels."""


@pytest.fixture
def compilation_raises_an_error(monkeypatch):
    """The first stage that the program would build, to compile its kernels, raises `CompilesError`.

    The program switches the garbage collector off, which works again afterwards.
    """

    def begin(*_):
        raise CompilesError

    monkeypatch.setattr("cdcore.narrow.ill_posed.MarginStage", begin)
    yield
    gc.enable()


def test_kernels_compile_only_where_the_module_is_the_program(compilation_raises_an_error):
    """``compile_beside`` compiles, and so raises the error of a stand-in, as ``__main__``; an import does nothing."""
    runpy.run_module("cdcore.detectors.compile_beside", run_name="imported")
    with pytest.raises(CompilesError):
        runpy.run_module("cdcore.detectors.compile_beside", run_name="__main__")
