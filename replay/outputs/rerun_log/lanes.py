"""Lanes of states, in the words of the audit, and of what people did. A state without a word is a gap.

No change is lost. A lane is sent on the session timeline only: a reset one nanosecond before each change keeps the
viewer from merging neighbours narrower than four pixels into grey, and a frame number leaves no room for it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore.protocol import counts_as_contact
from replay.base.shown import shown
from replay.comparison.outcome import Comparison, Outcome
from replay.outputs.palette import (
    OUTCOMES,
    SERIES,
    VERDICTS,
    WITHIN_TOLERANCE,
    Looks,
    Rgba,
)
from replay.outputs.rerun_log.recording_file import RecordingWriter, drawable, entity, packed
from replay.pipeline.run_result import RunResult

Span = tuple[str, int, int]
"""A word, and the first and last nanosecond on the session timeline."""

DOING: Final = "doing"
"""Lanes stand in the order of their paths: these above those of effects and of the pair in focus."""

VR_TYPE: Final = "vr_type"
"""The fact of a session that says how it was seen: ``immersive``, ``desktop`` ..."""

KINDS: Final = ("stage", "task", "feature", VR_TYPE)
"""Kinds of spans, in the order of their lanes; any other follows."""

LANES: Final = "lanes"
COLON: Final = "\u02d0_"
"""A letter that looks like a colon."""

MOST_PAIRS: Final = 40
"""Pairs with lanes per detector at most: beyond it nobody scrolls, and every lane costs the viewer a row."""

MOST_LANES: Final = 4
"""Lanes beside the list at most, as many as a screen of 800 lines shows, the reference's among them."""

SHOWN: Final = (Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH)
"""Outcomes of a lane of all pairs: of several at a time the first is shown."""

NARROWEST: Final = 0.005
"""Share of the session that a miss takes in the lane of all pairs at least: one of 54 ms in a minute is one pixel wide.
The lane of its pair says exactly when."""


def lane_name(*words: str) -> str:
    """A path that reads as words: the viewer shows the path of a lane, and escapes most of what is no letter.

    The first two words are parted by a letter that looks like a colon, for a colon is escaped.
    """
    parts = [re.sub(r"[^\w.-]+", "_", drawable(word)).strip("_") for word in words]
    return COLON.join(parts)


def pair_lanes(result: RunResult, label: str) -> dict[str, int]:
    """Paths of the lanes of one detector, worst first, and the pair's column that each speaks of.

    The viewer sorts lanes by path. Pairs have one in which the detector or the reference sees contact.
    """
    assembly, comparison = result.assembly, result.comparisons.get(label)
    if comparison is None:
        columns = np.flatnonzero(counts_as_contact(result.detections[label].verdict).any(axis=0)).tolist()
    else:
        columns = ranked_pairs(comparison, assembly.held)
    names = {column: assembly.pair_name(column) + (", held" if assembly.held[column] else "") for column in columns}
    ranked = enumerate(columns[:MOST_PAIRS], 1)
    return {entity(LANES, label, lane_name(f"{rank}_{names[column]}")): column for rank, column in ranked}


def ranked_pairs(comparison: Comparison, held: NDArray[np.bool_]) -> list[int]:
    """Columns worth a lane, worst first: most missed frames, then most invented, then most in contact; held ones last.

    A pair that was never in contact, for either detector, has none.
    """
    every = comparison.by_pair.T
    counts = every[[Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH]]
    rest = every[[Outcome.WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES, Outcome.HELD]].sum(axis=0)
    order = np.lexsort((-rest, -counts[2], -counts[1], -counts[0], held))
    return [int(column) for column in order if counts[:, column].any() or rest[column]]


def log_pair_lanes(writer: RecordingWriter, result: RunResult, label: str) -> None:
    """Send what a detector made of each pair, or, where nothing was compared, what it said."""
    comparison = result.comparisons.get(label)
    for path, column in pair_lanes(result, label).items():
        if comparison is None:
            log_lane(writer, path, result.detections[label].verdict[:, column], VERDICTS)
            continue
        log_lane(writer, path, comparison.outcome[:, column], OUTCOMES)


def detector_lanes(result: RunResult, order: Sequence[str]) -> list[str]:
    """Lanes of all pairs, of the reference and of the first detectors of this order, each with what it is."""
    what = {rank.label: rank.what for rank in result.ranking}
    reference = lane_name(f"1_{result.oracle} is the reference")
    shown = enumerate(order[: MOST_LANES - 1], 2)
    return [reference, *(lane_name(f"{number}_{label}", what[label]) for number, label in shown)]


