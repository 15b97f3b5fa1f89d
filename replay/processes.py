"""Independent pieces of work in processes: one that fails, or takes its process down, ends no other."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.process import BaseProcess
from typing import Any

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


def _end_with_parent() -> None:
    """A worker whose parent was killed ends too, instead of waiting for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_wait_and_end, args=(parent,), daemon=True).start()


def _wait_and_end(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
