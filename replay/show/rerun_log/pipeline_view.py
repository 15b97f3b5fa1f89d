"""The tab *Pipeline*: bounding volumes of a pair, one look of the search, and what each stage left and took.

The cursor of a recording is one for all tabs. So this tab, which is about one moment, has bodies of its own, which
stand as in its worked moment until a click leads to another.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cdcore import Detection, Motion, Verdict
from cdcore.bounding.bounding_sphere import Sphere
from cdcore.bounding.box import box_best
from cdcore.numerics import FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay import words
from replay.auditing.fault import worst_first
from replay.detection.run_detector import watched_again
from replay.document.cost import BUDGET_MS
from replay.document.run_result import RunResult
from replay.document.tables import markdown, table
from replay.effects.output import Vector
from replay.show.camera import Eye, eye_before, points_in_world, towards_user, viewing_direction
from replay.show.palette import GROUND_TAGS, MISSED, SERIES_COLOURS, WHITE, Rgba, see_through, tags_of
from replay.show.rerun_log.close_up import LARGEST_BALL_M, Mark, log_eyes, log_marks, text_beside
from replay.show.rerun_log.recording_file import (
    RecordingWriter,
    Steps,
    entity,
    pack_colours,
    pose_columns,
    steps_of,
    times_of,
)
from replay.show.rerun_log.scene import log_shape
from replay.show.rerun_log.timing import stage_ms, total_ms
from replay.words import plural
from sessions.model.constants import HEADSET_HZ

if TYPE_CHECKING:
    from cdcore.search.pair_search import SearchResult
    from cdcore.search.tracing import SearchTrace, Watched

DRAWN_EVALUATIONS: Final = 40_000
"""Evaluations that the looks of one detector draw at most: some 4 MB. Misses come first."""

MOST_SEARCHES: Final = 60
"""Looks drawn of one detector at most: beyond it nobody steps through them."""

ALL, SPHERES, BOXES, SEARCHED, CONFIRMED = "all pairs", "spheres meet", "boxes meet", "searched", "confirmed"

LOST, TRUE_CONTACT = "missed", "contact"


STAGE_COLOURS: Final[Mapping[str, Rgba]] = {
    SPHERES: SERIES_COLOURS[5],
    BOXES: SERIES_COLOURS[0],
    SEARCHED: SERIES_COLOURS[1],
    CONFIRMED: SERIES_COLOURS[2],
}
"""Colours of what a stage leaves."""

VOLUME_SHAPES: Final = {SPHERES: "sphere", BOXES: "box"}

END_COLOURS: Final[Mapping[str, Rgba]] = {TRUE_CONTACT: SERIES_COLOURS[2], LOST: MISSED}
"""Colour of how a look ended."""

EYE_RISE: Final = np.array([0.0, 0.35, 0.0])
"""How far above the user's side volumes are seen from."""

SPHERES_DISTANCE_RADII: Final = 2.6
"""Distance of that eye in radii of a ball around both spheres: nearer their narrow view would cut them."""

EYE_DISTANCES_M: Final = (0.22, 0.5)
"""Metres from the eye to what the search found, at least and at most."""

DISTANCE_RADII: Final = 4.2
"""Distance of that eye in radii of the smaller body, so that all of it is seen."""


@dataclass(frozen=True)
class Search:
    """A frame that matters, and the look that led to its verdict."""

    frame: int  # row of the verdict
    pair: int  # its column
    search_frame: int  # frame of the look; earlier where the pair was not searched again since
    kind: str  # ``LOST`` or ``TRUE_CONTACT``
    first: int  # frames in which it is shown: of a miss all of it, else this frame alone
    last: int
    later: int = 0  # nanoseconds after the frame
    meeting_point: Vector | None = None  # where the surfaces of a missed contact meet, world metres


