"""Damages the cache of compiled kernels in many ways, and says where the next program did not give the right answer.

    python .ci/damaged_caches.py --count 200 --seed 0 --jobs 2

Each damaged copy of a cache is used by a program of its own, which must end without a signal and print the digest that
a program with an empty cache printed. A line for each that did not; exit code 1 if there is any.
"""

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = """
from support.shapes import lab_bodies_and_motion
from cdcore import create_detector
bodies, motion = lab_bodies_and_motion(8)
print(create_detector("exact", bodies).detect(motion, faces=True).digest)
"""
LONGEST_S = 600
"""A program that has not ended by then hangs; all kernels compile in 40 s on a busy machine."""

PAGE = 4096
CACHE_SUFFIXES = {".nbi", ".nbc", ".seal"}
"""Of numba's index and machine code, and of the checksums that are verified before numba loads them."""

OTHER_PROCESSOR = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}

Damage = Callable[[list[Path], Path, random.Random], None]


@dataclass(frozen=True)
class Ended:
    """How a program ended, and what it printed."""

    code: int | None  # None: it was stopped
    printed: str
    errors: str


def answer(cache: Path, **settings: str) -> Ended:
    """Ask the exact detector in a program that keeps machine code in ``cache``."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    environment = {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(cache), **settings}
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env=environment, cwd=cache, capture_output=True, text=True, timeout=LONGEST_S, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return Ended(None, "", f"it had not ended after {LONGEST_S} s")
    return Ended(done.returncode, done.stdout.strip(), done.stderr.strip()[-300:])


def cache_files(folder: Path) -> list[Path]:
    """Return the files of a cache, in order."""
    return sorted(file for file in folder.rglob("*") if file.suffix in CACHE_SUFFIXES)


def flip_bit(file: Path, chance: random.Random) -> None:
    """Flip one bit of a file."""
    content = bytearray(file.read_bytes())
    content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    file.write_bytes(bytes(content))


def flip_one_bit(files: list[Path], _: Path, chance: random.Random) -> None:
    """Flip one bit of one file."""
    flip_bit(chance.choice(files), chance)


def flip_bits(files: list[Path], _: Path, chance: random.Random) -> None:
    """Flip one bit in each of four files."""
    for file in chance.sample(files, 4):
        flip_bit(file, chance)


def replace_page(files: list[Path], _: Path, chance: random.Random) -> None:
    """Fill a page of one file with zeros, or with random bytes, as a failing disk does."""
    file = chance.choice(files)
    content = bytearray(file.read_bytes())
    start = chance.randrange(len(content)) // PAGE * PAGE
    length = len(content[start : start + PAGE])
    content[start : start + length] = chance.choice([bytes(length), chance.randbytes(length)])
    file.write_bytes(bytes(content))


def swap(files: list[Path], _: Path, chance: random.Random) -> None:
    """Exchange the contents of two files of one kind."""
    first = chance.choice(files)
    second = chance.choice([file for file in files if file.suffix == first.suffix and file != first])
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)


def empty(files: list[Path], _: Path, chance: random.Random) -> None:
    """Leave nothing in a file."""
    chance.choice(files).write_bytes(b"")


def cut(files: list[Path], _: Path, chance: random.Random) -> None:
    """Cut a file short."""
    file = chance.choice(files)
    content = file.read_bytes()
    file.write_bytes(content[: chance.randrange(len(content))])


def remove(files: list[Path], _: Path, chance: random.Random) -> None:
    """Remove a file."""
    chance.choice(files).unlink()


def age(files: list[Path], _: Path, chance: random.Random) -> None:
    """Replace a seal by that of earlier sources."""
    seal = chance.choice([file for file in files if file.suffix == ".seal"])
    first, _end, rest = seal.read_text().partition("\n")
    seal.write_text(f"{first[:-1]}{'1' if first[-1] == '0' else '0'}\n{rest}")


def take_foreign_index(files: list[Path], foreign: Path, chance: random.Random) -> None:
    """Replace an index by that of the same kernel for another processor."""
    index = chance.choice([file for file in files if file.suffix == ".nbi"])
    shutil.copy(next(foreign.rglob(index.name)), index)


def take_foreign_cache(files: list[Path], foreign: Path, _: random.Random) -> None:
    """Replace the whole cache by one for another processor."""
    for file in files:
        file.unlink()
    for file in cache_files(foreign):
        (target,) = {item.parent for item in files if item.parent.name == file.parent.name}
        shutil.copy(file, target / file.name)


DAMAGES: tuple[Damage, ...] = (
    flip_one_bit, flip_bits, replace_page, swap, empty, cut, remove, age, take_foreign_index
)  # fmt: skip
FOREIGN_CACHE_EACH = 40
"""After a whole foreign cache everything is compiled again, which takes the longest."""


def damage_of(number: int) -> Damage:
    """Return the damage of a number; all kinds come in turn."""
    return (
        take_foreign_cache if number % FOREIGN_CACHE_EACH == FOREIGN_CACHE_EACH - 1 else DAMAGES[number % len(DAMAGES)]
    )


def fault_of(number: int, seed: int, work: Path, right: str) -> str:
    """Damage a copy of the cache and use it; the line that tells what was wrong, empty if nothing."""
    cache, damage = work / str(number), damage_of(number)
    shutil.copytree(work / "whole", cache)
    damage(cache_files(cache), work / "foreign", random.Random(f"{seed} {number}"))
    ended = answer(cache)
    shutil.rmtree(cache)
    if ended.code == 0 and ended.printed == right:
        return ""
    return f"{number} {damage.__name__}: ended with {ended.code}, printed {ended.printed!r}; {ended.errors}"


def main() -> int:
    """Damage caches; 1 if any answer was wrong or any program ended otherwise than well."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="programs at a time")
    options = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as made, ThreadPoolExecutor(options.jobs) as pool:
        work = Path(made)
        for name in ("whole", "foreign"):
            (work / name).mkdir()
        foreign = pool.submit(answer, work / "foreign", **OTHER_PROCESSOR)
        whole = answer(work / "whole")
        if whole.code or foreign.result().code or whole.printed != foreign.result().printed:
            print(f"no answer to compare with: {whole}, {foreign.result()}")
            return 1
        faults = []
        for fault in pool.map(lambda k: fault_of(k, options.seed, work, whole.printed), range(options.count)):
            if fault:
                faults.append(fault)
                print(fault, flush=True)
    kinds = Counter(damage_of(number).__name__ for number in range(options.count))
    print(", ".join(f"{count} {name}" for name, count in kinds.items()))
    print(f"{options.count} damaged caches, {len(faults)} faults, {time.monotonic() - began:.0f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
