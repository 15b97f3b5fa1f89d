"""Texts of a recording, read in a process of its own: Rerun's reader can end the process that reads a damaged file.

Among changed run folders one ended it with SIGABRT, without an exception (2026-11); why was not examined. The process
is started once and reads until this one ends.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Lock
from typing import Any, Final

from replay import words

MOST_READ_S: Final = 60.0
"""Of one read; a whole recording takes at most 0.04 s."""

_LOCK: Final = Lock()
_reader: _Reader | None = None


class RecordingDamagedError(Exception):
    """The reader gave up, ended or did not answer in time."""


def read_texts(recording: Path, path: str, column: str) -> tuple[bool, list[str]]:
    """Return whether an entity of a recording has rows, and its texts in columns whose name holds ``column``.

    Raises ``RecordingDamagedError``: the file is no whole recording.
    """
    global _reader
    with _LOCK:
        if _reader is None or not _reader.process.is_alive():
            _reader = _Reader()
        try:
            return _reader.ask(str(recording.absolute()), path, column)
        except RecordingDamagedError:
            if not _reader.answers:
                _reader.process.kill()
                _reader = None
            raise


class _Reader:
    """The process that reads, and the line to it; ``answers`` is false once it is of no use any more."""

    def __init__(self) -> None:
        spawn_context = multiprocessing.get_context("spawn")
        self._line, other_end = spawn_context.Pipe()
        self.process = spawn_context.Process(target=_serve, args=(other_end,), daemon=True)
        self.process.start()
        other_end.close()
        self.answers = True

    def ask(self, *question: str) -> tuple[bool, list[str]]:
        """Send a question and wait for its answer."""
        self.answers = False
        try:
            self._line.send(question)
            if not self._line.poll(MOST_READ_S):
                raise RecordingDamagedError(f"no answer within {words.decimal(MOST_READ_S, 0)} s")
            answer = self._line.recv()
        except (EOFError, OSError) as error:
            raise RecordingDamagedError("the reader ended") from error
        self.answers = True
        if isinstance(answer, str):
            raise RecordingDamagedError(answer)
        has_rows, texts = answer
        return has_rows, texts


def _serve(line: Connection) -> None:
    """Answer questions until the line is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Rerun's reader says there how it failed; the process that asks says it in a sentence.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    while True:
        try:
            recording, path, column = line.recv()
        except EOFError:
            return
        line.send(_texts_of(recording, path, column))


def _texts_of(recording: str, path: str, column: str) -> Any:
    """The answer of ``read_texts``, or why there is none."""
    from rerun.chunk import RrdReader

    try:
        RrdReader(recording).recordings()
        rrd_chunks = RrdReader(recording).stream().filter(content=path).to_chunks()
        record_batches = [chunk.to_record_batch() for chunk in rrd_chunks]
        column_values = [
            batch.column(name)[0].as_py() for batch in record_batches for name in batch.schema.names if column in name
        ]
        return bool(record_batches), [text for (text,) in column_values]
    except Exception as error:  # a library's reader of a file from anybody may fail with anything
        return f"{type(error).__name__}: {error}"
