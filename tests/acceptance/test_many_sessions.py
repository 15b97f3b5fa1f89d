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
SESSIONS = int(os.environ.get("SESSIONS", "24"))
SECONDS = int(os.environ.get("SECONDS_EACH", 30 if ON_DEMAND else 10))
EVERY = "60 s" if ON_DEMAND else "6 sessions"
"""How often a worker is killed."""
SETTINGS = {"detectors": ["slow=discrete[rate_hz=22.5]"], "picture": False}

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
    visited = [time.process_time() - begun, os.getpid(), psutil.Process().memory_info().rss]
    out.with_name(f".{out.name}.seen").write_text(json.dumps(visited))
    return outcome


def drive(folder, out, every, where):
    """A program of its own: one batch; what it came to, and what was told when, with the memory then.

    ``every``: how often a worker is killed, ``6 sessions`` or ``60 s``, or ``""``. ``where``: ``here``, or the workers
    of a scheduler that is reached by its address.
    """
    if where == "elsewhere":
        from distributed import LocalCluster

        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
            driven_by(folder, out, every, {"scheduler": cluster.scheduler_address})
    else:
        driven_by(folder, out, every, {"jobs": 2})


def driven_by(folder, out, every, workers):
    """One batch by these workers, as ``drive`` says."""
    batch.batch_digest(Path(folder).parent / "alone", ["s0000"])  # what reads and joins tables is loaded once
    rows_of_run(Path(folder).parent / "alone", "s0000", "metrics")
    batch.run_session = run_measured
    reported, begun, me = [], time.monotonic(), psutil.Process()
    last, killed, chance = begun, 0, random.Random(7)
    often, _, unit = every.partition(" ")

    def on_done(name, result):
        nonlocal last, killed
        reported.append((name, result, time.monotonic() - begun, me.memory_info().rss))
        passed = time.monotonic() - last if unit == "s" else len(reported) - float(often) * killed
        if every and passed >= float(often) and len(reported) < 0.9 * SESSIONS:
            chance.choice(sorted(spawned_by(me), key=lambda item: item.pid)).kill()
            last, killed = time.monotonic(), killed + 1

    files, died = sorted(Path(folder).glob("*.mcap")), []
    died_too = {"on_done": on_done, "on_died": lambda *item: died.append(item)}
    made = batch.run_batch(files, out, settings=SETTINGS, **died_too, **workers)
    wall = time.monotonic() - begun
    print(
        json.dumps([made.digest, made.done, made.kept, made.failed, reported, killed, wall, me.memory_info().rss, died])
    )


@pytest.fixture(scope="module")
def sessions_and_digest(tmp_path_factory):
    """The sessions, and the digest that one process makes of them."""
    folder = tmp_path_factory.mktemp("many") / "sessions"
    folder.mkdir()
    for number in range(SESSIONS):
        make(folder / f"s{number:04}.mcap", number)
    alone = batch.run_batch(sorted(folder.glob("*.mcap")), folder.parent / "alone", settings=SETTINGS)
    assert not alone.failed
    return folder, alone.digest


def driven(folder, out, every, where="here"):
    """Output of a program of its own that runs all sessions of a folder."""
    arguments = [sys.executable, __file__, str(folder), str(out), every, where]
    done = subprocess.run(arguments, env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_killed_workers_do_not_change_the_digest(sessions_and_digest, tmp_path):
    """The program that drives the workers kills some; tables are those of one process, and nobody's memory grows."""
    folder, alone = sessions_and_digest
    names, out = [path.stem for path in sorted(folder.glob("*.mcap"))], tmp_path / "runs"
    digest, done, kept, failed, reported, killed, wall, memory, _ = driven(folder, out, EVERY)
    assert killed >= (min(5, wall // 75) if ON_DEMAND else 3) and failed == {} and digest == alone
    reported_names, states, *_ = zip(*reported, strict=True)
    assert done == names and kept == [] and sorted(reported_names) == names
    assert set(states) == {"done"}
    tables, expected = replay.read(out), replay.read(folder.parent / "alone")
    assert tables["episodes"].num_rows > SESSIONS
    untimed = {
        name: [item for item in table.column_names if not item.endswith("_ms")] for name, table in tables.items()
    }
    assert all(tables[name].select(kept).equals(expected[name].select(kept)) for name, kept in untimed.items())
    rows = tables["metrics"].select(["run", "detector"]).to_pylist()
    assert rows == [{"run": name, "detector": label} for name in names for label in ("slow", "exact")]
    assert not [*out.glob(".*.partial")]
    early = reported[len(reported) // 4][3]
    assert memory - early < FLAT_BYTES, f"{(memory - early) / 2**20:.1f} MiB more than after a quarter"
    visited = [json.loads((out / f".{item[0]}.seen").read_text()) for item in reported]
    gained = max(of_worker(visited, pid) for pid in {item[1] for item in visited})
    tenth = max(len(visited) // 10, 2)
    first, last = (median(item[0] for item in piece) for piece in (visited[:tenth], visited[-tenth:]))
    print(
        f"\n{len(done)} sessions in {wall:.1f} s, {killed} killed; the driver gained"
        f" {(memory - early) / 2**20:.1f} MiB, a worker {gained / 2**20:.1f} MiB; processor time of a session"
        f" {1000 * first:.0f} ms in the first tenth, {1000 * last:.0f} ms in the last"
    )
    assert gained < WORKER_BYTES
    assert last < GROWTH * first or not ON_DEMAND


@pytest.mark.slow
def test_killed_scheduler_workers_are_named_without_changing_the_digest(sessions_and_digest, tmp_path):
    """Two workers of a Dask scheduler, killed now and then: each death has a session and the worker's address."""
    folder, alone = sessions_and_digest
    digest, done, _, failed, reported, killed, *_, died = driven(folder, tmp_path / "runs", EVERY, "elsewhere")
    assert killed >= 2 and failed == {} and digest == alone and len(done) == len(reported) == SESSIONS
    assert died and {name for name, _ in died} <= set(done)
    assert all(address.startswith("tcp://") for _, address in died)


def of_worker(seen, pid):
    """Bytes that a worker gained from a quarter of its sessions to its last."""
    kept = [item[2] for item in seen if item[1] == pid]
    return kept[-1] - kept[len(kept) // 4]


if __name__ == "__main__":
    drive(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
