"""Independent tasks in processes: named tasks, where one failure does not stop the others, and a crew that returns
results."""

import multiprocessing
import os
import threading
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, as_completed, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Final

from replay.errors import WorkerError

OnDone = Callable[[str, str], None]
"""Called with a name and what became of it: ``done``, ``kept`` or why it failed."""

Work = Callable[..., str]
"""A function of a module; gives back why it failed, or an empty string."""

Tasks = Mapping[str, tuple[Any, ...]]

ATTEMPTS: Final = 3
"""A task that ends its process this often is set aside."""


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

    for name in _attempted(work, tasks, jobs, note):
        note(name, f"its process was ended {ATTEMPTS} times, perhaps for want of memory")
    return failed


def answers_of(work: Callable[..., Any], tasks: Tasks, jobs: int, on_done: OnDone | None = None) -> dict[str, Any]:
    """Do every task as ``in_processes``; name -> what it gives back, in order of the tasks.

    Raises what a task raises; ``WorkerError``: tasks that ended their process each time, after all others are done.
    """
    answers: dict[str, Any] = {}

    def note(name: str, answer: Any) -> None:
        answers[name] = answer
        if on_done is not None:
            on_done(name, "done")

    if lost := _attempted(work, tasks, jobs, note):
        words = f"ended their process {ATTEMPTS} times, perhaps for want of memory; leave them out"
        raise WorkerError(f"{', '.join(lost)}: {words}")
    return {name: answers[name] for name in tasks}


def _attempted(work: Callable[..., Any], tasks: Tasks, jobs: int, note: Callable[[str, Any], None]) -> list[str]:
    """Do tasks, in this process if ``jobs`` is 1; return the names of those that ended their process each time."""
    if jobs <= 1:
        for name, arguments in tasks.items():
            note(name, work(*arguments))
        return []
    # A task may want more memory than is left beside others, so the last attempt is made with nothing beside it.
    lost = _pooled(work, tasks, min(jobs, len(tasks)), note, ATTEMPTS - 1)
    return [again for name in lost for again in _pooled(work, {name: tasks[name]}, 1, note, 1)]


def _pooled(
    work: Callable[..., Any], tasks: Tasks, jobs: int, note: Callable[[str, Any], None], attempts: int
) -> list[str]:
    """Do tasks in processes; return the names of those that ended their process at each of ``attempts``.

    Each process has a pool of its own: where one dies, only its task is asked again, after all others.
    """
    waiting, ended, lost = deque(tasks), Counter[str](), list[str]()
    pools = [_pool(1) for _ in range(jobs)]
    free, working = list(range(jobs)), dict[Future[Any], tuple[str, int]]()
    try:
        while waiting or working:
            while waiting and free:
                name, place = waiting.popleft(), free.pop()
                try:
                    working[pools[place].submit(work, *tasks[name])] = name, place
                except BrokenProcessPool:  # its process died idle: nobody's fault
                    waiting.appendleft(name)
                    pools[place] = _pool(1)
                    free.append(place)
            for finished in wait(working, return_when=FIRST_COMPLETED).done:
                name, place = working.pop(finished)
                free.append(place)
                if not isinstance(finished.exception(), BrokenProcessPool):
                    note(name, finished.result())
                    continue
                pools[place] = _pool(1)
                ended[name] += 1
                (waiting if ended[name] < attempts else lost).append(name)
    finally:
        for pool in pools:
            pool.shutdown(cancel_futures=True)
    return lost


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
