"""Sixty sessions: killed twice on the way, two processes end with the digest of one that was never disturbed."""

import os
import signal
import subprocess
import sys
import time

import pytest

from replay.batch import run_batch
from replay.study.made_up_class import make_class

SESSIONS = 60
SETTINGS = {"detectors": "hybrid", "oracle": "none", "picture": False}

SCRIPT = f"""
import sys
from pathlib import Path
from replay.batch import run_batch
if __name__ == "__main__":
    batch = run_batch(sorted(Path(sys.argv[1]).glob("*.mcap")), Path(sys.argv[2]), jobs=2, settings={SETTINGS!r})
    print(batch.digest, len(batch.kept), len(batch.failed))
"""


def finished(runs):
    return len([path for path in runs.glob("*/summary.json") if not path.parent.name.startswith(".")])


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")
def test_sixty_sessions_killed_twice_end_with_the_digest_of_one_process(tmp_path):
    assert make_class(tmp_path / "class", students=SESSIONS, seed=5, jobs=2) == {}
    sessions, runs = tmp_path / "class" / "sessions", tmp_path / "runs"
    script = tmp_path / "go.py"
    script.write_text(SCRIPT)
    command = [sys.executable, str(script), str(sessions), str(runs)]
    for least in (10, 30):
        batch = subprocess.Popen(command)
        limit = time.monotonic() + 300
        while finished(runs) < least and time.monotonic() < limit:
            assert batch.poll() is None, "the batch ended before it could be killed"
            time.sleep(0.05)
        os.kill(batch.pid, signal.SIGKILL)
        batch.wait()
        assert finished(runs) < SESSIONS
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    digest, kept, failed = done.stdout.split()
    assert int(kept) >= 30 and failed == "0"
    assert not list(runs.glob(".*.partial"))
    alone = run_batch(sorted(sessions.glob("*.mcap")), tmp_path / "alone", settings=SETTINGS)
    assert alone.digest == digest != ""
