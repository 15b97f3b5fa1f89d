"""Processor time of runs with effects against another checkout of this repository, in turns.

    python .ci/effect_turns.py OTHER [--turns 7] [--scene titration flame-test]

runs each made-up experiment in a process of its own, of this checkout and of OTHER by turns, and prints the median of
the ratios with the least and the greatest, and whether PHREEQC was imported. A process makes the session, runs it once
so that everything is imported and compiled, and times the runs that follow: the fastest counts.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

HERE = Path(__file__).parents[1]
SCENES = ("flame-test", "titration", "carbonate-titration", "silver-chloride", "marble", "ammonia-calorimetry")
RUNS = 3
PROGRAM = f"""
import json, sys
from time import process_time
import replay
session, _ = replay.synthetic_session(sys.argv[1])
replay.run(session, detectors=())
seconds = []
for _ in range({RUNS}):
    start = process_time()
    replay.run(session, detectors=())
    seconds.append(process_time() - start)
rate = (len(session.frames.stamp_ns) - 1) / (1e-9 * float(session.frames.stamp_ns[-1] - session.frames.stamp_ns[0]))
print(json.dumps([min(seconds), "phreeqc" in sys.modules, rate]))
"""


def timed(checkout, scene):
    """Processor seconds of a run, whether PHREEQC was imported, and frames a second."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, scene],
        cwd=checkout,
        env=os.environ | {"PYTHONPATH": str(checkout)},
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"{checkout}: {done.stderr.strip().splitlines()[-1]}")
    return json.loads(done.stdout.splitlines()[-1])


def row(scene, other, turns):
    """A line of the table: seconds of both, and their ratio over all turns."""
    pairs = [(timed(HERE, scene), timed(other, scene)) for _ in range(turns)]
    ratios = sorted(mine[0] / theirs[0] for mine, theirs in pairs)
    mine, theirs = (median(pair[side][0] for pair in pairs) for side in (0, 1))
    imported, rate = pairs[0][0][1:]
    return (
        f"{scene}, {rate:.0f} Hz: {mine:.3f} s, other {theirs:.3f} s, ratio {median(ratios):.2f} "
        f"[{ratios[0]:.2f}, {ratios[-1]:.2f}] over {turns} turns; PHREEQC {'' if imported else 'not '}imported"
    )


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("other", type=Path, help="a checkout of another commit")
    options.add_argument("--turns", type=int, default=7)
    options.add_argument("--scene", nargs="+", default=SCENES)
    chosen = options.parse_args()
    for name in chosen.scene:
        print(row(name, chosen.other.resolve(), chosen.turns), flush=True)
