"""A run as tables: verdict data in float64 and int64, bodies by name, one row per thing that happened."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from cdcore import Verdict
from cdcore.protocol import counts_as_contact
from replay.base.constants import VERDICT_FRAMES
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Episode, Outcome
from replay.outputs.results.effect_tables import EventRow, effect_event_rows
from replay.pipeline.run_result import RunResult
from replay.pipeline.summary import frame_seconds
from replay.prepare.flags import POSE_DOUBT, flag_words

VERDICT_WORDS: Final = [verdict.name for verdict in Verdict]
OUTCOME_WORDS: Final = [outcome.name for outcome in Outcome]

ROWS_PER_PART: Final = 1_000_000
"""Rows of the frame table that are made at a time: some 100 MB, for a session of any length."""

STATED: Final = np.array([Verdict.UNRESOLVED, Verdict.INVALID], dtype=np.uint8)
"""Verdicts that are no contact and still worth a row."""

Columns = dict[str, Any]


def frame_table(result: RunResult) -> Iterator[pa.Table]:
    """Pair-frames where anything happened, in order of time, part by part.

    A row stands for one pair in one frame that some detector calls contact, candidate, unresolved or invalid. Columns:
    ``frame stamp_ns time body_a body_b held``; per detector ``verdict/<label>``; per audited one ``outcome/<label>``
    and ``miss/<label>`` (number of the miss, null outside); ``work/<label>/<counter>`` where counted per pair-frame;
    and ``frame_seconds/<label>`` (the whole frame, all pairs) of online detectors. ``flag`` names what was in doubt
    about a pose of either body (``frozen+gap``; null: nothing); such pair-frames always have a row, except
    those after a gap, whose poses are not in doubt.
    """
    rows, columns = _happened(result)
    numbers = {label: _miss_numbers(result, label, rows, columns) for label in result.comparisons}
    for start in range(0, max(1, len(rows)), ROWS_PER_PART):
        part = slice(start, start + ROWS_PER_PART)
        cut = {label: number[part] for label, number in numbers.items()}
        yield pa.table(_frame_columns(result, rows[part], columns[part], cut))


def episode_table(result: RunResult) -> pa.Table:
    """Every contact of every detector, in order of time; ``number`` counts from 1 within a detector.

    Columns: ``detector number body_a body_b held first last frames start end``; ``missed_by`` names the audited
    detectors that never found an episode of the oracle, separated by commas. Of an audited detector ``status`` is
    ``matched``, ``piece`` (of a split one), ``invented`` or ``excused``, and where matched ``truth`` is the number of
    the oracle's episode, with ``overlap_frames``, ``onset_error`` and ``duration_error`` (seconds). ``flag`` names what
    was in doubt about a pose in it (null: nothing).
    """
    never = _never_found(result)
    rows = [
        (label, number, episode, ",".join(never.get((label, number), ())))
        for label, found in result.episodes.items()
        for number, episode in enumerate(found, 1)
    ]
    found = [row[2] for row in rows]
    columns = {
        "first": [one.first for one in found],
        "last": [one.last for one in found],
        "frames": [one.last - one.first + 1 for one in found],
        "start": [one.start for one in found],
        "end": [one.end for one in found],
        "missed_by": [row[3] for row in rows],
        "flag": [_doubt(result, one) for one in found],
    }
    kinds = (*[pa.int64()] * 3, *[pa.float64()] * 2, *[pa.string()] * 2)
    return pa.table(
        {
            **_heads(result, [(label, number, one.pair) for label, number, one, _ in rows]),
            **{name: pa.array(columns[name], kind) for name, kind in zip(columns, kinds, strict=True)},
            **_match_columns(result, [(label, number) for label, number, _, _ in rows]),
        }
    )


def _heads(result: RunResult, rows: list[tuple[str, int, int]]) -> Columns:
    """Detector, number and pair of each row."""
    return {
        "detector": pa.array([label for label, _, _ in rows], pa.string()),
        "number": pa.array([number for _, number, _ in rows], pa.int64()),
        **_pair_columns(result, np.array([pair for _, _, pair in rows], dtype=np.int64)),
    }


def _match_columns(result: RunResult, rows: list[tuple[str, int]]) -> Columns:
    status = {label: matches.status() for label, matches in result.matches.items()}
    match = {(label, one.found): one for label, matches in result.matches.items() for one in matches.matched}
    words = [status.get(label, {}).get(number, "") for label, number in rows]
    table: Columns = {"status": pa.array(words, pa.string())}
    kinds = {"truth": pa.int64(), "overlap": pa.int64(), "onset_error": pa.float64(), "duration_error": pa.float64()}
    for name, kind in kinds.items():
        values = [getattr(match.get(row), name, None) for row in rows]
        table["overlap_frames" if name == "overlap" else name] = pa.array(values, kind)
    return table


def miss_table(result: RunResult) -> pa.Table:
    """Every numbered miss of every audited detector, with the geometry of its deepest frame (metres, world).

    Of a contact that no frame shows ``touch`` says when, in seconds, it begins between the frames ``first`` - 1 and
    ``first``, and ``face_a`` and ``face_b`` which faces touch first; point and normal are those of that moment.
    """
    rows = [(label, miss) for label, found in result.misses.items() for miss in found]
    table = _heads(result, [(label, miss.number, miss.pair) for label, miss in rows])
    kinds = dict.fromkeys(("first", "last"), pa.int64()) | dict.fromkeys(("start", "end"), pa.float64())
    kinds |= {"kind": pa.string()} | dict.fromkeys(("episode", "deepest", "face_pairs"), pa.int64())
    kinds |= {"cut_length": pa.float64(), "cause": pa.string()}
    table |= {name: pa.array([getattr(miss, name) for _, miss in rows], kind) for name, kind in kinds.items()}
    for name in ("point", "normal"):
        for axis, letter in enumerate("xyz"):
            table[f"{name}_{letter}"] = pa.array([getattr(miss, name)[axis] for _, miss in rows], pa.float64())
    touches = [miss.touch for _, miss in rows]
    table["touch"] = pa.array([touch and touch.moment for touch in touches], pa.float64())
    for side, letter in enumerate("ab"):
        table[f"face_{letter}"] = pa.array([touch and touch.faces[side] for touch in touches], pa.int64())
    return pa.table(table)


def event_table(result: RunResult) -> pa.Table:
    """What the recording says happened, and what the effects found: moments, and spans with an end.

    ``source`` is ``event``, a span's kind, or ``effect/<kind>``; ``values`` holds an effect's numbers as JSON, and is
    empty for what was recorded. Columns: ``stamp_ns time end_stamp_ns end_time source name body level message values``.
    """
    zero = int(result.assembly.stamp_ns[0]) - round(float(result.assembly.motion.times[0]) * 1e9)
    rows: list[EventRow] = [
        (e.time_ns, None, "event", e.name, e.body, e.level, e.message, "") for e in result.session.events
    ]
    rows += [
        (i.start_ns, i.end_ns, i.kind, i.name, "", "info", "; ".join(f"{k}={v}" for k, v in i.data.items()), "")
        for i in result.session.intervals
    ]
    rows += effect_event_rows(result, zero)
    rows.sort(key=lambda row: row[0])
    names = ("stamp_ns", "end_stamp_ns", "source", "name", "body", "level", "message", "values")
    kinds = (pa.int64(), pa.int64(), *[pa.string()] * 6)
    table = {name: pa.array([row[k] for row in rows], kinds[k]) for k, name in enumerate(names)}
    table["time"] = pa.array([(row[0] - zero) / 1e9 for row in rows], pa.float64())
    table["end_time"] = pa.array([None if row[1] is None else (row[1] - zero) / 1e9 for row in rows], pa.float64())
    return pa.table(table)


def _happened(result: RunResult) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Frame and column of every pair-frame in which anything happened, looked for in some frames at a time."""
    rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for start in range(0, len(result.assembly.stamp_ns), VERDICT_FRAMES):
        verdicts = [found.verdict[start : start + VERDICT_FRAMES] for found in result.detections.values()]
        marked = [counts_as_contact(part) | np.isin(part, STATED) for part in verdicts]
        if marked:
            if result.flags is not None:
                flag = result.flags.of_pairs(result.assembly.pairs, start, start + VERDICT_FRAMES)
                marked += [((flag & POSE_DOUBT) > 0) & (part != Verdict.NO_POSE) for part in verdicts]
            frame, column = np.nonzero(np.logical_or.reduce(marked))
            rows.append(frame + start)
            columns.append(column)
    return np.concatenate(rows), np.concatenate(columns)


