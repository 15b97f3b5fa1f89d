"""Named tasks, one after the other or by workers of Dask: on this machine, or on a cluster that is there already.

Each worker gets one task at a time, and a task is bound to its worker: who died with it is known, and nothing else is
asked again. Dask itself would blame a dead worker on all tasks that it had in store. One failure stops no other task.
"""

import logging
import multiprocessing
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, ExitStack, suppress
from typing import Any, Final

from replay import words
from replay.document.machine import VERSIONED_PACKAGES, versions
from replay.errors import WorkerError

OnDone = Callable[[str, str], None]
"""Called with a name and what became of it: ``done``, ``kept`` or why it failed."""

Work = Callable[..., str]
"""A function of a module; gives back why it failed, an empty string, or ``KEPT``: there was nothing to do."""

Tasks = Mapping[str, tuple[Any, ...]]

DONE_OUTCOME, KEPT_OUTCOME = "done", "kept"

MOST_ATTEMPTS: Final = 3
"""A task that ends its worker this often is set aside."""

LOST_WORKER: Final = object()
"""In place of the answer of a worker that ended without one."""

CLOSING_S: Final = 20.0
"""Seconds in which workers of this machine have to end."""

INTERRUPTED_CLOSING_S: Final = 1.0
"""Seconds that Dask has to close, each of its client and its workers, after Ctrl-C; then the workers are killed."""

CLUSTER_SETTINGS: Final[dict[str, Any]] = {
    # Dask's profile of each worker took 0.7 MB a session, 85 MiB in 130 of them, and nobody reads it.
    "distributed.worker.profile.enabled": False,
    # A worker starts as `python -c`, which would import modules of the current folder in place of those of the
    # environment. It gets the search path of this process, with the current folder only where that has it.
    "distributed.nanny.pre-spawn-environ": {"PYTHONSAFEPATH": "1"},
}

POLL_S: Final = 0.5
"""How often dead and new workers are looked for while nothing is finished."""

PATIENCE_S: Final = 300.0
"""How long a batch waits for a first worker, or for one to come back: a queue, or a busy machine, takes minutes."""


def do_all(
    work: Work,
    tasks: Tasks,
    jobs: int = 1,
    on_done: OnDone | None = None,
    scheduler: str | None = None,
    on_died: OnDone | None = None,
) -> dict[str, str]:
    """Do every task (name -> arguments of ``work``); name -> why it failed, for those that did.

    This process does them if ``jobs`` is 1 and no ``scheduler`` of Dask is named by its address. ``on_done`` is called
    for every task when it is finished, ``on_died`` with a task and the address of the worker that ended with it.
    """
    failure_of_name: dict[str, str] = {}
    deaths_of_name: dict[str, list[str]] = {}

    def died(task_name: str, worker: str) -> None:
        deaths_of_name.setdefault(task_name, []).append(worker)
        if on_died is not None:
            on_died(task_name, worker)

    def note(task_name: str, outcome: str) -> None:
        if outcome and outcome != KEPT_OUTCOME:
            failure_of_name[task_name] = outcome
        if on_done is not None:
            on_done(task_name, outcome or DONE_OUTCOME)

    if not tasks or (jobs <= 1 and scheduler is None):
        for name, arguments in tasks.items():
            note(name, work(*arguments))
        return failure_of_name
    with Workers(min(jobs, len(tasks)), scheduler) as workers:
        names_without_answer = _run_on_workers(workers, work, tasks, note, died, MOST_ATTEMPTS - 1)
    # A task may want more memory than is left beside others, so the last attempt is made with nothing beside it.
    for name in names_without_answer:
        with Workers(1, scheduler) as workers:
            if _run_on_workers(workers, work, {name: tasks[name]}, note, died, 1):
                exit_codes = ", ".join(deaths_of_name[name])
                note(
                    name,
                    f"its process was ended {MOST_ATTEMPTS} times, perhaps for want of memory (workers {exit_codes})",
                )
    return failure_of_name


def _run_on_workers(
    workers: "Workers", work: Work, tasks: Tasks, note: OnDone, died: OnDone, attempts: int
) -> list[str]:
    """Do tasks; return the names of those that lost their worker at each of ``attempts``, made after all others."""
    waiting_names, attempts_of_name, lost_names = deque(tasks), Counter[str](), list[str]()
    task_of_future = dict[Any, tuple[str, str]]()
    while waiting_names or task_of_future:
        busy_workers = [worker for _, worker in task_of_future.values()]
        free_workers = [worker for worker in workers.ready_workers() if worker not in busy_workers]
        for worker in free_workers[: len(waiting_names)]:
            name = waiting_names.popleft()
            task_of_future[workers.submit(worker, work, tasks[name])] = name, worker
        for task, answer in workers.finished_tasks({task: worker for task, (_, worker) in task_of_future.items()}):
            name, worker = task_of_future.pop(task)
            if answer is not LOST_WORKER:
                note(name, answer)
                continue
            died(name, worker)
            attempts_of_name[name] += 1
            (waiting_names if attempts_of_name[name] < attempts else lost_names).append(name)
    return lost_names


