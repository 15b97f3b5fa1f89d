"""Branch coverage of the rooms whose kernels decide: trees of boxes, triangles, and the search of the paper.

    python .ci/branch_coverage.py --least 95
    python .ci/branch_coverage.py --rooms cdcore/search

Kernels run as the Python functions that they are (``NUMBA_DISABLE_JIT=1``), since compiled ones are not measured: the
rooms' own tests, then all detectors in short random worlds. One line a room: the percentage of statements
and branches that ran, and the files below the least with their lines; exit code 1 where a room is below it.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parents[1]
SEARCH_TESTS: Final = ("small_worlds", "equations", "printed", "search_settings")
"""Tests of the search whose worlds are so small that they end without a compiler; some others take minutes each."""
ROOMS: Final = {
    "cdcore/narrow/bvh": ("tests/cdcore/narrow/bvh",),
    "cdcore/triangles": ("tests/cdcore/triangles",),
    "cdcore/search": tuple(f"tests/cdcore/search/test_{name}.py" for name in SEARCH_TESTS),
}
"""Room of the source -> its tests."""
WORLDS: Final = range(10)
"""Worlds of `.ci/interpreted_worlds.py`, the first of each shape."""
MOST_LINES: Final = 12
"""Lines that did not run, named of a file."""


def run_measured(data: Path, rooms: list[str], *command: str) -> None:
    """Run a Python program with interpreted kernels; add what it covered to the data, or end if it fails."""
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "COVERAGE_FILE": str(data)}
    options = ["--branch", "--append", f"--source={','.join(rooms)}"]
    done = subprocess.run(
        [sys.executable, "-m", "coverage", "run", *options, *command],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode:
        print(done.stdout[-3000:])
        raise SystemExit(done.returncode)


def measured_files(data: Path) -> dict[str, Any]:
    """Return what coverage says of each file."""
    environment = os.environ | {"COVERAGE_FILE": str(data)}
    report = data.with_suffix(".json")
    command = [sys.executable, "-m", "coverage", "json", "-q", "-o", str(report)]
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    files: dict[str, Any] = json.loads(report.read_text())["files"]
    return files


def percentage(summaries: list[dict[str, int]]) -> float:
    """Return how many of the statements and branches ran, of a hundred."""
    total = sum(summary["num_statements"] + summary["num_branches"] for summary in summaries)
    ran = sum(summary["covered_lines"] + summary["covered_branches"] for summary in summaries)
    return 100.0 * ran / total if total else 100.0


def main() -> int:
    """Measure and print; 1 where a room is below the least."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--least", type=float, default=95.0, help="percentage of each room")
    parser.add_argument("--rooms", nargs="+", choices=list(ROOMS), default=list(ROOMS))
    options = parser.parse_args()
    tests = [path for room in options.rooms for path in ROOMS[room]]
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "coverage"
        run_measured(data, options.rooms, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *tests)
        run_measured(data, options.rooms, ".ci/interpreted_worlds.py", "--print", *map(str, WORLDS))
        files = measured_files(data)
    is_below = False
    for room in options.rooms:
        inside = {path: file for path, file in files.items() if path.startswith(f"{room}/")}
        ran = percentage([file["summary"] for file in inside.values()])
        is_below |= ran < options.least
        print(f"{room}: {ran:.1f} % of statements and branches")
        for path, file in inside.items():
            ran = percentage([file["summary"]])
            if ran < options.least:
                lines = ", ".join(map(str, file["missing_lines"][:MOST_LINES]))
                print(f"  {path}: {ran:.1f} %, not lines {lines}")
    return int(is_below)


if __name__ == "__main__":
    sys.exit(main())