def _doubt(result: RunResult, episode: Episode) -> str | None:
    """What is in doubt about any pose in a contact."""
    if result.flags is None:
        return None
    part = result.flags.bodies[episode.first : episode.last + 1, result.assembly.pairs[episode.pair]]
    return flag_words()[int(np.bitwise_or.reduce(part, axis=None))] or None


def _flag_column(result: RunResult, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> pa.DictionaryArray:
    flag = np.zeros(len(rows), dtype=np.uint8)
    if result.flags is not None:
        ends = result.assembly.pairs[columns]
        flag = result.flags.bodies[rows, ends[:, 0]] | result.flags.bodies[rows, ends[:, 1]]
    codes, place = np.unique(flag, return_inverse=True)
    words = flag_words()
    named = pa.array(place.reshape(-1).astype(np.int32), mask=flag == 0)
    return pa.DictionaryArray.from_arrays(named, pa.array([words[code] for code in codes.tolist()], pa.string()))


def _frame_columns(
    result: RunResult, rows: NDArray[np.int64], columns: NDArray[np.int64], numbers: Mapping[str, NDArray[np.int64]]
) -> Columns:
    table: Columns = {
        "frame": pa.array(rows),
        "stamp_ns": pa.array(result.assembly.stamp_ns[rows]),
        "time": pa.array(result.assembly.motion.times[rows]),
        **_pair_columns(result, columns),
        "flag": _flag_column(result, rows, columns),
    }
    for label, detection in result.detections.items():
        table[f"verdict/{label}"] = _words(detection.verdict[rows, columns], VERDICT_WORDS)
    for label, comparison in result.comparisons.items():
        table[f"outcome/{label}"] = _words(comparison.outcome[rows, columns], OUTCOME_WORDS)
        table[f"miss/{label}"] = pa.array(numbers[label], mask=numbers[label] == 0)
    for label, detection in result.detections.items():
        for counter, count in detection.work.items():
            if isinstance(count, np.ndarray):
                table[f"work/{label}/{counter}"] = pa.array(count[rows, columns].astype(np.int64))
        seconds = frame_seconds(detection)
        if seconds is not None:
            table[f"frame_seconds/{label}"] = pa.array(seconds[rows])
    return table


def _pair_columns(result: RunResult, pairs: NDArray[np.int64]) -> Columns:
    names = list(result.assembly.names)
    ends = result.assembly.pairs[pairs]
    return {
        "body_a": _words(ends[:, 0], names),
        "body_b": _words(ends[:, 1], names),
        "held": pa.array(result.assembly.held[pairs]),
    }


def _words(values: NDArray[np.integer], words: list[str]) -> pa.DictionaryArray:
    return pa.DictionaryArray.from_arrays(pa.array(values.astype(np.int32)), pa.array(words, pa.string()))


def _miss_numbers(
    result: RunResult, label: str, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Number of the miss that each row belongs to, 0 outside."""
    number = np.zeros(len(rows), dtype=np.int64)
    for miss in result.misses[label]:
        low, high = np.searchsorted(rows, [miss.first, miss.last + 1])
        number[low:high][columns[low:high] == miss.pair] = miss.number
    return number


def _never_found(result: RunResult) -> dict[tuple[str, int], list[str]]:
    never: dict[tuple[str, int], list[str]] = {}
    for label, found in result.misses.items():
        for episode in dict.fromkeys(miss.episode for miss in found if miss.kind == NEVER_FOUND):
            never.setdefault((result.oracle, episode), []).append(label)
    return never
