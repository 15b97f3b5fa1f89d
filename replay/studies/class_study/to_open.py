"""The sessions to look at first: those in which a detector misses most, each a click from its worst miss."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final
from urllib.parse import quote

from replay.outputs.results.run_folder import REPORT
from replay.outputs.tables import Cell, Marked, Table, table
from replay.outputs.words import address
from replay.studies.class_study.class_runs import ClassRuns, Row, grouped
from replay.studies.class_study.refusals import LEAST_IN_CELL

ABOUT_RECORDINGS: Final = (
    "A row is a link to one recording, and no figure of it: what is counted of fewer than five students is not shown."
)

Place = tuple[str, str]
"""Name and address of a session's page."""


def places(runs: ClassRuns, out: Path) -> dict[str, Place]:
    """Run -> name and address of its report, from a page in the folder ``out``."""
    found = {}
    for run in runs.metrics:
        # A run folder has the name of its session file, which may be a person's.
        name, page = runs.of(run, "session") or run, runs.top / run / REPORT
        found[run] = (name, quote(Path(os.path.relpath(page.resolve(), out.resolve())).as_posix()))
    return found


def sessions_table(runs: ClassRuns, where: Mapping[str, Place]) -> Table:
    """The sessions in which a detector misses most, of five students at least, by name: links, and no figure of one."""
    misses = {(run, label): found for (run, label), found in grouped(runs.tables["misses"], "run", "detector").items()}
    rows: dict[str, list[Cell]] = {}
    for run, detectors in runs.metrics.items():
        audited = [label for label in detectors if runs.of(run, "oracle") not in ("", label)]
        label = max(audited, key=lambda one: len(misses.get((run, one), ())), default="")
        found = misses.get((run, label), [])
        name, page = where[run]
        look: Cell = "nothing missed" if audited else "not audited"
        if found:
            look = _look(min(found, key=_depth), page, "" if label == audited[0] else label)
        rows[run] = [Marked(name, to=page), look, label]
    most = sorted(rows, key=lambda run: (-len(misses.get((run, str(rows[run][2])), ())), run))
    students, chosen = set[str](), list[str]()
    for run in most:
        if len(students) >= LEAST_IN_CELL and len(chosen) >= LEAST_IN_CELL:
            break
        chosen.append(run)
        # A session of nobody may be of anybody already there.
        students |= {runs.of(run, "student")} - {""}
    return table(
        "Sessions with most misses, by name", ("session", "look at", "by"), [rows[run] for run in sorted(chosen)],
        words=3, notes=(ABOUT_RECORDINGS,),
    )  # fmt: skip


def _depth(miss: Row) -> tuple[bool, float, int]:
    """The longest cut first, as the cards of a report; one that no frame shows has none."""
    return miss["touch"] is not None, -(miss["cut_length"] or 0.0), miss["number"]


def _look(miss: Row, page: str, by: str) -> Marked:
    words = f"{miss['body_a']} - {miss['body_b']} at {miss['start']:.2f} s"
    at = address("miss", miss["number"], quote(by))
    return Marked(words, below=f"miss {miss['number']}, {miss['kind']}", to=f"{page}#{at}")
