"""A session folder of UXF: its trials, and one CSV per tracked object and trial.

Rotations are Unity's Euler angles in degrees (z, then x, then y about fixed axes); stamps are Unity's ``Time.time``.
A tracker's file is ``OBJECT_DESCRIPTOR_T001.csv`` with the columns of a PositionRotationTracker.

Source: Brookes et al., "Studying human behavior with virtual reality: The Unity Experiment Framework", Behavior
Research Methods 52 (2020); its wiki, page *Output files*.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import PoseColumns
from sessions.importers.csv_head import read_head
from sessions.importers.csv_table import CsvTable
from sessions.importers.importing import PoseTable, SourceFrame, Stream, is_inverse, session_of_tables
from sessions.importers.ledger import LARGEST_SECONDS, Ledger, Numbers, Stamps
from sessions.importers.unstated_units import degrees_by_format
from sessions.input_files import check_regular
from sessions.model.assumption import Assumption, Origin, Subject
from sessions.model.event import Interval
from sessions.model.session import Session

TRACKER: Final = re.compile(r"(?P<body>.+?)_(?P<what>[^_]+)_T(?P<trial>\d+)\.csv")
POSITION: Final = ("pos_x", "pos_y", "pos_z")
POSE: Final = PoseColumns(POSITION, ("rot_z", "rot_x", "rot_y"), "euler", "zxy")
QUATERNION_POSE: Final = PoseColumns(POSITION, ("rot_x", "rot_y", "rot_z", "rot_w"))
"""The columns of a tracker of one's own that writes quaternions."""
TIME: Final = "time"
TRIALS: Final = "trial_results.csv"
LONGEST_HEADER: Final = 10_000


def read_uxf(source: Path, *, convention: str | None = None, rotations: str | None = None) -> Session:
    """Everything in a UXF session folder such as ``experiment/participant/S001``.

    Every trial of ``trial_results.csv`` is an interval of kind ``task``; its other columns are data of it. Every other
    column of numbers of a tracker is a scalar, ``OBJECT/COLUMN``.

    Parameters
    ----------
    convention : axes of the poses, where a tracker of your own writes others than Unity's.
    rotations : their direction, of ``ROTATIONS``; ``None``: that of a pose.

    Raises ``ImportFileError``: names folder, file, line and column.
    """
    folder = source.parent if source.is_file() else source
    ledger = Ledger(folder)
    poses: dict[str, list[PoseTable]] = {}
    numbers: dict[str, list[tuple[Stamps, Numbers]]] = {}
    notes = list[str]()
    angles = list[Numbers]()
    for path, body in _trackers(folder):
        if not _begins_with(path, TIME):
            ledger.book("files", path.name, read=1, kept=0, dropped={f"whose first line does not name {TIME}": 1})
            continue
        table = CsvTable(path, ledger, read_head(path, (TIME,)).layout, body=path.name)
        ledger.book("rows", path.name, read=len(table), kept=len(table))
        stamps = table.stamps(TIME, "s")
        form = QUATERNION_POSE if "rot_w" in table.columns else POSE
        if POSITION[0] in table.columns:
            poses.setdefault(body, []).append(table.poses(form, stamps))
            if form is POSE:
                angles.append(table.measurements(form.rotation))
        for column in table.columns:
            if column not in (TIME, *form.numbers) and table.holds_numbers(column):
                values = table.measurements((column,))[:, 0]
                numbers.setdefault(f"{body}/{column}", []).append((stamps, values))
        notes += [f"{path.name}: {note}" for note in table.notes]
    tables = {body: PoseTable(*map(np.concatenate, zip(*chunks, strict=True))) for body, chunks in poses.items()}
    streams = []
    for name, chunks in numbers.items():
        times, values = map(np.concatenate, zip(*chunks, strict=True))
        streams.append(Stream(name, times, values))
    trials = _trials(folder, ledger)
    assumed = ("clock in s since the start of the program (Unity's Time.time)",)
    frame = SourceFrame.in_axes(convention, "unity", "", "Unity's Time.time, s", assumed)
    frame = replace(frame, inverse_rotations=is_inverse(rotations))
    if angles:
        notes.insert(0, "rotations from Euler angles zxy in degrees to unit quaternions")
        frame = replace(
            frame, others=(Assumption(Subject.EULER_ORDER, "zxy", Origin.FORMAT), degrees_by_format(angles))
        )
    samples = session_of_tables(tables, frame, ledger, notes, streams)
    return replace(samples, intervals=tuple(trials), facts={"source_file": folder.name, **samples.facts})


def _trackers(folder: Path) -> Iterator[tuple[Path, str]]:
    """Every tracker's file, by trial, and the body it follows."""
    named = ((TRACKER.fullmatch(path.name), path) for path in sorted(folder.rglob("*.csv")))
    trackers = [(match, path) for match, path in named if match]
    for _, path in trackers:
        check_regular(path, "tracker file", ImportFileError)
    names = [path.name for path in (*folder.rglob(TRIALS), *(path for _, path in trackers))]
    if len({*names}) < len(names):
        raise ImportFileError(f"{folder}: several sessions are in it; name the folder of one")
    if not any(_begins_with(path, POSITION[0]) for _, path in trackers):
        raise ImportFileError(
            f"{folder}: no file OBJECT_movement_T001.csv with columns {', '.join(POSITION)}; "
            "name the session's folder, for example experiment/participant/S001"
        )
    for match, path in sorted(trackers, key=lambda tracker: (int(tracker[0]["trial"]), str(tracker[1]))):
        yield path, match["body"] if match["what"] == "movement" else f"{match['body']}_{match['what']}"


def _begins_with(path: Path, column: str) -> bool:
    """Whether a file's header seems to name a column."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return column in file.readline(LONGEST_HEADER)


def _trials(folder: Path, ledger: Ledger) -> list[Interval]:
    """Every trial that began and ended, with the other columns of its row."""
    intervals, rows = list[Interval](), 0
    for path in folder.rglob(TRIALS):
        check_regular(path, "trial file", ImportFileError)
        table = CsvTable(path, ledger, read_head(path, ("start_time", "end_time")).layout, body=path.name)
        rows += len(table)
        spans = table.numbers(("start_time", "end_time"))
        cells = {name: table.texts(name) for name in table.columns if name not in ("start_time", "end_time")}
        for row, (start, end) in enumerate(spans.tolist()):
            if 0.0 <= start <= end < LARGEST_SECONDS:
                data = {name: column[row] for name, column in cells.items() if column[row]}
                name = f"trial {data.get('trial_num', row + 1)}"
                intervals.append(Interval(round(start * 1e9), round(end * 1e9), "task", name, data))
    ledger.book("trials", read=rows, kept=len(intervals), dropped={"that did not end": rows - len(intervals)})
    return intervals
