"""Independent tasks in processes or on a cluster: named tasks, where one failure does not stop the others, and a crew
that returns results."""

import multiprocessing
import os
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, as_completed, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager
from importlib import import_module
from typing import Any, Final, Protocol

from replay.errors import WorkerError

OnDone = Callable[[str, str], None]
"""Called with a name and what became of it: ``done``, ``kept`` or why it failed."""

Work = Callable[..., str]
"""A function of a module; gives back why it failed, an empty string, or ``KEPT``: there was nothing to do."""

Tasks = Mapping[str, tuple[Any, ...]]

DONE, KEPT = "done", "kept"

ATTEMPTS: Final = 3
"""A task that ends its process this often is set aside."""

POOLS: Final = {"processes": "replay.base.processes:Processes", "dask": "replay.base.cluster:Dask"}
"""Who works: name -> ``module:Class`` of a ``Pool``, made with a number of jobs and the address of a scheduler."""


LOST: Final = object()
"""In place of the answer of a worker that ended without one."""


class Pool(AbstractContextManager["Pool"], Protocol):
    """Workers, each at a place of its own: where one dies, only its task is asked again."""

    def places(self) -> Iterable[Any]:
        """Where a worker is now."""

    def submit(self, place: Any, work: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """Give a task to the worker at a place; what stands for its answer."""

    def finished(self, working: Mapping[Any, Any]) -> Iterable[tuple[Any, Any]]:
        """Tasks of these (with their places) that are over, each with its answer or ``LOST``; may wait a while.

        Raises what a task raised.
        """


def in_processes(
    work: Work, tasks: Tasks, jobs: int, on_done: OnDone | None = None, scheduler: str | None = None
) -> dict[str, str]:
    """Do every task (name -> arguments of ``work``); name -> why it failed, for those that did.

    ``jobs`` processes do them, this one if it is 1; or the workers of a ``scheduler`` of Dask: its address, or
    ``local``. ``on_done`` is called for every task when it is finished.
    """
    failed: dict[str, str] = {}

    def note(name: str, became: str) -> None:
        if became and became != KEPT:
            failed[name] = became
        if on_done is not None:
            on_done(name, became or DONE)

    for name in _attempted(work, tasks, jobs, scheduler, note):
        note(name, f"its process was ended {ATTEMPTS} times, perhaps for want of memory")
    return failed


def answers_of(
    work: Callable[..., Any], tasks: Tasks, jobs: int, on_done: OnDone | None = None, scheduler: str | None = None
) -> dict[str, Any]:
    """Do every task as ``in_processes``; name -> what it gives back, in order of the tasks.

    Raises what a task raises; ``WorkerError``: tasks that ended their process each time, after all others are done.
    """
    answers: dict[str, Any] = {}

    def note(name: str, answer: Any) -> None:
        answers[name] = answer
        if on_done is not None:
            on_done(name, DONE)

    if lost := _attempted(work, tasks, jobs, scheduler, note):
        words = f"ended their process {ATTEMPTS} times, perhaps for want of memory; leave them out"
        raise WorkerError(f"{', '.join(lost)}: {words}")
    return {name: answers[name] for name in tasks}


def _attempted(
    work: Callable[..., Any], tasks: Tasks, jobs: int, scheduler: str | None, note: Callable[[str, Any], None]
) -> list[str]:
    """Do tasks, in this process if ``jobs`` is 1; return the names of those that ended their process each time."""
    if not tasks or (jobs <= 1 and scheduler is None):
        for name, arguments in tasks.items():
            note(name, work(*arguments))
        return []
    module, _, kind = POOLS["dask" if scheduler else "processes"].partition(":")
    row = getattr(import_module(module), kind)
    with row(min(jobs, len(tasks)), scheduler) as pool:
        lost = _pooled(pool, work, tasks, note, ATTEMPTS - 1)
    # A task may want more memory than is left beside others, so the last attempt is made with nothing beside it.
    for name in [*lost]:
        with row(1, scheduler) as pool:
            if not _pooled(pool, work, {name: tasks[name]}, note, 1):
                lost.remove(name)
    return lost


def _pooled(
    pool: Pool, work: Callable[..., Any], tasks: Tasks, note: Callable[[str, Any], None], attempts: int
) -> list[str]:
    """Do tasks; return the names of those that lost their worker at each of ``attempts``, made after all others."""
    waiting, ended, lost = deque(tasks), Counter[str](), list[str]()
    working = dict[Any, tuple[str, Any]]()
    while waiting or working:
        busy = [place for _, place in working.values()]
        for place in [one for one in pool.places() if one not in busy][: len(waiting)]:
            name = waiting.popleft()
            working[pool.submit(place, work, tasks[name])] = name, place
        for task, answer in pool.finished({task: place for task, (_, place) in working.items()}):
            name, _ = working.pop(task)
            if answer is not LOST:
                note(name, answer)
                continue
            ended[name] += 1
            (waiting if ended[name] < attempts else lost).append(name)
    return lost


class Processes(AbstractContextManager["Processes"]):
    """Processes of this machine, each in a pool of one, which breaks alone."""

    def __init__(self, jobs: int, _: str | None = None) -> None:
        self._pools = [_pool(1) for _ in range(jobs)]

    def __exit__(self, *error: object) -> None:
        for pool in self._pools:
            pool.shutdown(cancel_futures=True)

    def places(self) -> Iterable[int]:
        """As ``Pool``."""
        return range(len(self._pools))

    def submit(self, place: int, work: Callable[..., Any], arguments: tuple[Any, ...]) -> Future[Any]:
        """As ``Pool``; a process that died, at work or idle, is replaced."""
        try:
            return self._pools[place].submit(work, *arguments)
        except BrokenProcessPool:
            self._pools[place] = _pool(1)
            return self._pools[place].submit(work, *arguments)

    def finished(self, working: Mapping[Future[Any], int]) -> Iterable[tuple[Future[Any], Any]]:
        """As ``Pool``."""
        for task in wait(working, return_when=FIRST_COMPLETED).done:
            yield task, LOST if isinstance(task.exception(), BrokenProcessPool) else task.result()


def _pool(jobs: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"), initializer=_end_with_parent)


class Crew(AbstractContextManager["Crew"]):
    """``jobs`` processes (1: this one) that stay for several rounds, so that each compiles once."""

    def __init__(self, jobs: int) -> None:
        self._pool = _pool(jobs) if jobs > 1 else None

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
