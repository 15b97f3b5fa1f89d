"""The module compiles kernels where it is run as a program, and nothing where it is imported."""

import gc
import runpy

import pytest


class CompilesError(Exception):
    """Raised by the first thing that the program asks of kernels."""


@pytest.fixture
def nothing_compiles(monkeypatch):
    """The program ends with `CompilesError` where it would begin; the garbage collector works again afterwards."""

    def begin(*_):
        raise CompilesError

    monkeypatch.setattr("cdcore.narrow.ill_posed.MarginStage", begin)
    yield
    gc.enable()


def test_kernels_compile_only_where_the_module_is_the_program(nothing_compiles):
    """A program would begin to compile, which a stand-in reports by `CompilesError`; an import does nothing."""
    runpy.run_module("cdcore.detectors.compile_beside", run_name="imported")
    with pytest.raises(CompilesError):
        runpy.run_module("cdcore.detectors.compile_beside", run_name="__main__")
