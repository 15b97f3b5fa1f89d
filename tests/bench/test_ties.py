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
"""Two grids of 6,962 faces, two fans of 200."""
COST_AT_MOST = 3.0
"""Times ``obb``."""
PEAK_AT_MOST = 300e6

PEAK = """
import sys
from support.processes import peak_bytes
from support.shapes import {scene}
from cdcore import create_detector
bodies, motion, meets = {scene}({size}, {frames})
found = create_detector("exact", bodies).detect(motion)
assert ((found.verdict[:, 0] == 1) == meets).all()
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
def test_boolean_answer_of_ties_costs_three_times_obb_at_most(scene):
    build, size = SCENES[scene]
    bodies, motion, _ = build(size, FRAMES)
    exact, obb = (create_detector(name, bodies) for name in ("exact", "obb"))
    for mode, ask in {
        "whole": lambda item: item.detect(motion),
        "live": lambda item: detect_live(item, motion),
    }.items():
        ask(exact)
        ask(obb)
        own, other = seconds_of(lambda ask=ask: ask(exact)), seconds_of(lambda ask=ask: ask(obb))
        print(f"{scene}, {mode}: exact {own / FRAMES * 1e6:.1f} us a frame, obb {other / FRAMES * 1e6:.1f}")
        assert own < COST_AT_MOST * other


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_memory_of_ties_does_not_grow_with_their_number(scene):
    build, size = SCENES[scene]
    program = PEAK.format(scene=build.__name__, size=size, frames=FRAMES)
    # the first run may compile, which holds more than the answer does
    for _ in range(2):
        output = subprocess.run(
            [sys.executable, "-c", program],
            env=environment() | {"OMP_NUM_THREADS": "1"},
            check=True,
            capture_output=True,
            text=True,
            cwd=Path(__file__).parent,
        )
    assert int(output.stdout) < PEAK_AT_MOST
