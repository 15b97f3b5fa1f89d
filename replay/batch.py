"""Many sessions, each in a run folder of its own: the order and number of processes change nothing, and a batch that
was killed goes on where it stopped.

A run folder appears whole or not at all, so one that is there is done; whatever is not there is run. One session's
failure is written down and ends no other.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import shutil
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import pyarrow.parquet as pq

from replay.errors import OutputError
from replay.machine import versions
from replay.results.run_folder import METRICS, SUMMARY, read_run_folder

BATCH: Final = "batch.json"
SCHEMA: Final = "vrlab-batch/1"

Told = Callable[[str, str], None]
"""Called with a session's name and what became of it: ``done``, ``kept`` or why it failed."""


@dataclass(frozen=True)
class Batch:
    """What became of a batch.

    Parameters
    ----------
    out : folder with a run folder per session.
    done : names of the sessions that have their run folder now.
    kept : those among them that had it before.
    failed : name -> one sentence.
    digest : SHA-256 over every answer and every row of metrics, whatever the order of work; ``""`` if any failed.
    """

    out: Path
    done: tuple[str, ...]
    kept: tuple[str, ...]
    failed: Mapping[str, str] = field(default_factory=dict)
    digest: str = ""


def run_batch(
    sessions: Sequence[Path],
    out: Path,
    *,
    jobs: int = 1,
    settings: Mapping[str, Any] | None = None,
    told: Told | None = None,
) -> Batch:
    """Run every session and write its run folder to ``out/<name of the file>``.

    Parameters
    ----------
    sessions : session files with different names.
    out : folder of the batch; one that a batch with the same settings began is gone on with.
    jobs : processes.
    settings : for ``replay.run``: detectors, oracle, seed, picture.
    told : told of each session when it is finished.

    Raises
    ------
    OutputError
        Two files of one name, a folder of something else, or a batch with other settings.
    """
    tell = told or _untold
    request = {"schema": SCHEMA, "settings": dict(settings or {}), "versions": versions()}
    named = _named(sessions)
    digests = {name: _sha256(path) for name, path in named.items()}
    kept = _begin(out, request, digests)
    for name in kept:
        tell(name, "kept")
    failed = _run_all({name: path for name, path in named.items() if name not in kept}, out, jobs, request, tell)
    done = tuple(name for name in named if name not in failed)
    return Batch(out, done, tuple(kept), failed, "" if failed else batch_digest(out, done))


def batch_digest(out: Path, names: Sequence[str]) -> str:
    """SHA-256 over the digests of all detections and all rows of metrics, in order of name."""
    digest = hashlib.sha256()
    for name in sorted(names):
        summary = read_run_folder(out / name).summary
        answers = {label: told["digest"] for label, told in summary["detectors"].items()}
        rows = pq.read_table(out / name / METRICS).to_pylist()
        digest.update(json.dumps([name, answers, rows], sort_keys=True).encode())
    return digest.hexdigest()


def _named(sessions: Sequence[Path]) -> dict[str, Path]:
    named: dict[str, Path] = {}
    for path in sorted(sessions, key=lambda one: one.name):
        if named.setdefault(path.stem, path) != path:
            raise OutputError(f"{named[path.stem]} and {path} would share one run folder; give them different names")
    return named


def _begin(out: Path, request: dict[str, Any], digests: Mapping[str, str]) -> list[str]:
    """Make or take up the folder; the names of sessions that are done already."""
    before = _before(out, request)
    kept = [name for name in digests if before.get(name) == digests[name] and (out / name / SUMMARY).is_file()]
    for name in digests:
        if name not in kept and (out / name / SUMMARY).is_file():
            shutil.rmtree(out / name)
    for leftover in [*out.glob(".*.partial"), *out.glob(".*.old")]:
        shutil.rmtree(leftover, ignore_errors=True)
    text = json.dumps({**request, "sessions": {**before, **digests}}, indent=1, sort_keys=True) + "\n"
    partial = out / f".{BATCH}.{uuid4().hex[:8]}"
    partial.write_text(text, encoding="utf-8", newline="\n")
    partial.replace(out / BATCH)
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
        told = json.loads((out / BATCH).read_text(encoding="utf-8"))
        same = all(told[key] == json.loads(json.dumps(value)) for key, value in request.items())
        sessions = dict(told["sessions"])
    except (ValueError, KeyError, TypeError) as error:
        raise OutputError(f"{out / BATCH} cannot be read; name another folder") from error
    if not same:
        raise OutputError(f"{out} holds a batch with other settings or of another version; name another folder")
    return sessions


def _run_all(
    sessions: Mapping[str, Path], out: Path, jobs: int, request: Mapping[str, Any], tell: Told
) -> dict[str, str]:
    failed: dict[str, str] = {}

    def note(name: str, why: str) -> None:
        if why:
            failed[name] = why
        tell(name, why or "done")

    if jobs <= 1 or len(sessions) <= 1:
        for name, path in sessions.items():
            note(name, run_one(path, out / name, request["settings"]))
        return failed
    lost = _pooled(sessions, out, min(jobs, len(sessions)), request["settings"], note)
    for name in lost:
        # A process that dies takes its pool along; alone, each session shows whether it was the one.
        for again in _pooled({name: sessions[name]}, out, 1, request["settings"], note):
            note(again, "its process was ended, perhaps for want of memory")
    return failed


def _pooled(sessions: Mapping[str, Path], out: Path, jobs: int, settings: Mapping[str, Any], note: Told) -> list[str]:
    """Run sessions in processes; the names of those that a dying process took along."""
    lost = []
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_end_with_parent)
    try:
        waiting: dict[Future[str], str] = {
            pool.submit(run_one, path, out / name, settings): name for name, path in sessions.items()
        }
        for finished in as_completed(waiting):
            if isinstance(finished.exception(), BrokenProcessPool):
                lost.append(waiting[finished])
            else:
                note(waiting[finished], finished.result())
    finally:
        pool.shutdown(cancel_futures=True)
    return sorted(lost)


def run_one(path: Path, out: Path, settings: Mapping[str, Any]) -> str:
    """Run one session into its folder; why it failed, or ``""``."""
    from replay.runner import run

    try:
        run(path, out=out, **settings)
    except Exception as error:
        return " ".join(f"{type(error).__name__}: {error}".split())
    return ""


def _end_with_parent() -> None:
    """A worker whose batch was killed ends too, instead of waiting for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_wait_and_end, args=(parent,), daemon=True).start()


def _wait_and_end(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def _untold(name: str, became: str) -> None:
    del name, became


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
