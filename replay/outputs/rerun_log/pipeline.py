"""The tab *Pipeline*: bounding volumes of a pair, one look of the search, and what each stage left and took.

The cursor of a recording is one for all tabs. So this tab, which is about one moment, has bodies of its own, which
stand as in its worked moment until a click leads to another.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np
import rerun as rr
from scipy.spatial.transform import Rotation

from cdcore.bounding.bounding_sphere import Sphere, sphere_best
from cdcore.bounding.box import box_best
from cdcore.numerics import FloatArray
from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.effects.output import vector_of
from replay.outputs.camera import Eye, across, framing, placed, towards_user
from replay.outputs.palette import MISSED, SERIES, WHITE, Rgba, albedo, tags_of
from replay.outputs.rerun_log.moment_views import ROOM
from replay.outputs.rerun_log.recording_file import (
    RecordingWriter,
    Steps,
    entity,
    packed,
    pose_columns,
    steps_of,
    times_of,
)
from replay.outputs.rerun_log.scene import log_shape
from replay.outputs.rerun_log.stage import GROUND, Mark, faded, log_eyes, log_marks, words_beside
from replay.outputs.rerun_log.timing import stage_ms, total_ms
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

RISE: Final = np.array([0.0, 0.35, 0.0])
"""How far above the user's side volumes are seen from."""

NARROW: Final = 0.75
"""Width of their view over its height, with a rim: a wider one would cut the spheres at both sides."""

NEAREST: Final = 0.22
"""Metres from the eye to the pair at least."""


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
    root = pipeline_path(run.label)
    steps = steps_of(run.moments, len(run.motion), run.worked)
    balls = [sphere_best(body.mesh) for body in result.assembly.bodies]
    _log_bodies(writer, run, result, steps, balls)
    near = {moment: _volumes_eye(result, moment, balls) for moment in run.moments}
    log_eyes(writer, f"{root}/near/eye", [(frame, later, near[moment]) for frame, later, moment in steps])
    eyes = {moment: _search_eye(run, result, moment, balls) for moment in run.moments}
    log_eyes(writer, f"{root}/search/eye", [(frame, later, eyes[moment]) for frame, later, moment in steps])
    marks = {moment: _search_marks(run, result, moment, eyes[moment]) for moment in run.moments}
    log_marks(writer, f"{root}/search", steps, marks)
    notes = {moment: [_frame_text(run, result, moment)] for moment in run.moments}
    writer.steps(f"{root}/frame", steps, notes, _markdowns)
    _log_list(writer, run, result)


def _markdowns(texts: list[str]) -> rr.ComponentColumnList:
    return rr.TextDocument.columns(text=texts, media_type=[rr.MediaType.MARKDOWN] * len(texts))


def _log_bodies(writer: RecordingWriter, run: WatchedRun, result: RunResult, steps: Steps, balls: list[Sphere]) -> None:
    """The pair of each moment and the ground as they stand then; below both bodies their sphere and their box."""
    assembly, motion, when = result.assembly, run.motion, times_of(steps)
    frames = [moment.frame for *_, moment in steps]
    pairs = assembly.pairs[[moment.pair for *_, moment in steps]]
    wire, grey, blue = rr.components.FillMode.MajorWireframe, STAGE_COLOURS[SPHERES], STAGE_COLOURS[BOXES]
    for body, name in enumerate(assembly.names):
        tags, near = tags_of(name, result.session.scene), (pairs == body).any(axis=1)
        ground = not GROUND.isdisjoint(tags)
        if not (ground or near.any()):
            continue
        path, colour, mesh = _body_path(run.label, name), faded(albedo(tags), tags), assembly.bodies[body].mesh
        log_shape(writer, f"{path}/mesh", mesh)
        writer.rows(path, when, pose_columns(motion.translations[frames, body], motion.rotations[frames, body]))
        seen = motion.valid[frames, body] & (ground | near)
        colours = np.where(seen[:, None], colour, (*colour[:3], 0)).astype(np.uint8)
        writer.rows(f"{path}/mesh", when, rr.Mesh3D.columns(albedo_factor=colours))
        # What holds the room is not drawn. Wires ignore alpha: an empty row hides them.
        count, ball = int(near.sum()), balls[body]
        if ball.radius > ROOM or not count:
            continue
        sizes = np.full((count, 3), ball.radius)
        spheres = rr.Ellipsoids3D.columns(centers=np.tile(ball.centre, (count, 1)), half_sizes=sizes)
        writer.rows(f"{path}/sphere", when, spheres, near)
        looks = rr.Ellipsoids3D.from_fields(fill_mode=wire, line_radii=rr.Radius.ui_points(1.0), colors=packed([grey]))
        writer.static(f"{path}/sphere", looks)
        if BOXES in run.counts:
            box = box_best(mesh)
            # The axes of a box may be left-handed: turned about, the box is the same.
            turn = Rotation.from_matrix(box.axes * np.sign(np.linalg.det(box.axes))).as_quat()
            centres, halves, turns = (np.tile(part, (count, 1)) for part in (box.centre, box.half, turn))
            boxes = rr.Boxes3D.columns(centers=centres, half_sizes=halves, quaternions=turns)
            writer.rows(f"{path}/box", when, boxes, near)
            edges = rr.Boxes3D.from_fields(fill_mode=wire, radii=rr.Radius.ui_points(1.8), colors=packed([blue]))
            writer.static(f"{path}/box", edges)


