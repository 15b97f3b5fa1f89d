"""What detectors say where kernels run as plain Python: ``NUMBA_DISABLE_JIT=1 python tests/support/interpreted.py``.

Operands: first and last seed of the random worlds; prints digests as JSON, by detector.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from support.digests import SCALE_FREE, VARIANTS, parts_of, variant_name
from support.random_worlds import SHAPES, World, random_world
from support.shapes import lab

FRAMES = 4


def laboratory():
    """A world of ordinary solids, which every detector may be asked about."""
    bodies, motion = lab(FRAMES)
    return World(bodies, motion, None)


def answers(first, last):
    """Digests of verdicts and faces, and counters, by detector: of a laboratory and of random worlds."""
    found = {}
    for name, settings in VARIANTS:
        worlds = [laboratory()]
        if name in SCALE_FREE:
            worlds += [random_world(seed, shape) for seed in range(first, last) for shape in SHAPES]
        found[variant_name(name, settings)] = [parts_of(world, name, settings) for world in worlds]
    return found


def interpreted_answers(first, last):
    """The same from a process whose kernels are interpreted."""
    done = subprocess.run(
        [sys.executable, __file__, str(first), str(last)], capture_output=True, text=True, check=False,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


if __name__ == "__main__":
    print(json.dumps(answers(*map(int, sys.argv[1:]))))
