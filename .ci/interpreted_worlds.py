"""Compare the digests of compiled kernels with those of kernels that run as plain Python, in short hard worlds.

    python .ci/interpreted_worlds.py                                     200 worlds, every detector
    python .ci/interpreted_worlds.py --worlds 20 --detectors exact obb
    python .ci/interpreted_worlds.py --only 132 133 --limit 1200         two worlds that did not end
    NUMBA_DISABLE_JIT=1 python .ci/interpreted_worlds.py --print 3       the digests of world 3

A row is a detector with its settings in one world; its digests are those of verdicts and faces, and the counters.
Prints the rows that differ and the worlds that did not end within the limit; exit code 1 where a row differs.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from time import monotonic
from typing import IO, Final

ROOT: Final = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from support.digests import VARIANTS, pieces_of, variant_name  # noqa: E402
from support.random_worlds import short_world  # noqa: E402

from cdcore.detectors.detector_table import DETECTORS  # noqa: E402
from cdcore.kernels.compiling import INTERPRETED  # noqa: E402

WORLDS: Final = 200
LIMIT_S: Final = 600.0
"""Seconds a world may take with interpreted kernels: most take 3, the longest 20, a busy machine many times as long."""
REPORTED_WORLDS: Final = 20
"""Worlds from one line of progress to the next."""

Digests = dict[str, list[str | None]]
"""Detector with its settings -> digest of verdicts, digest of faces, counters."""


@dataclass
class Comparison:
    """Rows that were compared, those that differ as (world, detector), and worlds that did not end."""

    rows: int = 0
    differing: list[tuple[int, str]] = field(default_factory=list)
    unfinished: list[int] = field(default_factory=list)

    def add(self, world: int, compiled: Digests, interpreted: Digests | None) -> None:
        """Enter the rows of a world; ``None``: it did not end."""
        if interpreted is None:
            self.unfinished.append(world)
            return
        self.rows += len(compiled)
        self.differing += [(world, row) for row in compiled if compiled[row] != interpreted[row]]

    def __str__(self) -> str:
        """Return the three counts as a line."""
        return f"{self.rows} rows, {len(self.differing)} differ; {len(self.unfinished)} worlds did not end"


def digests_of_world(number: int, detectors: Sequence[str]) -> Digests:
    """Return the digests of these detectors in a world, by the kernels of this process."""
    world = short_world(number)
    variants = [variant for variant in VARIANTS if variant[0] in detectors]
    return {variant_name(*variant): list(pieces_of(world, *variant)) for variant in variants}


def interpreted_digests(
    numbers: Sequence[int], detectors: Sequence[str], limit_s: float
) -> Iterator[tuple[int, Digests | None]]:
    """Yield the digests of each world by interpreted kernels; ``None`` where it did not end within the limit."""
    remaining = list(numbers)
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    while remaining:
        command = [sys.executable, __file__, "--print", *map(str, remaining), "--detectors", *detectors]
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
            lines = lines_of(process.stdout)
            try:
                while remaining:
                    yield remaining[0], json.loads(lines.get(timeout=limit_s))
                    del remaining[0]
            except Empty:
                yield remaining.pop(0), None
            finally:
                process.kill()


def lines_of(stream: IO[str]) -> "Queue[str]":
    """Return a queue that a thread fills with the lines of a stream, and with an empty one at its end."""
    lines: Queue[str] = Queue()

    def fill() -> None:
        for line in stream:
            lines.put(line)
        lines.put("")

    Thread(target=fill, daemon=True).start()
    return lines


def compare_worlds(numbers: Sequence[int], detectors: Sequence[str], limit_s: float = LIMIT_S) -> Comparison:
    """Compare both digests of each world, and print how far it came."""
    comparison, began = Comparison(), monotonic()
    for count, (number, interpreted) in enumerate(interpreted_digests(numbers, detectors, limit_s), 1):
        comparison.add(number, digests_of_world(number, detectors), interpreted)
        if count % REPORTED_WORLDS == 0:
            print(f"{count} of {len(numbers)} worlds, {monotonic() - began:.0f} s: {comparison}", flush=True)
    return comparison


def main() -> int:
    """Print digests, or compare them; 1 where a row differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=WORLDS, help="how many worlds, from world 0")
    parser.add_argument("--only", type=int, nargs="+", metavar="WORLD", help="these worlds in place of the first ones")
    parser.add_argument("--detectors", nargs="+", choices=list(DETECTORS), default=list(DETECTORS))
    parser.add_argument("--limit", type=float, default=LIMIT_S, help="seconds a world may take, interpreted")
    parser.add_argument("--print", type=int, nargs="+", metavar="WORLD", help="print the digests of these worlds")
    options = parser.parse_args()
    if options.print is not None:
        for number in options.print:
            print(json.dumps(digests_of_world(number, options.detectors)), flush=True)
        return 0
    if INTERPRETED:
        parser.error("unset NUMBA_DISABLE_JIT: the kernels of this process are to be compiled")
    numbers = options.only or range(options.worlds)
    comparison = compare_worlds(numbers, options.detectors, options.limit)
    for number, row in comparison.differing:
        print(f"  world {number}, {row}: the digests differ")
    for number in comparison.unfinished:
        print(f"  world {number}: not ended after {options.limit:g} s")
    print(f"{len(numbers)} worlds: {comparison}")
    return int(bool(comparison.differing))


if __name__ == "__main__":
    sys.exit(main())
