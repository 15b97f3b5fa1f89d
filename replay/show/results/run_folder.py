"""Run folders, written whole or not at all: everything gets a temporary name beside the folder, then is renamed."""

import json
import shutil
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import structs

from replay.auditing.fault import Fault
from replay.detection.progress import Advance, ignore_progress
from replay.document.answer import Answer
from replay.document.coding import json_of
from replay.document.columns import FILE_TABLES
from replay.document.contact import ContactRecord, EventRecord, contacts_by_detector, events_of
from replay.document.file_hash import file_hash
from replay.document.machine import give_back_memory
from replay.document.ranking import Rank, ranking
from replay.document.result_tables import faults_of_rows
from replay.document.run_document import SCHEMA, RunDocument
from replay.document.run_result import RunResult
from replay.document.summary import frame_seconds, recording_mark
from replay.document.tables import Column
from replay.effects.output import plain_value
from replay.errors import OutputError, RunFolderError
from replay.prepare.session_input import require_folder
from replay.show.report.page import write_report
from replay.show.results import parquet_tables
from replay.show.results.parquet import read_table, with_keys
from replay.show.results.reading import checked_document, checked_rows, checked_table, read_json
from replay.show.run_tables import stored_tables
from replay.show.tradeoff_table import tradeoff_numbers
from sessions.model.constants import SCENE_FACT
from sessions.whole_files import whole_folder

SUMMARY_FILE: Final = "summary.json"
PICTURE_FILE: Final = "run.rrd"
REPORT_FILE: Final = "report.html"

READ_TABLES: Final[Mapping[str, Mapping[str, Column]]] = {
    name: {column.name: column for column in table.columns} for name, table in FILE_TABLES.items() if table.joined
}
"""The tables that are read again as rows, with their columns by name."""


@dataclass(frozen=True)
class FolderKind:
    """A kind of folder that a command writes and, when asked, replaces."""

    what: str  # its name in sentences
    mark: str  # the file that says what the folder is; its key ``files`` lists what was written
    schema: str  # what its key ``schema`` holds, up to the version

    def listed_files(self, folder: Path) -> tuple[str, ...]:
        """The files that a command wrote into a folder, the mark last; ``OutputError``: it is none of this kind."""
        if not any(folder.iterdir()):
            return ()
        try:
            mark = read_json(folder / self.mark)
            family, names = self.schema.rpartition("/")[0], list(mark["files"])
            is_right = str(mark["schema"]).rpartition("/")[0] == family and all(is_plain_name(name) for name in names)
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            is_right = False
        if not is_right or any((folder / name).is_dir() for name in names):
            raise OutputError(f"{folder} is not a {self.what} folder and is not replaced; name another folder")
        return (*(name for name in names if name != self.mark), self.mark)


def is_plain_name(name: Any) -> bool:
    """Whether this is the name of a file in a folder, and leads nowhere else."""
    return isinstance(name, str) and Path(name).name == name and name not in ("", ".", "..") and "\0" not in name


RUN_FOLDER: Final = FolderKind("run", SUMMARY_FILE, SCHEMA)


def check_target(out: Path, *, force: bool = False, kind: FolderKind = RUN_FOLDER) -> None:
    """Refuse a folder that cannot become one of a kind, before the work is done and not after.

    With ``force``, an earlier folder of the kind or an empty folder may be replaced; any other folder never is. Raises
    ``OutputError``, which says what is in the way.
    """
    if not out.exists():
        return
    if not out.is_dir():
        raise OutputError(f"{out} is a file; name a folder for the {kind.what}")
    if not force:
        raise OutputError(f"{out} exists; name another folder, or replace it with --force")
    if out.is_symlink():
        raise OutputError(f"{out} is a link and is not replaced; name the folder itself")
    kind.listed_files(out)


def result_folder(out: Path, kind: FolderKind, *, force: bool) -> AbstractContextManager[Path]:
    """A folder to write into that appears whole; with ``force`` in place of what an earlier one of its kind lists."""
    return whole_folder(out, OutputError, kind.listed_files if force else None)


def write_summary(folder: Path, kind: FolderKind, summary: Mapping[str, Any]) -> None:
    """Write the file that says what a folder is and which files are in it; the last to be written."""
    files = sorted([kind.mark, *(entry.name for entry in folder.iterdir())])
    text = json.dumps({**summary, "files": files}, indent=1, allow_nan=False, default=plain_value)
    (folder / kind.mark).write_text(text + "\n", encoding="utf-8", newline="\n")


def _write_document(folder: Path, document: RunDocument) -> None:
    """Write the document of a run, the last file of its folder, with the names of all files."""
    files = sorted([SUMMARY_FILE, *(entry.name for entry in folder.iterdir())])
    text = json_of(structs.replace(document, files=tuple(files)))
    (folder / SUMMARY_FILE).write_text(text, encoding="utf-8", newline="\n")


