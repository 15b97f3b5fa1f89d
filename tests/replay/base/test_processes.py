import os
import signal
import time
from pathlib import Path

import pytest

from replay.base.processes import Crew, answers_of, in_processes
from replay.base.progress import Silent
from replay.errors import WorkerError

needs_sigkill = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")


def work(path, what):
    if what == "fail":
        return "it was not to be"
    if what.startswith("die"):
        with open(f"{path} tries", "a+") as file:  # noqa: PTH123
            file.write("x")
            file.seek(0)
            if what == "die" or file.read() == "x":
                file.flush()
                os.kill(os.getpid(), signal.SIGKILL)
    if what == "meet" and not meets(Path(path)):
        return "nobody came"
    if what == "slow":
        time.sleep(0.5)
    with open(path, "a") as file:  # noqa: PTH123
        file.write(f"x{os.getpid()}")
    return ""


def meets(path):
    """Whether another task of this kind is at work at the same time."""
    (path.parent / f"here {path.name}").touch()
    limit = time.monotonic() + 30
    while len(list(path.parent.glob("here *"))) < 2:
        if time.monotonic() > limit:
            return False
        time.sleep(0.02)
    return True


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
    written = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert written.keys() == {"a", "c", "d"} and all(text.count("x") == 1 for text in written.values())
    assert {text == f"x{os.getpid()}" for text in written.values()} == {jobs == 1}


@needs_sigkill
def test_a_task_that_takes_its_process_down_is_asked_three_times_and_ends_no_other(tmp_path):
    failed = in_processes(work, tasks(tmp_path, a="go", b="die", c="slow", d="slow", e="go"), 2, lambda *one: None)
    assert set(failed) == {"b"} and "ended 3 times" in failed["b"]
    written = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert written.pop("b tries") == "xxx"
    assert written.keys() == {"a", "c", "d", "e"} and all(text.count("x") == 1 for text in written.values())


@needs_sigkill
def test_only_the_task_of_a_killed_process_is_asked_again_and_the_others_go_on_side_by_side(tmp_path):
    """The last two wait for each other: asked one by one, both would fail."""
    failed = in_processes(work, tasks(tmp_path, a="die once", b="slow", c="meet", d="meet"), 2)
    assert not failed
    written = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert written.pop("a tries") == "xx" and written.keys() >= {"a", "b", "c", "d"}
    assert all(written[name].count("x") == 1 for name in "abcd")


@needs_sigkill
def test_answers_are_in_order_of_the_tasks_and_what_ended_its_process_is_named_when_the_others_are_done(tmp_path):
    assert list(answers_of(double, {"b": (1,), "a": (2,)}, 2).items()) == [("b", 2), ("a", 4)]
    with pytest.raises(WorkerError, match="b: ended"):
        answers_of(work, tasks(tmp_path, a="go", b="die", c="go"), 2)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "b tries", "c"}


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


@needs_sigkill
def test_a_process_of_a_crew_that_dies_is_one_sentence(tmp_path):
    with Crew(2) as crew, pytest.raises(WorkerError, match="use --jobs 1"):
        crew.results([(work, (str(tmp_path / "a"), "die")), (work, (str(tmp_path / "b"), "slow"))], lambda done: None)


def test_silence_takes_any_stage_and_any_advance():
    with Silent().stage("detect", 10) as advance:
        assert advance(3) is None
