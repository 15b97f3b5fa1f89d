"""Many sessions, each in its own run folder; order and number of processes do not change the results.

A run folder appears whole or not at all, so one that exists is finished: a batch that was killed can be continued. One
session's failure is written down and does not stop the others.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from replay.base.machine import versions
from replay.base.processes import OnDone, in_processes
from replay.errors import OutputError
from replay.outputs.results.run_folder import METRICS, SUMMARY, read_run_folder
from sessions.whole_files import whole_file

BATCH: Final = "batch.json"
SCHEMA: Final = "vrlab-batch/1"


@dataclass(frozen=True)
class Batch:
    """The outcome of a batch.

    Parameters
    ----------
    out : folder with a run folder per session.
    done : names of the sessions that have their run folder now.
    kept : those among them that had it before.
    failed : name -> one sentence.
    digest : SHA-256 over every answer and every row of metrics, in any order of work the same; ``""`` if any failed.
    """

    out: Path
    done: tuple[str, ...]
    kept: tuple[str, ...]
    failed: Mapping[str, str] = field(default_factory=dict)
    digest: str = ""


def run_batch(
    sessions: Sequence[Path], out: Path, *, jobs: int = 1, settings: Mapping[str, Any] | None = None,
    on_done: OnDone | None = None,
) -> Batch:  # fmt: skip
    """Run every session and write its run folder to ``out/<name of the file>``.

    Parameters
    ----------
    sessions : session files with different names.
    out : folder of the batch; a batch with the same settings that was begun there is continued.
    jobs : processes.
    settings : for ``replay.run``: detectors, oracle, seed, picture.
    on_done : called for each session when it is finished.

    Raises ``OutputError``: two files of one name, a folder of something else, or a batch with other settings.
    """
    request = {"schema": SCHEMA, "settings": dict(settings or {}), "versions": versions()}
    named = _named(sessions)
    digests = {}
    for name, path in named.items():
        with path.open("rb") as file:
            digests[name] = hashlib.file_digest(file, "sha256").hexdigest()
    kept = _begin(out, request, digests)
    for name in kept:
        if on_done is not None:
            on_done(name, "kept")
    tasks = {name: (path, out / name, request["settings"]) for name, path in named.items() if name not in kept}
    failed = in_processes(run_one, tasks, jobs, on_done)
    done = tuple(name for name in named if name not in failed)
    return Batch(out, done, tuple(kept), failed, "" if failed else batch_digest(out, done))


def batch_digest(out: Path, names: Sequence[str]) -> str:
    """SHA-256 over the digests of all detections and all rows of metrics, in order of name."""
    digest = hashlib.sha256()
    for name in sorted(names):
        run = read_run_folder(out / name)
        answers = {label: one["digest"] for label, one in run.summary["detectors"].items()}
        digest.update(json.dumps([name, answers, run.rows(METRICS)], sort_keys=True).encode())
    return digest.hexdigest()


def _named(sessions: Sequence[Path]) -> dict[str, Path]:
    named: dict[str, Path] = {}
    for path in sorted(sessions, key=lambda one: one.name):
        if named.setdefault(path.stem, path) != path:
            raise OutputError(f"{named[path.stem]} and {path} would share one run folder; give them different names")
    return named


def _begin(out: Path, request: dict[str, Any], digests: Mapping[str, str]) -> list[str]:
    """Make or reopen the folder; return the names of sessions that are finished already."""
    before = _before(out, request)
    kept = [name for name in digests if before.get(name) == digests[name] and (out / name / SUMMARY).is_file()]
    text = json.dumps({**request, "sessions": {**before, **digests}}, indent=1, sort_keys=True) + "\n"
    with whole_file(out / BATCH, OutputError) as file:
        file.write(text.encode())
    return kept


def _before(out: Path, request: dict[str, Any]) -> dict[str, str]:
    if not out.exists():
        out.mkdir(parents=True)
    if not out.is_dir():
        raise OutputError(f"{out} is a file; name a folder for the runs")
    if not (out / BATCH).is_file():
        if any(not entry.name.startswith(".") for entry in out.iterdir()):
            raise OutputError(f"{out} holds something else than a batch of runs; name another folder")
        return {}
    try:
        before = json.loads((out / BATCH).read_text(encoding="utf-8"))
        same = all(before[key] == json.loads(json.dumps(value)) for key, value in request.items())
        sessions = dict(before["sessions"])
    except (ValueError, KeyError, TypeError) as error:
        raise OutputError(f"{out / BATCH} cannot be read; name another folder") from error
    if not same:
        raise OutputError(f"{out} holds a batch with other settings or of another version; name another folder")
    return sessions


def run_one(path: Path, out: Path, settings: Mapping[str, Any]) -> str:
    """Run one session into its folder; why it failed, or ``""``."""
    from replay.api.runner import run

    try:
        run(path, out=out, force=True, **settings)
    except Exception as error:
        return " ".join(f"{type(error).__name__}: {error}".split())
    return ""
