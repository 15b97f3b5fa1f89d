"""Surfaces in one plane, and fans hub on hub: what a boolean answer costs and holds where every face pair is a tie.

Run with ``-m bench -s`` for the figures; ``-m slow`` checks the memory.
"""

import subprocess
import sys
from pathlib import Path
from time import perf_counter

import pytest
from support.processes import environment
from support.shapes import fans_at_their_hubs, sliding_grids

from cdcore import create_detector, detect_live

FRAMES = 300
SCENES = {"grids": (sliding_grids, 59), "fans": (fans_at_their_hubs, 200)}
"""Function that makes two bodies and their motion, and its size: grids in one plane of 2 * 59^2 faces, fans of 200."""
COST_AT_MOST = 3.0
"""Time of ``exact`` over that of ``obb``."""
MOST_BYTES = 300e6

PEAK = """
import sys
from support.processes import peak_bytes
from support.shapes import {scene}
from cdcore import create_detector
bodies, motion, meets = {scene}({size}, {frames})
detection = create_detector("exact", bodies).detect(motion)
assert ((detection.verdict[:, 0] == 1) == meets).all()
print(peak_bytes())
"""


def seconds_of(run, repeats=7):
    """The shortest of several runs, in seconds."""
    spent = []
    for _ in range(repeats):
        start = perf_counter()
        run()
        spent.append(perf_counter() - start)
    return min(spent)


@pytest.mark.bench
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("mode", ["whole", "live"])
def test_boolean_answer_of_ties_costs_three_times_obb_at_most(scene, mode):
    """Two bodies whose face pairs nearly all touch exactly, in 300 frames, all at once or frame by frame.

    The least time of seven runs of ``exact`` is at most three times that of ``obb``, bounding boxes and plain tests.
    """
    build, size = SCENES[scene]
    bodies, motion, _ = build(size, FRAMES)
    exact, obb = (create_detector(name, bodies) for name in ("exact", "obb"))

    def answer(detector):
        return detector.detect(motion) if mode == "whole" else detect_live(detector, motion)

    answer(exact)
    answer(obb)
    exact_s, obb_s = seconds_of(lambda: answer(exact)), seconds_of(lambda: answer(obb))
    print(f"{scene}, {mode}: exact {exact_s / FRAMES * 1e6:.1f} us a frame, obb {obb_s / FRAMES * 1e6:.1f}")
    assert exact_s < COST_AT_MOST * obb_s


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_memory_of_ties_does_not_grow_with_their_number(scene):
    """Nearly all face pairs of two bodies touch exactly; a program decides 300 frames as the scene knows them.

    It takes less than 300 MB with all that it loads.
    """
    build, size = SCENES[scene]
    program = PEAK.format(scene=build.__name__, size=size, frames=FRAMES)
    # the first run may compile, which holds more than the answer does
    for _ in range(2):
        ended = subprocess.run(
            [sys.executable, "-c", program],
            env=environment() | {"OMP_NUM_THREADS": "1"},
            check=True,
            capture_output=True,
            text=True,
            cwd=Path(__file__).parent,
        )
    assert int(ended.stdout) < MOST_BYTES
