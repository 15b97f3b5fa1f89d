"""The tab *Pipeline*: bounding volumes of a pair, one look of the search, and what each stage left and took."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np
import rerun as rr

from cdcore.bounding.bounding_sphere import sphere_in_mode
from cdcore.bounding.box import box_best
from cdcore.numerics import FloatArray
from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.effects.output import vector_of
from replay.outputs.camera import Eye, across, framing, placed, towards_user
from replay.outputs.palette import MISSED, SERIES, WHITE, Rgba
from replay.outputs.rerun_log.moment_views import ROOM
from replay.outputs.rerun_log.recording_file import RecordingWriter, Steps, entity, packed, steps_of
from replay.outputs.rerun_log.stage import (
    Label,
    Standing,
    beside,
    log_dots,
    log_eyes,
    log_labels,
    log_lines,
    log_notes,
    log_standing,
)
from replay.outputs.rerun_log.timing import ceiling, stage_ms, total_ms
from replay.outputs.tables import markdown, table
from replay.outputs.watched_run import ALL, BOXES, CONFIRMED, CONTACT, LOST, SEARCHED, SPHERES, Moment, WatchedRun
from replay.outputs.words import counted
from replay.pipeline.gates import figure
from replay.pipeline.run_result import RunResult

if TYPE_CHECKING:
    from cdcore.search.tracing import LookTrace

STAGE_COLOURS: Final[Mapping[str, Rgba]] = {
    SPHERES: SERIES[5], BOXES: SERIES[0], SEARCHED: SERIES[1], CONFIRMED: SERIES[2],
}  # fmt: skip
"""Colours of what a stage leaves."""

ENDS: Final[Mapping[str, Rgba]] = {CONTACT: SERIES[2], LOST: MISSED}
"""Colour of how a look ended."""

FARTHER: Final = 1.25
"""How much farther an eye stands than boxes need: spheres reach beyond them."""

ANT: Final = SERIES[1]
NEAREST: Final = 0.22
"""Metres from the eye to the pair at least."""

WORDS_UP: Final = (0.24, 0.10, -0.34)
"""How high words on the search stand, in distances of the eye."""


def pipeline_path(label: str, *parts: str) -> str:
    """Entity of a part of one detector's pipeline."""
    return entity("pipeline", label, *parts)


def moment_words(run: WatchedRun, moment: Moment) -> str:
    """When it is, and what: the name of a moment."""
    what = "a miss of the search" if moment.kind == LOST else "a contact that the search finds"
    return f"At {run.motion.times[moment.frame]:.3f} s: {what}"


def log_pipeline(writer: RecordingWriter, run: WatchedRun, result: RunResult) -> None:
    """Send everything of one detector; at every instant without a moment of its own its worked moment is shown."""
    _log_counts(writer, run)
    if not run.moments:
        return
    assembly, root = result.assembly, pipeline_path(run.label)
    rows = [(one.frame, 0, one.first, one.last, one) for one in run.moments]
    steps = steps_of(rows, len(run.motion), run.worked)
    at = {one: Standing(assembly, one.frame, assembly.pairs[one.pair].tolist()) for one in run.moments}
    log_standing(writer, f"{root}/bodies", result.session.scene, steps, at)
    _log_volumes(writer, run, result, steps)
    _log_search(writer, run, result, steps)
    _log_frame(writer, run, result, steps)
    _log_list(writer, run, result)
    ns = int(writer.clock.ns[run.worked.frame])
    marks = np.array([ns - 2_000_000, ns, ns + 2_000_000])
    for part, top in (("pairs", float(run.counts[SPHERES].max())), ("mark", ceiling([total_ms(run.detection)]))):
        path = f"{root}/{part}/moment"
        writer.session_rows(path, np.maximum(marks, 0), rr.Scalars.columns(scalars=[0.0, top, 0.0]))
        colour = packed([ENDS[run.worked.kind]])
        writer.static(path, rr.SeriesLines.from_fields(names=[f"this moment, {ns * 1e-9:.3f} s"], colors=colour))


