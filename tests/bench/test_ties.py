"""Surfaces in one plane, and fans hub on hub: what a boolean answer costs where every face pair is a tie.

Run with ``-m bench -s`` for the figures.
"""

from time import perf_counter

import pytest
from support.ties import fans_at_their_hubs, sliding_grids

from cdcore import create_detector, detect_live

FRAMES = 300
SCENES = {"grids": (sliding_grids, 59), "fans": (fans_at_their_hubs, 200)}
"""Two grids of 6,962 faces, two fans of 200."""
COST_AT_MOST = 3.0
"""Times ``obb``."""


def seconds_of(run, repeats=7):
    spent = []
    for _ in range(repeats):
        start = perf_counter()
        run()
        spent.append(perf_counter() - start)
    return min(spent)


@pytest.mark.bench
@pytest.mark.parametrize("scene", SCENES)
def test_a_boolean_answer_of_ties_costs_at_most_three_times_that_of_obb(scene):
    build, size = SCENES[scene]
    bodies, motion, _ = build(size, FRAMES)
    exact, obb = (create_detector(name, bodies) for name in ("exact", "obb"))
    for way, ask in {"whole": lambda one: one.detect(motion), "live": lambda one: detect_live(one, motion)}.items():
        ask(exact)
        ask(obb)
        ours, theirs = seconds_of(lambda ask=ask: ask(exact)), seconds_of(lambda ask=ask: ask(obb))
        print(f"{scene}, {way}: exact {ours / FRAMES * 1e6:.1f} us a frame, obb {theirs / FRAMES * 1e6:.1f}")
        assert ours < COST_AT_MOST * theirs