class Workers(AbstractContextManager["Workers"]):
    """``jobs`` workers of this machine, or those of a scheduler; who comes later works too, with the same versions.

    Raises ``WorkerError``: Dask is not installed, no scheduler, no worker, or other versions there.
    """

    def __init__(self, jobs: int, scheduler: str | None = None) -> None:
        try:
            import dask
            from distributed import Client, LocalCluster
        except ImportError as error:
            message = f"--jobs and --scheduler need {error.name}, which is not installed"
            raise WorkerError(f'{message}; pip install "vrlab-replay[cluster]"') from error
        self._cluster: Any = None
        self._jobs = jobs
        self._settings = ExitStack()
        self._foreign_processes = {process.pid for process in multiprocessing.active_children()}
        if scheduler is None:
            # The system ends who takes too much memory; a worker that Dask stops for it would wait for ever.
            cluster_settings: dict[str, Any] = {
                "memory_limit": 0,
                "dashboard_address": None,
                "silence_logs": logging.CRITICAL,
            }
            # Dask reads the settings whenever a worker starts, so they hold until the end.
            self._settings.enter_context(dask.config.set(CLUSTER_SETTINGS))
            try:
                self._cluster = LocalCluster(
                    n_workers=jobs, threads_per_worker=1, config=CLUSTER_SETTINGS, **cluster_settings
                )
            except KeyboardInterrupt:
                self._kill_workers()
                raise
        try:
            self._client = Client(self._cluster or scheduler, timeout=10)
        except (OSError, ValueError, TypeError) as error:
            todo = "start one with `dask scheduler`, or use --jobs for workers on this machine"
            raise WorkerError(f"no scheduler of Dask answers at {scheduler} ({error}); {todo}") from error
        self._checked_workers: set[str] = set()
        self._last_present = time.monotonic()

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        with self._settings:
            if kind is not None and issubclass(kind, KeyboardInterrupt):
                self._end_at_once()
                return
            try:
                self._close()
            except KeyboardInterrupt:
                self._end_at_once()
                raise

    def _close(self) -> None:
        self._client.close()
        if self._cluster is not None:
            # Of a worker that was killed while it started Dask may wait for ever for the word that it has closed.
            with suppress(TimeoutError):
                self._cluster.close(timeout=CLOSING_S)

    def _end_at_once(self) -> None:
        """Close what closes quickly and kill workers of this machine that work on; those of a scheduler finish."""
        with suppress(Exception):
            self._client.close(timeout=INTERRUPTED_CLOSING_S)
        if self._cluster is None:
            return
        with suppress(Exception):
            self._cluster.close(timeout=INTERRUPTED_CLOSING_S)
        self._kill_workers()
        # Else Dask waits for the killed ones once more when the interpreter ends.
        self._cluster.shutdown_on_close = False

    def _kill_workers(self) -> None:
        workers = [child for child in multiprocessing.active_children() if child.pid not in self._foreign_processes]
        for process in workers:
            process.kill()
        for process in workers:
            process.join(INTERRUPTED_CLOSING_S)

    def ready_workers(self) -> Iterable[str]:
        """Addresses of the workers that are there and have our versions."""
        present_workers = self._present_workers()
        if self._cluster is not None and len(present_workers) < self._jobs:
            # Dask gives up a worker that is killed while it starts; this brings it back.
            self._cluster.scale(self._jobs)
        if unchecked_workers := [worker for worker in present_workers if worker not in self._checked_workers]:
            for worker, installed_versions in self._client.run(
                versions, workers=unchecked_workers, on_error="return"
            ).items():
                if not isinstance(installed_versions, OSError):  # it died before it could say
                    _require_same(worker, installed_versions)
                    self._checked_workers.add(worker)
        if self._checked_workers & present_workers:
            self._last_present = time.monotonic()
        elif time.monotonic() - self._last_present > PATIENCE_S:
            todo = "start some with `dask worker ADDRESS --nthreads 1`; the same command goes on where it stopped"
            raise WorkerError(f"the scheduler has had no worker for {words.decimal(PATIENCE_S, 0)} s; {todo}")
        return sorted(self._checked_workers & present_workers)

    def submit(self, worker: str, work: Work, arguments: tuple[Any, ...]) -> Any:
        """Give a task to the worker of an address; what stands for its answer."""
        return self._client.submit(work, *arguments, workers=[worker], pure=False)

    def finished_tasks(self, worker_of_future: Mapping[Any, str]) -> Iterable[tuple[Any, Any]]:
        """Tasks that are over, each with its answer or ``LOST_WORKER``; may wait. ``worker_of_future``: addresses.

        Raises what a task raised.
        """
        from distributed import CancelledError, wait

        if not worker_of_future:
            time.sleep(POLL_S)
        with suppress(TimeoutError, CancelledError):
            wait([*worker_of_future], timeout=POLL_S, return_when="FIRST_COMPLETED")
        present_workers = self._present_workers()
        for task, worker in worker_of_future.items():
            if task.done() or worker not in present_workers:
                yield task, self._answer(task, worker)

    def _answer(self, task: Any, worker: str) -> Any:
        from distributed import CancelledError, KilledWorker

        while worker in self._present_workers():  # an answer that waits for us at a worker dies with it
            try:
                return task.result(timeout=10 * POLL_S)
            except (KilledWorker, CancelledError):
                break
            except TimeoutError:
                if task.status == "error":  # the task itself raised it
                    raise
        task.cancel()
        return LOST_WORKER

    def _present_workers(self) -> set[str]:
        try:
            return set(self._client.nthreads())
        except OSError as error:
            raise WorkerError(f"the scheduler is gone ({error}); the same command goes on where it stopped") from error


def _require_same(worker: str, installed_versions: Any) -> None:
    """Refuse a worker with other versions of what can change a verdict, a time or a file, or without it."""
    if isinstance(installed_versions, Exception):
        todo = "install it there, with the same versions"
        raise WorkerError(f"the worker {worker} cannot load vrlab-replay ({installed_versions}); {todo}")
    local_versions = versions()
    for name in VERSIONED_PACKAGES:
        if installed_versions.get(name) != local_versions.get(name):
            is_remote, is_here = (of.get(name, "none") for of in (installed_versions, local_versions))
            todo = "install the same everywhere"
            raise WorkerError(f"the worker {worker} has {name} {is_remote}, this machine {is_here}; {todo}")