def _log_volumes(writer: RecordingWriter, run: WatchedRun, result: RunResult, steps: Steps) -> None:
    """The sphere and the box of both bodies, below the bodies, and the eye that sees both."""
    assembly, root = result.assembly, pipeline_path(run.label)
    pairs = {one: assembly.pairs[one.pair].tolist() for one in run.moments}
    shown = {body: assembly.bodies[body] for pair in pairs.values() for body in pair}
    spheres = {body: sphere_in_mode(shape.mesh, "best") for body, shape in shown.items()}
    boxes = {body: box_best(shape.mesh) for body, shape in shown.items()}
    wire = rr.components.FillMode.MajorWireframe
    # What holds the room is not drawn. Wires ignore alpha: an empty row hides them.
    for body in (body for body, sphere in spheres.items() if sphere.radius <= ROOM):
        path = f"{root}/bodies/{entity(assembly.names[body])}"

        here = {moment: [body] for moment, pair in pairs.items() if body in pair}

        def round_ones(some: list[int]) -> rr.ComponentColumnList:
            sizes = [[spheres[one].radius] * 3 for one in some]
            return rr.Ellipsoids3D.columns(centers=[spheres[one].centre for one in some], half_sizes=sizes)

        def square_ones(some: list[int]) -> rr.ComponentColumnList:
            turns = [_turn(boxes[one].axes) for one in some]
            sizes, centres = [boxes[one].half for one in some], [boxes[one].centre for one in some]
            return rr.Boxes3D.columns(centers=centres, half_sizes=sizes, quaternions=turns)

        writer.steps(f"{path}/sphere", steps, here, round_ones)
        colour, thin = packed([STAGE_COLOURS[SPHERES]]), rr.Radius.ui_points(1.0)
        writer.static(f"{path}/sphere", rr.Ellipsoids3D.from_fields(fill_mode=wire, line_radii=thin, colors=colour))
        if BOXES in run.counts:
            writer.steps(f"{path}/box", steps, here, square_ones)
            colour, thick = packed([STAGE_COLOURS[BOXES]]), rr.Radius.ui_points(1.8)
            writer.static(f"{path}/box", rr.Boxes3D.from_fields(fill_mode=wire, radii=thick, colors=colour))
    eyes = {}
    for moment, pair in pairs.items():
        near = [body for body in pair if spheres[body].radius <= ROOM] or pair
        points = np.concatenate(
            [placed(result.assembly.motion, moment.frame, body, boxes[body].corners) for body in near]
        )
        user = towards_user(assembly, result.session.scene, moment.frame, points.mean(axis=0).tolist())
        eye = framing(points, user + np.array([0.0, 0.35, 0.0]))
        away = FARTHER * np.subtract(eye.position, eye.target)
        eyes[moment] = Eye(tuple(np.asarray(eye.target) + away), eye.target)
    log_eyes(writer, f"{root}/near/eye", [(frame, later, eyes[moment]) for frame, later, moment in steps])


def _turn(axes: FloatArray) -> FloatArray:
    from scipy.spatial.transform import Rotation

    # The axes of a box may be left-handed: turned about, the box is the same.
    rotation = axes * np.sign(np.linalg.det(axes))
    turn: FloatArray = Rotation.from_matrix(rotation).as_quat()
    return turn


