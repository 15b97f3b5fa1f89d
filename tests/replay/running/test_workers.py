import os
import re
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from functools import partial
from importlib.metadata import version
from types import SimpleNamespace
from unittest.mock import Mock

import psutil
import pytest
from support.processes import spawned_by

from replay.document.machine import versions
from replay.errors import WorkerError
from replay.running import workers
from replay.running.workers import Workers, do_all

needs_sigkill = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")


@pytest.mark.slow
def test_scheduler_that_does_not_answer_is_named():
    """An address of no scheduler; marked slow because the import of Dask takes a second."""
    pytest.importorskip("distributed")
    with pytest.raises(WorkerError, match=r"no scheduler of Dask answers at nonsense://a .*or use --jobs"):
        Workers(1, "nonsense://a")


def test_missing_dask_is_a_clear_error(monkeypatch):
    """``None`` in sys.modules makes the import of Dask's package fail; two processes are requested."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(WorkerError, match=r"--jobs and --scheduler need distributed, .*cluster"):
        do_all(str, {"a": ()}, jobs=2)


class TwoWorkers:
    """Stands for Dask's workers x and y, which do a task (name, what becomes of it) at once.

    ``die``: the worker dies with it; ``die once``: only at the first attempt; else it is the task's own outcome.
    """

    def __init__(self, *_):
        self.working = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def ready_workers(self):
        return ["x", "y"]

    def submit(self, worker, work, arguments):
        self.working.append(arguments)
        return len(self.working) - 1, worker, work(*arguments)

    def finished_tasks(self, working):
        for task in working:
            number, worker, (name, fate) = task
            assert worker == working[task]
            is_first = self.working.index((name, fate)) == number
            dies = {"die": True, "die once": is_first}.get(fate, False)
            yield task, workers.LOST_WORKER if dies else fate.removeprefix("die once")


def test_task_that_kills_its_worker_is_tried_three_times(monkeypatch):
    """Task b always kills its worker, d once, c fails with a text; a is done, and e kept as it was.

    Tried alone after all others, b dies last; failures are those of b and c, and each task is reported once. The
    failure of b names three workers.
    """
    monkeypatch.setattr(workers, "Workers", TwoWorkers)
    reported, died = [], []
    fates = {"a": "", "b": "die", "c": "it was not to be", "d": "die once", "e": workers.KEPT_OUTCOME}
    failed = do_all(
        lambda name, fate: (name, fate),
        {name: (name, fate) for name, fate in fates.items()},
        jobs=2,
        on_done=lambda name, outcome: reported.append(name),
        on_died=lambda name, worker: died.append(name),
    )
    assert failed.keys() == {"b", "c"}
    assert "ended 3 times" in failed["b"]
    assert len(re.findall(r"\b[xy]\b", failed["b"])) == 3
    assert sorted(died) == ["b", "b", "b", "d"] and died[-1] == "b"
    assert sorted(reported) == ["a", "b", "c", "d", "e"]


@pytest.mark.slow
@needs_sigkill
def test_cluster_names_a_dying_worker_and_raises_task_errors():
    """Task b kills its process each of three times, on a worker with an address; what a task raises is raised here."""
    kill_own_process = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    failed = do_all(exec, {"a": ("",), "b": (kill_own_process,)}, jobs=2)
    assert failed.keys() == {"b"}
    assert failed["b"].count("tcp://127.0.0.1:") == 3
    with pytest.raises(TimeoutError, match="it took its time"):
        do_all(exec, {"a": ("raise TimeoutError('it took its time')",)}, jobs=2)


@pytest.mark.slow
def test_scheduler_is_reached_by_its_address():
    """Tasks are max("b", "c") and max("b", "a"): what a task returns is the text of its failure."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        failed = do_all(partial(max, "b"), {"a": ("c",), "b": ("a",)}, scheduler=cluster.scheduler_address)
    assert failed == {"a": "c", "b": "b"}


@pytest.mark.slow
def test_scheduler_without_workers_is_given_up(monkeypatch):
    """A scheduler on this machine has no worker for 1 s, which is all the patience here."""
    from distributed import LocalCluster

    monkeypatch.setattr("replay.running.workers.PATIENCE_S", 1.0)
    nobody = LocalCluster(n_workers=0, dashboard_address=None)
    with nobody, pytest.raises(WorkerError, match="has had no worker for 1 s; start some with `dask worker ADDRESS"):
        do_all(max, {"a": ("2", "3")}, scheduler=nobody.scheduler_address)


