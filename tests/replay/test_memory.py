"""Ten minutes of twelve bodies fit in one gibibyte, and two hours in less than two."""

import json
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.processes import environment

from replay.prepare.holding_poses import MOST_POSES
from sessions import Frames, Session, Status, write_session
from sessions.geometry.solids import pointed_ball

BODIES, RATE_HZ = 12, 90.0
GIBIBYTE = 2**30

MEASURED = """
import json, sys
import replay
from replay.document.coding import plain_of
from support.processes import peak_bytes
result = replay.run(sys.argv[1], detectors="slow=discrete[rate_hz=22.5]", out=sys.argv[2], picture=sys.argv[3] == "yes")
print(json.dumps({"peak": peak_bytes(), "summary": plain_of(result.document)}))
"""


class Wandering:
    """Frames made when asked for: bodies that swing through each other, so that a long session is never in memory."""

    names = tuple(f"ball-{k:02d}" for k in range(BODIES))

    def __init__(self, count):
        self._count = count
        rng = np.random.default_rng(0)
        self._rate, self._phase = rng.uniform(0.05, 0.4, (BODIES, 3)), rng.uniform(0, 2 * np.pi, (BODIES, 3))

    def blocks(self, frames):
        for start in range(0, self._count, frames):
            yield self._block(np.arange(start, min(start + frames, self._count)))

    def _block(self, number):
        stamps = np.round(number * (1e9 / RATE_HZ)).astype(np.int64)
        time = (number / RATE_HZ)[:, None, None]
        position = np.sin(2 * np.pi * self._rate * time + self._phase) * [0.5, 0.2, 0.3]
        rotation = (
            Rotation.from_rotvec(np.sin(0.3 * time + self._phase).reshape(-1, 3))
            .as_quat()
            .reshape(*position.shape[:2], 4)
        )
        status = np.full(position.shape[:2], int(Status.VALID), dtype=np.uint8)
        sample = np.repeat(stamps[:, None], BODIES, axis=1)
        return Frames(self.names, stamps, stamps.copy(), sample, position, rotation, status)


def peak_of(frames, folder, *, picture):
    """Bytes that a run over so many frames takes at most."""
    mesh = pointed_ball(radius=0.05, splits=4)
    write_session(Session(Wandering(frames), dict.fromkeys(Wandering.names, mesh)), folder / "s.mcap")
    arguments = [str(folder / "s.mcap"), str(folder / "run"), "yes" if picture else "no"]
    command = [sys.executable, "-c", MEASURED, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert done.returncode == 0, done.stderr[-3000:]
    report = json.loads(done.stdout)
    assert report["summary"]["session"]["frames"] == frames
    assert report["summary"]["audit"]["slow"]["contacts"] > 100
    assert (folder / "run" / "run.rrd").is_file() is picture
    print(f"{frames} frames of {BODIES} bodies: {report['peak'] / GIBIBYTE:.2f} GiB")
    return report["peak"]


@pytest.mark.slow
def test_ten_minute_run_needs_less_than_1_gibibyte(tmp_path):
    """Ten minutes at 90 Hz of 12 bodies that swing through each other, with the picture of the run."""
    frames = 10 * 60 * 90
    assert peak_of(frames, tmp_path, picture=True) < GIBIBYTE


@pytest.mark.bench
def test_two_hour_run_needs_less_than_1_5_gibibytes(tmp_path):
    """Two hours at 90 Hz of 12 bodies, without a picture; a run may have so many poses."""
    frames = 2 * 3600 * 90
    assert frames * BODIES <= MOST_POSES
    assert peak_of(frames, tmp_path, picture=False) < 1.5 * GIBIBYTE
