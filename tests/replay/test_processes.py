import os
import signal
import time

import pytest

from replay.processes import in_processes


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
