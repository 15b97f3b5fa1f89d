import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from importlib.metadata import version

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
    """Marked slow because the import of Dask takes a second."""
    pytest.importorskip("distributed")
    with pytest.raises(WorkerError, match=r"no scheduler of Dask answers at nonsense://a .*or use --jobs"):
        Workers(1, "nonsense://a")


def test_missing_dask_is_a_clear_error(monkeypatch):
    """``None`` in sys.modules makes the import of Dask's package fail; two processes are requested."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(WorkerError, match=r"--jobs and --scheduler need distributed, .*cluster"):
        do_all(str, {"a": ()}, 2)


class Slots:
    """Two workers: a task that says so dies with its worker, always or at first; ``working`` says who did which."""

    def __init__(self, *_):
        self.working = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def ready_workers(self):
        return ["x", "y"]

    def submit(self, slot, work, arguments):
        self.working.append(arguments)
        return len(self.working) - 1, slot, work(*arguments)

    def finished_tasks(self, working):
        for task in working:
            number, position, (name, what) = task
            assert position == working[task]
            first = self.working.index((name, what)) == number
            dies = {"die": True, "die once": first}.get(what, False)
            yield task, workers.LOST_WORKER if dies else what.removeprefix("die once")


def test_task_that_kills_its_worker_is_tried_three_times(monkeypatch):
    """Task b always kills its worker, d once, c fails with a text; a and e are done.

    Retried alone after all others, b dies last; failures are those of b and c, and each task is reported once.
    """
    monkeypatch.setattr(workers, "Workers", Slots)
    reported, dead = [], []
    tasks = {"a": "", "b": "die", "c": "it was not to be", "d": "die once", "e": workers.KEPT_OUTCOME}
    failed = do_all(
        lambda *one: one,
        {name: (name, what) for name, what in tasks.items()},
        2,
        lambda *one: reported.append(one),
        on_died=lambda name, _: dead.append(name),
    )
    assert failed.keys() == {"b", "c"} and "ended 3 times" in failed["b"] and failed["b"].count(", ") == 3
    assert sorted(dead) == ["b", "b", "b", "d"] and dead[-1] == "b"
    assert sorted(name for name, _ in reported) == [*tasks]


@pytest.mark.slow
@needs_sigkill
def test_cluster_names_a_dying_worker_and_raises_task_errors():
    """Task b kills its process each of three times, on a worker with an address; what a task raises is raised here."""
    kill = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    failed = do_all(exec, {"a": ("",), "b": (kill,)}, 2)
    assert failed.keys() == {"b"} and failed["b"].count("tcp://127.0.0.1:") == 3
    with pytest.raises(TimeoutError, match="it took its time"):
        do_all(exec, {"a": ("raise TimeoutError('it took its time')",)}, 2)


@pytest.mark.slow
def test_scheduler_is_reached_by_address_and_needs_workers(monkeypatch):
    """Tasks are max("b", "c") and max("b", "a"), whose texts are failures; a second scheduler has no worker for 1 s."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        result = do_all(partial(max, "b"), {"a": ("c",), "b": ("a",)}, scheduler=cluster.scheduler_address)
        assert result == {"a": "c", "b": "b"}
    monkeypatch.setattr("replay.running.workers.PATIENCE_S", 1.0)
    nobody = LocalCluster(n_workers=0, dashboard_address=None)
    with nobody, pytest.raises(WorkerError, match="has had no worker for 1 s; start some with `dask worker ADDRESS"):
        do_all(max, {"a": ("2", "3")}, scheduler=nobody.scheduler_address)


@pytest.mark.slow
def test_worker_with_another_version_is_refused_before_any_work(tmp_path, monkeypatch):
    """The task would create a file; ``versions`` runs here and in the workers, and differs here alone."""
    this_process = os.getpid()

    def versions_but_1_0_here():
        return versions() | ({"vrlab-replay": "1.0"} if os.getpid() == this_process else {})

    monkeypatch.setattr(workers, "versions", versions_but_1_0_here)
    file_of_task = tmp_path / "created"
    with pytest.raises(WorkerError, match=f"has vrlab-replay {version('vrlab-replay')}, this machine 1.0"):
        do_all(open, {"a task": (str(file_of_task), "w")}, 2)
    assert not file_of_task.exists()


@pytest.mark.slow
@needs_sigkill
def test_local_workers_killed_while_starting_come_back():
    """Three processes are killed before a worker is ready; one is ready in the end, within 60 s."""
    from dask import config

    with Workers(1) as pool:
        limit, killed = time.monotonic() + 60, 0
        while not pool.ready_workers() or killed < 3:
            assert time.monotonic() < limit
            for item in spawned_by() if killed < 3 else []:
                item.kill()
                killed += 1
            time.sleep(0.1)
        # a restarted one is not watched either: profiles took 0.7 MB a session
        (worker,) = pool.ready_workers()
        assert pool.submit(worker, config.get, ("distributed.worker.profile.enabled",)).result() is False