def _body_path(label: str, name: str) -> str:
    return pipeline_path(label, "bodies", name)


def _volumes_eye(result: RunResult, moment: Moment, balls: list[Sphere]) -> Eye:
    """An eye that sees the volumes of both bodies, but of one that holds the room."""
    assembly, pair = result.assembly, result.assembly.pairs[moment.pair].tolist()
    near = [body for body in pair if balls[body].radius <= ROOM] or pair
    centres = [placed(assembly.motion, moment.frame, body, balls[body].centre[None]) for body in near]
    axes = np.vstack([np.eye(3), -np.eye(3)])
    points = np.concatenate([centre + balls[body].radius * axes for body, centre in zip(near, centres, strict=True)])
    user = towards_user(assembly, result.session.scene, moment.frame, points.mean(axis=0).tolist())
    return framing(points, user + RISE, NARROW)


def _search_eye(run: WatchedRun, result: RunResult, moment: Moment, balls: list[Sphere]) -> Eye:
    """An eye that sees the smaller body whole, with the place where the search ended before it."""
    assembly, look = result.assembly, run.look(moment)
    points = run.seen.search.places(assembly.motion, moment.frame, moment.pair, look.hit or look.closest)
    point = points.mean(axis=0) if moment.meets is None else np.asarray(moment.meets)
    user = towards_user(assembly, result.session.scene, moment.frame, point.tolist())
    body = min(assembly.pairs[moment.pair].tolist(), key=lambda body: balls[body].radius)
    middle = placed(assembly.motion, moment.frame, body, balls[body].centre[None])[0]
    distance = float(np.clip(4.2 * balls[body].radius, NEAREST, 0.5))
    # Not farther aside than the place stays in view.
    way = middle - point
    target = point + way * min(1.0, 0.25 * distance / max(float(np.linalg.norm(way)), 1e-9))
    return Eye(vector_of(target + distance * across(np.zeros(3), user)), vector_of(target))


def _search_marks(run: WatchedRun, result: RunResult, moment: Moment, eye: Eye) -> list[Mark]:
    """Faces that ants of a look evaluated, the way of its best pair, its end, and where the surfaces of a miss meet."""
    trace, marks, centres = run.trace(moment), list[Mark](), list[FloatArray]()
    by_ants = np.flatnonzero(np.isfinite(trace.pheromone))
    for side, body in enumerate(result.assembly.pairs[moment.pair].tolist()):
        corners = result.assembly.bodies[body].mesh.triangles[trace.faces[:, side]]
        centres.append(placed(run.motion, moment.frame, body, corners.mean(axis=1)))
        once = np.unique(trace.faces[by_ants, side], return_index=True)[1]
        marks += [Mark(place, SERIES[1], 2.6) for place in centres[side][by_ants[once]][:, None]]
    path = np.mean(centres, axis=0)[trace.best()]
    marks += [Mark(line, WHITE, 2.0) for line in np.stack([path[:-1], path[1:]], axis=1)]
    marks.append(Mark(path[-1:], ENDS[moment.kind] if moment.meets is None else WHITE, 8.0))
    marks += _way_words(run, moment, trace, path, eye)
    if moment.meets is not None:
        meets = np.asarray(moment.meets)
        away = 1e3 * float(np.linalg.norm(meets - path[-1]))
        words = f"missed: the surfaces meet here, {away:.0f} mm away"
        marks += [Mark(meets[None], MISSED, 8.0), *words_beside(eye, meets, words, MISSED, -0.05, 0.40)]
    return marks


