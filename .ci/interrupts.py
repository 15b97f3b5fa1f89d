"""Interrupts commands at random moments, as Ctrl-C does, and says what was not as it must be.

python .ci/interrupts.py --count 100 --seed 0

Each interrupted command must end within 5 s (``--limit``), leave no process, no temporary folder and no partial file,
and what stands under the name of its result must be whole.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import psutil
import pyarrow.parquet as pq

from sessions import read_session

SCENE = ["demo", "--scene", "fast-ball"]
COMMANDS = {
    "run": ["run", "../s0.mcap", "--out", "made", "-q"],
    "batch": ["run", "../s0.mcap", "../s1.mcap", "../s2.mcap", "--out", "made", "--no-picture", "-q"],
    "batch with jobs": ["run", "../s0.mcap", "../s1.mcap", "../s2.mcap", "--out", "made", "--jobs", "2", "-q"],
    "batch without a folder": ["run", "../s0.mcap", "../s1.mcap", "../s2.mcap", "--jobs", "2", "-q"],
    "fix": ["fix", "../s0.mcap", "--engine", "unity", "--max-false", "1", "-o", "made", "-q"],
    "recording": [*SCENE, "--session-only", "-o", "made.mcap", "-q"],
    "demo": [*SCENE, "-o", "made", "-q"],
}
"""Verbs as they are called in an empty folder beside three sessions."""


def command(words: list[str]) -> list[str]:
    """The command line of a verb."""
    return [sys.executable, "-P", "-m", "replay", *words]


def problems_of(work: Path, name: str, delay: float, limit: float) -> tuple[list[str], float]:
    """Interrupt one command after ``delay`` seconds; what was wrong, and the seconds it took to end."""
    folder, temp = work / "call", work / "temp"
    folder.mkdir()
    temp.mkdir()
    process = subprocess.Popen(
        command(COMMANDS[name]), cwd=folder, env={**os.environ, "TMPDIR": str(temp)}, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        # A shell that runs this in the background switches Ctrl-C off for its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL) and None,
    )  # fmt: skip
    with suppress(subprocess.TimeoutExpired):
        process.wait(delay)
    group = [psutil.Process(process.pid), *descendants(process.pid)] if process.poll() is None else []
    began = time.monotonic()
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGINT)
    problems = []
    try:
        _, errors = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        problems.append(f"had not ended after {limit:g} s")
        kill_all(group)
        _, errors = process.communicate()
    seconds = time.monotonic() - began
    if process.returncode not in (0, 130, -signal.SIGINT, -signal.SIGKILL):
        problems.append(f"ended with {process.returncode}: {errors.strip()[-300:]}")
    left = [item for item in group if item.is_running() and item.status() != psutil.STATUS_ZOMBIE]
    _, alive = psutil.wait_procs(left, timeout=2)
    if alive:
        problems.append(f"left {len(alive)} processes")
        kill_all(alive)
    problems += [f"left {entry.name}" for entry in temp.glob("replay-*")]
    problems += [f"left {entry.relative_to(folder)}" for entry in folder.rglob(".*")]
    problems += [problem for made in folder.iterdir() if (problem := not_whole(made))]
    return problems, seconds


def descendants(pid: int) -> list[psutil.Process]:
    """Processes below one, as far as they live."""
    with suppress(psutil.Error):
        return psutil.Process(pid).children(recursive=True)
    return []


def kill_all(processes: list[psutil.Process]) -> None:
    """End processes of this script's own commands."""
    for process in processes:
        with suppress(psutil.Error):
            process.kill()


def not_whole(made: Path) -> str:
    """What is wrong with a session, a run folder, or a folder of them; empty if nothing is."""
    if made.name.startswith("."):
        return ""
    try:
        if made.suffix == ".mcap":
            read_session(made)
        elif (made / "summary.json").exists():
            files = json.loads((made / "summary.json").read_bytes())["files"]
            if sorted(files) != sorted(file.name for file in made.iterdir()):
                return f"{made.name} has not the files it lists"
            for table in made.glob("*.parquet"):
                pq.read_table(table)
        elif made.is_dir():
            pieces = [entry for entry in made.iterdir() if entry.is_dir() and entry.name != "tables"]
            return "; ".join(filter(None, map(not_whole, pieces)))
    except Exception as error:
        return f"{made.name} is not whole: {error}"
    return ""


def main() -> int:
    """Interrupt commands; 1 if anything was not as it must be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=5.0, help="seconds in which a command must end")
    parser.add_argument("--only", choices=COMMANDS, help="interrupt only this command")
    options = parser.parse_args()
    chance = random.Random(options.seed)
    names = [options.only] if options.only else [*COMMANDS]
    faults, slowest = Counter(), 0.0
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for number in range(3):
            arguments = [*SCENE, "--seed", str(number), "--session-only", "-o", f"s{number}.mcap", "-q"]
            subprocess.run(command(arguments), cwd=folder, check=True)
        durations = {}
        for name in names:
            (folder / name).mkdir()
            began = time.monotonic()
            subprocess.run(command(COMMANDS[name]), cwd=folder / name, check=True, stdout=subprocess.DEVNULL)
            durations[name] = time.monotonic() - began
        for number in range(options.count):
            name = names[number % len(names)]
            delay = chance.uniform(0.0, durations[name])
            with tempfile.TemporaryDirectory(dir=folder) as work:
                for file in folder.glob("s?.mcap"):
                    os.link(file, Path(work) / file.name)
                problems, seconds = problems_of(Path(work), name, delay, options.limit)
            slowest = max(slowest, seconds)
            for problem in problems:
                faults[name] += 1
                print(f"{number} {name} after {delay:.2f} of {durations[name]:.2f} s: {problem}", flush=True)
    print(f"{options.count} interrupts, {sum(faults.values())} problems, the slowest end took {slowest:.1f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
