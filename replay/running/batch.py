"""Many sessions, each in its own run folder; order and number of processes do not change the results.

A run folder appears whole or not at all and keeps a mark of the recording and the settings it was made from. One with
the right mark is finished: a batch that was killed can be continued. One session's failure does not stop the others.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from replay.document.audit import DetectorAudit
from replay.document.detector import DetectorTimes
from replay.document.file_hash import file_hash
from replay.document.machine import versions
from replay.document.metrics.row import TYPES_OF_MEASURES
from replay.document.run_document import RunDocument
from replay.document.scores import pooled_audits
from replay.document.session import FlaggedPoses
from replay.errors import OutputError, RunFolderError
from replay.running.remote_files import is_remote, local_copy, path_of_place, run_folder_for, store_errors
from replay.running.runner import run
from replay.running.workers import DONE_OUTCOME, KEPT_OUTCOME, OnDone, do_all
from replay.show.results.batch_parts import TABLES_FOLDER as TABLES
from replay.show.results.data_set import write_batch_tables
from replay.show.results.run_folder import PICTURE_FILE, RUN_FOLDER, read_run_folder
from sessions.whole_files import remove_abandoned, whole_file

BATCH_FILE: Final = "batch.json"
SCHEMA: Final = "vrlab-batch/1"
NO_SETTINGS: Final[Mapping[str, Any]] = {}


@dataclass(frozen=True)
class SessionOfBatch:
    """The part of a run's document that gates and tables over many runs read; thousands of whole ones fill the memory.

    ``flagged`` has those poses alone that were dropped; ``times`` is label -> what a detector took.
    """

    frames: int
    dropped_frames: int
    flagged: tuple[FlaggedPoses, ...]
    times: Mapping[str, DetectorTimes]
    audit: Mapping[str, DetectorAudit]
    request: str
    open_questions: int

    @classmethod
    def of(cls, document: RunDocument) -> "SessionOfBatch":
        """The same of a whole document."""
        return cls(
            frames=document.session.frames,
            dropped_frames=document.session.dropped_frames.total,
            flagged=tuple(poses for poses in document.flagged if poses.dropped),
            times={label: detector.seconds for label, detector in document.detectors.items()},
            audit=document.audit,
            request=document.request,
            open_questions=len(document.open_questions),
        )


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
    audit : label -> counts over all that are done, as ``replay.audit``.
    runs : name -> session, for those that are done.
    """

    out: Path
    done: tuple[str, ...]
    kept: tuple[str, ...]
    failed: Mapping[str, str] = field(default_factory=dict)
    digest: str = ""
    audit: Mapping[str, DetectorAudit] = field(default_factory=dict)
    runs: Mapping[str, SessionOfBatch] = field(default_factory=dict)


def run_batch(
    sessions: Sequence[str | Path],
    out: str | Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    settings: Mapping[str, Any] = NO_SETTINGS,
    force: bool = False,
    on_done: OnDone | None = None,
    on_died: OnDone | None = None,
) -> Batch:
    """Run every session and write its run folder to ``out/<name of the file>``.

    Parameters
    ----------
    sessions : session files with different names: paths, or URLs of fsspec.
    out : folder of the batch, or the URL of one; a batch with the same settings that was begun there is continued.
    jobs : workers of Dask on this machine; 1: this process.
    scheduler : address of a scheduler of Dask whose workers do the work; they see paths as this process does, in a
        folder that all share.
    settings : for ``replay.run``: detectors, oracle, seed, picture.
    force : go on in a batch of other settings too, whose run folders are replaced one by one.
    on_done : called for each session when it is finished.
    on_died : called with a session and the address of the worker that ended while it replayed it.

    Raises ``OutputError``: two files of one name, a folder of something else, or a batch with other settings;
    ``PlaceError``: a URL that cannot be reached; ``WorkerError``: workers that cannot be used.
    """
    # A path that means the same in every process.
    path_of_name, folder = (
        _paths_by_name([path_of_place(path).absolute() for path in sessions]),
        path_of_place(out).absolute(),
    )
    run_settings = dict(settings)
    # Not whether there is a picture: it changes no answer, so a folder without pictures can be given them later.
    options = {name: value for name, value in run_settings.items() if name != "picture"}
    if run_settings.get("scene"):
        run_settings["scene"] = Path(run_settings["scene"]).absolute()
        options["scene"] = file_hash(run_settings["scene"])
    # As JSON, which has no tuples: a worker that reads it makes the same marks.
    request = json.loads(json.dumps({"schema": SCHEMA, "settings": options, "versions": versions()}))
    with store_errors(folder):
        existing_names, kept_names = _open_batch_folder(folder, request, force=force), set[str]()

    def tell(session_name: str, outcome: str) -> None:
        if outcome == KEPT_OUTCOME and session_name in existing_names:
            kept_names.add(session_name)
        if on_done is not None:  # what was not there and is kept, was done by a worker whose answer was lost
            on_done(
                session_name,
                DONE_OUTCOME if outcome == KEPT_OUTCOME and session_name not in existing_names else outcome,
            )

    tasks = {name: (path, folder / name, run_settings, request) for name, path in path_of_name.items()}
    try:
        failure_of_name = do_all(run_session, tasks, jobs, tell, scheduler, on_died)
    except KeyboardInterrupt:
        _remove_what_killed_workers_left(folder, path_of_name)
        raise
    done_names = tuple(name for name in path_of_name if name not in failure_of_name)
    digest, runs = batch_digest(folder, done_names)
    if not is_remote(folder):
        write_batch_tables(folder, {name: run.request for name, run in runs.items()})
    kept_done_names, audit = (
        tuple(name for name in done_names if name in kept_names),
        pooled_audits(session.audit for session in runs.values()),
    )
    return Batch(folder, done_names, kept_done_names, failure_of_name, "" if failure_of_name else digest, audit, runs)


