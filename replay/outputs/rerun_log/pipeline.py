"""The pipeline over time: bounding spheres that overlap, pairs that each stage left, and what each stage took."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore.bounding.sphere import Sphere, sphere_in_mode
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.outputs.palette import BUDGET, MISSED, SERIES, WITHIN_TOLERANCE, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, entity, packed, send_moments
from replay.outputs.rerun_log.world import body_path
from replay.outputs.watched_run import ALL, BOXES, CONFIRMED, LOST, SEARCHED, SPHERES, Moment, WatchedRun
from replay.pipeline.gates import figure
from replay.prepare.assembly import Assembly

ROOT: Final = "pipeline"

ROOM: Final = 0.5
"""Metres: a larger sphere holds the room and is left out, and so are its pairs: all glass stands on the bench."""

STAGE_COLOURS: Final[Mapping[str, Rgba]] = {
    ALL: WITHIN_TOLERANCE, SPHERES: SERIES[5], BOXES: SERIES[0], SEARCHED: SERIES[1], CONFIRMED: SERIES[2],
    "spheres": SERIES[5], "boxes": SERIES[0], "search": SERIES[1], "meshes": SERIES[4], "containment": SERIES[3],
}  # fmt: skip
"""Colours of what a stage leaves, and of the time it takes."""

OTHER: Final[Rgba] = BUDGET
"""For a stage without a colour."""

IDLE: Final = 1e-7
"""Seconds, in the mean, below which a stage had nothing to do and is not shown."""

NOWHERE, BY_SPHERES, BY_BOXES = range(3)


def pipeline_path(label: str, *parts: str) -> str:
    """Entity of a part of one detector's pipeline."""
    return entity(ROOT, label, *parts)


def sphere_path(body: str, label: str) -> str:
    """Entity of a body's sphere, below the body: so it moves with it."""
    return f"{body_path(body)}/{entity(f'sphere_of_{label}')}"


def log_pipeline(writer: RecordingWriter, run: WatchedRun, assembly: Assembly) -> None:
    """Send spheres, counts and times of one detector."""
    mode = getattr(run.seen.settings, "sphere", "best")
    spheres = [sphere_in_mode(body.mesh, mode) for body in assembly.bodies]
    stages = sphere_stages(run, assembly.pairs, spheres)
    for column, (body, sphere) in enumerate(zip(assembly.bodies, spheres, strict=True)):
        _log_sphere(writer, sphere_path(body.name, run.label), body.name, sphere, stages[:, column])
    _log_near_pairs(writer, run, assembly, spheres)
    _log_counts(writer, run)
    _log_times(writer, run)
    _log_work(writer, run)


def sphere_stages(run: WatchedRun, pairs: IntArray, spheres: Sequence[Sphere]) -> NDArray[np.uint8]:
    """(T, N): whether a body's sphere meets another, and whether the boxes of one such pair meet too."""
    reached = np.where(run.seen.boxes, BY_BOXES, np.where(run.seen.spheres, BY_SPHERES, NOWHERE)).astype(np.uint8)
    stages = np.zeros((len(reached), len(spheres)), dtype=np.uint8)
    for column, ends in enumerate(pairs.tolist()):
        if max(spheres[body].radius for body in ends) <= ROOM:
            for body in ends:
                np.maximum(stages[:, body], reached[:, column], out=stages[:, body])
    return stages


def _log_sphere(writer: RecordingWriter, path: str, name: str, sphere: Sphere, stage: NDArray[np.uint8]) -> None:
    frames = changes(stage)
    shown = stage[frames] > NOWHERE
    colours = packed(STAGE_COLOURS[BOXES if one == BY_BOXES else SPHERES] for one in stage[frames][shown])
    count = int(shown.sum())
    columns = rr.Ellipsoids3D.columns(
        centers=np.tile(sphere.centre.astype(np.float32), (count, 1)),
        half_sizes=np.full((count, 3), sphere.radius, dtype=np.float32), colors=colours, labels=[name] * count,
    )  # fmt: skip
    # Wires ignore alpha: an empty row hides them.
    writer.rows(path, frames, columns, shown.astype(np.int64))
    wire, thin = rr.components.FillMode.MajorWireframe, rr.Radius.ui_points(0.7)
    writer.static(path, rr.Ellipsoids3D.from_fields(fill_mode=wire, line_radii=thin, show_labels=True))


def pair_stages(run: WatchedRun, moment: Moment) -> dict[int, Rgba]:
    """Pair whose spheres met in the frame of a moment -> colour of how far it came; the red of a miss for a missed."""
    frame, seen, contact = moment.frame, run.seen, counts_as_contact(run.detection.verdict[moment.frame])
    stages = ((seen.spheres, SPHERES), (seen.boxes, BOXES), (seen.searched, SEARCHED))
    colours = {pair: STAGE_COLOURS[stage] for held, stage in stages for pair in np.flatnonzero(held[frame]).tolist()}
    colours |= {pair: STAGE_COLOURS[CONFIRMED] for pair in colours if contact[pair]}
    return colours | ({moment.pair: MISSED} if moment.kind == LOST else {})


