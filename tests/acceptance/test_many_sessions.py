"""Many sessions by processes and by a cluster, workers killed while they work: all done, none twice, equal answers.

``SESSIONS=1000 python -m pytest -m slow -s tests/acceptance/test_many_sessions.py`` asks it of a thousand, and whether
the last cost as much as the first; ``-m bench`` measures what a killed worker costs.
"""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import psutil
import pytest
from support.processes import environment, spawned_by
from support.small_worlds import unit_cubes_on_x

import replay
from replay.running import batch
from replay.show.results.data_set import rows_of_run
from sessions import write_session

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")

ON_DEMAND = "SESSIONS" in os.environ
"""Whether somebody asks for more than the usual few sessions."""
SESSIONS = int(os.environ.get("SESSIONS", "24"))
SECONDS = int(os.environ.get("SECONDS_EACH", 30 if ON_DEMAND else 10))
"""Length of each session."""
KILL_EVERY = "60 s" if ON_DEMAND else "6 sessions"
"""How often a worker is killed, up to nine tenths of the sessions: of 24 after 6, 12 and 18 of them."""

KILLS_OF_24 = 3
SETTINGS = {"detectors": ["slow=discrete[rate_hz=22.5]"], "picture": False}
"""Of every run; the reference, ``exact``, is added."""

FLAT_BYTES = (8 << 20) + SESSIONS * (32 << 10)
"""What the driver may gain from a quarter of its sessions to its end: 18 kB a session (2026-11-22), and noise."""

WORKER_BYTES = 48 << 20
"""What a worker may gain from a quarter of its sessions to its last."""

GROWTH = 1.1
"""Processor time of a session in the last tenth over that in the first; of 24 it is noise, and only printed."""


def make(path, number):
    """A cube that passes another one as no other number does; how often does not go with the number."""
    t, pace = np.arange(100 * SECONDS) / 100.0, 1.0 + number * 0.6180339887 % 1.0
    write_session(unit_cubes_on_x({"a": [0.0] * len(t), "b": [*(2.0 + 1.3 * np.sin(pace * t))]}), path)


run_session = batch.run_session


def run_measured(path, out, settings, request):
    """Does the work of a batch; leaves processor time, its own process and the memory of that beside the run folder."""
    begun = time.process_time()
    outcome = run_session(path, out, settings, request)
    measured = [time.process_time() - begun, os.getpid(), psutil.Process().memory_info().rss]
    out.with_name(f".{out.name}.seen").write_text(json.dumps(measured))
    return outcome


class Driven(NamedTuple):
    """Report of a program that ran a batch: of the batch, of each session in order of its end, and of itself.

    ``reported``: session, result, seconds since the begin, and the program's memory in bytes then. ``died``: session
    and address of each worker that died with one.
    """

    digest: str
    done: list
    kept: list
    failed: dict
    reported: list
    killed: int
    wall_seconds: float
    memory: int
    died: list


def drive(folder, out, kill_every, where):
    """The main function of a program of its own: runs one batch and prints a ``Driven``.

    ``kill_every``: how often a worker is killed, ``6 sessions`` or ``60 s``, or ``""``. ``where``: in ``processes``, or
    by the workers of a ``scheduler`` that is reached by its address.
    """
    if where == "scheduler":
        from distributed import LocalCluster

        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
            run_and_kill(folder, out, kill_every, {"scheduler": cluster.scheduler_address})
    else:
        run_and_kill(folder, out, kill_every, {"jobs": 2})


def run_and_kill(folder, out, kill_every, workers):
    """One batch by these workers, as ``drive`` says."""
    batch.batch_digest(Path(folder).parent / "alone", ["s0000"])  # what reads and joins tables is loaded once
    rows_of_run(Path(folder).parent / "alone", "s0000", "metrics")
    batch.run_session = run_measured
    reported, begun, me = [], time.monotonic(), psutil.Process()
    last, killed, chance = begun, 0, random.Random(7)
    often, _, unit = kill_every.partition(" ")

    def on_done(name, result):
        nonlocal last, killed
        reported.append((name, result, time.monotonic() - begun, me.memory_info().rss))
        passed = time.monotonic() - last if unit == "s" else len(reported) - float(often) * killed
        if kill_every and passed >= float(often) and len(reported) < 0.9 * SESSIONS:
            chance.choice(sorted(spawned_by(me), key=lambda item: item.pid)).kill()
            last, killed = time.monotonic(), killed + 1

    files, died = sorted(Path(folder).glob("*.mcap")), []
    callbacks = {"on_done": on_done, "on_died": lambda *item: died.append(item)}
    made = batch.run_batch(files, out, settings=SETTINGS, **callbacks, **workers)
    driven = Driven(
        digest=made.digest,
        done=made.done,
        kept=made.kept,
        failed=made.failed,
        reported=reported,
        killed=killed,
        wall_seconds=time.monotonic() - begun,
        memory=me.memory_info().rss,
        died=died,
    )
    print(json.dumps(driven))


@pytest.fixture(scope="module")
def sessions_and_digest(tmp_path_factory):
    """The folder of the sessions, and the digest of the tables that one process makes of them, in ``alone``."""
    folder = tmp_path_factory.mktemp("many") / "sessions"
    folder.mkdir()
    for number in range(SESSIONS):
        make(folder / f"s{number:04}.mcap", number)
    alone = batch.run_batch(sorted(folder.glob("*.mcap")), folder.parent / "alone", settings=SETTINGS)
    assert not alone.failed
    return folder, alone.digest