def table_file(folder: Path, name: str) -> Path:
    """Return the file of a table in a run folder."""
    return folder / f"{name}.parquet"


def write_run_folder(
    result: RunResult,
    out: Path,
    *,
    force: bool = False,
    picture: bool = False,
    files: Mapping[str, Path] | None = None,
    advance: Advance = ignore_progress,
) -> Path:
    """Write tables, summary, report and picture of a run to the folder ``out``; folders above it are made too.

    ``force`` replaces an earlier run folder of that name; with ``picture`` there is a recording for Rerun;
    ``files`` are further files to put in, name -> where they are; ``advance`` is called with 20 in all. Raises
    ``OutputError``: the folder exists, or cannot be written.
    """
    check_target(out, force=force)
    if picture:
        from replay.show.rerun_log.recording import write_recording
    with result_folder(out, RUN_FOLDER, force=force) as folder:
        _write_frames(result, table_file(folder, "frames"))
        _release_memory()
        advance(3)
        for name, rows in result.tables.items():
            _write_table(with_keys(rows.to_arrow(), result), table_file(folder, name))
        _write_table(with_keys(parquet_tables.metrics_table(result), result), table_file(folder, "metrics"))
        if any(frame_seconds(detection) is not None for detection in result.detections.values()):
            _write_table(parquet_tables.timing_table(result), table_file(folder, "timing"))
        for name, rows in stored_tables(result).items():
            _write_table(rows.to_arrow(), table_file(folder, name))
        if result.effects:
            _write_table(parquet_tables.series_table(result), table_file(folder, "series"))
        _release_memory()
        advance(2)
        if picture:
            write_recording(result, folder / PICTURE_FILE)
        advance(10)
        write_report(replace(result, out=out), folder / REPORT_FILE)
        advance(5)
        for name, file in (files or {}).items():
            shutil.copyfile(file, folder / name)
        document = result.document
        if result.tradeoff is not None:
            _write_table(tradeoff_numbers(result.tradeoff).to_arrow(), table_file(folder, "tradeoff"))
            document = structs.replace(document, tradeoff=result.tradeoff.record)
        if picture:
            document = structs.replace(document, picture_sha256=file_hash(folder / PICTURE_FILE))
        _write_document(folder, document)
    return out


