"""A good file of another program comes back from its session file; each mutant of it is read or named in a sentence."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from support.fuzzing import mutated

from sessions import read_session, write_session
from sessions.errors import SessionError
from sessions.importers import import_session


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


def survive(name, path, count, source=None):
    """Import this many mutants of a file; ``source``: the folder to import where that is not the file."""
    data = path.read_bytes()
    with TemporaryDirectory() as folder:
        round_trips(import_session(name, source or path), Path(folder))
    for number in range(count):
        path.write_bytes(mutated(data, np.random.default_rng([11, number])))
        try:
            session = import_session(name, source or path)
        except SessionError as error:
            assert str(source or path) in str(error) and "\n" not in str(error), (number, str(error))
        else:
            assert len(session.frames) and dict(session.facts)
    path.write_bytes(data)