def driven(folder, out, kill_every, where="processes"):
    """Report of a program of its own that runs all sessions of a folder; for the arguments see ``drive``."""
    arguments = [sys.executable, __file__, str(folder), str(out), kill_every, where]
    ended = subprocess.run(arguments, env=environment(), capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr[-3000:]
    return Driven(*json.loads(ended.stdout.splitlines()[-1]))


@pytest.fixture(scope="module")
def batch_with_kills(sessions_and_digest, tmp_path_factory):
    """The folder of the runs that two processes make of the sessions, some of which are killed, and its report."""
    folder, _ = sessions_and_digest
    out = tmp_path_factory.mktemp("killed") / "runs"
    return out, driven(folder, out, KILL_EVERY)


@pytest.mark.slow
def test_killed_workers_do_not_change_the_digest(sessions_and_digest, batch_with_kills):
    """24 sessions in two processes; three times, after 6, 12 and 18 sessions, a process is killed.

    All sessions are done, each reported once, none failed or was there before; the digest is that of one process. Of
    many sessions (ON_DEMAND) one is killed every minute: five times at least, or once in 75 s.
    """
    folder, expected_digest = sessions_and_digest
    out, report = batch_with_kills
    names = [path.stem for path in sorted(folder.glob("*.mcap"))]
    assert report.killed >= (min(5, report.wall_seconds // 75) if ON_DEMAND else KILLS_OF_24)
    assert report.done == names and report.kept == [] and report.failed == {}
    reported_names, states, *_ = zip(*report.reported, strict=True)
    assert sorted(reported_names) == names and set(states) == {"done"}
    assert report.digest == expected_digest
    assert not [*out.glob(".*.partial")], "no run is left half written"


@pytest.mark.slow
def test_tables_after_kills_are_those_of_a_single_process(sessions_and_digest, batch_with_kills):
    """Tables of sessions run by two processes, some killed, and by one: all columns but times (``_ms``) are equal.

    Each session has a row of figures for either detector, in order.
    """
    folder, _ = sessions_and_digest
    out, report = batch_with_kills
    tables, expected = replay.read(out), replay.read(folder.parent / "alone")
    assert tables["episodes"].num_rows > SESSIONS
    for name, table in tables.items():
        untimed = [column for column in table.column_names if not column.endswith("_ms")]
        assert table.select(untimed).equals(expected[name].select(untimed)), name
    rows = tables["metrics"].select(["run", "detector"]).to_pylist()
    assert rows == [{"run": name, "detector": label} for name in report.done for label in ("slow", "exact")]


@pytest.mark.slow
def test_memory_and_time_of_a_batch_do_not_grow(batch_with_kills):
    """From a quarter of the sessions on, neither the driver nor a worker gains more than FLAT_BYTES and WORKER_BYTES.

    Of many sessions the last tenth costs as much processor time as the first, to 10 %; of 24 it is only printed.
    """
    out, report = batch_with_kills
    *_, memory_after_a_quarter = report.reported[len(report.reported) // 4]
    driver_gained = report.memory - memory_after_a_quarter
    measured = [json.loads((out / f".{name}.seen").read_text()) for name, *_ in report.reported]
    worker_gained = max(gained_by_worker(measured, pid) for pid in {pid for _, pid, _ in measured})
    tenth = max(len(measured) // 10, 2)
    first, last = (
        median(seconds for seconds, *_ in tenth_of_all) for tenth_of_all in (measured[:tenth], measured[-tenth:])
    )
    print(
        f"\n{len(report.done)} sessions in {report.wall_seconds:.1f} s, {report.killed} killed; the driver gained"
        f" {driver_gained / 2**20:.1f} MiB, a worker {worker_gained / 2**20:.1f} MiB; processor time of a session"
        f" {1000 * first:.0f} ms in the first tenth, {1000 * last:.0f} ms in the last"
    )
    assert driver_gained < FLAT_BYTES
    assert worker_gained < WORKER_BYTES
    assert last < GROWTH * first or not ON_DEMAND


@pytest.mark.slow
def test_killed_scheduler_workers_are_named_without_changing_the_digest(sessions_and_digest, tmp_path):
    """Two workers of a Dask scheduler, one of them killed now and then, make all runs with the digest of one process.

    A worker that dies with a session is reported with both: some are, and not all, as a kill may find a worker idle.
    """
    folder, expected_digest = sessions_and_digest
    report = driven(folder, tmp_path / "runs", KILL_EVERY, where="scheduler")
    assert report.killed >= KILLS_OF_24 or ON_DEMAND
    assert report.failed == {} and report.digest == expected_digest
    assert len(report.done) == len(report.reported) == SESSIONS
    assert report.died and {session for session, _ in report.died} <= set(report.done)
    assert all(address.startswith("tcp://") for _, address in report.died)


def gained_by_worker(measured, pid):
    """Bytes that a worker gained from a quarter of its sessions to its last."""
    memory = [rss for _, worker, rss in measured if worker == pid]
    return memory[-1] - memory[len(memory) // 4]


if __name__ == "__main__":
    drive(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
