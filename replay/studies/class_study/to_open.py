"""The sessions to look at first: those in which a detector misses most, each a click from its worst miss."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final
from urllib.parse import quote

from replay.outputs.results.run_folder import REPORT
from replay.outputs.share.folder import pages_of, run_key
from replay.outputs.tables import Cell, Marked, Table, table
from replay.outputs.words import address
from replay.studies.class_study.class_runs import ClassRuns, Row, grouped, missed_by
from replay.studies.class_study.class_tables import percent, plain
from sessions.mcap_format.metadata import NOT_STATED

ABOUT_RECORDINGS: Final = (
    "A row is one recording. It counts what a detector missed, and nothing that the student did or answered."
)

Place = tuple[str, str]
"""Name and address of a session's page."""


def places(runs: ClassRuns, out: Path, shared: Path | None) -> dict[str, Place]:
    """Run -> name and address, from a page in the folder ``out``: of a shared folder, or else of the run's report."""
    shared_pages = pages_of(shared) if shared is not None else {}
    found = {}
    for run in runs.metrics:
        # A run folder has the name of its session file, which may be a person's.
        folder, name = runs.top / run, runs.of(run, "session") or run
        page = folder / REPORT
        if shared is not None and (key := run_key(folder)) in shared_pages:
            page = shared / shared_pages[key]
            name = page.stem if page.stem != "index" else shared.resolve().name
        found[run] = (name, quote(Path(os.path.relpath(page.resolve(), out.resolve())).as_posix()))
    return found


def sessions_table(runs: ClassRuns, where: Mapping[str, Place]) -> Table:
    """A row per session, by the detector that misses most in it: those of most misses first."""
    misses = {(run, label): found for (run, label), found in grouped(runs.tables["misses"], "run", "detector").items()}
    lost = grouped(runs.tables["episodes"], "run")
    rows: list[tuple[tuple[float, float, str], list[Cell]]] = []
    for run, detectors in runs.metrics.items():
        audited = [label for label in detectors if runs.of(run, "oracle") not in ("", label)]
        label = max(audited, key=lambda one: len(misses.get((run, one), ())), default="")
        found, first = misses.get((run, label), []), next(iter(detectors.values()))
        never = sum(missed_by(row, label) for row in lost.get((run,), ()) if label)
        name, page = where[run]
        look: Cell = "nothing missed" if audited else "not audited"
        if found:
            look = _look(min(found, key=_depth), page, "" if label == audited[0] else label)
        flagged = first["flagged_share"]
        cells: list[Cell] = [
            Marked(name, to=page), look, label, runs.of(run, "vr_type") or NOT_STATED, len(found), never,
            "" if flagged is None else percent(flagged), plain(first["valid_minutes"] or 0.0),
        ]  # fmt: skip
        rows.append(((-len(found), -(flagged or 0.0), run), cells))
    head = (
        "session", "look at", "by", "VR type", "misses", "never found", "poses not recorded", "minutes",
    )  # fmt: skip
    ordered = [cells for _, cells in sorted(rows, key=lambda one: one[0])]
    return table("Sessions, most misses first", head, ordered, words=4, notes=(ABOUT_RECORDINGS,))


def _depth(miss: Row) -> tuple[bool, float, int]:
    """The longest cut first, as the cards of a report; one that no frame shows has none."""
    return miss["touch"] is not None, -(miss["cut_length"] or 0.0), miss["number"]


def _look(miss: Row, page: str, by: str) -> Marked:
    words = f"{miss['body_a']} - {miss['body_b']} at {miss['start']:.2f} s"
    at = address("miss", miss["number"], quote(by))
    return Marked(words, below=f"miss {miss['number']}, {miss['kind']}", to=f"{page}#{at}")
