"""Independent pieces of work in processes: of named ones one that fails ends no other; a crew gives back results."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any

from replay.errors import WorkerError

Told = Callable[[str, str], None]
"""Called with a name and what became of it: ``done``, ``kept`` or why it failed."""

Work = Callable[..., str]
"""A function of a module; gives back why it failed, or an empty string."""

Tasks = Mapping[str, tuple[Any, ...]]


def in_processes(work: Work, tasks: Tasks, jobs: int, tell: Told) -> dict[str, str]:
    """Do every task; name -> why it failed, for those that did.

    Parameters
    ----------
    tasks : name -> arguments of ``work``.
    jobs : processes; 1 works in this one.
    tell : told of every task when it is finished.
    """
    failed: dict[str, str] = {}

    def note(name: str, why: str) -> None:
        if why:
            failed[name] = why
        tell(name, why or "done")

    if jobs <= 1 or len(tasks) <= 1:
        for name, arguments in tasks.items():
            note(name, work(*arguments))
        return failed
    for name in _pooled(work, tasks, min(jobs, len(tasks)), note):
        # A process that dies takes its pool along; alone, each task shows whether it was the one.
        for again in _pooled(work, {name: tasks[name]}, 1, note):
            note(again, "its process was ended, perhaps for want of memory")
    return failed


def untold(name: str, became: str) -> None:
    """Tell nobody."""
    del name, became


def _pooled(work: Work, tasks: Tasks, jobs: int, note: Told) -> list[str]:
    """Do tasks in processes; the names of those that a dying process took along."""
    lost = []
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_end_with_parent)
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


class Crew:
    """Processes that stay for several rounds of work, so that what each has loaded and compiled serves the next.

    Parameters
    ----------
    jobs : processes; 1 works in this one.
    """

    def __init__(self, jobs: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_end_with_parent) if jobs > 1 else None

    def __enter__(self) -> Crew:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def results(
        self, tasks: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]], done: Callable[[int], None]
    ) -> list[Any]:
        """What each function gives for its arguments, in order of the tasks; what one raises is raised here.

        Parameters
        ----------
        tasks : functions of modules, each with its arguments; the longest first keeps all processes busy.
        done : called with 1 whenever a task is finished.

        Raises
        ------
        WorkerError
            A process ended without an answer.
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
    if parent is not None:
        threading.Thread(target=_wait_and_end, args=(parent,), daemon=True).start()


def _wait_and_end(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
