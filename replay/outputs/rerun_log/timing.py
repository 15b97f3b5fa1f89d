"""What each detector cost: milliseconds per frame where it works frame by frame, a mean where it takes all at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from cdcore import Detection
from cdcore.numerics import FloatArray, IntArray
from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.outputs.palette import BUDGET, SERIES, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, entity
from replay.outputs.rerun_log.views import plot
from replay.outputs.tables import markdown, table
from replay.pipeline.summary import look_seconds

TOTAL: Final = "1_total"
"""Stage name of the sum; the number sorts it first."""


BUDGET_SHOWN: Final = 0.25
"""Share of the budget from which its line is in the plot of times."""

LEGEND: Final = 3
"""Detectors beside whose names that of the budget fits into the legend of a low plot; its height says it too."""

CUT: Final = 1.3
"""A plot of times ends at so many times what one look in a thousand exceeds."""


@dataclass(frozen=True)
class Cost:
    """What a detector took: stage -> milliseconds per frame, mean over all frames.

    ``per_frame`` (L,) are milliseconds of the frames it looked at, ``None`` if it took the whole motion at once.
    """

    stages: Mapping[str, float]
    per_frame: FloatArray | None

    @property
    def mean_ms(self) -> float:
        """Milliseconds per frame of the session, all stages."""
        return sum(self.stages.values())

    def words(self) -> str:
        """The cost for a legend or a table."""
        if self.per_frame is None or not len(self.per_frame):
            return f"{self.short}, all at once"
        return f"median {np.percentile(self.per_frame, 50):.2f}, {self.short} a look"

    @property
    def short(self) -> str:
        """The mean over frames, and the 99th percentile over samples where they were timed."""
        if self.per_frame is None or not len(self.per_frame):
            return f"mean {self.mean_ms:.2f} ms"
        return f"mean {self.mean_ms:.2f}, p99 {np.percentile(self.per_frame, 99):.2f} ms"


def cost_of(detection: Detection) -> Cost:
    """Cost of a detection from its seconds."""
    frames = max(1, len(detection.times))
    stages = {name: float(np.sum(value)) * 1e3 / frames for name, value in detection.seconds.items()}
    looks = look_seconds(detection)
    return Cost(stages, None if looks is None else looks * 1e3)


def colour_of(number: int) -> Rgba:
    """Colour of the n-th detector in every plot."""
    return SERIES[number % len(SERIES)]


def log_timing(writer: RecordingWriter, detections: Mapping[str, Detection], remarks: Mapping[str, str]) -> None:
    """Send ``timing/<detector>/<stage>`` in milliseconds, the budget line, and ``counters/<detector>/<counter>``.

    ``remarks`` (label -> words) go into the legend, so that price and misses stand in one line.
    """
    ends, words = _ends(writer), f"budget {BUDGET_MS:.1f} ms ({HEADSET_HZ:g} Hz)"
    writer.curve("timing/budget", ends, np.full(len(ends), BUDGET_MS), words, BUDGET, 1.0)
    for number, (label, detection) in enumerate(detections.items()):
        _log_seconds(writer, label, detection, colour_of(number), remarks.get(label, ""))
        _log_counters(writer, label, detection)


def _log_seconds(writer: RecordingWriter, label: str, detection: Detection, colour: Rgba, remark: str) -> None:
    cost = cost_of(detection)
    words = f"{label}: {remark}, {cost.words()}" if remark else f"{label}, {cost.words()}"
    seconds = {name: value for name, value in detection.seconds.items() if isinstance(value, np.ndarray)}
    if seconds:
        rows = {name: 1e3 * value for name, value in seconds.items()}
        total = 1e3 * np.sum(list(seconds.values()), axis=0)
        frames = writer.clock.kept[total[writer.clock.kept] > 0]
    else:
        rows = {name: np.full(len(writer.clock.ns), mean) for name, mean in cost.stages.items()}
        total, frames = np.full(len(writer.clock.ns), cost.mean_ms), _ends(writer)
    writer.curve(stage_path(label, TOTAL), frames, total[frames], words, colour, 1.5)
    for number, (name, value) in enumerate(rows.items()):
        writer.curve(stage_path(label, name), frames, value[frames], f"{label} {name}", colour_of(number), 1.2)


def _log_counters(writer: RecordingWriter, label: str, detection: Detection) -> None:
    for name, value in detection.work.items():
        frames = writer.clock.kept if isinstance(value, np.ndarray) else _ends(writer)
        counts = value[frames].sum(axis=1) if isinstance(value, np.ndarray) else np.full(len(frames), value)
        writer.rows(entity("counters", label, name), frames, rr.Scalars.columns(scalars=counts.astype(np.float64)))


def clipped(timed: Sequence[FloatArray]) -> tuple[float, float, str]:
    """Where a plot of times ends, the slowest, and words where that is beyond: one look would flatten all others."""
    slowest = max((float(one.max()) for one in timed), default=0.0)
    high = min(slowest, CUT * max((float(np.percentile(one, 99.9)) for one in timed), default=0.0))
    return 1.15 * high, slowest, ", cut off" if slowest > 1.15 * high else ""


def timing_view(costs: Mapping[str, Cost], whole: rrb.TimeAxis, *, short: bool = False) -> Any:
    """Times of all detectors on one axis; ``short``: curves named by their 99th percentile alone."""
    timed = [cost.per_frame for cost in costs.values() if cost.per_frame is not None and len(cost.per_frame)]
    top, slowest, cut = clipped(timed)
    # A budget far above everything would press the curves to the floor: then the title says how far.
    budget = ["timing/budget"] if top > BUDGET_SHOWN * BUDGET_MS and not (short and len(costs) > LEGEND) else []
    top = max(top, 1.15 * BUDGET_MS if budget else 0.0)
    worst = f"worst {slowest:.2f}{cut if slowest > top else ''}: {100 * slowest / BUDGET_MS:.0f} % of a "
    worst += f"{HEADSET_HZ:g} Hz frame" if short else f"frame at {HEADSET_HZ:g} Hz ({BUDGET_MS:.1f} ms)"
    totals = {label: stage_path(label, TOTAL) for label in costs}
    more: dict[str, Any] = {"axis_y": rrb.ScalarAxis(range=(0.0, top))}
    if short:
        names = {label: rr.SeriesLines.from_fields(names=[f"{label}: {cost.short}"]) for label, cost in costs.items()}
        more["overrides"] = {f"/{totals[label]}": named for label, named in names.items()}
    return plot(whole, "/timing", f"Time per frame, ms    {worst}", [*budget, *totals.values()], **more)


def stage_path(label: str, stage: str) -> str:
    """Entity of one stage of one detector."""
    return entity("timing", label, stage)


def _ends(writer: RecordingWriter) -> IntArray:
    """The first frame and the last: between them a constant is a line."""
    return np.unique([0, len(writer.clock.ns) - 1])[: len(writer.clock.ns)]


def cost_text(detections: Mapping[str, Detection], remarks: Mapping[str, str]) -> str:
    """Price and misses of every detector in Markdown."""
    costs = {label: cost_of(detection) for label, detection in detections.items()}
    rows = [(label, remarks.get(label, ""), cost.words(), f"{cost.mean_ms:.4f}") for label, cost in costs.items()]
    parts = [markdown(table("What each detector costs", ("detector", "misses", "cost", "ms per frame"), rows), level=2)]
    for label, detection in detections.items():
        stages = [(name, f"{mean:.4f}") for name, mean in costs[label].stages.items()]
        counters = [(name, int(np.sum(value))) for name, value in detection.work.items()]
        parts.append(markdown(table(label, ("stage", "ms per frame"), stages), level=3))
        parts.append(markdown(table("", ("counter", "total"), counters)))
    return "\n\n".join(parts)
