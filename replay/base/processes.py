"""Independent tasks in processes: named tasks, where one failure does not stop the others, and a crew that returns
results."""

import multiprocessing
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from replay.errors import WorkerError

OnDone = Callable[[str, str], None]
"""Called with a name and what became of it: ``done``, ``kept`` or why it failed."""

Work = Callable[..., str]
"""A function of a module; gives back why it failed, or an empty string."""

Tasks = Mapping[str, tuple[Any, ...]]


def in_processes(work: Work, tasks: Tasks, jobs: int, on_done: OnDone | None = None) -> dict[str, str]:
    """Do every task (name -> arguments of ``work``); name -> why it failed, for those that did.

    ``jobs`` processes do them, this one if it is 1; ``on_done`` is called for every task when it is finished.
    """
    failed: dict[str, str] = {}

    def note(name: str, why: str) -> None:
        if why:
            failed[name] = why
        if on_done is not None:
            on_done(name, why or "done")

    if jobs <= 1 or len(tasks) <= 1:
        for name, arguments in tasks.items():
            note(name, work(*arguments))
        return failed
    for name in _pooled(work, tasks, min(jobs, len(tasks)), note):
        # A process that dies breaks its whole pool; run alone, each task shows whether it was the cause.
        for again in _pooled(work, {name: tasks[name]}, 1, note):
            note(again, "its process was ended, perhaps for want of memory")
    return failed


def _pooled(work: Work, tasks: Tasks, jobs: int, note: OnDone) -> list[str]:
    """Do tasks in processes; return the names of those that were lost with a dying process."""
    lost = []
    pool = _pool(jobs)
    try:
        waiting: dict[Future[str], str] = {pool.submit(work, *arguments): name for name, arguments in tasks.items()}
        for finished in as_completed(waiting):
            if isinstance(finished.exception(), BrokenProcessPool):
                lost.append(waiting[finished])
            else:
                note(waiting[finished], finished.result())
    finally:
        pool.shutdown(cancel_futures=True)
    return sorted(lost)


def _pool(jobs: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"), initializer=_end_with_parent)


class Crew:
    """``jobs`` processes (1: this one) that stay for several rounds, so that each compiles once."""

    def __init__(self, jobs: int) -> None:
        self._pool = _pool(jobs) if jobs > 1 else None

    def __enter__(self) -> "Crew":
        return self

    def __exit__(self, *error: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def results(
        self, tasks: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]], done: Callable[[int], None]
    ) -> list[Any]:
        """What each function returns, in order of the tasks; what one raises is raised here.

        Tasks are functions of modules with their arguments; the longest first keeps all processes busy. ``done`` is
        called with 1 whenever one is finished. Raises ``WorkerError``: a process ended without an answer.
        """
        if self._pool is None:
            found = []
            for work, arguments in tasks:
                found.append(work(*arguments))
                done(1)
            return found
        try:
            waiting = [self._pool.submit(work, *arguments) for work, arguments in tasks]
            for finished in as_completed(waiting):
                finished.result()
                done(1)
            return [one.result() for one in waiting]
        except BrokenProcessPool as error:
            raise WorkerError(
                "a process ended in the middle of its work, perhaps for want of memory; use --jobs 1"
            ) from error


def _end_with_parent() -> None:
    """A worker whose parent was killed ends too, instead of waiting for work for ever."""
    parent = multiprocessing.parent_process()

    def wait_and_end() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait_and_end, daemon=True).start()