@dataclass(frozen=True, eq=False)
class SearchRun:
    """One audited detector at its work."""

    label: str
    detection: Detection
    motion: Motion
    counts: Mapping[str, IntArray]  # stage -> (T,) pairs that it left
    stage_log: Watched  # what each stage did
    searches: Sequence[Search]  # at most one per frame, in order of time

    @property
    def worked_search(self) -> Search:
        """The one to begin with: of misses that with the most evaluations, else of contacts."""
        return min(self.searches, key=lambda search: (search.kind != LOST, -self.look(search).evaluations))

    def look(self, search: Search) -> SearchResult:
        """Result of the search at its sample."""
        return self.stage_log.search.noted[search.search_frame, search.pair].result

    def trace(self, search: Search) -> SearchTrace:
        """Everything that its look evaluated."""
        return self.stage_log.search.trace(self.motion, search.search_frame, search.pair)


def search_runs(result: RunResult) -> list[SearchRun]:
    """The audited detectors that can be watched, searched again; none of hours."""
    runs: list[SearchRun] = []
    for label in result.comparisons:
        detection, motion = result.detections[label], result.assembly.motion
        stage_log = watched_again(result.detectors.get(label), motion)
        if stage_log is not None:
            searches = _searches(result, label, stage_log)
            runs.append(SearchRun(label, detection, motion, stage_counts(detection, stage_log), stage_log, searches))
    return runs


def stage_counts(detection: Detection, stage_log: Watched) -> dict[str, IntArray]:
    """Stage -> pairs that it left, (T,); without boxes there is no such stage."""
    pairs_left = {ALL: detection.verdict != Verdict.NO_POSE, SPHERES: stage_log.spheres, BOXES: stage_log.boxes}
    if stage_log.boxes is stage_log.spheres:
        del pairs_left[BOXES]
    pairs_left |= {SEARCHED: stage_log.searched, CONFIRMED: counts_as_contact(detection.verdict)}
    return {stage: pairs.sum(axis=1) for stage, pairs in pairs_left.items()}


def _searches(result: RunResult, label: str, stage_log: Watched) -> list[Search]:
    search_by_frame: dict[int, Search] = {}
    evaluations_spent = 0
    for search in [*_missed_searches(result, label, stage_log), *_first_contact_searches(result, label, stage_log)]:
        evaluations = stage_log.search.noted[search.search_frame, search.pair].result.evaluations
        has_room = len(search_by_frame) < MOST_SEARCHES and evaluations_spent + evaluations <= DRAWN_EVALUATIONS
        if search.frame not in search_by_frame and has_room:
            search_by_frame[search.frame] = search
            evaluations_spent += evaluations
    return [search_by_frame[frame] for frame in sorted(search_by_frame)]


def _missed_searches(result: RunResult, label: str, stage_log: Watched) -> Iterator[Search]:
    """The frame of each miss that shows most, longest cut first, with the last look before it."""
    for miss in worst_first(result.misses[label]):
        searched_frames = np.flatnonzero(stage_log.searched[: miss.frame + 1, miss.pair])
        if len(searched_frames):
            yield Search(
                miss.frame, miss.pair, int(searched_frames[-1]), LOST, miss.first, miss.last, meeting_point=miss.point
            )


