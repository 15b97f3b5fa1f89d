"""Speed of ``exact`` against loops over python-fcl, coal and trimesh, and its growth with a session.

Run with ``-m bench -s`` for the figures; CONTRIBUTING shows them.
"""

from functools import partial

import numpy as np
import pytest
from support.bench_loads import ENGINES, YARDSTICK, OwnExact, make_workload, seconds

pytestmark = pytest.mark.bench

REPEATED_BELOW_S = 3.0
"""An engine that takes longer is timed once; YARDSTICK (python-fcl) and ``exact`` are always timed five times."""
MINUTE = 60 * 90
"""Frames of a minute at 90 Hz."""


@pytest.mark.parametrize("answer", ["bool", "faces"], ids=["whether pairs touch", "how many faces meet"])
@pytest.mark.parametrize("faces", [500, 5_000, 50_000])
def test_exact_answers_as_python_fcl_five_times_as_fast(faces, answer):
    """A minute of frames of bodies with so many faces; the least of five passes, of slow engines of one.

    ``exact`` has the same answers as python-fcl (YARDSTICK) and takes less than a fifth of its time; the other engines
    are only printed.
    """
    workload = make_workload(faces, frames=MINUTE)
    engines = {name: engine(workload) for name, engine in ENGINES.items()}
    answers = {name: engine.ask(answer) for name, engine in engines.items()}
    shortest = {name: seconds(partial(engine.ask, answer)) for name, engine in engines.items()}
    repeated = [name for name in engines if name in (YARDSTICK, "exact") or shortest[name] < REPEATED_BELOW_S]
    for _ in range(4):
        for name in repeated:
            shortest[name] = min(shortest[name], seconds(partial(engines[name].ask, answer)))
    for name, spent in shortest.items():
        differing = int((answers[name] != answers[YARDSTICK]).sum())
        speed = shortest[YARDSTICK] / spent
        print(f"\n{faces:,} faces, {answer}: {name} {spent:.4f} s, speed {speed:.2f}", end="")
        print(f", unlike {YARDSTICK} {differing}", end="")
    assert np.array_equal(answers["exact"], answers[YARDSTICK])
    assert shortest["exact"] < shortest[YARDSTICK] / 5


GROWTH = {"frames": (MINUTE, 10 * MINUTE, 100 * MINUTE), "bodies": (5, 20, 60), "faces": (500, 5_000, 50_000)}
"""What grows from size to size; the other two are a minute of frames, 7 bodies, 500 faces."""


@pytest.mark.parametrize("distant", [True, False], ids=["distant", "near"])
@pytest.mark.parametrize("grows", GROWTH)
def test_exact_grows_no_faster_than_its_pair_frames(grows, distant):
    """1 to 100 minutes of frames, 5 to 60 bodies or 500 to 50,000 faces, of bodies far from each other or near.

    The least of three passes, divided by frames times pairs: that of the largest size is below three times that of the
    smallest. Time with more faces is only printed: it may grow with them.
    """
    seconds_per_pair_frame = []
    for size in GROWTH[grows]:
        sizes = {"faces": 500, "frames": MINUTE, "bodies": 7} | {grows: size}
        engine = OwnExact(
            make_workload(faces=sizes["faces"], frames=sizes["frames"], bodies=sizes["bodies"], distant=distant)
        )
        engine.ask("bool")
        spent = min(seconds(partial(engine.ask, "bool")) for _ in range(3))
        stages, detection = engine.staged("bool")
        pieces = ", ".join(f"{name} {1e3 * took:.2f} ms" for name, took in stages.items())
        print(f"\n{size:,} {grows}: {1e3 * spent:.2f} ms; {pieces}", end="")
        seconds_per_pair_frame.append(spent / detection.verdict.size)
    smallest, *_, largest = seconds_per_pair_frame
    assert largest < 3 * smallest or grows == "faces"
