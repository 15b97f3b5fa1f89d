"""Many sessions, each in its own run folder; order and number of processes do not change the results.

A run folder appears whole or not at all and keeps a mark of the recording and the settings it was made from. One with
the right mark is finished: a batch that was killed can be continued. One session's failure does not stop the others.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from replay.base.machine import versions
from replay.base.processes import OnDone, answers_of, in_processes
from replay.errors import OutputError, RunFolderError
from replay.outputs.results.run_folder import METRICS, check_target, read_run_folder
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
    named = _named(sessions)
    chosen = dict(settings or {})
    scene = {"scene": _file_digest(Path(chosen["scene"]))} if "scene" in chosen else {}
    request = {"schema": SCHEMA, "settings": chosen | scene, "versions": versions()}
    _begin(out, request)
    marks = {name: _mark(request, path) for name, path in named.items()}
    kept = tuple(name for name, mark in marks.items() if _is_whole(out / name, mark))
    for name in kept:
        if on_done is not None:
            on_done(name, "kept")
    tasks = {name: (path, out / name, chosen, marks[name]) for name, path in named.items() if name not in kept}
    failed = in_processes(run_one, tasks, jobs, on_done)
    done = tuple(name for name in named if name not in failed)
    return Batch(out, done, kept, failed, "" if failed else batch_digest(out, done))


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


def _begin(out: Path, request: dict[str, Any]) -> None:
    """Make or reopen the folder of a batch."""
    if not out.exists():
        out.mkdir(parents=True)
    if not out.is_dir():
        raise OutputError(f"{out} is a file; name a folder for the runs")
    if (out / BATCH).is_file():
        try:
            before = json.loads((out / BATCH).read_text(encoding="utf-8"))
            same = all(before[key] == json.loads(json.dumps(value)) for key, value in request.items())
        except (ValueError, KeyError, TypeError) as error:
            raise OutputError(f"{out / BATCH} cannot be read; name another folder") from error
        if not same:
            raise OutputError(f"{out} holds a batch with other settings or of another version; name another folder")
    elif any(not entry.name.startswith(".") for entry in out.iterdir()):
        raise OutputError(f"{out} holds something else than a batch of runs; name another folder")
    with whole_file(out / BATCH, OutputError) as file:
        file.write((json.dumps(request, indent=1, sort_keys=True) + "\n").encode())


def _mark(request: dict[str, Any], path: Path) -> str:
    """SHA-256 over the contents of a recording and all that is asked of it; its run folder keeps it."""
    return hashlib.sha256(json.dumps([request, _file_digest(path)], sort_keys=True).encode()).hexdigest()


def _file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _is_whole(out: Path, mark: str) -> bool:
    try:
        return read_run_folder(out).summary.get("request") == mark
    except RunFolderError:
        return False


def run_side_by_side(
    asked: Mapping[str, tuple[Any, Mapping[str, Any]]], jobs: int, on_done: OnDone | None = None
) -> tuple[Any, ...]:
    """Run sessions (name -> session or file, what ``replay.run`` is asked) in processes; a result each, in this order.

    Results come without what cannot leave a process: detectors, intersection segments, the search for step rates.
    Raises ``OutputError`` before any work for a run folder that is in the way; then as ``replay.run`` and
    ``replay.base.processes.answers_of``.
    """
    for _, settings in asked.values():
        if settings["out"] is not None:
            check_target(Path(settings["out"]), force=settings["force"])
    return tuple(answers_of(_portable_run, asked, jobs, on_done).values())


def _portable_run(session: Any, settings: Mapping[str, Any]) -> Any:
    from replay.api.runner import run

    # A folder that stands now is of this very task, whose answer was lost: others were refused before.
    result = run(session, **{**settings, "force": True})
    bare = {label: replace(one, section_source=None) for label, one in result.detections.items()}
    cut: dict[str, Any] = {
        label: SimpleNamespace(settings=one.settings, parts=one.parts)
        for label, one in result.detectors.items()
        if hasattr(one, "parts")  # the pieces of compounds, which the words of a run count
    }
    dwell = None if result.dwell is None else replace(result.dwell, rates=None)
    return replace(result, detections=bare, detectors=cut, dwell=dwell, watched={})


def run_one(path: Path, out: Path, settings: Mapping[str, Any], mark: str = "") -> str:
    """Run one session into its folder, unless it is there already; why it failed, or ``""``."""
    from replay.api.runner import run

    if mark and _is_whole(out, mark):  # done by a process whose answer was lost
        return ""
    try:
        run(path, out=out, force=True, request=mark, **settings)
    except Exception as error:
        return " ".join(f"{type(error).__name__}: {error}".split())
    return ""