def _way_words(run: WatchedRun, moment: Moment, trace: LookTrace, path: FloatArray, eye: Eye) -> list[Mark]:
    """Numbered words on the way of the best pair."""
    best, apart = trace.best(), 1e3 * trace.distance[trace.best()]
    last, look, ago = len(best) - 1, run.look(moment), moment.frame - moment.looked
    end, colour = f"{apart[-1]:.1f} mm apart; stopped at {look.evaluations:,} samples", WHITE
    if ago:
        end += f", {ago} frames ago"
    if moment.kind == CONTACT:
        end, colour = "confirmed by the triangle test", ENDS[CONTACT]
    # Step of the way, words, and how far to the right and up they stand.
    words = [(0, f"first pair: {apart[0]:.0f} mm apart", WHITE, 0.34, 0.24)] if last else []
    by_ants = np.flatnonzero(trace.asked_by[best] == "ant")
    if len(by_ants) and 0 < by_ants[-1] < last:
        words.append((int(by_ants[-1]), f"best ant: {apart[by_ants[-1]]:.0f} mm", WHITE, 0.34, 0.10))
    words.append((last, end, colour, 0.14, -0.34))
    return [
        mark
        for number, (step, text, colour, right, up) in enumerate(words, 3)
        for mark in words_beside(eye, path[step], f"{number}  {text}", colour, right, up)
    ]


def _log_counts(writer: RecordingWriter, run: WatchedRun) -> None:
    """What was searched is wider, so that it shows where all of it is confirmed."""
    for rank, (stage, count) in enumerate(run.counts.items()):
        if stage != ALL:
            path, width = pipeline_path(run.label, "pairs", f"{rank}_{stage}"), 4.5 if stage == SEARCHED else 1.8
            writer.curve(path, count, stage, STAGE_COLOURS[stage], width, step=True)


def _frame_text(run: WatchedRun, result: RunResult, moment: Moment) -> str:
    """The frame of a moment in numbers: how many pairs each stage leaves, and what each takes."""
    times, total = stage_ms(run.detection), total_ms(run.detection)[moment.frame]
    counts = [(stage, _count_words(run, result, moment, stage)) for stage in run.counts]
    taken = [(stage, f"{1e3 * ms[moment.frame]:.0f} µs") for stage, ms in times.items()]
    price = f"{total:.2f} ms for this frame: {figure(100 * total / BUDGET_MS)} % of a {HEADSET_HZ:g} Hz frame"
    left = table("", ("stage", "pairs that it leaves"), counts)
    return "\n\n".join([markdown(left), f"**{price}**", markdown(table("", ("stage", "takes"), taken))])


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
    names = [result.assembly.pair_name(moment.pair) for moment in run.moments]
    width, texts = max(map(len, names)), []
    for moment, name in zip(run.moments, names, strict=True):
        samples = counted(run.look(moment).evaluations, "sample")
        texts.append(f"{run.motion.times[moment.frame]:8.3f} s  {moment.kind:<9}  {name:<{width}}  {samples:>13}")
    columns = rr.TextLog.columns(
        text=texts,
        level=[moment.kind for moment in run.moments],
        color=packed(ENDS[moment.kind] for moment in run.moments),
    )
    writer.rows(pipeline_path(run.label, "moments"), [moment.frame for moment in run.moments], columns)
