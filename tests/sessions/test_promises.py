"""Promises of a session file: readable by others, read for ever, quick, and safe in a crash and from damage.

The slow ones print what they measured: ``python -m pytest -m slow -s tests/sessions/test_promises.py``.
"""

import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from support.processes import environment
from support.session_files import random_frames, session_of, tetrahedron

from sessions import Event, Interval, Session, read_session, recover, write_session
from sessions.model.session import Status

EARLIER = Path(__file__).parent / "mcap" / "earlier.mcap"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A session file, its frames, and when each was written."""
    frames = random_frames(seed=1, count=900, bodies=3, absent=0.05, odd=0.1)
    first = int(frames.stamp_ns[0])
    path = tmp_path_factory.mktemp("written") / "s.mcap"
    pieces = {"events": [Event(first, "grasp")], "intervals": [Interval(first, first + 9, "task", "stir")]}
    write_session(session_of(frames, meshes={"body 1": tetrahedron()}, **pieces), path)
    return path


@pytest.mark.skipif(not shutil.which("rerun"), reason="rerun is not on the path")
@pytest.mark.parametrize("which", ["written", "earlier"])
def test_rerun_finds_nothing_wrong_with_a_session_file(written, which):
    """``rerun mcap check`` prints a row a channel, at least four with "ok".

    The second file is of an earlier version.
    """
    path = written if which == "written" else EARLIER
    done = subprocess.run(["rerun", "mcap", "check", str(path)], capture_output=True, text=True, timeout=120)
    rows = [line.split() for line in done.stdout.splitlines() if "/" in line.rpartition(" ")[0] and "ok" in line]
    assert done.returncode == 0 and len(rows) >= 4, done.stdout
    assert not {"warning", "error", "fail"} & {word.strip(":").lower() for word in done.stdout.split()}


def test_session_file_of_earlier_version_is_read_exactly():
    """Written by 51c3acd0, whose container was its own; the numbers are those of the program that made it.

    40 frames of two bodies; the wand is absent in frame 9, and the cup lost in frame 5.
    """
    session, k = read_session(EARLIER), np.arange(40)
    frames = session.frames
    stamps = 1_700_000_000_000_000_000 + k * 11_111_111
    assert session.names == ("wand", "cup") and frames.stamp_ns.tolist() == stamps.tolist()
    present = k != 9
    assert np.array_equal(frames.position[present, 0], np.stack([k / 64, 1 + k / 128, -k / 32], axis=1)[present])
    assert np.array_equal(frames.quaternion_xyzw[present, 0, 1], np.sin(k / 100)[present])
    assert (frames.sample_ns[:, 1] == stamps - 3_000_000).all() and (frames.log_ns == stamps + 700).all()
    assert (frames.status[9, 0], frames.status[5, 1]) == (Status.ABSENT, Status.LOST)
    assert session.events == (Event(int(stamps[3]), "grasp", "takes", "cup"),)
    assert session.intervals == (Interval(int(stamps[0]), int(stamps[9]), "task", "stir"),)
    assert session.hands["student/right"].trigger.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert session.meshes["cup"].faces.tolist() == tetrahedron().faces.tolist() and session.facts["pseudonym"] == "S1"


RECORD = """
import sys, time
from sessions import Recorder
with Recorder(sys.argv[1], overwrite=True) as recorder:
    for k in range(2000):
        stamp = time.time_ns()
        poses = {f"body {b}": ((0.001 * k, b, 0), (0, 0, 0, 1)) for b in range(12)}
        recorder.poses(stamp, poses)
        print(stamp, flush=True)
        time.sleep(1 / 90)
"""
KILLS = 12


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no signal kills there")
def test_killed_recorder_loses_at_most_0_3_s(tmp_path):
    """Killed 0.3 to 1.2 s after its first frame; the last frame it printed against the last one recovered."""
    random, lost = np.random.default_rng(5), []
    for number in range(KILLS):
        path = tmp_path / f"{number}.mcap"
        command = [sys.executable, "-c", RECORD, str(path)]
        process = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True)
        process.stdout.readline()
        time.sleep(float(random.uniform(0.3, 1.2)))
        process.kill()
        last = int(process.communicate()[0].split()[-1])
        kept = recover(path.with_name(f"{path.name}.partial"), path).last_ns
        lost.append((last - kept) / 1e9)
    print(f"{KILLS} kills: at most {max(lost):.3f} s lost, {np.median(lost):.3f} s in the median")
    assert max(lost) <= 0.3


@pytest.mark.bench
def test_ten_minutes_are_read_and_written_at_library_speed(tmp_path):
    """At most 3 times the processor time in which the library iterates over the messages, and twice it to write."""
    frames, bodies = 54_000, 12
    random = np.random.default_rng(0)
    stamps = 1_700_000_000_000_000_000 + np.arange(frames) * 11_111_111
    poses = {f"body {k}": (random.normal(size=(frames, 3)), random.normal(size=(frames, 4))) for k in range(bodies)}
    session, path = Session.from_arrays(stamps, poses), tmp_path / "ten.mcap"

    def library():
        with path.open("rb") as stream:
            return list(make_reader(stream).iter_messages())

    def seconds(work):
        times = []
        for _ in range(3):
            began = time.process_time()
            work()
            times.append(time.process_time() - began)
        return min(times)

    writing = seconds(lambda: write_session(session, path))
    reading = seconds(lambda: sum(map(len, read_session(path).blocks())))
    iterating = seconds(library)
    print(
        f"reading {reading:.2f} s, {reading / iterating:.2f} times the library's plain iteration ({iterating:.2f} s); "
        f"writing {writing:.2f} s, {writing / iterating:.2f} times it"
    )
    assert reading <= 3 * iterating and writing <= 2 * iterating
