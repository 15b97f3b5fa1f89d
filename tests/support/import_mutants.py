"""Mutants of a good file of another program: each ends in a session or in one sentence that names the file."""

import numpy as np
from support.fuzzing import mutated

from sessions.errors import SessionError
from sessions.importers import import_session


def survive(name, path, count, source=None):
    """Import this many mutants of a file; ``source``: the folder to import where that is not the file."""
    data = path.read_bytes()
    for number in range(count):
        path.write_bytes(mutated(data, np.random.default_rng([11, number])))
        try:
            session = import_session(name, source or path)
        except SessionError as error:
            assert str(source or path) in str(error) and "\n" not in str(error), (number, str(error))
        else:
            assert len(session.frames) and dict(session.facts)
    path.write_bytes(data)