@pytest.mark.slow
def test_worker_with_another_version_is_refused_before_any_work(tmp_path, monkeypatch):
    """The task would create a file; ``versions`` runs here and in the workers, and says 1.0 here alone."""
    this_process = os.getpid()

    def versions_but_1_0_here():
        return versions() | ({"vrlab-replay": "1.0"} if os.getpid() == this_process else {})

    monkeypatch.setattr(workers, "versions", versions_but_1_0_here)
    file_of_task = tmp_path / "created"
    with pytest.raises(WorkerError, match=f"has vrlab-replay {version('vrlab-replay')}, this machine 1.0"):
        do_all(open, {"a task": (str(file_of_task), "w")}, jobs=2)
    assert not file_of_task.exists()


@pytest.mark.slow
@needs_sigkill
def test_local_workers_killed_while_starting_come_back():
    """Three processes are killed before a worker is ready; one is ready in the end, within 60 s.

    Dask's profile of it is off, as of those it starts first: profiles took 0.7 MB a session.
    """
    from dask import config

    with Workers(1) as pool:
        limit, killed = time.monotonic() + 60, 0
        while not pool.ready_workers() or killed < 3:
            assert time.monotonic() < limit
            for process in spawned_by() if killed < 3 else []:
                process.kill()
                killed += 1
            time.sleep(0.1)
        (worker,) = pool.ready_workers()
        assert pool.submit(worker, config.get, ("distributed.worker.profile.enabled",)).result() is False


def test_failed_task_does_not_stop_the_remaining_tasks():
    """A task is done if its function, here ``str``, returns ""; other text is its failure."""
    reported, tasks = [], {"a": ("",), "b": ("it was not to be",), "c": ("",)}
    failed = do_all(str, tasks, jobs=1, on_done=lambda name, outcome: reported.append((name, outcome)))
    assert failed == {"b": "it was not to be"}
    assert reported == [("a", "done"), ("b", "it was not to be"), ("c", "done")]


@pytest.mark.parametrize(
    ("tasks", "jobs", "scheduler", "needs_workers"),
    [
        pytest.param({}, 2, None, False, id="no task"),
        pytest.param({"a": ("",)}, 1, None, False, id="one job"),
        pytest.param({"a": ("",)}, 2, None, True, id="two jobs"),
        pytest.param({"a": ("",)}, 1, "tcp://x", True, id="one job and a scheduler"),
    ],
)
def test_workers_start_only_for_tasks_beside_this_process(monkeypatch, tasks, jobs, scheduler, needs_workers):
    """Workers are needed for tasks with more than one job, or with a scheduler's address; their start fails here."""
    start = Mock(side_effect=WorkerError("started"))
    monkeypatch.setattr(workers, "Workers", start)
    with pytest.raises(WorkerError, match="started") if needs_workers else nullcontext():
        do_all(str, tasks, jobs, scheduler=scheduler)
    assert start.called == needs_workers


INTERRUPTED = """
import sys, time
from replay.running.workers import do_all
print("started", flush=True)
do_all(exec, {"a": ("import time; time.sleep(300)",), "b": ("import time; time.sleep(300)",)}, 2)
"""
"""A program that has two workers sleep for five minutes."""


