"""What the people in a session were doing: lanes of stages, tasks and features of the teaching, and the kind of VR."""

from __future__ import annotations

from typing import Final

import numpy as np

from replay.base.shown import shown
from replay.outputs.palette import SERIES
from replay.outputs.rerun_log.columns import RecordingWriter, entity
from replay.outputs.rerun_log.lanes import send_lane
from replay.pipeline.run_result import RunResult

ROOT: Final = "doing"
"""Lanes stand in the order of their paths: these above those of effects and of the pair in focus."""

VR_TYPE: Final = "vr_type"
"""The fact of a session that says how it was seen: ``immersive``, ``desktop`` ..."""

KINDS: Final = ("stage", "task", "feature", VR_TYPE)
"""Kinds of spans, in the order of their lanes; any other follows."""

Span = tuple[int, int, str]
"""First and last nanosecond on the session timeline, and a word."""


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
            spans.setdefault(one.kind, []).append((start, end, shown(one.name or one.kind)))
    if kind := result.session.facts.get(VR_TYPE):
        spans[VR_TYPE] = [(0, last, shown(kind))]
    lanes: dict[str, list[Span]] = {}
    for kind in sorted(spans, key=lambda one: (KINDS.index(one) if one in KINDS else len(KINDS), one)):
        free: list[tuple[int, str]] = []  # when each lane of this kind ends, and its path
        for span in spans[kind]:
            row = next((k for k, (end, _) in enumerate(free) if end <= span[0]), len(free))
            path = free[row][1] if row < len(free) else entity(ROOT, f"{len(lanes) + 1}_{kind}")
            free[row : row + 1] = [(span[1], path)]
            lanes.setdefault(path, []).append(span)
    return lanes


def log_session_lanes(writer: RecordingWriter, result: RunResult) -> None:
    """Send the lanes; the same word has the same colour in all of them."""
    lanes = session_lanes(result)
    words = dict.fromkeys(word for spans in lanes.values() for *_, word in spans)
    colours = [(word, SERIES[k % len(SERIES)]) for k, word in enumerate(words)]
    for path, spans in lanes.items():
        # A span that begins where the one before it ends takes its place.
        rows = {end: "" for _, end, _ in spans} | {start: word for start, _, word in spans}
        send_lane(writer, path, np.array(sorted(rows), dtype=np.int64), [rows[ns] for ns in sorted(rows)], colours)
