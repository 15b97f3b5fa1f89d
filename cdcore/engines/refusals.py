"""Errors where an engine is not installed or refuses a mesh; silences engines that print."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from io import StringIO

from cdcore.errors import InvalidMeshError, MissingEngineError


@contextmanager
def needs_engine(module: str, extra: str, note: str = "") -> Iterator[None]:
    """Import an engine in this context: MissingEngineError says how to install it; what it prints goes nowhere."""
    try:
        with quiet():
            yield
    except (ImportError, FileNotFoundError) as error:
        raise MissingEngineError(f'{module} is not installed; pip install "vrlab-replay[{extra}]"{note}') from error


@contextmanager
def mesh_may_be_refused(engine: str, refusal: type[Exception]) -> Iterator[None]:
    """Give meshes to an engine in this context: its own words say why it takes one not."""
    try:
        yield
    except refusal as error:
        message = " ".join(str(error).split())
        raise InvalidMeshError(f"{engine} refuses a mesh, repair it or leave it out: {message}") from error


@contextmanager
def quiet() -> Iterator[None]:
    """Nothing that this process writes to its standard output and error goes anywhere, also from C."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, ValueError, OSError):
            stream.flush()
    kept = [os.dup(number) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number in (1, 2):
            os.dup2(nowhere, number)
        # A notebook has streams of its own in their place.
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            yield
    finally:
        for number, before in zip((1, 2), kept, strict=True):
            os.dup2(before, number)
            os.close(before)
        os.close(nowhere)
