import json
import os
import platform
import signal
import subprocess
import time

import numpy as np
import pytest
from scipy.stats import binomtest

from replay.base import machine as module
from replay.base.machine import machine, processor, versions
from replay.base.processes import Crew, in_processes
from replay.base.progress import Silent
from replay.base.wilson import share, wilson
from replay.errors import WorkerError


def work(path, what):
    if what == "fail":
        return "it was not to be"
    if what == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "slow":
        time.sleep(0.5)
    with open(path, "a") as file:  # noqa: PTH123
        file.write("x")
    return ""


def tasks(folder, **kinds):
    return {name: (str(folder / name), what) for name, what in kinds.items()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_task_is_done_once_and_told_and_failures_are_named(tmp_path, jobs):
    told = []
    failed = in_processes(
        work, tasks(tmp_path, a="go", b="fail", c="slow", d="go"), jobs, lambda *one: told.append(one)
    )
    assert failed == {"b": "it was not to be"}
    assert sorted(told) == [("a", "done"), ("b", "it was not to be"), ("c", "done"), ("d", "done")]
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "x", "c": "x", "d": "x"}


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")
def test_a_task_that_takes_its_process_down_ends_no_other(tmp_path):
    failed = in_processes(work, tasks(tmp_path, a="go", b="die", c="slow", d="slow", e="go"), 2, lambda *one: None)
    assert set(failed) == {"b"} and "memory" in failed["b"]
    assert {path.name for path in tmp_path.iterdir()} == {"a", "c", "d", "e"}


def double(number, file=None):
    if file:
        with open(file, "a") as mark:  # noqa: PTH123
            mark.write(f"{os.getpid()} ")
    if number < 0:
        raise ValueError("nothing below zero")
    return 2 * number


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_crew_gives_results_in_order_of_the_tasks_round_after_round(jobs, tmp_path):
    told = []
    with Crew(jobs) as crew:
        for _ in range(2):
            tasks = [(double, (k, str(tmp_path / "pids"))) for k in range(5)]
            assert crew.results(tasks, told.append) == [0, 2, 4, 6, 8]
    assert told == [1] * 10
    pids = set((tmp_path / "pids").read_text().split())
    assert len(pids) <= jobs and (str(os.getpid()) in pids) == (jobs == 1)


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_task_raises_is_raised_to_who_asked(jobs):
    with Crew(jobs) as crew, pytest.raises(ValueError, match="nothing below zero"):
        crew.results([(double, (-1,)), (double, (1,))], lambda done: None)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")
def test_a_process_of_a_crew_that_dies_is_one_sentence(tmp_path):
    with Crew(2) as crew, pytest.raises(WorkerError, match="use --jobs 1"):
        crew.results([(work, (str(tmp_path / "a"), "die")), (work, (str(tmp_path / "b"), "slow"))], lambda done: None)


def test_silence_takes_any_stage_and_any_advance():
    with Silent().stage("detect", 10) as advance:
        assert advance(3) is None


def test_versions_name_python_and_what_decides_verdicts():
    found = versions()
    assert found["python"] == platform.python_version()
    assert {"numpy", "numba", "python-fcl", "rerun-sdk", "vrlab-replay"} <= set(found)


def test_the_machine_is_named_without_naming_user_or_host():
    text = json.dumps(machine())
    assert machine()["cores"] >= 1 and machine()["architecture"] == platform.machine()
    assert platform.node() == "" or platform.node() not in text


@pytest.mark.parametrize(
    ("listed", "named"),
    [
        ("processor\t: 0\nmodel name\t: AMD  EPYC 9\nmodel name\t: other\n", "AMD EPYC 9"),
        ("processor\t: 0\nBogoMIPS\t: 50\n", platform.machine()),
    ],
)
def test_a_linux_processor_is_named_by_its_model_or_its_architecture(listed, named, tmp_path, monkeypatch):
    monkeypatch.setattr(platform, "system", lambda: "Linux")
    monkeypatch.setattr(module, "LINUX_PROCESSORS", tmp_path / "cpuinfo")
    assert processor() == platform.machine()
    (tmp_path / "cpuinfo").write_text(listed)
    assert processor() == named


def test_a_mac_is_asked_and_one_that_does_not_answer_is_named_by_its_architecture(monkeypatch):
    monkeypatch.setattr(platform, "system", lambda: "Darwin")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess((), 0, "Apple M2\n"))
    assert processor() == "Apple M2"

    def absent(*_, **__):
        raise FileNotFoundError

    monkeypatch.setattr(subprocess, "run", absent)
    assert processor() == platform.machine()


def test_windows_names_its_processor_itself(monkeypatch):
    monkeypatch.setattr(platform, "system", lambda: "Windows")
    monkeypatch.setattr(platform, "processor", lambda: "Intel64 Family 6")
    assert processor() == "Intel64 Family 6"


@pytest.mark.parametrize(("count", "of"), [(0, 5), (5, 5), (1, 7), (865, 1000), (3, 100_000)])
def test_the_interval_is_the_one_of_scipy(count, of):
    expected = binomtest(count, of).proportion_ci(0.95, method="wilson")
    assert wilson(count, of) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_nothing_counted_leaves_everything_open():
    assert wilson(0, 0) == (0.0, 1.0)
    assert share(0, 0) == {"count": 0, "of": 0, "share": None, "low": 0.0, "high": 1.0}


def test_nineteen_of_twenty_intervals_hold_the_truth():
    counts = np.random.default_rng(0).binomial(200, 0.1, 2000)
    held = [low <= 0.1 <= high for low, high in (wilson(int(count), 200) for count in counts)]
    assert 0.93 < np.mean(held) < 0.97