def _log_search(writer: RecordingWriter, run: WatchedRun, result: RunResult, steps: Steps) -> None:
    """Faces that a look evaluated, the way of its best pair, its end, and where the surfaces of a miss meet."""
    root = pipeline_path(run.label, "search")
    eyes, labels, dots, ways, ends = {}, {}, {}, {}, {}
    for one in run.moments:
        trace, eye = run.trace(one), _eye(run, result, one)
        eyes[one] = eye
        path = np.mean([centre[trace.best()] for centre in _centres(trace, result, one)], axis=0)
        labels[one] = _labels(run, one, trace, path, eye)
        ways[one] = [(line, WHITE) for line in np.stack([path[:-1], path[1:]], axis=1)]
        dots[one] = _ant_dots(trace, result, one)
        last = [(path[-1], ENDS[one.kind] if one.meets is None else WHITE)]
        last += [(np.asarray(one.meets), MISSED)] if one.meets is not None else []
        ends[one] = last
    log_eyes(writer, f"{root}/eye", [(frame, later, eyes[one]) for frame, later, one in steps])
    log_labels(writer, root, steps, labels)
    log_dots(writer, f"{root}/ants", steps, dots, 2.6)
    log_dots(writer, f"{root}/ends", steps, ends, 8.0)
    log_lines(writer, f"{root}/best", steps, ways, 2.0)


def _labels(run: WatchedRun, moment: Moment, trace: LookTrace, path: FloatArray, eye: Eye) -> list[Label]:
    """Numbered words on the way of the best pair, and where the surfaces of a miss meet."""
    best, apart = trace.best(), 1e3 * trace.distance[trace.best()]
    said = [(0, f"first pair: {apart[0]:.0f} mm apart", WHITE)]
    by_ants = np.flatnonzero(trace.asked_by[best] == "ant")
    if len(by_ants) and 0 < by_ants[-1] < len(best) - 1:
        said.append((int(by_ants[-1]), f"best ant: {apart[by_ants[-1]]:.0f} mm", WHITE))
    look, ago = run.look(moment), moment.frame - moment.looked
    end = f"{apart[-1]:.1f} mm apart; stopped at {look.evaluations:,} samples"
    if ago:
        end += f", {ago} frames ago"
    if moment.kind == CONTACT:
        end = "confirmed by the triangle test"
    said = [*(said if len(best) > 1 else []), (len(best) - 1, end, ENDS[CONTACT] if moment.kind == CONTACT else WHITE)]
    heights = [*WORDS_UP[: len(said) - 1], WORDS_UP[-1]]
    labels = [
        beside(eye, path[step], f"{number}  {words}", colour, 0.34 if number < len(said) else 0.14, height)
        for number, ((step, words, colour), height) in enumerate(zip(said, heights, strict=True), 3)
    ]
    if moment.meets is not None:
        away = 1e3 * float(np.linalg.norm(np.subtract(moment.meets, path[-1])))
        words = f"missed: the surfaces meet here, {away:.0f} mm away"
        labels.append(beside(eye, np.asarray(moment.meets), words, MISSED, -0.05, 0.40))
    return labels


def _eye(run: WatchedRun, result: RunResult, moment: Moment) -> Eye:
    """An eye that sees the smaller body whole, with the place where the search ended before it."""
    assembly, look = result.assembly, run.look(moment)
    points = run.seen.search.places(assembly.motion, moment.frame, moment.pair, look.hit or look.closest)
    point = points.mean(axis=0) if moment.meets is None else np.asarray(moment.meets)
    user = towards_user(assembly, result.session.scene, moment.frame, point.tolist())
    balls = {body: sphere_in_mode(assembly.bodies[body].mesh, "best") for body in assembly.pairs[moment.pair].tolist()}
    body = min(balls, key=lambda one: balls[one].radius)
    middle = placed(result.assembly.motion, moment.frame, body, balls[body].centre[None])[0]
    distance = float(np.clip(4.2 * balls[body].radius, NEAREST, 0.5))
    # Not farther aside than the place stays in view.
    way = middle - point
    target = point + way * min(1.0, 0.25 * distance / max(float(np.linalg.norm(way)), 1e-9))
    return Eye(vector_of(target + distance * across(np.zeros(3), user)), vector_of(target))


