"""A good file of another program comes back from its session file; each mutant of it is read or named in a sentence.

So many of each kind of file, where 200 are too few:
``IMPORT_MUTANTS=10000 python -m pytest -m slow tests/sessions tests/replay/cli/test_scene.py -k mutants``
"""

import os
import sys
import time
import warnings
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from support.mutants import damaged_below_checksums

from sessions import read_session, write_session
from sessions.errors import ImportFileError, SessionError
from sessions.importers import import_session
from sessions.importers.ledger import ledger_of

MUTANTS = [15, pytest.param(int(os.environ.get("IMPORT_MUTANTS", "200")), marks=pytest.mark.slow)]
LONGEST_S = 10.0
FOR_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
CHANGES = ("os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.link", "os.symlink")
touched: list[str] = []


def _noted(event, arguments):
    if event in CHANGES or (event == "open" and isinstance(arguments[2], int) and arguments[2] & FOR_WRITING):
        touched.append(os.fsdecode(arguments[0]) if not isinstance(arguments[0], int) else "")


sys.addaudithook(_noted)


@contextmanager
def nothing_written(but=Path("none")):
    """Nothing anywhere is written, made, moved or removed, but the file named and its parts."""
    touched.clear()
    yield
    paths = [Path(path) for path in touched if path and "__pycache__" not in path]
    assert [path for path in paths if path.parent != but.parent or but.name not in path.name] == []


def round_trips(session, folder):
    """Every stamp, number and name of an import comes back from its file."""
    write_session(session, folder / "written.mcap")
    result = read_session(folder / "written.mcap")
    for piece in ("tracks", "fast_tracks", "hands", "gaze", "scalars"):
        expected = getattr(session, piece)
        assert list(getattr(result, piece)) == list(expected)
        for key, item in expected.items():
            for field, values in vars(item).items():
                np.testing.assert_array_equal(
                    vars(getattr(result, piece)[key])[field], values, err_msg=f"{key} {field}"
                )
    assert (result.events, result.intervals) == (session.events, session.intervals)


def books(session):
    """Losses and mergers in the ledger of an import."""
    return "; ".join(ledger_of(session.facts).sentences())


def refused(name, path, words, **options):
    """It is refused in one sentence that holds these words (a pattern) and names the source, if the words do not."""
    with pytest.raises(ImportFileError, match=words) as raised:
        import_session(name, path, **options)
    assert str(raised.value).isprintable() and (path.name in str(raised.value) or "importer" in words)


def tried(path, count, read, source=None, out=Path("none")):
    """A result or one sentence that names the file, of this many mutants: quick, and nothing is written but ``out``."""
    data = path.read_bytes()

    @settings(max_examples=count, database=None, suppress_health_check=[*HealthCheck])
    @given(damaged_below_checksums(data))
    def each_is_read_or_named(mutant):
        path.write_bytes(mutant)
        began = time.process_time()
        with warnings.catch_warnings(), nothing_written(out):
            warnings.simplefilter("error", RuntimeWarning)
            try:
                read()
            except SessionError as error:
                assert str(source or path) in str(error) and str(error).isprintable(), str(error)
        assert time.process_time() - began < LONGEST_S

    each_is_read_or_named()
    path.write_bytes(data)


def survive(name, path, count, source=None, **options):
    """Import this many mutants of a file, also as what it looks like; what is accepted can be kept.

    ``source``: the folder to import where that is not the file.
    """
    out = path.parent.parent / "imported.mcap"
    with TemporaryDirectory() as folder:
        round_trips(import_session(name, source or path, **options), Path(folder))

    def imported():
        with suppress(SessionError):
            import_session("auto", source or path)
        session = import_session(name, source or path, **options)
        assert len(session.frames) and dict(session.facts)
        with suppress(SessionError):  # a session that no file holds
            write_session(session, out)
            assert sum(map(len, read_session(out).blocks())) == len(session.frames)

    tried(path, count, imported, source, out)
