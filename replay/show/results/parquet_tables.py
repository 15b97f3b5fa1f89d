"""A run as tables: verdict data in float64 and int64, bodies by name, one row per thing that happened."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from cdcore import Verdict
from cdcore.numerics import IntArray
from cdcore.protocol import counts_as_contact, is_one_of
from replay.auditing.compare import VERDICT_FRAMES
from replay.auditing.fault import Fault
from replay.auditing.holding import overlaps_holding
from replay.auditing.outcome import Outcome
from replay.document.metrics.row import METRIC_TYPES, TASK_COLUMN_PREFIX, TYPES_OF_MEASURES, metric_rows
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult
from replay.document.summary import frame_seconds
from replay.prepare.flags import POSE_DOUBT_BITS, flag_word
from replay.show.results.parquet import table_of

VERDICT_NAMES: Final = [verdict.name for verdict in Verdict]
OUTCOME_NAMES: Final = [outcome.name for outcome in Outcome]

ROWS_PER_BATCH: Final = 200_000
"""Rows of the frame table that are made at a time: some 20 MB, for a session of any length."""

STATED_VERDICTS: Final = (Verdict.UNRESOLVED, Verdict.INVALID)
"""Verdicts that are no contact and still worth a row."""

Columns = dict[str, Any]


def frame_table(result: RunResult) -> Iterator[pa.Table]:
    """Pair-frames where anything happened, in order of time, part by part.

    A row stands for one pair in one frame that some detector calls contact, candidate, unresolved or invalid. Columns:
    ``frame stamp_ns time body_a body_b held``; per detector ``verdict/<label>``; per audited one ``outcome/<label>``,
    ``miss/<label>`` and ``false/<label>`` (number of the miss or the false contact, null outside);
    ``work/<label>/<counter>`` where counted per pair-frame; and ``frame_seconds/<label>`` (the whole frame, all pairs)
    where frames were timed. ``flag`` names what was in doubt about a pose of either body (``frozen+gap``; null:
    nothing); such pair-frames always have a row, except those after a gap, whose poses are not in doubt.
    """
    frames, columns = _eventful_pair_frames(result)
    numbers = {
        f"{kind}/{label}": _fault_numbers(faults[label], frames, columns)
        for label in result.comparisons
        for kind, faults in (("miss", result.misses), ("false", result.false))
    }
    for start in range(0, max(1, len(frames)), ROWS_PER_BATCH):
        batch = slice(start, start + ROWS_PER_BATCH)
        batch_numbers = {name: number[batch] for name, number in numbers.items()}
        yield pa.table(_frame_columns(result, frames[batch], columns[batch], batch_numbers))


def timing_table(result: RunResult) -> pa.Table:
    """Seconds of every frame: ``frame stamp_ns time``, and ``seconds/<label>/<stage>`` of detectors timed by frame."""
    frame_times = result.assembly.motion.times
    columns: Columns = {"frame": np.arange(len(frame_times)), "stamp_ns": result.assembly.stamp_ns, "time": frame_times}
    for label, detection in result.detections.items():
        for stage, value in detection.seconds.items():
            if isinstance(value, np.ndarray):
                columns[f"seconds/{label}/{stage}"] = value
    return pa.table(columns)


def series_table(result: RunResult) -> pa.Table:
    """Every value of every series of the effects: ``effect series unit time value``."""
    named_series = [(kind, name, series) for kind, run in result.effects.items() for name, series in run.series.items()]
    every_series = [series for _, _, series in named_series]
    series_rows = np.repeat(np.arange(len(every_series)), [len(series.times) for series in every_series])
    columns: Columns = {
        "effect": _dictionary(series_rows, [kind for kind, _, _ in named_series]),
        "series": _dictionary(series_rows, [name for _, name, _ in named_series]),
        "unit": _dictionary(series_rows, [series.unit for series in every_series]),
        "time": pa.array(np.concatenate([np.zeros(0), *(series.times for series in every_series)])),
        "value": pa.array(np.concatenate([np.zeros(0), *(series.values for series in every_series)])),
    }
    return pa.table(columns)


def metrics_table(result: RunResult) -> pa.Table:
    """The metrics of a run, columns of ``METRIC_TYPES`` and ``TYPES_OF_MEASURES`` and one per task."""
    metric_columns = [row | _measured_columns(result.document, row["detector"]) for row in metric_rows(result)]
    tasks = sorted(
        name for name in (metric_columns[0] if metric_columns else {}) if name.startswith(TASK_COLUMN_PREFIX)
    )
    return table_of(metric_columns, METRIC_TYPES | TYPES_OF_MEASURES | dict.fromkeys(tasks, float))


def _measured_columns(document: RunDocument, label: str) -> dict[str, Any]:
    detector = document.detectors.get(label)
    seconds = None if detector is None else detector.seconds
    samples = None if seconds is None else seconds.sample_times
    durations_s = (
        None if seconds is None else seconds.per_frame_mean,
        None if samples is None else samples.p99,
        None if samples is None else samples.max,
    )
    milliseconds = [None if time is None else 1e3 * time for time in durations_s]
    return dict(
        zip(TYPES_OF_MEASURES, (document.oracle, document.session.facts.get("vr_type"), *milliseconds), strict=True)
    )


def _eventful_pair_frames(result: RunResult) -> tuple[IntArray, IntArray]:
    """Frame and column of every pair-frame in which anything happened, looked for in some frames at a time."""
    rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for start in range(0, len(result.assembly.stamp_ns), VERDICT_FRAMES):
        verdicts = [detection.verdict[start : start + VERDICT_FRAMES] for detection in result.detections.values()]
        is_marked = [counts_as_contact(verdict) | is_one_of(verdict, STATED_VERDICTS) for verdict in verdicts]
        if is_marked:
            is_flagged = result.flags.of_pairs(result.assembly.pairs, start, start + VERDICT_FRAMES)
            is_marked += [((is_flagged & POSE_DOUBT_BITS) > 0) & (verdict != Verdict.NO_POSE) for verdict in verdicts]
            frame, column = np.nonzero(np.logical_or.reduce(is_marked))
            rows.append(frame + start)
            columns.append(column)
    return np.concatenate(rows), np.concatenate(columns)


def _flag_column(result: RunResult, frames: IntArray, columns: IntArray) -> pa.DictionaryArray:
    pair_bodies = result.assembly.pairs[columns]
    flag_bits = result.flags.bodies[frames, pair_bodies[:, 0]] | result.flags.bodies[frames, pair_bodies[:, 1]]
    codes, code_index = np.unique(flag_bits, return_inverse=True)
    flag_indices = pa.array(code_index.reshape(-1).astype(np.int32), mask=flag_bits == 0)
    return pa.DictionaryArray.from_arrays(
        flag_indices, pa.array([flag_word(code) for code in codes.tolist()], pa.string())
    )


def _frame_columns(result: RunResult, frames: IntArray, columns: IntArray, numbers: Mapping[str, IntArray]) -> Columns:
    names, pair_bodies = list(result.assembly.names), result.assembly.pairs[columns]
    table: Columns = {
        "frame": pa.array(frames),
        "stamp_ns": pa.array(result.assembly.stamp_ns[frames]),
        "time": pa.array(result.assembly.motion.times[frames]),
        "body_a": _dictionary(pair_bodies[:, 0], names),
        "body_b": _dictionary(pair_bodies[:, 1], names),
        "held": pa.array(result.assembly.grasped[columns] | overlaps_holding(result.holdings, columns, frames, frames)),
        "flag": _flag_column(result, frames, columns),
    }
    for label, detection in result.detections.items():
        table[f"verdict/{label}"] = _dictionary(detection.verdict[frames, columns], VERDICT_NAMES)
    for label, comparison in result.comparisons.items():
        table[f"outcome/{label}"] = _dictionary(comparison.outcome[frames, columns], OUTCOME_NAMES)
        for name in (f"miss/{label}", f"false/{label}"):
            table[name] = pa.array(numbers[name], mask=numbers[name] == 0)
    for label, detection in result.detections.items():
        for counter, count in detection.work.items():
            if isinstance(count, np.ndarray):
                table[f"work/{label}/{counter}"] = pa.array(count[frames, columns].astype(np.int64))
        seconds = frame_seconds(detection)
        if seconds is not None:
            table[f"frame_seconds/{label}"] = pa.array(seconds[frames])
    return table


def _dictionary(values: NDArray[np.integer], names: list[str]) -> pa.DictionaryArray:
    return pa.DictionaryArray.from_arrays(pa.array(values.astype(np.int32)), pa.array(names, pa.string()))


def _fault_numbers(faults: Sequence[Fault], frames: IntArray, columns: IntArray) -> IntArray:
    """Number of the miss or the false contact that each row belongs to, 0 outside."""
    fault_numbers = np.zeros(len(frames), dtype=np.int64)
    for fault in faults:
        start, stop = np.searchsorted(frames, [fault.first, fault.last + 1])
        fault_numbers[start:stop][columns[start:stop] == fault.pair] = fault.number
    return fault_numbers
