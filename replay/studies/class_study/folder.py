"""A study as files: a page to read, tables for further work, and JSON with everything that it was made from."""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from replay.outputs.results.run_folder import FolderKind, check_target, result_folder, write_summary
from replay.studies.class_study.analysis import Study, associated, conclusion
from replay.studies.class_study.class_runs import ClassRuns
from replay.studies.class_study.class_tables import places
from replay.studies.class_study.page import study_html

SCHEMA: Final = "vrlab-study/1"
PAGE: Final = "study.html"
SUMMARY: Final = "study.json"
ASSOCIATIONS: Final = "associations.csv"
RELIABILITY: Final = "reliability.csv"
SENSITIVITY: Final = "sensitivity.csv"

STUDY: Final = FolderKind("study", SUMMARY, SCHEMA)


def write_study(
    runs: ClassRuns,
    study: Study | None,
    out: Path,
    *,
    inputs: dict[str, str],
    title: str = "Class",
    force: bool = False,
    seed: int = 0,
) -> Path:
    """Write a study folder; whole, or not at all.

    ``inputs`` are names and digests of the files, and the seed; ``title`` heads the page, which leads to the reports
    of the runs; ``force`` replaces an earlier study folder. Raises ``OutputError``: the folder exists, or cannot be
    written; ``StudyRefusedError``: ``causal-wording``.
    """
    check_target(out, force=force, kind=STUDY)
    page = study_html(runs, places(runs, out), study, title, seed)
    with result_folder(out, STUDY, force=force) as folder:
        (folder / PAGE).write_text(page, encoding="utf-8", newline="\n")
        if study is not None:
            _write_csv(folder / ASSOCIATIONS, association_rows(study))
            _write_csv(folder / RELIABILITY, reliability_rows(study))
            _write_csv(folder / SENSITIVITY, [asdict(row) for row in study.sensitivity])
        write_summary(folder, STUDY, {"schema": SCHEMA, "inputs": inputs} | as_json(runs, study))
    return out


def association_rows(study: Study) -> list[dict[str, Any]]:
    """One row per coefficient, each with its n, the detector and what that misses."""
    return [
        {
            "outcome": one.outcome, **{name: value for name, value in asdict(c).items() if name != "name"},
            "predictor": c.name, "regression": one.kind, "adjusted_r2": one.adjusted_r2, "students": one.students,
            "rows": one.rows, "associated": associated(c), "conclusion": conclusion(c),
            "detector": study.detector, "recall": study.recall,
        }
        for one in study.regressions
        for c in one.coefficients
    ]  # fmt: skip


def reliability_rows(study: Study) -> list[dict[str, Any]]:
    """One row per construct."""
    return [
        {
            "construct": name, "alpha": r.alpha, "low": r.low, "high": r.high, "items": r.items,
            "students": r.students, "least_item_total": min(r.item_total),
        }
        for name, r in study.reliabilities.items()
    ]  # fmt: skip


def as_json(runs: ClassRuns, study: Study | None) -> dict[str, Any]:
    """Everything that JSON can hold; a value that is no number is null."""
    told: dict[str, Any] = {"sessions": len(runs.metrics)}
    if study is not None:
        told |= asdict(replace(study, refusals=(), regressions=(), reliabilities={}))
        for name in ("refusals", "regressions", "reliabilities"):
            del told[name]
        told["refused"] = [
            {"result": r.what, "rule": r.rule, "reason": r.reason, "lift": r.lift} for r in study.refusals
        ]
        told |= {"reliability": reliability_rows(study), "associations": association_rows(study)}
    plain: dict[str, Any] = _plain(told)
    return plain


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write_csv(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        if rows:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
