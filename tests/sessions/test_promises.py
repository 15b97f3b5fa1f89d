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
def new_file(tmp_path_factory):
    """The path of a session file of this version: 900 frames of three bodies, a mesh, an event and an interval."""
    frames = random_frames(seed=1, count=900, bodies=3, absent=0.05, odd=0.1)
    first = int(frames.stamp_ns[0])
    path = tmp_path_factory.mktemp("written") / "s.mcap"
    pieces = {"events": [Event(first, "grasp")], "intervals": [Interval(first, first + 9, "task", "stir")]}
    write_session(session_of(frames, meshes={"body 1": tetrahedron()}, **pieces), path)
    return path


@pytest.mark.skipif(not shutil.which("rerun"), reason="rerun is not on the path")
@pytest.mark.parametrize("version", ["new", "earlier"])
def test_rerun_finds_nothing_wrong_with_a_session_file(new_file, version):
    """The viewer's own check, ``rerun mcap check``, prints a row a channel: at least four with "ok", and no warning."""
    path = new_file if version == "new" else EARLIER
    process = subprocess.run(["rerun", "mcap", "check", str(path)], capture_output=True, text=True, timeout=120)
    assert process.returncode == 0, process.stdout
    rows = [line for line in process.stdout.splitlines() if "/" in line.rpartition(" ")[0] and "ok" in line]
    assert len(rows) >= 4, process.stdout
    assert not {"warning", "error", "fail"} & {word.strip(":").lower() for word in process.stdout.split()}


def test_session_file_of_earlier_version_is_read_exactly():
    """A file was written by commit 51c3acd0; the numbers are those of the program that made it, which is gone.

    It has 40 frames at 90 Hz of a wand, absent in frame 9, and a cup, lost in frame 5, sampled 3 ms before each frame.
    """
    session, frame = read_session(EARLIER), np.arange(40)
    frames = session.frames
    stamps = 1_700_000_000_000_000_000 + frame * 11_111_111
    wand, cup = 0, 1
    assert session.names == ("wand", "cup")
    assert frames.stamp_ns.tolist() == stamps.tolist()
    present = frame != 9
    wand_positions = np.stack([frame / 64, 1 + frame / 128, -frame / 32], axis=1)
    assert np.array_equal(frames.position[present, wand], wand_positions[present])
    assert np.array_equal(frames.quaternion_xyzw[present, wand, 1], np.sin(frame / 100)[present])
    assert (frames.sample_ns[:, cup] == stamps - 3_000_000).all()
    assert (frames.log_ns == stamps + 700).all()
    assert frames.status[9, wand] == Status.ABSENT
    assert frames.status[5, cup] == Status.LOST
    assert session.events == (Event(int(stamps[3]), name="grasp", message="takes", body="cup"),)
    assert session.intervals == (Interval(int(stamps[0]), int(stamps[9]), kind="task", name="stir"),)
    assert session.hands["student/right"].trigger.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert session.meshes["cup"].faces.tolist() == tetrahedron().faces.tolist()
    assert session.facts["pseudonym"] == "S1"


PROGRAM_THAT_RECORDS = """
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
    """Twelve programs that record at 90 Hz, and print each frame's stamp, are killed 0.3 to 1.2 s after the first.

    What they wrote is recovered; lost is the time from its last frame to the last frame that was printed.
    """
    random, lost_seconds = np.random.default_rng(5), []
    for number in range(KILLS):
        path = tmp_path / f"{number}.mcap"
        command = [sys.executable, "-c", PROGRAM_THAT_RECORDS, str(path)]
        process = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True)
        process.stdout.readline()
        time.sleep(float(random.uniform(0.3, 1.2)))
        process.kill()
        printed, _errors = process.communicate()
        last_printed_ns = int(printed.split()[-1])
        last_recovered_ns = recover(path.with_name(f"{path.name}.partial"), path).last_ns
        lost_seconds.append((last_printed_ns - last_recovered_ns) / 1e9)
    print(f"{KILLS} kills: at most {max(lost_seconds):.3f} s lost, {np.median(lost_seconds):.3f} s in the median")
    assert max(lost_seconds) <= 0.3


@pytest.mark.bench
def test_ten_minutes_are_read_and_written_at_library_speed(tmp_path):
    """Reading takes at most 3 times the processor time in which the format's library iterates over the messages.

    Writing takes at most twice that. The file has 54,000 frames of 12 bodies, ten minutes at 90 Hz.
    """
    frames, bodies = 54_000, 12
    random = np.random.default_rng(0)
    stamps = 1_700_000_000_000_000_000 + np.arange(frames) * 11_111_111
    poses = {f"body {k}": (random.normal(size=(frames, 3)), random.normal(size=(frames, 4))) for k in range(bodies)}
    session, path = Session.from_arrays(stamps, poses), tmp_path / "ten.mcap"

    def iterate_over_messages():
        with path.open("rb") as stream:
            return list(make_reader(stream).iter_messages())

    def least_seconds_of_three(work):
        times = []
        for _ in range(3):
            began = time.process_time()
            work()
            times.append(time.process_time() - began)
        return min(times)

    writing = least_seconds_of_three(lambda: write_session(session, path))
    reading = least_seconds_of_three(lambda: sum(map(len, read_session(path).blocks())))
    iterating = least_seconds_of_three(iterate_over_messages)
    print(
        f"reading {reading:.2f} s, {reading / iterating:.2f} times the library's plain iteration ({iterating:.2f} s); "
        f"writing {writing:.2f} s, {writing / iterating:.2f} times it"
    )
    assert reading <= 3 * iterating
    assert writing <= 2 * iterating
