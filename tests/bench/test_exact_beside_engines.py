"""Speed of ``exact`` against loops over python-fcl, coal and trimesh, and its growth with a session.

Run with ``-m bench -s`` for the figures; CONTRIBUTING shows them.
"""

from functools import partial

import numpy as np
import pytest
from support.bench_loads import ENGINES, YARDSTICK, OwnExact, make_workload, seconds

pytestmark = pytest.mark.bench

PATIENCE_S = 3.0
"""A peer that takes longer is asked once."""


@pytest.mark.parametrize("what", ["bool", "faces"])
@pytest.mark.parametrize("faces", [500, 5_000, 50_000])
def test_exact_answers_as_python_fcl_five_times_as_fast(faces, what):
    load = make_workload(faces, 5_400)
    engines = {name: engine(load) for name, engine in ENGINES.items()}
    answers = {name: engine.ask(what) for name, engine in engines.items()}
    least = {name: seconds(partial(engine.ask, what)) for name, engine in engines.items()}
    again = [name for name in engines if name in (YARDSTICK, "exact") or least[name] < PATIENCE_S]
    for _ in range(4):
        for name in again:
            least[name] = min(least[name], seconds(partial(engines[name].ask, what)))
    for name, spent in least.items():
        wrong = int((answers[name] != answers[YARDSTICK]).sum())
        speed = least[YARDSTICK] / spent
        print(f"\n{faces:,} faces, {what}: {name} {spent:.4f} s, speed {speed:.2f}, unlike {YARDSTICK} {wrong}", end="")
    assert np.array_equal(answers["exact"], answers[YARDSTICK])
    assert least["exact"] < 0.2 * least[YARDSTICK]


GROWTH = {"frames": (5_400, 54_000, 540_000), "bodies": (5, 20, 60), "faces": (500, 5_000, 50_000)}


@pytest.mark.parametrize("distant", [True, False], ids=["distant", "near"])
@pytest.mark.parametrize("grows", GROWTH)
def test_exact_grows_no_faster_than_its_pair_frames(grows, distant):
    each = []
    for size in GROWTH[grows]:
        sizes = {"faces": 500, "frames": 5_400, "bodies": 7} | {grows: size}
        engine = OwnExact(make_workload(sizes["faces"], sizes["frames"], bodies=sizes["bodies"], distant=distant))
        engine.ask("bool")
        spent = min(seconds(partial(engine.ask, "bool")) for _ in range(3))
        stages, result = engine.staged("bool")
        pieces = ", ".join(f"{name} {1e3 * took:.2f} ms" for name, took in stages.items())
        print(f"\n{size:,} {grows}: {1e3 * spent:.2f} ms; {pieces}", end="")
        each.append(spent / result.verdict.size)
    assert each[-1] < 3 * each[0] or grows == "faces"
