"""Hard case 43: a batch that is killed and gone on with has the digest of one that nobody disturbed."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.api.batch import run_batch
from sessions import write_session

SETTINGS = {"detectors": "exact", "oracle": "none", "picture": False}
SESSIONS = 8
GO = f"""
import sys
from pathlib import Path
from replay.api.batch import run_batch
if __name__ == "__main__":
    run_batch(sorted(Path(sys.argv[1]).glob("*.mcap")), Path(sys.argv[2]), settings={SETTINGS!r})
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")
def test_43_a_killed_batch_gone_on_with_has_the_digest_of_an_undisturbed_one(tmp_path):
    folder, out = tmp_path / "sessions", tmp_path / "killed"
    folder.mkdir()
    for k in range(SESSIONS):
        write_session(cubes({"a": [0.0] * 90, "b": list(np.linspace(3, 0.7 + 0.1 * k, 90))}), folder / f"s{k}.mcap")
    files = sorted(folder.glob("*.mcap"))
    script = tmp_path / "go.py"
    script.write_text(GO)
    batch = subprocess.Popen([sys.executable, str(script), str(folder), str(out)])
    limit = time.monotonic() + 60
    while not list(out.glob("s*/summary.json")) and batch.poll() is None and time.monotonic() < limit:
        time.sleep(0.002)
    batch.kill()
    batch.wait()
    resumed = run_batch(files, out, settings=SETTINGS)
    assert 1 <= len(resumed.kept) < SESSIONS == len(resumed.done)
    assert resumed.digest == run_batch(files, tmp_path / "whole", settings=SETTINGS).digest != ""
