"""The whole way of an audit, all outputs written: processor time beside python-fcl's loop."""

import json
import subprocess
import sys
from time import process_time

import numpy as np
import pytest
from support.bench_loads import ten_minutes
from support.processes import environment

from replay import audit
from sessions import write_session
from sessions.synthetic.scenes import make_scene_session

pytestmark = pytest.mark.bench

MEASURED = """
import json, sys, time
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from support.processes import peak_bytes
from replay import audit
from replay.running.runner import WRITING
from support.bench_loads import FclLoop
from support.bench_loads import make_workload

def seconds(call):
    begin = time.process_time()
    call()
    return time.process_time() - begin

class Stages:
    # processor time of each stage; what is written is told by how far writing is before it
    WRITTEN = {0: "frames", 3: "tables", 5: "picture", 15: "report"}

    def __init__(self):
        self.seconds = Counter()

    @contextmanager
    def stage(self, name, total=None, unit="frames"):
        step, mark = 0, time.process_time()

        def advance(count):
            nonlocal step, mark
            if name == WRITING:
                now = time.process_time()
                self.seconds[f"{name}: {self.WRITTEN[step]}"] += now - mark
                step, mark = step + count, now

        begin = mark
        yield advance
        if name != WRITING:
            self.seconds[name] += time.process_time() - begin

session, detectors, out = sys.argv[1:]
# what is not compiled on this machine yet is compiled here
audit(session, detectors=detectors, end=45.0, out=Path(out) / "warm")
loop = FclLoop(make_workload(5000))
yard = [seconds(lambda: loop.ask("bool")) for _ in range(3)]
spent, stages = [], []
for k in range(2):
    stages.append(Stages())
    spent.append(seconds(lambda: audit(session, detectors=detectors, out=Path(out) / str(k), progress=stages[-1])))
yard += [seconds(lambda: loop.ask("bool")) for _ in range(3)]
shares = {name: took / spent[-1] for name, took in stages[-1].seconds.items()}
print(json.dumps({"shares": shares, "seconds": min(spent), "loops": min(spent) / min(yard), "peak": peak_bytes()}))
"""

MOST_LOOPS = {
    ("ten minutes", "discrete"): 95.0,
    ("ten minutes", "hybrid-qaco"): 150.0,
    ("demo", "22.5Hz=discrete[rate_hz=22.5]"): 40.0,
}
"""(session, detectors) -> times of python-fcl's loop over a minute (booleans, 5,000 faces) that an audit may take."""
SESSIONS = {"ten minutes": ten_minutes, "demo": lambda: make_scene_session("bench-bumps")[0]}
MOST_BYTES = 900 * 2**20


@pytest.mark.parametrize(("name", "detectors"), MOST_LOOPS)
def test_audit_with_all_outputs_takes_a_multiple_of_the_loop(name, detectors, tmp_path):
    """An audit of a session, with report, tables and picture: the least processor time of two runs.

    It is a multiple ("loops") of the least of six passes of python-fcl's loop over a minute: at most 40 to 150, by
    session and detector (MOST_LOOPS). Its memory is at most 900 MiB.
    """
    write_session(SESSIONS[name](), tmp_path / "session.mcap")
    command = [sys.executable, "-c", MEASURED, str(tmp_path / "session.mcap"), detectors, str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, env=environment())
    assert ended.returncode == 0, ended.stderr
    result, most = json.loads(ended.stdout.splitlines()[-1]), MOST_LOOPS[name, detectors]
    print(
        f"\n{name}, {detectors}: {result['seconds']:.1f} s of processor time, {result['loops']:.0f} times the loop "
        f"(at most {most:.0f}), {result['peak'] / 2**20:.0f} MiB"
    )
    for stage, fraction in sorted(result["shares"].items(), key=lambda row: -row[1]):
        print(f"  {100 * fraction:4.0f} %  {stage}")
    assert result["loops"] <= most
    assert result["peak"] < MOST_BYTES


def test_default_detectors_take_at_most_twice_the_papers_time(tmp_path):
    """Ten minutes, audited with the default detectors and with the paper's, hybrid-qaco, alone: least of three runs.

    A first run of either, of 45 s, warms up.
    """
    recording = tmp_path / "session.mcap"
    write_session(ten_minutes(), recording)

    def seconds(detectors, **window):
        begin = process_time()
        audit(recording, detectors=detectors, out=tmp_path / "run", force=True, **window)
        return process_time() - begin

    for detectors in (None, "hybrid-qaco"):
        seconds(detectors, end=45.0)
    spent = np.array([[seconds(None), seconds("hybrid-qaco")] for _ in range(3)])
    default_s, paper_s = spent.min(axis=0)
    print(f"\nten minutes: {default_s:.1f} s by default, {paper_s:.1f} s with hybrid-qaco alone")
    assert default_s <= 2.0 * paper_s
