"""What each detector cost: milliseconds of every frame by stage, and its counters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from cdcore import Detection
from cdcore.numerics import FloatArray, IntArray
from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.outputs.palette import BUDGET, SERIES, Rgba
from replay.outputs.rerun_log.recording_file import RecordingWriter, entity

BUDGET_LINE: Final = "timing/budget"
CUT_PERCENTILE: Final = 99.9
"""A plot of times ends at what one frame in a thousand exceeds: one slow frame would press all curves to the floor."""

IDLE: Final = 1e-7
"""Seconds, in the mean, below which a stage had nothing to do and is not shown."""

STAGES: Final[Mapping[str, str]] = {
    "volumes": "broad phase", "spheres": "broad phase", "boxes": "broad phase", "surfaces": "narrow phase",
    "meshes": "narrow phase", "rest": "other",
}  # fmt: skip
"""Stage as a detector calls it -> in words of the field; any other keeps its name."""


def colour_of(number: int) -> Rgba:
    """Colour of the n-th detector in every plot."""
    return SERIES[number % len(SERIES)]


def stage_ms(detection: Detection) -> dict[str, FloatArray]:
    """Stage -> milliseconds of each frame, (T,); where the whole motion was asked at once, their mean."""
    frames, stages = len(detection.times), dict[str, FloatArray]()
    for name, value in detection.seconds.items():
        if np.sum(value) > IDLE * frames:
            word = STAGES.get(name, name)
            ms = 1e3 * (value if isinstance(value, np.ndarray) else np.full(frames, value / max(1, frames)))
            stages[word] = stages[word] + ms if word in stages else ms
    return stages


def total_ms(detection: Detection) -> FloatArray:
    """Milliseconds of each frame, (T,)."""
    total: FloatArray = sum(stage_ms(detection).values(), start=np.zeros(len(detection.times)))
    return total


def is_timed(detection: Detection) -> bool:
    """Whether frames were timed one by one."""
    return any(isinstance(value, np.ndarray) for value in detection.seconds.values())


def ceiling(totals: Sequence[FloatArray]) -> float:
    """Milliseconds at which a plot of these is cut."""
    return max((float(np.percentile(one, CUT_PERCENTILE)) for one in totals if len(one)), default=0.0) or BUDGET_MS


def budget_share(top: float) -> float:
    """The largest of 1, 1/10, 1/100 ... of a frame's budget that a plot up to ``top`` shows."""
    return float(10.0 ** min(0, int(np.floor(np.log10(top / BUDGET_MS)))))


def log_timing(writer: RecordingWriter, detections: Mapping[str, Detection], words: Mapping[str, str]) -> None:
    """Send totals, stages added up, counters and the line of the budget; ``words``: what a legend calls a detector."""
    totals = [total_ms(detection) for detection in detections.values()]
    share = budget_share(ceiling(totals))
    ends, part = _ends(writer), {1.0: "", 0.1: "a tenth of ", 0.01: "a hundredth of "}.get(share, f"{share:g} of ")
    name = f"{part}a {HEADSET_HZ:g} Hz frame: {share * BUDGET_MS:.2g} ms"
    writer.curve(BUDGET_LINE, ends, np.full(len(ends), share * BUDGET_MS), name, BUDGET, 1.6)
    for number, (label, detection) in enumerate(detections.items()):
        frames = writer.clock.kept if is_timed(detection) else ends
        writer.curve(total_path(label), frames, totals[number][frames], words[label], colour_of(number), 1.4)
        _log_stages(writer, label, detection, frames)
        _log_counters(writer, label, detection)


def _log_stages(writer: RecordingWriter, label: str, detection: Detection, frames: IntArray) -> None:
    """Lines added up, the total drawn first: Rerun has no areas."""
    stages, total = stage_ms(detection), np.zeros(len(detection.times))
    for rank, (stage, ms) in enumerate(stages.items()):
        total = total + ms
        path = entity("timing", label, "stages", f"{len(stages) - rank}_{stage}")
        writer.curve(path, frames, total[frames], f"+ {stage}" if rank else stage, colour_of(rank), 1.4)


def _log_counters(writer: RecordingWriter, label: str, detection: Detection) -> None:
    for number, (name, value) in enumerate(detection.work.items()):
        if not np.any(value):
            continue
        frames = writer.clock.kept if isinstance(value, np.ndarray) else _ends(writer)
        counts = value[frames].sum(axis=1) if isinstance(value, np.ndarray) else np.full(len(frames), value)
        words = f"{name.replace('_', ' ')}: {int(np.sum(value)):,} in all"
        writer.curve(entity("counters", label, name), frames, counts.astype(np.float64), words, colour_of(number), 1.4)


def total_path(label: str) -> str:
    """Entity of all that a detector took."""
    return entity("timing", label, "total")


def _ends(writer: RecordingWriter) -> Any:
    """The first frame and the last: between them a constant is a line."""
    return np.unique([0, len(writer.clock.ns) - 1])[: len(writer.clock.ns)]
