"""A study as files: a page to read, tables for further work, and JSON with everything that it was made from."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from replay.show.results.run_folder import FolderKind, check_target, result_folder, write_summary
from replay.show.results.spreadsheets import CSV, write_tables
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_runs import ClassRuns
from replay.studies.class_study.class_tables import places
from replay.studies.class_study.page import Heading, study_html
from replay.studies.class_study.tables import study_tables

SCHEMA: Final = "vrlab-study/1"
PAGE_FILE: Final = "study.html"
SUMMARY_FILE: Final = "study.json"

STUDY_FOLDER: Final = FolderKind("study", SUMMARY_FILE, SCHEMA)


def write_study(
    runs: ClassRuns,
    study: Study | None,
    out: Path,
    *,
    inputs: dict[str, str],
    heading: Heading = Heading(),  # noqa: B008  (frozen)
    force: bool = False,
    seed: int = 0,
    tables: str = CSV,
) -> Path:
    """Write a study folder; whole, or not at all.

    ``inputs`` are names and digests of the files, and the seed; ``heading`` is that of the page, which leads to the
    reports of the runs; ``force`` replaces an earlier study folder; ``tables`` is the form of its tables.

    Raises ``OutputError``: the folder exists, or cannot be written.
    """
    check_target(out, force=force, kind=STUDY_FOLDER)
    page = study_html(runs, places(runs, out), study, heading, seed)
    with result_folder(out, STUDY_FOLDER, force=force) as folder:
        (folder / PAGE_FILE).write_text(page, encoding="utf-8", newline="\n")
        if study is not None:
            arrow_tables = {name: table.to_arrow() for name, table in study_tables(study).items() if table.rows}
            write_tables(arrow_tables, folder, tables)
        write_summary(folder, STUDY_FOLDER, {"schema": SCHEMA, "inputs": inputs} | as_json(runs, study))
    return out


def as_json(runs: ClassRuns, study: Study | None) -> dict[str, Any]:
    """Everything that JSON can hold; a value that is no number is null."""
    summary: dict[str, Any] = {"sessions": len(runs.metrics)}
    if study is not None:
        plain_fields = ("students", "rows", "detector", "recall", "kmo", "group_sizes", "warnings")
        summary |= {name: getattr(study, name) for name in plain_fields}
        summary["bartlett"] = None if study.bartlett is None else asdict(study.bartlett)
        summary["refused"] = [
            {"result": r.what, "rule": r.rule, "reason": r.reason, "lift": r.lift} for r in study.refusals
        ]
        summary |= {name: table.plain() for name, table in study_tables(study).items()}
    return summary