def test_failed_task_does_not_stop_the_remaining_tasks():
    """A task is done if its function returns ""; other text is its failure."""
    reported, tasks = [], {"a": ("",), "b": ("it was not to be",), "c": ("",)}
    assert do_all(str, tasks, 1, lambda *one: reported.append(one)) == {"b": "it was not to be"}
    assert reported == [("a", "done"), ("b", "it was not to be"), ("c", "done")]


@pytest.mark.parametrize(
    ("tasks", "jobs", "scheduler", "needs_workers"),
    [
        ({}, 2, None, False),
        ({"a": ("",)}, 1, None, False),
        ({"a": ("",)}, 2, None, True),
        ({"a": ("",)}, 1, "tcp://x", True),
    ],
)
def test_workers_start_only_for_tasks_beside_this_process(monkeypatch, tasks, jobs, scheduler, needs_workers):
    """Workers are needed for tasks with more than one job, or with a scheduler's address."""
    started = []

    class Counted(Slots):
        def __enter__(self):
            started.append(self)
            raise WorkerError("counted")

    monkeypatch.setattr(workers, "Workers", Counted)
    with suppress(WorkerError):
        do_all(str, tasks, jobs, scheduler=scheduler)
    assert bool(started) == needs_workers


INTERRUPTED = """
import sys, time
from replay.running.workers import do_all
print("started", flush=True)
do_all(exec, {"a": ("import time; time.sleep(300)",), "b": ("import time; time.sleep(300)",)}, 2)
"""


@pytest.mark.slow
@needs_sigkill
@pytest.mark.parametrize("delay", [0.0, 1.0, 4.0])
def test_interrupted_work_ends_within_five_seconds_with_its_workers(delay):
    """SIGINT comes 0, 1 or 4 s after the workers were started."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", INTERRUPTED],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
    )
    assert process.stdout.readline() == b"started\n"
    time.sleep(delay)
    spawned = spawned_by(psutil.Process(process.pid))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=5.0)
    assert psutil.wait_procs(spawned, timeout=2.0)[1] == []


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
    ("scheduler", "present", "scaled"), [(None, ["a"], [2]), (None, ["a", "b"], []), ("tcp://x", ["a"], [])]
)
def test_missing_workers_of_this_machine_are_started_again(monkeypatch, scheduler, present, scaled):
    """Two workers are requested. Where one is missing, a cluster of this machine (no scheduler) is scaled to 2."""
    dask = FakeDask(monkeypatch, *present)
    assert Workers(2, scheduler).ready_workers() == present and dask.scaled == scaled


def test_worker_of_another_version_is_named_with_both_versions(monkeypatch):
    """Worker b has numpy 0.1, unlike worker a and this process."""
    dask = FakeDask(monkeypatch, "a", "b")
    dask.installed["b"] = {**workers.versions(), "numpy": "0.1"}
    with pytest.raises(WorkerError, match=r"the worker b has numpy 0\.1, this machine "):
        Workers(2).ready_workers()


def test_scheduler_without_a_worker_is_given_up_after_some_time(monkeypatch):
    """Patience is 300 s from the last moment at which a worker was there."""
    dask, clock = FakeDask(monkeypatch, "a"), [0.0]
    monkeypatch.setattr(workers.time, "monotonic", lambda: clock[0])
    pool = Workers(1, "tcp://x")
    clock[0] = 10.0 * workers.PATIENCE_S
    assert pool.ready_workers() == ["a"]
    dask.present.clear()
    clock[0] += 0.9 * workers.PATIENCE_S
    assert pool.ready_workers() == []
    clock[0] += 0.2 * workers.PATIENCE_S
    with pytest.raises(WorkerError, match="has had no worker for 300 s"):
        pool.ready_workers()


def test_answers_come_from_done_tasks_and_lost_workers(monkeypatch):
    """Worker "a" is there and "gone" is not, so its task is lost and cancelled; one still waits and has no answer.

    Task "slow" times out once in handing over its result; a TimeoutError that the task itself raised is raised again.
    """
    FakeDask(monkeypatch, "a")
    done, slow = FakeTask("x"), FakeTask(TimeoutError(), "late", status="pending")
    lost, waiting = FakeTask(is_done=False), FakeTask(is_done=False)
    answers = dict(Workers(1).finished_tasks({done: "a", slow: "a", lost: "gone", waiting: "a"}))
    assert answers == {done: "x", slow: "late", lost: workers.LOST_WORKER} and lost.cancelled
    failed = FakeTask(TimeoutError("its own"), status="error")
    with pytest.raises(TimeoutError, match="its own"):
        list(Workers(1).finished_tasks({failed: "a"}))


@pytest.mark.parametrize(("error", "is_at_once"), [(None, False), (ValueError, False), (KeyboardInterrupt, True)])
def test_workers_end_at_once_only_when_interrupted(monkeypatch, error, is_at_once):
    """``error``: what ends the work; on KeyboardInterrupt a shorter time is allowed, and Dask does not wait."""
    dask = FakeDask(monkeypatch, "a")
    Workers(1).__exit__(error)
    assert dask.closed[-1] == (workers.INTERRUPTED_CLOSING_S if is_at_once else workers.CLOSING_S)
    assert dask.shutdown_on_close != is_at_once