@dataclass(frozen=True)
class RunFolder:
    """A run folder that was found to be one; ``document`` is what ``summary.json`` holds."""

    path: Path
    document: RunDocument

    @property
    def oracle(self) -> str:
        """Label of the detection the others are compared with, or ``""``."""
        return self.document.oracle

    @cached_property
    def ranking(self) -> tuple[Rank, ...]:
        """The audited detectors, the worst first, and the oracle last."""
        return ranking(self.document)

    @property
    def answers(self) -> tuple[Answer, ...]:
        """The answer about each audited detector, in the order of the ranking."""
        return self.document.answers

    @cached_property
    def faults(self) -> dict[str, list[Fault]]:
        """Faults of every audited detector, false contacts first; ``RunFolderError``: no run writes such rows."""
        faults: dict[str, list[Fault]] = {label: [] for label in self.document.audit}
        pairs = [pair.name for pair in self.document.pairs]
        for name in ("false", "misses"):
            try:
                for fault in faults_of_rows(name, self.rows(name), pairs):
                    faults[fault.detector].append(fault)
            except (ValueError, KeyError) as error:
                raise RunFolderError.unreadable(table_file(self.path, name), error) from error
        return faults

    @cached_property
    def contacts(self) -> dict[str, list[ContactRecord]]:
        """Contacts of every detector, in order of time; ``RunFolderError``: no run writes such rows."""
        return contacts_by_detector(self.rows("episodes"), self.document.detectors)

    @cached_property
    def events(self) -> tuple[EventRecord, ...]:
        """Events of the recording and of the effects, in order of time; ``RunFolderError``: no run writes such rows."""
        return events_of(self.rows("events"))

    @property
    def has_picture(self) -> bool:
        """Whether there is a recording for Rerun, whole or not."""
        return (self.path / PICTURE_FILE).is_file()

    @cached_property
    def picture(self) -> Path:
        """The recording for Rerun, byte by byte as the run wrote it.

        Raises ``RunFolderError``: the run was made without one, or it was changed; Rerun draws a changed one silently.
        """
        path = self.path / PICTURE_FILE
        if not self.has_picture:
            raise RunFolderError(f"{self.path} holds no picture ({PICTURE_FILE}); run again without --no-picture")
        try:
            is_as_written = file_hash(path) == self.document.picture_sha256
        except OSError as error:
            raise RunFolderError.unreadable(path, error) from error
        if not is_as_written:
            raise RunFolderError(f"{path} is damaged: it is not the picture that its run wrote; run its session again")
        return path

    def find_recording(self, given_path: Path | None = None, scene: Path | None = None) -> Path:
        """The recording that was replayed: the one given, or one of its content in the folder, beside it or here.

        ``scene``: the one given in place of the recording's. Raises ``RunFolderError``: no recording, or no scene.
        """
        mark, replaced_scene = self.document.session.recording, self.document.session.facts.get(SCENE_FACT)
        if mark is None and given_path is None:
            raise RunFolderError(f"{self.path} replayed a session in memory; write it to a file and run that")
        folders = (self.path, self.path.parent, Path())
        files = (file for folder in folders for file in sorted(folder.glob("*.mcap")) if file.is_file())
        files_of_size = (file for file in files if mark is not None and file.stat().st_size == mark.bytes)
        recording = given_path or next((file for file in files_of_size if recording_mark(file) == mark), None)
        if recording is None:
            raise RunFolderError(f"the recording that {self.path} replayed is not beside it; say where: --session FILE")
        if replaced_scene and scene is None:
            raise RunFolderError(f"{self.path} replayed with the scene of {replaced_scene}; give it with --scene FILE")
        return recording

    def require_miss(self, number: int | None) -> None:
        """Refuse the number of a miss that is not in the run; the ``RunFolderError`` says which there are."""
        all_faults = chain.from_iterable(self.faults.values())
        highest_number = max((fault.number for fault in all_faults if fault.kind.is_miss), default=0)
        if number is not None and number > highest_number:
            numbers_text = (
                f"its misses are numbered 1 to {highest_number}" if highest_number else "nothing was missed in it"
            )
            raise RunFolderError(f"{self.path} has no miss {number}; {numbers_text}")

    def require_digest(self, recording: Path, digest: str) -> None:
        """Refuse a recording of another hash."""
        if digest != self.document.session.digest:
            raise RunFolderError(f"{recording} is not the recording that {self.path} replayed; its contents differ")

    def rows(self, name: str) -> list[dict[str, Any]]:
        """The rows of one of ``READ_TABLES``; ``RunFolderError``: no run writes such rows."""
        path, columns = table_file(self.path, name), READ_TABLES[name]
        table = read_table(path)
        stored_count = self.document.tables.get(name)
        if stored_count is not None and stored_count.rows != len(table):
            counts_clause = f"{len(table):,} rows, and {SUMMARY_FILE} counts {stored_count.rows:,}"
            raise RunFolderError(f"{path} holds {counts_clause}; run its session again")
        if len(table) > path.stat().st_size:
            raise RunFolderError(f"{path} claims {len(table):,} rows that it does not hold; run its session again")
        table = checked_table(path, table, columns)
        return checked_rows(path, table, columns, self.document).to_pylist()


def read_run_folder(path: str | Path) -> RunFolder:
    """Open a run folder; ``RunFolderError`` where it holds no summary, one of another schema, or one that is damaged.

    Anybody may have sent it: every value that is known has the type that a run writes.
    """
    path = require_folder(path)
    try:
        summary = read_json(path / SUMMARY_FILE)
    except (OSError, ValueError) as error:
        no_summary_clause = f"it has no readable {SUMMARY_FILE}; make one with `replay run`"
        raise RunFolderError(f"{path} is not a run folder: {no_summary_clause}") from error
    schema = summary.get("schema") if isinstance(summary, dict) else None
    if schema != SCHEMA:
        raise RunFolderError(f"{path / SUMMARY_FILE} {_other_version(schema)}")
    return RunFolder(path, checked_document(path / SUMMARY_FILE, summary))


def _other_version(schema: Any) -> str:
    """Say what to do with a document of another schema."""
    family, number = SCHEMA.rsplit("/", 1)
    given_family, _, version = str(schema).rpartition("/")
    if given_family != family or not version.isdecimal():
        return f"has schema {repr(schema)[:60]}, this version reads {SCHEMA!r}; run its session again"
    if len(version) > len(number) or int(version) > int(number):
        return f"was written by a newer version ({schema[:40]}, this one reads {SCHEMA}); update vrlab-replay"
    return (
        f"was written by an older version ({schema}, this one reads {SCHEMA}); make the folder anew: "
        "replay run SESSION.mcap --out FOLDER --force"
    )


def _release_memory() -> None:
    """Return the memory of tables, which Arrow and the C library keep: 0.1 GiB of two hours of twelve bodies."""
    pa.default_memory_pool().release_unused()
    give_back_memory()


def _write_table(table: pa.Table, path: Path) -> None:
    pq.write_table(table, path, compression="zstd")


def _write_frames(result: RunResult, path: Path) -> None:
    writer: pq.ParquetWriter | None = None
    try:
        for batch in parquet_tables.frame_table(result):
            writer = writer or pq.ParquetWriter(path, batch.schema, compression="zstd")
            writer.write_table(batch)
    finally:
        if writer is not None:
            writer.close()