def _first_contact_searches(result: RunResult, label: str, stage_log: Watched) -> Iterator[Search]:
    """The first frame of each contact that the search found, spread over the session where there are too many."""
    contact_searches = [
        Search(contact.first, contact.pair, contact.first, TRUE_CONTACT, contact.first, contact.first)
        for contact in result.episodes[label]
        if (contact.first, contact.pair) in stage_log.search.noted
    ]
    stride = max(1, -(-len(contact_searches) // MOST_SEARCHES))
    for remainder in range(stride):
        yield from contact_searches[remainder::stride]


def pipeline_path(label: str, *names: str) -> str:
    """Entity of a part of one detector's pipeline."""
    return entity("pipeline", label, *names)


def search_title(run: SearchRun, search: Search) -> str:
    """When it is, and what."""
    search_word = "a miss of the search" if search.kind == LOST else "a contact that the search finds"
    return f"At {words.moment(run.motion.times[search.frame])}: {search_word}"


def log_pipeline(writer: RecordingWriter, run: SearchRun, result: RunResult, balls: Sequence[Sphere]) -> None:
    """Send everything of one detector; at every instant without a search of its own its worked one is shown."""
    _log_counts(writer, run)
    if not run.searches:
        return
    root = pipeline_path(run.label)
    segments = {search: ((search.frame, search.later), search.first, search.last) for search in run.searches}
    steps = steps_of(segments, len(run.motion), run.worked_search)
    for body, ball in enumerate(balls):
        _log_body(writer, run, result, steps, body, ball)
    eyes = {search: _search_eye(run, result, search, balls) for search in run.searches}
    log_eyes(writer, f"{root}/near/eye", steps, {search: _volumes_eye(result, search, balls) for search in eyes})
    log_eyes(writer, f"{root}/search/eye", steps, eyes)
    log_marks(writer, f"{root}/search", steps, {search: _marks(run, result, search, eyes[search]) for search in eyes})
    writer.steps(f"{root}/frame", steps, {search: [_frame_text(run, result, search)] for search in eyes}, _markdowns)
    _log_list(writer, run, result)


def _markdowns(texts: list[str]) -> rr.ComponentColumnList:
    return rr.TextDocument.columns(text=texts, media_type=[rr.MediaType.MARKDOWN] * len(texts))


def _log_counts(writer: RecordingWriter, run: SearchRun) -> None:
    """Logs the pairs of each stage; the searched curve is wider, so that it shows behind an equal confirmed one."""
    for rank, (stage, count) in enumerate(run.counts.items()):
        if stage != ALL:
            path, width = pipeline_path(run.label, "pairs", f"{rank}_{stage}"), 4.5 if stage == SEARCHED else 1.8
            writer.curve(path, count, stage, STAGE_COLOURS[stage], width, step=True)


def _log_body(
    writer: RecordingWriter, run: SearchRun, result: RunResult, steps: Steps, body: int, ball: Sphere
) -> None:
    """A body as it stands in each search of it, the ground in all; below it its sphere and its box."""
    assembly, motion = result.assembly, run.motion
    name, mesh = assembly.names[body], assembly.bodies[body].mesh
    tags, path = tags_of(name, result.session.scene), pipeline_path(run.label, "bodies", name)
    is_in_pair = np.array([body in assembly.pairs[search.pair] for *_, search in steps])
    is_drawn = is_in_pair | (not GROUND_TAGS.isdisjoint(tags))
    if not is_drawn.any():
        return
    step_times, frames = times_of(steps), [search.frame for *_, search in steps]
    log_shape(writer, f"{path}/mesh", mesh)
    writer.rows(path, step_times, pose_columns(motion.translations[frames, body], motion.rotations[frames, body]))
    colours = np.tile(np.array(see_through(tags), dtype=np.uint8), (len(frames), 1))
    colours[~(is_drawn & motion.valid[frames, body]), 3] = 0
    writer.rows(f"{path}/mesh", step_times, rr.Mesh3D.columns(albedo_factor=colours))
    # What holds the room has no wires.
    if ball.radius > LARGEST_BALL_M or not is_in_pair.any():
        return

    def wires(stage: str, shape: Any, half: ArrayLike, **style: Any) -> None:
        # Wires ignore alpha: an empty row hides them.
        shape_path = f"{path}/{VOLUME_SHAPES[stage]}"
        writer.rows(
            shape_path, step_times, shape.columns(half_sizes=np.tile(half, (int(is_in_pair.sum()), 1))), is_in_pair
        )
        colour, lines = pack_colours([STAGE_COLOURS[stage]]), rr.components.FillMode.MajorWireframe
        writer.static(shape_path, shape.from_fields(fill_mode=lines, colors=colour, **style))

    thin_lines, thick_lines = rr.Radius.ui_points(1.0), rr.Radius.ui_points(1.8)
    wires(SPHERES, rr.Ellipsoids3D, np.full(3, ball.radius), centers=[ball.centre], line_radii=thin_lines)
    if BOXES in run.counts:
        box = box_best(mesh)
        # The axes of a box may be left-handed: turned about, the box is the same.
        rotation = Rotation.from_matrix(box.axes * np.sign(np.linalg.det(box.axes))).as_quat()
        wires(BOXES, rr.Boxes3D, box.half, centers=[box.centre], quaternions=[rotation], radii=thick_lines)


def _volumes_eye(result: RunResult, search: Search, balls: Sequence[Sphere]) -> Eye:
    """An eye that sees the spheres of both bodies whole, but of one that holds the room."""
    motion, pair = result.assembly.motion, result.assembly.pairs[search.pair].tolist()
    small_bodies = [body for body in pair if balls[body].radius <= LARGEST_BALL_M] or pair
    centres = np.concatenate(
        [points_in_world(motion, search.frame, body, balls[body].centre[None]) for body in small_bodies]
    )
    radii = np.array([[balls[body].radius] for body in small_bodies])
    middle = ((centres - radii).min(axis=0) + (centres + radii).max(axis=0)) / 2
    enclosing_radius = (np.linalg.norm(centres - middle, axis=1) + radii[:, 0]).max()
    towards_eye = towards_user(result.assembly, result.session.scene, search.frame, middle.tolist()) + EYE_RISE
    return eye_before(middle, SPHERES_DISTANCE_RADII * enclosing_radius * towards_eye / np.linalg.norm(towards_eye))


def _search_eye(run: SearchRun, result: RunResult, search: Search, balls: Sequence[Sphere]) -> Eye:
    """An eye before the place where the search ended, or where it missed, that sees the smaller body whole."""
    assembly, sample = result.assembly, run.look(search)
    end_points = run.stage_log.search.points(assembly.motion, search.frame, search.pair, sample.hit or sample.closest)
    target = end_points.mean(axis=0) if search.meeting_point is None else np.asarray(search.meeting_point)
    user_side = towards_user(assembly, result.session.scene, search.frame, target.tolist())
    radius = min(balls[body].radius for body in assembly.pairs[search.pair].tolist())
    return eye_before(
        target, float(np.clip(DISTANCE_RADII * radius, *EYE_DISTANCES_M)) * viewing_direction(np.zeros(3), user_side)
    )


def _marks(run: SearchRun, result: RunResult, search: Search, eye: Eye) -> list[Mark]:
    """Faces that ants of a look evaluated, the way of its best pair, its end, and where the surfaces of a miss meet."""
    trace, marks, centres = run.trace(search), list[Mark](), list[FloatArray]()
    ant_rows = np.flatnonzero(np.isfinite(trace.pheromone))
    for side, body in enumerate(result.assembly.pairs[search.pair].tolist()):
        corners = result.assembly.bodies[body].mesh.triangles[trace.faces[:, side]]
        centres.append(points_in_world(run.motion, search.frame, body, corners.mean(axis=1)))
        first_rows = np.unique(trace.faces[ant_rows, side], return_index=True)[1]
        marks += [Mark(position, SERIES_COLOURS[1], 2.6) for position in centres[side][ant_rows[first_rows]][:, None]]
    path = np.mean(centres, axis=0)[trace.best()]
    marks += [Mark(line, WHITE, 2.0) for line in np.stack([path[:-1], path[1:]], axis=1)]
    marks.append(Mark(path[-1:], END_COLOURS[search.kind] if search.meeting_point is None else WHITE, 8.0))
    for number, (step, text, colour, right, up) in enumerate(_path_text(run, search, trace), 3):
        marks += text_beside(eye, path[step], f"{number}  {text}", colour, right, up)
    if search.meeting_point is not None:
        meeting_point = np.asarray(search.meeting_point)
        gap = words.length(float(np.linalg.norm(meeting_point - path[-1])))
        text = f"missed: the surfaces meet here, {gap} away"
        marks += [Mark(meeting_point[None], MISSED, 8.0), *text_beside(eye, meeting_point, text, MISSED, -0.05, 0.40)]
    return marks


def _path_text(run: SearchRun, search: Search, trace: SearchTrace) -> Iterator[tuple[int, str, Rgba, float, float]]:
    """Steps of the way of the best pair, their words, and how far to the right and up these stand."""
    best_path, path_gaps = trace.best(), trace.distance[trace.best()].tolist()
    last_step, frames_ago = len(best_path) - 1, search.frame - search.search_frame
    ant_rows = np.flatnonzero(trace.source[best_path] == "ant")
    if last_step:
        yield 0, f"first pair: {words.length(path_gaps[0])} apart", WHITE, 0.34, 0.24
    if len(ant_rows) and 0 < ant_rows[-1] < last_step:
        yield int(ant_rows[-1]), f"best ant: {words.length(path_gaps[ant_rows[-1]])}", WHITE, 0.34, 0.10
    if search.kind == TRUE_CONTACT:
        yield last_step, "confirmed by the triangle test", END_COLOURS[TRUE_CONTACT], 0.14, -0.34
    else:
        end_text = f"{words.length(path_gaps[-1])} apart; stopped at {run.look(search).evaluations:,} samples"
        yield last_step, f"{end_text}, {frames_ago} frames ago" if frames_ago else end_text, WHITE, 0.14, -0.34


def _frame_text(run: SearchRun, result: RunResult, search: Search) -> str:
    """The frame of a search in numbers: how many pairs each stage leaves, and what each takes."""
    count_of_stage = {stage: int(count[search.frame]) for stage, count in run.counts.items()}
    cells = {stage: str(count) for stage, count in count_of_stage.items()}
    if (waiting_pairs := count_of_stage.get(BOXES, count_of_stage[SPHERES]) - count_of_stage[SEARCHED]) > 0:
        cells[SEARCHED] += f", {waiting_pairs} as before"
    if search.kind == LOST:
        cells[CONFIRMED] += f", missed: {result.assembly.pair_name(search.pair)}"
    time_of_stage = [(stage, words.duration(ms[search.frame] / 1e3)) for stage, ms in stage_ms(run.detection).items()]
    total_of_frame = total_ms(run.detection)[search.frame]
    percentage = words.as_percentage(total_of_frame / BUDGET_MS)
    price_sentence = (
        f"{words.frame_time(total_of_frame / 1e3)} for this frame: {percentage} of a {HEADSET_HZ:g} Hz frame"
    )
    counts_table = table("", ("stage", "pairs that it leaves"), [*cells.items()])
    return "\n\n".join(
        [markdown(counts_table), f"**{price_sentence}**", markdown(table("", ("stage", "takes"), time_of_stage))]
    )


def _log_list(writer: RecordingWriter, run: SearchRun, result: RunResult) -> None:
    """One line per search: a click on its time moves the cursor there."""
    pair_names = [result.assembly.pair_name(search.pair) for search in run.searches]
    width, lines = max(map(len, pair_names)), []
    for search, name in zip(run.searches, pair_names, strict=True):
        samples = plural(run.look(search).evaluations, "sample")
        moment = words.moment(run.motion.times[search.frame])
        line = f"{moment:>10}  {search.kind:<9}  {name:<{width}}  {samples:>13}"
        lines.append((line, search.kind, END_COLOURS[search.kind]))
    ns = writer.clock.ns[[search.frame for search in run.searches]]
    writer.log_lines(pipeline_path(run.label, "moments"), ns, lines)
