"""A good file of another program comes back from its session file; each mutant of it is read or named in a sentence.

``IMPORT_MUTANTS=10000 python -m pytest -m "" tests/sessions/importers -k mutants`` tries so many of each kind of file.
"""

import os
import time
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from support.fuzzing import mutated

from sessions import read_session, write_session
from sessions.errors import SessionError
from sessions.importers import import_session

MUTANTS = [15, pytest.param(int(os.environ.get("IMPORT_MUTANTS", "500")), marks=pytest.mark.slow)]
LONGEST_S = 10.0


def round_trips(session, folder):
    """Every stamp, number and name of an import comes back from its file."""
    write_session(session, folder / "written.mcap")
    found = read_session(folder / "written.mcap")
    for part in ("tracks", "hands", "gaze", "scalars"):
        expected = getattr(session, part)
        assert list(getattr(found, part)) == list(expected)
        for key, one in expected.items():
            for field, values in vars(one).items():
                np.testing.assert_array_equal(vars(getattr(found, part)[key])[field], values, err_msg=f"{key} {field}")
    assert (found.events, found.intervals) == (session.events, session.intervals)


def survive(name, path, count, source=None, **options):
    """Import this many mutants of a file, a fifth of them as what they look like; what is accepted can be kept.

    ``source``: the folder to import where that is not the file.
    """
    data, out = path.read_bytes(), path.parent.parent / "imported.mcap"
    with TemporaryDirectory() as folder:
        round_trips(import_session(name, source or path, **options), Path(folder))
    there = sorted([*path.parent.rglob("*")])
    for number in range(count):
        path.write_bytes(mutated(data, np.random.default_rng([11, number])))
        began = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                session = import_session("auto", source or path) if number % 5 == 4 else None
            except SessionError as error:
                assert str(error).isprintable(), (number, str(error))
            try:
                session = import_session(name, source or path, **options)
            except SessionError as error:
                assert str(source or path) in str(error) and str(error).isprintable(), (number, str(error))
            else:
                assert len(session.frames) and dict(session.facts)
                kept(session, out, number)
        assert time.process_time() - began < LONGEST_S, (number, "slow")
    path.write_bytes(data)
    assert sorted([*path.parent.rglob("*")]) == there, "an import writes nothing"


def kept(session, out, number):
    """A session comes back from a file with as many frames, or is refused in a sentence."""
    try:
        write_session(session, out)
    except SessionError as error:
        assert str(error).isprintable(), (number, str(error))
    else:
        assert sum(map(len, read_session(out).blocks())) == len(session.frames), number