def _remove_what_killed_workers_left(folder: Any, names: Iterable[str]) -> None:
    if is_remote(folder):
        return
    for name in names:
        with suppress(OSError, OutputError):
            remove_abandoned(folder / name, RUN_FOLDER.listed_files)


def batch_digest(out: Path, names: Sequence[str]) -> tuple[str, dict[str, SessionOfBatch]]:
    """SHA-256 over the digests of all detections and all rows of metrics, in order of name; name -> ``Batch.runs``."""
    batch_hash, runs = hashlib.sha256(), dict[str, SessionOfBatch]()
    for name in sorted(names):
        run = read_run_folder(out / name)
        answers = {label: detector.digest for label, detector in run.document.detectors.items()}
        # Times differ from run to run.
        metric_rows = [
            {key: value for key, value in row.items() if key not in TYPES_OF_MEASURES} for row in run.rows("metrics")
        ]
        batch_hash.update(json.dumps([name, answers, metric_rows], sort_keys=True).encode())
        runs[name] = SessionOfBatch.of(run.document)
    return batch_hash.hexdigest(), runs


def _paths_by_name(sessions: Sequence[Path]) -> dict[str, Path]:
    path_of_name: dict[str, Path] = {}
    for path in sorted(sessions, key=lambda session_path: session_path.name):
        if path.stem in ("", ".", "..") or path.stem.casefold() in (BATCH_FILE, TABLES):
            raise OutputError(f"{path}: a run folder cannot be called {path.stem!r}; give the file another name")
        if path_of_name.setdefault(path.stem, path) != path:
            raise OutputError(
                f"{path_of_name[path.stem]} and {path} would share one run folder; give them different names"
            )
    return path_of_name


def _open_batch_folder(out: Path, request: Mapping[str, Any], *, force: bool) -> set[str]:
    """Make or reopen the folder of a batch; the names of what is in it."""
    if out.is_file():
        raise OutputError(f"{out} is a file; name a folder for the runs")
    out.mkdir(parents=True, exist_ok=True)
    existing_names = (
        {entry.name for entry in out.iterdir()} if out.exists() else set[str]()
    )  # a store has no empty folders
    if BATCH_FILE in existing_names:
        try:
            previous_request = json.loads((out / BATCH_FILE).read_text(encoding="utf-8"))
            is_same_request = all(previous_request[key] == value for key, value in request.items())
        except (ValueError, KeyError, TypeError) as error:
            raise OutputError(f"{out / BATCH_FILE} cannot be read; name another folder") from error
        if not is_same_request and not force:
            raise OutputError(f"{out} holds a batch with other settings or of another version; name another folder")
    elif any(not name.startswith(".") for name in existing_names):
        raise OutputError(f"{out} holds something else than a batch of runs; name another folder")
    request_json = (json.dumps(request, indent=1, sort_keys=True) + "\n").encode()
    if is_remote(out):  # a store shows an object when it is whole
        (out / BATCH_FILE).write_bytes(request_json)
        return existing_names
    with whole_file(out / BATCH_FILE, OutputError) as file:
        file.write(request_json)
    return existing_names


def _is_whole(out: Path, request_digest: str, *, picture: bool) -> bool:
    try:
        is_complete = read_run_folder(out).document.request == request_digest
        return is_complete and ((out / PICTURE_FILE).is_file() or not picture)
    except RunFolderError:
        return False


def run_session(path: Path, out: Path, settings: Mapping[str, Any], request: Any = "") -> str:
    """Run one session into its folder: ``KEPT`` if it stands there already, why it failed, or ``""``."""
    try:
        with local_copy(path) as file:
            # Over all that is asked of the recording, and its contents; its run folder keeps it.
            request_digest = hashlib.sha256(json.dumps([request, file_hash(file)], sort_keys=True).encode()).hexdigest()
            if _is_whole(out, request_digest, picture=settings.get("picture", True)):
                return KEPT_OUTCOME
            with run_folder_for(
                out
            ) as folder:  # one begun in a store by a process that was killed is no run folder yet
                run(file, out=folder, force=True, request=request_digest, **settings)
    except Exception as error:
        return " ".join(f"{type(error).__name__}: {error}".split())
    return ""