def log_detector_lanes(writer: RecordingWriter, result: RunResult, order: Sequence[str], lanes: Sequence[str]) -> None:
    """Send contact of the reference in grey, and what is wrong or right anywhere."""
    verdict, outcomes = result.detections[result.oracle].verdict, result.comparisons[order[0]].outcome
    touched = (counts_as_contact(verdict) & (outcomes != Outcome.HELD)).any(axis=1)
    words = np.array(["", "contact"], dtype=object)[touched.astype(np.intp)]
    send_lane(writer, lanes[0], word_changes(writer, words), [("contact", WITHIN_TOLERANCE)])
    for label, path in zip(order, lanes[1:], strict=False):
        outcome = result.comparisons[label].outcome
        worst = np.full(len(outcome), "", dtype=object)
        for code in reversed(SHOWN):
            worst[(outcome == code).any(axis=1)] = OUTCOMES[code][0]
        for miss in result.misses[label]:
            worst[miss.first : miss.first + round(NARROWEST * len(worst))] = OUTCOMES[Outcome.MISSED][0]
        send_lane(writer, path, word_changes(writer, worst), [OUTCOMES[code] for code in SHOWN])


def log_lane(writer: RecordingWriter, path: str, state: NDArray[np.uint8], words: Looks) -> None:
    """Send one lane of states; one without a word is a gap."""
    text = np.array([words[code][0] if code in words else "" for code in range(256)], dtype=object)
    send_lane(writer, path, word_changes(writer, text[state]), words.values())


def word_changes(writer: RecordingWriter, words: NDArray[np.object_]) -> dict[int, str]:
    """When a word per frame, ``""`` for none, changes, in nanoseconds, and to what."""
    ns = writer.clock.ns
    changes = np.flatnonzero(np.append(True, words[1:] != words[:-1])) if len(words) else np.zeros(0, np.int64)
    rows = dict(zip(ns[changes].tolist(), words[changes].tolist(), strict=True))
    if len(words) > 1:
        # The last state lasts one frame: left open, it would run on to the end of the axis.
        rows[int(ns[-1]) + round(float(np.median(np.diff(ns))))] = ""
    return rows


def send_spans(writer: RecordingWriter, path: str, spans: Sequence[Span], words: Iterable[tuple[str, Rgba]]) -> None:
    """Send a lane of these spans, and the colours of their words; a span replaces one that ends where it begins."""
    rows = {end: "" for _, _, end in spans} | {start: word for word, start, _ in spans}
    send_lane(writer, path, rows, words)


def send_lane(writer: RecordingWriter, path: str, rows: Mapping[int, str], words: Iterable[tuple[str, Rgba]]) -> None:
    """Send a lane of nanosecond -> word, ``""`` for none, and the colours of the words."""
    known = dict(words)
    writer.static(path, rr.StateConfiguration(values=[*known], colors=packed(known.values())))
    # A first, empty row at zero gives every lane a row wherever the cursor is; a state that begins there replaces it.
    states, before = {0: ""}, ""
    for ns in sorted(rows):
        if before and rows[ns]:
            states[ns - 1] = ""
        states[ns] = before = rows[ns]
    stamps = sorted(states)
    columns = rr.StateChange.columns(state=[states[ns] for ns in stamps])
    writer.session_rows(path, np.array(stamps, dtype=np.int64), columns)


def session_lanes(result: RunResult) -> dict[str, list[Span]]:
    """Path -> its spans, in order of time; where spans of a kind overlap, each has a lane of its own."""
    stamps = result.assembly.stamp_ns
    if not len(stamps):
        return {}
    zero, last = int(stamps[0]), int(stamps[-1] - stamps[0])
    spans: dict[str, list[Span]] = {}
    for one in sorted(result.session.intervals, key=lambda one: (one.start_ns, one.end_ns)):
        start, end = max(0, one.start_ns - zero), min(last, one.end_ns - zero)
        if start < end:
            spans.setdefault(one.kind, []).append((shown(one.name or one.kind), start, end))
    if kind := result.session.facts.get(VR_TYPE):
        spans[VR_TYPE] = [(shown(kind), 0, last)]
    lanes: dict[str, list[Span]] = {}
    for kind in sorted(spans, key=lambda one: (KINDS.index(one) if one in KINDS else len(KINDS), one)):
        free: list[tuple[int, str]] = []  # when each lane of this kind ends, and its path
        for span in spans[kind]:
            row = next((k for k, (end, _) in enumerate(free) if end <= span[1]), len(free))
            path = free[row][1] if row < len(free) else entity(DOING, f"{len(lanes) + 1}_{kind}")
            free[row : row + 1] = [(span[2], path)]
            lanes.setdefault(path, []).append(span)
    return lanes


def log_session_lanes(writer: RecordingWriter, result: RunResult) -> None:
    """Send the lanes; the same word has the same colour in all of them."""
    lanes = session_lanes(result)
    words = dict.fromkeys(word for spans in lanes.values() for word, _, _ in spans)
    colours = [(word, SERIES[k % len(SERIES)]) for k, word in enumerate(words)]
    for path, spans in lanes.items():
        send_spans(writer, path, spans, colours)
