"""The frame at the cursor in numbers, beside the picture: how many pairs each stage left, and what it took."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore.numerics import FloatArray
from cdcore.protocol import counts_as_contact
from replay.outputs.palette import TICKS, WHITE, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, packed
from replay.outputs.rerun_log.pipeline import OTHER, STAGE_COLOURS, changes, is_timed, pipeline_path, stage_ms
from replay.outputs.watched_run import ALL, BOXES, CONFIRMED, SEARCHED, SPHERES, WatchedRun
from replay.prepare.assembly import Assembly

WIDTH: Final = 520.0
"""Of the longest bar; words stand at its left and at its end."""

STEP: Final = 76.0
LINES: Final = 14
THICK: Final = 40.0
"""A bar is so many thin lines: thick ones have round caps, which lie at small counts, and boxes have no fill."""

LETTER: Final = 9.0
LABEL_UP: Final = 26.0
"""Half the width of a letter, and how far a label hangs below its point, on which it is centred."""

TITLE_Y, COUNTS_Y, TIMES_Y = -70.0, 0.0, 560.0
NAMES_X: Final = -160.0


def log_frame(writer: RecordingWriter, run: WatchedRun, assembly: Assembly) -> None:
    """Send bars and words; times are those of the frame where it matters and was timed, else the mean."""
    root = pipeline_path(run.label, "frame")
    pairs = max(1, int(max(run.counts[ALL], default=0)))
    _words(writer, f"{root}/title", [f"how many of {pairs} pairs each stage leaves"], [TITLE_Y], WHITE, 240.0)
    _words(writer, f"{root}/names", list(run.counts), [COUNTS_Y + STEP * k for k in range(len(run.counts))], TICKS)
    remarks = _remarks(run, assembly)
    for rank, (stage, count) in enumerate(run.counts.items()):
        said = np.array(
            [f"{n}{more}" for n, more in zip(count.tolist(), remarks.get(stage, [""] * len(count)), strict=True)]
        )
        frames = changes(said)
        _bar(writer, f"{root}/{rank}", COUNTS_Y + STEP * rank, frames, WIDTH * count[frames] / pairs,
             said[frames].tolist(), STAGE_COLOURS[stage])  # fmt: skip
    _log_price(writer, f"{root}/price", run)


def _remarks(run: WatchedRun, assembly: Assembly) -> dict[str, list[str]]:
    """Words after a count, frame by frame: why fewer pairs are searched than boxes met, and which are confirmed."""
    near = run.counts.get(BOXES, run.counts[SPHERES]) - run.counts[SEARCHED]
    contact = counts_as_contact(run.detection.verdict)
    names = [assembly.pair_name(column) for column in range(contact.shape[1])]
    confirmed = []
    for row in contact:
        there = np.flatnonzero(row).tolist()
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        confirmed.append(f"   {names[there[0]]}{more}" if there else "")
    return {
        SEARCHED: [
            f"   {'the other stands' if n == 1 else f'the other {n} stand'} as before" if n else ""
            for n in near.tolist()
        ],
        CONFIRMED: confirmed,
    }


def _log_price(writer: RecordingWriter, root: str, run: WatchedRun) -> None:
    stages = stage_ms(run)
    there = [moment.frame for moment in run.moments] if is_timed(run) else []
    last = len(run.motion) - 1
    frames = sorted({0, *there, *(frame + 1 for frame in there if frame < last)})
    exact = np.isin(frames, there)
    rows = {stage: np.where(exact, ms[frames], ms.mean()) for stage, ms in stages.items()}
    total: FloatArray = np.sum(list(rows.values()), axis=0)
    title = [
        f"{ms:.2f} ms {'for this frame' if one else 'per frame, mean'}" for ms, one in zip(total, exact, strict=True)
    ]
    _bar(writer, f"{root}/title", TIMES_Y + TITLE_Y, np.array(frames), 0 * total, title, WHITE, aside=120.0)
    _words(writer, f"{root}/names", list(stages), [TIMES_Y + STEP * k for k in range(len(stages))], TICKS)
    longest = max((float(ms.max()) for ms in rows.values()), default=0.0) or 1.0
    for rank, (stage, ms) in enumerate(rows.items()):
        said = [f"{one * 1e3:.{0 if one >= 0.01 else 1}f} µs" for one in ms.tolist()]
        colour = STAGE_COLOURS.get(stage, OTHER)
        _bar(writer, f"{root}/{rank}", TIMES_Y + STEP * rank, np.array(frames), WIDTH * ms / longest, said, colour)


def _bar(
    writer: RecordingWriter, path: str, y: float, frames: NDArray[np.int64], lengths: FloatArray, words: Sequence[str],
    colour: Rgba, aside: float = 26.0,
) -> None:  # fmt: skip
    """Send a bar from zero, and words at its end, a row for each of these frames."""
    heights = y + THICK * (np.arange(LINES) / (LINES - 1) - 0.5)
    strips = np.zeros((len(frames), LINES, 2, 2), dtype=np.float32)
    strips[..., 1] = heights[None, :, None]
    strips[:, :, 1, 0] = lengths[:, None]
    shown = np.where(lengths > 0, LINES, 0)
    lines = rr.LineStrips2D.columns(strips=strips[lengths > 0].reshape(-1, 2, 2))
    if shown.any():
        writer.rows(f"{path}/bar", frames, lines, shown)
        thin = rr.LineStrips2D.from_fields(colors=packed([colour]), radii=0.9 * THICK / LINES)
        writer.static(f"{path}/bar", thin)
    places = np.array([(x + aside + LETTER * len(text), y - LABEL_UP) for x, text in zip(lengths, words, strict=True)])
    points = rr.Points2D.columns(positions=places.astype(np.float32), labels=list(words))
    writer.rows(f"{path}/words", frames, points, [1] * len(words))
    dot = rr.Points2D.from_fields(radii=rr.Radius.ui_points(0.01), colors=packed([colour]), show_labels=True)
    writer.static(f"{path}/words", dot)


def _words(
    writer: RecordingWriter, path: str, words: Sequence[str], y: Sequence[float], colour: Rgba, x: float = NAMES_X
) -> None:
    places = [(x, height - LABEL_UP) for height in y]
    shown = rr.Points2D(places, labels=list(words), radii=0.01, colors=packed([colour]), show_labels=True)
    writer.static(path, shown)