def _log_near_pairs(writer: RecordingWriter, run: WatchedRun, assembly: Assembly, spheres: Sequence[Sphere]) -> None:
    """A line from sphere to sphere, an entity for each pair, so that each can be clicked; at the frames that matter."""
    lines: dict[int, dict[int, list[tuple[FloatArray, Rgba]]]] = {}
    for moment in run.moments:
        turns, moves = assembly.motion.rotations[moment.frame], assembly.motion.translations[moment.frame]
        for pair, colour in pair_stages(run, moment).items():
            ends = assembly.pairs[pair].tolist()
            if max(spheres[body].radius for body in ends) <= ROOM:
                line = np.array([turns[body] @ spheres[body].centre + moves[body] for body in ends])
                lines.setdefault(pair, {})[moment.frame] = [(line, colour)]
    for pair, found in lines.items():
        path = near_path(run.label, assembly.pair_name(pair))
        send_moments(writer, path, found, line_columns)
        writer.static(path, rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.8)))


def line_columns(lines: Sequence[tuple[Any, Rgba]]) -> rr.ComponentColumnList:
    """Lines from point to point, (2, 3) each, and their colours."""
    strips = np.array([line for line, _ in lines], dtype=np.float32).reshape(-1, 2, 3)
    return rr.LineStrips3D.columns(strips=strips, colors=packed(colour for _, colour in lines))


def near_path(label: str, *pair: str) -> str:
    """Entity of a pair whose spheres meet, or of the folder of all."""
    return pipeline_path(label, "near", "pairs", *pair)


def _log_work(writer: RecordingWriter, run: WatchedRun) -> None:
    """What the looks of each frame evaluated, and in how many iterations, where that is not nothing."""
    work = {name: np.zeros(len(run.motion)) for name in ("evaluations", "iterations")}
    for (frame, _), look in run.seen.search.noted.items():
        work["evaluations"][frame] += look.result.evaluations
        work["iterations"][frame] += look.result.iterations
    for number, (name, value) in enumerate(work.items()):
        path, frames = pipeline_path(run.label, "work", name), np.flatnonzero(_seen_with_neighbours(value))
        writer.curve(path, frames, value[frames], f"{name}: {value.sum():,.0f} in all", SERIES[number], 1.4)


def _seen_with_neighbours(value: FloatArray) -> BoolArray:
    """Frames with a value, those beside them, and both ends: between them a line at zero is true."""
    seen = value > 0
    seen[:-1] |= value[1:] > 0
    seen[1:] |= value[:-1] > 0
    seen[[0, -1]] = True
    return seen


def changes(values: NDArray[np.generic]) -> NDArray[np.int64]:
    """The first frame, and every frame whose value is another than that before."""
    return np.flatnonzero(np.append(True, values[1:] != values[:-1])) if len(values) else np.zeros(0, np.int64)


def _log_counts(writer: RecordingWriter, run: WatchedRun) -> None:
    """A step where a count changes; what was searched is wider, so that it shows where all of it is confirmed."""
    stages = [stage for stage in run.counts if stage != ALL]
    for rank, stage in enumerate(stages):
        count = run.counts[stage]
        frames = np.union1d(changes(count), [len(count) - 1])
        path, width = pipeline_path(run.label, "pairs", f"{rank}_{stage}"), 4.5 if stage == SEARCHED else 1.8
        counts, name = count[frames].astype(np.float64), f"{stage}: {count.mean():.1f} on average"
        writer.curve(path, frames, counts, name, STAGE_COLOURS[stage], width, step=True)


def stage_ms(run: WatchedRun) -> dict[str, FloatArray]:
    """Stage -> milliseconds of each frame, (T,); where the whole motion was asked at once, their mean."""
    frames = len(run.motion)
    return {
        stage: 1e3 * (value if isinstance(value, np.ndarray) else np.full(frames, value / max(1, frames)))
        for stage, value in run.detection.seconds.items()
        if np.sum(value) > IDLE * frames
    }


def is_timed(run: WatchedRun) -> bool:
    """Whether frames were timed one by one."""
    return any(isinstance(value, np.ndarray) for value in run.detection.seconds.values())


def budget_words(run: WatchedRun) -> str:
    """How a frame's time stands to the budget."""
    total = np.sum(list(stage_ms(run).values()), axis=0)
    what, ms = f"mean {total.mean():.2f} ms, p99", float(np.percentile(total, 99))
    if not is_timed(run):
        what, ms = "mean of all at once", float(total[0])
    return f"{what} {ms:.2f} = {figure(100 * ms / BUDGET_MS)} % of a {HEADSET_HZ:g} Hz frame ({BUDGET_MS:.1f} ms)"


def _log_times(writer: RecordingWriter, run: WatchedRun) -> None:
    """Cumulated lines, the total drawn first: Rerun has no areas."""
    total = np.zeros(len(run.motion))
    stages = stage_ms(run)
    for rank, (stage, ms) in enumerate(stages.items()):
        total = total + ms
        path = pipeline_path(run.label, "time", f"{len(stages) - rank}_{stage}")
        frames = writer.clock.kept if is_timed(run) else writer.clock.kept[[0, -1]]
        name = f"+ {stage}" if rank else stage
        writer.curve(path, frames, total[frames], name, STAGE_COLOURS.get(stage, OTHER), 1.4)
