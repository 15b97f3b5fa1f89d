"""Commands that write, where they are tried, and what is wrong with how they end and with what they leave."""

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pyarrow.parquet as pq
from support.peak_memory import environment
from support.small_worlds import cubes

from sessions import Severity, examine, read_session, write_session

LONGEST_S = 300.0
OK, FAILURE, USAGE, LOSS = 0, 1, 2, 3
BYSTANDER, WORDS = "thesis.txt", "three years of work"


class Verb(NamedTuple):
    """A command that writes: its words, what it makes, and what finds fault with each that is not whole."""

    words: tuple[str, ...]
    made: tuple[str, ...]
    whole: Callable[[Path], None]


class Ended(NamedTuple):
    """How a process ended."""

    code: int
    said: str


def whole_session(path: Path) -> None:
    """Every pose of a session, and no structure that the doctor finds wrong; of its truth, JSON."""
    if path.suffix == ".json":
        json.loads(path.read_bytes())
        return
    assert sum(len(block) for block in read_session(path).blocks()) > 0
    assert [one.code for one in examine(path) if one.severity == Severity.ERROR and one.code != "no-mesh"] == []


def whole_run(folder: Path) -> None:
    """Every file that the summary lists, and no other; tables are read, the page ends."""
    listed = json.loads((folder / "summary.json").read_bytes())["files"]
    assert sorted(listed) == sorted(one.name for one in folder.iterdir()), listed
    for table in folder.glob("*.parquet"):
        pq.read_table(table)
    assert (folder / "report.html").read_text("utf-8").rstrip().endswith("</html>")


RUN = ("run", "{s}.mcap", "--out", "made", "-q")
VERBS = {
    "import": Verb(
        ("import", "csv", "{s}.csv", "--convention", "unity", "-o", "made.mcap"), ("made.mcap",), whole_session
    ),
    "recover": Verb(("recover", "{s}.torn", "made.mcap"), ("made.mcap",), whole_session),
    "session": Verb(
        ("demo", "--session-only", "--scene", "fast-ball", "-o", "made.mcap"),
        ("made.mcap", "made.truth.json"),
        whole_session,
    ),
    "run": Verb((*RUN, "--no-picture"), ("made",), whole_run),
    "picture": Verb(RUN, ("made",), whole_run),
    "demo": Verb(("demo", "-q", "--scene", "fast-ball", "-o", "made"), ("made",), whole_run),
    "tradeoff": Verb(("tradeoff", "{s}.mcap", "-q", "--time-limit", "1", "-o", "made"), ("made",), whole_run),
}  # fmt: skip


class Place:
    """A folder with what trials begin with, made once: inputs, and what each verb makes when nothing fails."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.inputs, self.work = folder, folder / "inputs", folder / "work"
        self.inputs.mkdir(parents=True, exist_ok=True)
        self._seconds: dict[str, float] = {}
        for name, places in {"one": (0, 3, 0.9), "two": (3, 0.8, 4)}.items():
            session = cubes({f"{name} cube": [0] * 90, f"{name} other": [*places] * 30})
            write_session(session, self.inputs / f"{name}.mcap")
            data = (self.inputs / f"{name}.mcap").read_bytes()
            (self.inputs / f"{name}.torn").write_bytes(data[: len(data) * 9 // 10])
            rows = [f"pose,{0.011 * k:.6f},{name}{k % 2},{0.01 * k},1,0,0,0,0,1,1,," for k in range(600)]
            head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"
            (self.inputs / f"{name}.csv").write_text("\n".join([head, *rows, ""]), "utf-8")

    def words(self, verb: str, *more: str, source: str = "one") -> list[str]:
        """A command line."""
        given = (word.replace("{s}", str(self.inputs / source)) for word in VERBS[verb].words)
        return [sys.executable, "-m", "replay", *given, *more]

    def earlier(self, verb: str) -> Path:
        """A folder with what the verb makes when nothing fails, and how long that took."""
        made = self.folder / "earlier" / verb
        if verb not in self._seconds:
            shutil.rmtree(made, ignore_errors=True)
            made.mkdir(parents=True)
            for _ in range(2):  # the first may compile
                began = time.monotonic()
                ended = run(self.words(verb, "--force"), made)
                self._seconds[verb] = time.monotonic() - began
                assert ended.code in (OK, LOSS), ended.said
        return made

    def seconds(self, verb: str) -> float:
        """How long the verb takes when nothing fails."""
        self.earlier(verb)
        return self._seconds[verb]

    def fresh(self, verb: str, *, earlier: bool, at: Path | None = None) -> Path:
        """A working folder with a file of somebody else in it and, if asked, what an earlier call has made."""
        work = at or self.work
        shutil.rmtree(self.work, ignore_errors=True)
        work.mkdir(parents=True, exist_ok=True)
        (work / BYSTANDER).write_text(WORDS)
        if earlier:
            shutil.copytree(self.earlier(verb), work, dirs_exist_ok=True)
        return work


def run(words: list[str], folder: Path, **more) -> Ended:
    """Run a command to its end."""
    env = environment() | more.pop("env", {})
    done = subprocess.run(
        words, cwd=folder, env=env, capture_output=True, text=True, errors="replace", timeout=LONGEST_S, **more
    )
    return Ended(done.returncode, done.stderr)


def bytes_of(folder: Path) -> dict[str, bytes]:
    """Every file below a folder."""
    return {str(one.relative_to(folder)): one.read_bytes() for one in sorted(folder.rglob("*")) if one.is_file()}


def faults_of(
    verb: str, folder: Path, ended: Ended, before: dict[str, bytes], *, codes=(OK, LOSS, FAILURE)
) -> list[str]:
    """What is wrong with how a command ended and with what it left."""
    made, wrong = VERBS[verb].made, []
    said = [line for line in ended.said.splitlines() if line.startswith("error: ")]
    if "Traceback" in ended.said or "should not have happened" in ended.said:
        wrong.append("traceback")
    if ended.code not in codes or (ended.code == FAILURE) != (len(said) == 1):
        wrong.append(f"ended with {ended.code}")
    wrong += [f"left {one.name}" for one in folder.iterdir() if one.name not in (BYSTANDER, *made)]
    if (folder / BYSTANDER).read_text() != WORDS:
        wrong.append("a file of somebody else is lost")
    after = bytes_of(folder)
    # Of two files the first may stand when the second fails.
    if ended.code == FAILURE and after != before and len(made) == 1:
        wrong.append("failed, and changed what was there")
    if ended.code in (OK, LOSS) and not all((folder / name).exists() for name in made):
        wrong.append("made nothing")
    return [f"{one}: {ended.said[-600:]}" for one in wrong + broken(verb, folder)]


def broken(verb: str, folder: Path) -> list[str]:
    """What stands under the name and is not whole."""
    wrong = []
    for name in VERBS[verb].made:
        if (folder / name).exists():
            try:
                VERBS[verb].whole(folder / name)
            except Exception as error:
                wrong.append(f"{name} is torn ({type(error).__name__}: {error})")
    return wrong