@pytest.mark.slow
@needs_sigkill
@pytest.mark.parametrize("seconds_until_interrupt", [0.0, 1.0, 4.0])
def test_interrupted_work_ends_within_five_seconds_with_its_workers(seconds_until_interrupt):
    """SIGINT comes 0, 1 or 4 s after two workers were started that sleep for five minutes."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", INTERRUPTED],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
    )
    assert process.stdout.readline() == b"started\n"
    time.sleep(seconds_until_interrupt)
    worker_processes = spawned_by(psutil.Process(process.pid))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=5.0)
    _ended, still_alive = psutil.wait_procs(worker_processes, timeout=2.0)
    assert still_alive == []


class FakeDask:
    """A scheduler or cluster in memory: who is present, what each worker has installed, and what was asked of it."""

    def __init__(self, monkeypatch, *present):
        pytest.importorskip("distributed")
        self.present, self.installed, self.scaled, self.closed = set(present), {}, [], []
        self.shutdown_on_close = True
        monkeypatch.setattr("distributed.Client", lambda *_, **__: self)
        monkeypatch.setattr("distributed.LocalCluster", lambda **_: self)
        monkeypatch.setattr("distributed.wait", lambda *_, **__: None)

    def nthreads(self):
        return dict.fromkeys(self.present, 1)

    def run(self, function, workers, on_error):
        return {worker: self.installed.get(worker, function()) for worker in workers}

    def scale(self, count):
        self.scaled.append(count)

    def close(self, timeout=None):
        self.closed.append(timeout)


class FakeTask:
    """A future whose result is one of these in turn; an exception is raised."""

    def __init__(self, *results, status="finished", is_done=True):
        self.results, self.status, self.is_done, self.cancelled = [*results], status, is_done, False

    def done(self):
        return self.is_done

    def result(self, timeout):
        result = self.results.pop(0)
        if isinstance(result, Exception):
            raise result
        return result

    def cancel(self):
        self.cancelled = True


@pytest.mark.parametrize(
    ("scheduler", "present", "scaled_to"),
    [
        pytest.param(None, ["a"], [2], id="one of two missing on this machine"),
        pytest.param(None, ["a", "b"], [], id="none missing"),
        pytest.param("tcp://x", ["a"], [], id="one of two missing on a cluster of others"),
    ],
)
def test_missing_workers_of_this_machine_are_started_again(monkeypatch, scheduler, present, scaled_to):
    """Two workers are requested, and so many are present; a cluster of this machine (no scheduler) is scaled to two.

    A cluster of others has its own scheduler, which is not told how many workers to have.
    """
    dask = FakeDask(monkeypatch, *present)
    assert Workers(2, scheduler).ready_workers() == present
    assert dask.scaled == scaled_to


def test_worker_of_another_version_is_named_with_both_versions(monkeypatch):
    """Worker b has numpy 0.1, unlike worker a and this process."""
    dask = FakeDask(monkeypatch, "a", "b")
    dask.installed["b"] = {**workers.versions(), "numpy": "0.1"}
    with pytest.raises(WorkerError, match=r"the worker b has numpy 0\.1, this machine "):
        Workers(2).ready_workers()


def test_scheduler_without_a_worker_is_given_up_after_some_time(monkeypatch):
    """Patience is 300 s from the last moment at which a worker was there; the clock is set by hand."""
    dask, clock = FakeDask(monkeypatch, "a"), SimpleNamespace(seconds=0.0)
    monkeypatch.setattr(workers.time, "monotonic", lambda: clock.seconds)
    pool = Workers(1, "tcp://x")
    clock.seconds = 3000.0
    assert pool.ready_workers() == ["a"]
    dask.present.clear()
    clock.seconds += 270.0
    assert pool.ready_workers() == []
    clock.seconds += 60.0
    with pytest.raises(WorkerError, match="has had no worker for 300 s"):
        pool.ready_workers()


def test_answers_come_from_done_tasks_and_lost_workers(monkeypatch):
    """Four tasks on workers "a", which is present, and "gone", which is not: its task is lost and cancelled.

    Of the tasks on "a" one is done, one times out once in handing over its result, and one waits and has no answer.
    """
    FakeDask(monkeypatch, "a")
    done, slow = FakeTask("x"), FakeTask(TimeoutError(), "late", status="pending")
    lost, waiting = FakeTask(is_done=False), FakeTask(is_done=False)
    answers = dict(Workers(1).finished_tasks({done: "a", slow: "a", lost: "gone", waiting: "a"}))
    assert answers == {done: "x", slow: "late", lost: workers.LOST_WORKER}
    assert lost.cancelled and not waiting.cancelled


def test_error_that_a_task_raised_is_raised_again(monkeypatch):
    """Here a TimeoutError, which Dask raises too, where a result is slow to come: the task has ended with an error."""
    FakeDask(monkeypatch, "a")
    failed = FakeTask(TimeoutError("its own"), status="error")
    with pytest.raises(TimeoutError, match="its own"):
        list(Workers(1).finished_tasks({failed: "a"}))


@pytest.mark.parametrize(("error", "is_at_once"), [(None, False), (ValueError, False), (KeyboardInterrupt, True)])
def test_workers_end_at_once_only_when_interrupted(monkeypatch, error, is_at_once):
    """``error``: what ends the work; on KeyboardInterrupt a shorter time is allowed, and Dask does not wait."""
    dask = FakeDask(monkeypatch, "a")
    Workers(1).__exit__(error)
    *_, seconds_to_close = dask.closed
    assert seconds_to_close == (workers.INTERRUPTED_CLOSING_S if is_at_once else workers.CLOSING_S)
    assert dask.shutdown_on_close != is_at_once
