"""Many sessions by processes and by a cluster, workers killed while they work: all done, none twice, equal answers.

``SESSIONS=1000 python -m pytest -m slow -s tests/acceptance/test_many_sessions.py`` asks it of a thousand.
"""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from statistics import mean

import numpy as np
import psutil
import pytest
from support.peak_memory import environment
from support.small_worlds import cubes

import replay
from replay.api.batch import batch_digest, run_batch
from sessions import write_session

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught"),
]

SESSIONS = int(os.environ.get("SESSIONS", "40"))
SECONDS = 30 if "SESSIONS" in os.environ else 10
KILLED_AFTER_S = 60.0
"""How often a worker is killed; of the forty of CI, after every tenth session."""
SETTINGS = {"detectors": ["slow=discrete[rate_hz=22.5]"], "picture": False}

FLAT_BYTES = (8 << 20) + SESSIONS * (32 << 10)
"""What the driver may gain from a quarter of its sessions to its end: 18 kB a session (2026-11-22), and noise."""


def make(path, number):
    """A cube that passes another one now and then, as no other number does."""
    t = np.arange(100 * SECONDS) / 100.0
    write_session(cubes({"a": [0.0] * len(t), "b": [*(2.0 + 1.3 * np.sin((1.0 + number / 997.0) * t))]}), path)


def drive(folder, out, scheduler, kill):
    """A program of its own: one batch; what it came to, and what was told when, with the memory then."""
    batch_digest(Path(folder).parent / "alone", ["s0000"])  # what reads tables is loaded once
    told, begun, me = [], time.monotonic(), psutil.Process()
    last, killed, chance = begun, 0, random.Random(7)

    def on_done(name, became):
        nonlocal last, killed
        told.append((name, became, time.monotonic() - begun, me.memory_info().rss))
        due = time.monotonic() - last > KILLED_AFTER_S if "SESSIONS" in os.environ else len(told) % 10 == 0
        if kill and due and len(told) < 0.9 * SESSIONS:
            alive = [one for one in me.children(recursive=True) if "spawn_main" in " ".join(one.cmdline())]
            chance.choice(sorted(alive, key=lambda one: one.pid)).kill()
            last, killed = time.monotonic(), killed + 1

    files = sorted(Path(folder).glob("*.mcap"))
    batch = run_batch(files, out, jobs=2, scheduler=scheduler, settings=SETTINGS, on_done=on_done)
    wall = time.monotonic() - begun
    answer = [batch.digest, batch.done, batch.kept, batch.failed, told, killed, wall, me.memory_info().rss]
    print(json.dumps(answer), flush=True)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The sessions, and the digest that one process makes of them."""
    folder = tmp_path_factory.mktemp("many") / "sessions"
    folder.mkdir()
    for number in range(SESSIONS):
        make(folder / f"s{number:04}.mcap", number)
    alone = run_batch(sorted(folder.glob("*.mcap")), folder.parent / "alone", settings=SETTINGS)
    assert not alone.failed
    return folder, alone.digest


def driven(folder, out, scheduler, kill):
    words = [sys.executable, __file__, str(folder), str(out), scheduler or "", str(int(kill))]
    done = subprocess.run(words, env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("scheduler", [None, "local"], ids=["processes", "dask"])
def test_all_are_done_once_with_the_digest_of_one_process_though_workers_are_killed(made, tmp_path, scheduler):
    folder, alone = made
    names = [path.stem for path in sorted(folder.glob("*.mcap"))]
    digest, done, kept, failed, told, killed, wall, memory = driven(folder, tmp_path / "runs", scheduler, True)
    assert killed >= (5 if "SESSIONS" in os.environ else 3) and failed == {} and digest == alone
    assert done == names and kept == [] and sorted(one[0] for one in told) == names
    assert {one[1] for one in told} == {"done"}
    rows = replay.read(tmp_path / "runs")["metrics"].to_pylist()
    assert sorted((row["run"], row["detector"]) for row in rows) == sorted(
        (name, label) for name in names for label in ("exact", "slow")
    )
    assert not [*(tmp_path / "runs").glob(".*.partial")]
    early = told[len(told) // 4][3]
    assert memory - early < FLAT_BYTES, f"{(memory - early) / 2**20:.1f} MiB more than after a quarter"
    times, tenth = [0.0, *(one[2] for one in told)], max(len(told) // 10, 2)
    steps = np.diff(times)
    first, last = mean(steps[tenth : 2 * tenth]), mean(steps[-tenth:])  # the very first load the compiled kernels
    print(
        f"\n{scheduler or 'processes'}: {len(done)} sessions in {wall:.1f} s, {killed} killed; the driver gained"
        f" {(memory - early) / 2**20:.1f} MiB; {first:.2f} s a session in the second tenth, {last:.2f} s in the last"
    )


if __name__ == "__main__":
    drive(sys.argv[1], Path(sys.argv[2]), sys.argv[3] or None, sys.argv[4] == "1")
