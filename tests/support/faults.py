"""What commands leave behind when the machine fails them: kills, full disks, limits, odd surroundings, races.

``PYTHONPATH=.:tests python -m support.faults FOLDER [KIND[=COUNT] ...]`` tries them all and prints the counts.
Number ``k`` of a kind is one trial for ever, up to the clock of the machine.
"""

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from support.fault_grounds import BYSTANDER, LONGEST_S, LOSS, OK, VERBS, Ended, Place, broken, bytes_of, faults_of, run
from support.hand_made import HAND_MADE, wrong_with
from support.hostile import good_files
from support.peak_memory import environment

from sessions import read_session

RECORD = """
import sys, time
from sessions import Recorder
with Recorder("made.mcap", overwrite=True) as recorder:
    for k in range(2000):
        stamp = time.time_ns()
        recorder.poses(stamp, {"a": ((0.001 * k, 0, 0), (0, 0, 0, 1)), "b": ((0, 1, 0), (0, 0, 0, 1))})
        print(stamp, flush=True)
        time.sleep(1 / 90)
"""


# --- Kinds of trials: each gives what was wrong with number k ---


def kill(place: Place, number: int) -> list[str]:
    """Kill a command at a random moment, every second one once it writes; then call it again."""
    random, names = np.random.default_rng([1, number]), [*VERBS, "record"]
    verb = names[number % len(names)]
    if verb == "record":
        return kill_recorder(place, random)
    earlier = bool(random.integers(2))
    work = place.fresh(verb, earlier=earlier)
    began = time.monotonic()
    process = subprocess.Popen(
        place.words(verb, "--force"), cwd=work, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    if random.integers(2):
        while process.poll() is None and not any(work.glob(".made*")) and time.monotonic() < began + LONGEST_S:
            time.sleep(0.0005)
        time.sleep(float(random.uniform(0, 0.03)))
    else:
        time.sleep(float(random.uniform(0, 1.02)) * place.seconds(verb))
    process.kill()
    process.wait()
    wrong = broken(verb, work)
    if earlier and not all(any(work.glob(f"*{name}*")) for name in VERBS[verb].made):
        wrong.append("what an earlier call made is lost")
    ended = run(place.words(verb, "--force"), work)
    return wrong + faults_of(verb, work, ended, {}, codes=(OK, LOSS))


def kill_recorder(place: Place, random: np.random.Generator) -> list[str]:
    """Kill a recorder after at least a second: all but the last second can be saved."""
    work = place.fresh("recover", earlier=False)
    command = [sys.executable, "-c", RECORD]
    process = subprocess.Popen(command, cwd=work, env=environment(), stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    time.sleep(float(random.uniform(1.1, 4)))
    process.kill()
    last = int(process.communicate()[0].split()[-2])
    ended = run([sys.executable, "-m", "replay", "recover", "made.mcap.partial", "made.mcap"], work)
    (work / "made.mcap.partial").unlink()
    wrong = faults_of("recover", work, ended, {}, codes=(LOSS,))
    lost_s = (last - max(int(block.stamp_ns[-1]) for block in read_session(work / "made.mcap").blocks())) / 1e9
    return wrong + [f"{lost_s} s lost"] * (lost_s > 1)


@contextmanager
def small_disk(folder: Path, size: int) -> Iterator[bool]:
    """A disk of so many bytes; where nobody may mount one, nothing, and ``False``."""
    folder.mkdir(parents=True, exist_ok=True)
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    mounted = sys.platform == "linux" and subprocess.run(words, capture_output=True).returncode == 0
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", "-l", str(folder)], check=True)


def limited(what: str, size: int) -> Callable[[], None]:
    """What a new process does first: it takes a limit upon itself."""

    def take() -> None:
        import resource

        resource.setrlimit(getattr(resource, what), (size, size))

    return take


def disk(place: Place, number: int) -> list[str]:
    """Every third time the folder for temporary files lies on the full disk too. Without mounts files are limited."""
    random = np.random.default_rng([2, number])
    verb, earlier = [*VERBS][number % len(VERBS)], bool(number // len(VERBS) % 2)
    size = sum(map(len, bytes_of(place.earlier(verb)).values()))
    room = int(random.uniform(0, 1.1) * size) + 4096
    with small_disk(place.folder / "disk", (size if earlier else 0) + 16384 + room) as mounted:
        work = place.fresh(verb, earlier=earlier, at=place.folder / "disk" if mounted else None)
        more = {"env": {"TMPDIR": str(work)}} if mounted and random.integers(3) == 0 else {}
        if not mounted:
            more["preexec_fn"] = limited("RLIMIT_FSIZE", room)
        before = bytes_of(work)
        return faults_of(verb, work, run(place.words(verb, *["--force"] * earlier), work, **more), before)


def file_size(place: Place, number: int) -> list[str]:
    """A limit on the size of every file that a command writes."""
    random = np.random.default_rng([3, number])
    verb, earlier = [*VERBS][number % len(VERBS)], bool(random.integers(2))
    largest = max(map(len, bytes_of(place.earlier(verb)).values()))
    work = place.fresh(verb, earlier=earlier)
    before, limit = bytes_of(work), limited("RLIMIT_FSIZE", int(random.uniform(0, 1.1) * largest))
    return faults_of(verb, work, run(place.words(verb, *["--force"] * earlier), work, preexec_fn=limit), before)


def memory(place: Place, number: int) -> list[str]:
    """A limit on memory, from what the interpreter needs on."""
    random = np.random.default_rng([4, number])
    verb = [*VERBS][number % len(VERBS)]
    place.earlier(verb)
    work = place.fresh(verb, earlier=False)
    limit = limited("RLIMIT_AS", int(2 ** random.uniform(26, 31)))
    ended = run(place.words(verb), work, preexec_fn=limit)
    if ended.code < 0:  # a library ended the process: as after a kill, the next call cleans up
        return broken(verb, work) + faults_of(verb, work, run(place.words(verb), work), {}, codes=(OK, LOSS))
    return faults_of(verb, work, ended, bytes_of(work))


NO_UTF8 = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
UMLAUTS = "Übung für Jürgen ß 東京"
SURROUNDINGS: dict[str, tuple[dict[str, str], str]] = {
    "no home": ({"HOME": "/nonexistent", "XDG_CACHE_HOME": "", "XDG_CONFIG_HOME": ""}, "work"),
    "a home that is a file": ({"HOME": "/dev/null"}, "work"),
    "locale C": (NO_UTF8, "work"),
    "umlauts in locale C": (NO_UTF8, UMLAUTS),
    "umlauts": ({"LC_ALL": "C.UTF-8"}, UMLAUTS),
    "a terminal of one column": ({"COLUMNS": "1", "TERM": "dumb"}, "a b; $(c) 'd' [red]"),
    "a cache that cannot be written": ({"NUMBA_CACHE_DIR": "/dev/null/cache"}, "work"),
}
"""What surrounds a command -> variables, and the name of the folder it works in."""


def surroundings(place: Place, number: int) -> list[str]:
    """A command with odd variables, in an odd folder: it ends well."""
    names, verbs = [*SURROUNDINGS], [*VERBS]
    name, verb = names[number % len(names)], verbs[number // len(names) % len(verbs)]
    env, folder = SURROUNDINGS[name]
    work = place.fresh(verb, earlier=False, at=place.work / folder)
    ended = run(place.words(verb), work, env=env)
    return [f"{name}: {one}" for one in faults_of(verb, work, ended, {}, codes=(OK, LOSS))]


def race(place: Place, number: int) -> list[str]:
    """Two commands write one output from two inputs: one stands whole, and no data of both."""
    random, verb = np.random.default_rng([5, number]), ("run", "import", "recover", "picture")[number % 4]
    force = ["--force"] * int(random.integers(2))
    place.earlier(verb)
    work = place.fresh(verb, earlier=bool(force))
    both = [
        subprocess.Popen(
            place.words(verb, *force, source=source), cwd=work, env=environment(), text=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )
        for source in ("one", "two")
    ]  # fmt: skip
    ended = [Ended(process.wait(LONGEST_S), process.stderr.read()) for process in both]
    wrong = [] if any(one.code in (OK, LOSS) for one in ended) else ["nobody made it"]
    wrong += [fault for one in ended for fault in faults_of(verb, work, one, bytes_of(work))]
    text = b"".join(data for name, data in bytes_of(work).items() if name.endswith((".json", ".html", ".mcap")))
    seen = [word for word in ("one", "two") if word.encode() + (b" cube" if verb != "import" else b"0") in text]
    return wrong + [f"data of {seen}"] * (len(seen) > 1)


def compilers(place: Place, number: int) -> list[str]:
    """Two commands compile into one empty cache; every second time the first is killed meanwhile. A third reads it."""
    random, cache = np.random.default_rng([6, number]), place.folder / "compiled"
    shutil.rmtree(cache, ignore_errors=True)
    work, env = place.fresh("run", earlier=False), {"NUMBA_CACHE_DIR": str(cache)}
    first = subprocess.Popen(
        place.words("run"),
        cwd=place.inputs,
        env=environment() | env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    if number % 2:
        time.sleep(float(random.uniform(2, 12)))
        first.kill()
    wrong = faults_of("run", work, run(place.words("run"), work, env=env), {}, codes=(OK,))
    first.wait(LONGEST_S)
    shutil.rmtree(place.inputs / "made", ignore_errors=True)
    return wrong + faults_of("run", work, run(place.words("run", "--force"), work, env=env), {}, codes=(OK,))


def mutants(place: Place, number: int) -> list[str]:
    """Five hundred mutants of session files through four verbs, in a process of their own."""
    first, folder = 500 * number, place.folder / "mutants"
    words = [sys.executable, "-m", "support.hostile", str(folder), str(first), str(first + 500)]
    done = subprocess.run(words, env=environment(), capture_output=True, text=True, timeout=10 * LONGEST_S)
    return json.loads(done.stdout.splitlines()[-1])["wrong"] if done.returncode == 0 else [done.stderr[-600:]]


def made_by_hand(place: Place, number: int) -> list[str]:
    """A file that is wrong in a way of its own."""
    work, files = place.fresh("recover", earlier=False), place.folder / "good"
    files.mkdir(exist_ok=True)
    (work / BYSTANDER).unlink()
    return wrong_with([*HAND_MADE][number], good_files(files)["own.mcap"], work)


KINDS: dict[str, tuple[Callable[[Place, int], list[str]], int, int]] = {
    "mutants": (mutants, 6, 500), "files made by hand": (made_by_hand, len(HAND_MADE), 1), "kills": (kill, 32, 1),
    "full disks": (disk, 14, 1), "file sizes": (file_size, 14, 1), "memory": (memory, 28, 1),
    "surroundings": (surroundings, 49, 1), "races": (race, 12, 1), "compilers": (compilers, 2, 1),
}  # fmt: skip
"""Kind -> one trial, how many trials where nobody says how many, and how many cases are in a trial."""


def tried(place: Place, kind: str, numbers) -> list[str]:
    """What was wrong with trials of a kind; a command that takes too long is."""
    wrong = []
    for number in numbers:
        try:
            wrong += [f"{kind} {number}: {one}" for one in KINDS[kind][0](place, number)]
        except subprocess.TimeoutExpired as error:
            wrong.append(f"{kind} {number}: hangs: {error}")
    return wrong


def main(folder: Path, kinds: list[str]) -> int:
    """Try kinds of faults, all where none is named; ``kind=count`` tries so many."""
    place, counts, wrong = Place(folder.resolve()), {}, []
    for kind, _, count in (text.partition("=") for text in kinds or KINDS):
        began, most = time.monotonic(), int(count or KINDS[kind][1])
        found = tried(place, kind, range(most))
        counts[kind], wrong = most * KINDS[kind][2], wrong + found
        said = f"{kind}: {counts[kind]} tried, {len(found)} wrong, {time.monotonic() - began:.0f} s"
        print(*found[:50], said, sep="\n", flush=True)
    print(json.dumps({"tried": counts, "wrong": len(wrong)}))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]))