def _centres(trace: LookTrace, result: RunResult, moment: Moment) -> list[FloatArray]:
    """World centroids (n, 3) of the faces that a look evaluated, of each body."""
    ends = result.assembly.pairs[moment.pair].tolist()
    return [
        placed(
            result.assembly.motion,
            moment.frame,
            body,
            result.assembly.bodies[body].mesh.triangles[trace.faces[:, side]].mean(axis=1),
        )
        for side, body in enumerate(ends)
    ]


def _ant_dots(trace: LookTrace, result: RunResult, moment: Moment) -> list[tuple[FloatArray, Rgba]]:
    """Centroids of the faces that ants evaluated, once each."""
    dots, rows = [], np.flatnonzero(np.isfinite(trace.pheromone))
    for side, centres in enumerate(_centres(trace, result, moment)):
        first = np.unique(trace.faces[rows, side], return_index=True)[1]
        dots += [(place, ANT) for place in centres[rows[first]]]
    return dots


def _log_counts(writer: RecordingWriter, run: WatchedRun) -> None:
    """A step where a count changes; what was searched is wider, so that it shows where all of it is confirmed."""
    for rank, (stage, count) in enumerate(run.counts.items()):
        if stage == ALL:
            continue
        frames = np.union1d(np.flatnonzero(np.append(True, count[1:] != count[:-1])), [len(count) - 1])
        path, width = pipeline_path(run.label, "pairs", f"{rank}_{stage}"), 4.5 if stage == SEARCHED else 1.8
        writer.curve(path, frames, count[frames].astype(np.float64), stage, STAGE_COLOURS[stage], width, step=True)


def _log_frame(writer: RecordingWriter, run: WatchedRun, result: RunResult, steps: Steps) -> None:
    """The frame of the moment in numbers: how many pairs each stage leaves, and what each takes."""
    times, total = stage_ms(run.detection), total_ms(run.detection)
    words = {}
    for one in run.moments:
        share = figure(100 * total[one.frame] / BUDGET_MS)
        price = f"{total[one.frame]:.2f} ms for this frame: {share} % of a {HEADSET_HZ:g} Hz frame"
        counts = [(stage, _count_words(run, result, one, stage)) for stage in run.counts]
        taken = [(stage, f"{1e3 * ms[one.frame]:.0f} µs") for stage, ms in times.items()]
        left = table("", ("stage", "pairs that it leaves"), counts)
        words[one] = "\n\n".join([markdown(left), f"**{price}**", markdown(table("", ("stage", "takes"), taken))])
    log_notes(writer, pipeline_path(run.label, "frame"), steps, words)


def _count_words(run: WatchedRun, result: RunResult, moment: Moment, stage: str) -> str:
    """How many pairs, and why fewer are searched than boxes meet, or which is confirmed or missed."""
    count = int(run.counts[stage][moment.frame])
    waiting = int(run.counts.get(BOXES, run.counts[SPHERES])[moment.frame]) - count
    if stage == SEARCHED and waiting > 0:
        return f"{count}, {waiting} as before"
    if stage == CONFIRMED and moment.kind == LOST:
        return f"{count}, missed: {result.assembly.pair_name(moment.pair)}"
    return f"{count}"


def _log_list(writer: RecordingWriter, run: WatchedRun, result: RunResult) -> None:
    """One line per moment: a click on its time moves the cursor there."""
    names = [result.assembly.pair_name(one.pair) for one in run.moments]
    width, texts = max(map(len, names)), []
    for one, name in zip(run.moments, names, strict=True):
        samples = counted(run.look(one).evaluations, "sample")
        texts.append(f"{run.motion.times[one.frame]:8.3f} s  {one.kind:<9}  {name:<{width}}  {samples:>13}")
    levels = [one.kind.replace(" ", "_") for one in run.moments]
    colours = packed(ENDS[one.kind] for one in run.moments)
    columns = rr.TextLog.columns(text=texts, level=levels, color=colours)
    writer.rows(pipeline_path(run.label, "moments"), [one.frame for one in run.moments], columns)
