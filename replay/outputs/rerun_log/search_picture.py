"""One look of the search in space: faces it sampled, pheromone as their colour, the way of its best pair, its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore.bounding.sphere import sphere_in_mode
from cdcore.numerics import FloatArray, place_points
from replay.outputs.camera import CLOSE_UP, Eye, Obstacles, look_rotation, towards_user
from replay.outputs.palette import MISSED, SERIES, WHITE, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, packed, send_moments
from replay.outputs.rerun_log.focus import log_eyes
from replay.outputs.rerun_log.pipeline import ROOM, line_columns, pipeline_path
from replay.outputs.rerun_log.world import face_normals
from replay.outputs.watched_run import CONTACT, LOST, Moment, WatchedRun
from replay.outputs.words import counted
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

if TYPE_CHECKING:
    from cdcore.search.tracing import LookTrace

STAND_OFF: Final = 0.00025
"""Metres that sampled faces stand off their body."""

VIRIDIS: Final = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], dtype=np.float64)
"""Least pheromone to most. Source: matplotlib's viridis, every quarter."""

WALKED: Final[Rgba] = (184, 192, 206, 255)
"""Faces of the local search: pale, for they have no pheromone."""

ANT: Final = SERIES[1]
CONFIRMED: Final = SERIES[2]

TOWARDS_EYE: Final = 0.01
"""Metres that the last dot stands before its place, else glass and patches hide it."""

DISTANCES: Final = (CLOSE_UP, 0.45)
"""Metres from eye to pair: the smaller of both bodies fills the view."""

WIDE: Final = 3.2
"""Distance of the eye in reaches of the spheres that it shall see."""

WORDS_UP: Final = (0.30, 0.02, -0.24)
WORDS_ASIDE: Final = 0.26
"""Where words stand, in distances of the eye: up, and to the right of what they speak of."""


@dataclass(frozen=True, eq=False)
class Look:
    """What is drawn of one look, in world metres.

    ``corners`` (f, 3, 3) and ``shades`` (f,) of the faces; ``path`` (k, 3) of the best pair and ``dots`` (k,) of it;
    ``words`` with the places they stand at and speak of.
    """

    corners: FloatArray
    shades: NDArray[np.uint32]
    path: FloatArray
    dots: NDArray[np.uint32]
    words: Sequence[tuple[str, FloatArray, FloatArray]]
    end: Rgba


def log_searches(writer: RecordingWriter, run: WatchedRun, assembly: Assembly, scene: Scene, overview: Eye) -> None:
    """Send the looks of the moments that matter; each stands in its own frame and no longer.

    Two cameras go from moment to moment: before the pair of faces, and before both bodies from where ``overview`` is.
    """
    eyes = _eyes(run, assembly, scene)
    looks = {moment.frame: _look(run, assembly, moment, eye) for moment, eye in zip(run.moments, eyes, strict=True)}
    if not looks:
        return
    root = pipeline_path(run.label, "search")
    _log_faces(writer, root, looks)
    _log_path(writer, root, looks)
    _log_words(writer, root, looks)
    _log_list(writer, pipeline_path(run.label, "moments"), run, assembly)
    frames = [moment.frame for moment in run.moments]
    halves = [0, *((before + after + 1) // 2 for before, after in pairwise(frames))]
    log_eyes(writer, f"{root}/eye", [(frame, 0) for frame in halves], eyes)
    wide = [_wide(assembly, moment, overview) for moment in run.moments]
    log_eyes(writer, pipeline_path(run.label, "near", "eye"), [(frame, 0) for frame in halves], wide)


def end_words(moment: Moment, trace: LookTrace) -> str:
    """How a look ended."""
    if moment.kind == CONTACT:
        return "confirmed by the triangle test"
    apart = f"{trace.result.distance * 1e3:.1f} mm apart"
    if moment.kind != LOST:
        return f"closest: centroids {apart}"
    ago = moment.frame - moment.looked
    return f"last seen: centroids {apart}" + (f", {counted(ago, 'frame')} ago" if ago else "")


def _eyes(run: WatchedRun, assembly: Assembly, scene: Scene) -> list[Eye]:
    obstacles = Obstacles(assembly, scene)
    eyes = []
    for moment in run.moments:
        ends = assembly.pairs[moment.pair].tolist()
        hit = run.seen.search.noted[moment.looked, moment.pair].result
        spheres = [sphere_in_mode(assembly.bodies[body].mesh, "best") for body in ends]
        smaller = int(np.argmin([sphere.radius for sphere in spheres]))
        points = run.seen.search.places(assembly.motion, moment.frame, moment.pair, hit.hit or hit.closest)
        point = points.mean(axis=0)
        near = obstacles.close_up(moment.frame, point.tolist(), towards_user(assembly, scene, moment.frame, point))
        back = np.subtract(near.position, near.target) / CLOSE_UP
        middle = _placed(assembly, moment.frame, ends[smaller], spheres[smaller].centre[None])[0]
        distance = float(np.clip(2.6 * spheres[smaller].radius, *DISTANCES))
        # Not farther aside than the pair stays in view.
        way = middle - point
        target = point + way * min(1.0, 0.25 * distance / max(float(np.linalg.norm(way)), 1e-9))
        eyes.append(Eye(tuple(target + distance * back), tuple(target)))
    return eyes


def _wide(assembly: Assembly, moment: Moment, overview: Eye) -> Eye:
    """An eye that sees the spheres of both bodies, a small one and one that holds the room aside."""
    ends = assembly.pairs[moment.pair].tolist()
    spheres = [sphere_in_mode(assembly.bodies[body].mesh, "best") for body in ends]
    both = [(body, ball) for body, ball in zip(ends, spheres, strict=True) if ball.radius <= ROOM]
    if not both:
        return overview
    centres = np.array([_placed(assembly, moment.frame, body, ball.centre[None])[0] for body, ball in both])
    middle = centres.mean(axis=0)
    reach = max(float(np.linalg.norm(at - middle)) + ball.radius for at, (_, ball) in zip(centres, both, strict=True))
    back = np.subtract(overview.position, overview.target)
    return Eye(tuple(middle + WIDE * reach * back / np.linalg.norm(back)), tuple(middle))


def _placed(assembly: Assembly, frame: int, body: int, points: FloatArray) -> FloatArray:
    motion = assembly.motion
    return place_points(points, motion.rotations[frame, body], motion.translations[frame, body])


def _look(run: WatchedRun, assembly: Assembly, moment: Moment, eye: Eye) -> Look:
    trace, ends = run.trace(moment), assembly.pairs[moment.pair].tolist()
    corners, shades, centres = [], [], []
    for side, body in enumerate(ends):
        faces, shade = shaded_faces(trace, side)
        triangles = assembly.bodies[body].mesh.triangles
        out = triangles[faces] + STAND_OFF * face_normals(triangles[faces])[1][:, None]
        corners.append(_placed(assembly, moment.frame, body, out))
        shades.append(shade)
        best = triangles[trace.faces[trace.best(), side]].mean(axis=1)
        centres.append(_placed(assembly, moment.frame, body, best))
    path = np.mean(centres, axis=0)
    end = {CONTACT: CONFIRMED, LOST: MISSED}.get(moment.kind, WHITE)
    by_ant = trace.asked_by[trace.best()] == "ant"
    dots = np.where(by_ant, packed([ANT])[0], packed([WHITE])[0])
    dots[-1] = packed([end])[0]
    towards = np.subtract(eye.position, path[-1])
    path[-1] += TOWARDS_EYE * towards / np.linalg.norm(towards)
    words = _words(path, eye, path_words(trace, end_words(moment, trace)))
    return Look(np.concatenate(corners), np.concatenate(shades), path, dots, words, end)


def shaded_faces(trace: LookTrace, side: int) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Faces of one body that a look evaluated, and their colours: the most pheromone that came to each."""
    faces, which = np.unique(trace.faces[:, side], return_inverse=True)
    most = np.full(len(faces), -np.inf)
    np.maximum.at(most, which, np.where(np.isnan(trace.pheromone), -np.inf, trace.pheromone))
    by_ant, low, high = np.isfinite(most), np.inf, -np.inf
    if by_ant.any():
        low, high = float(np.nanmin(trace.pheromone)), float(np.nanmax(trace.pheromone))
    share = np.clip((np.where(by_ant, most, 0.0) - low) / max(high - low, 1e-12), 0.0, 1.0) if by_ant.any() else most
    steps = np.linspace(0.0, 1.0, len(VIRIDIS))
    colours = np.stack([np.interp(share, steps, VIRIDIS[:, k]) for k in range(3)], axis=1).astype(int)
    alike = packed((int(r), int(g), int(b), 255) for r, g, b in colours)
    return faces.astype(np.int64), np.where(by_ant, alike, packed([WALKED])[0])


def path_words(trace: LookTrace, end: str) -> list[tuple[int, str]]:
    """Step of the path -> words: the first pair, the best of the colony, the end."""
    best = trace.best()
    last = len(best) - 1
    said = [(0, f"first pair: {trace.distance[best[0]] * 1e3:.0f} mm apart")]
    by_ants = np.flatnonzero(trace.asked_by[best] == "ant")
    if len(by_ants) and 0 < by_ants[-1] < last:
        step = int(by_ants[-1])
        apart, number = trace.distance[best[step]] * 1e3, trace.iteration[best[step]]
        said.append((step, f"best ant, iteration {number}: {apart:.0f} mm; local search takes over"))
    return [*(said if last else []), (last, end)]


def _words(path: FloatArray, eye: Eye, said: Sequence[tuple[int, str]]) -> list[tuple[str, FloatArray, FloatArray]]:
    """Numbered words aside of the path, each at its own height."""
    right, up, _ = look_rotation(eye).T
    distance = float(np.linalg.norm(np.subtract(eye.position, eye.target)))
    places = []
    for number, (step, words) in enumerate(said, 1):
        height = WORDS_UP[number - 1 if number < len(said) else -1]
        place = np.asarray(eye.target) + distance * (WORDS_ASIDE * right + height * up)
        places.append((f"{number}  {words}", place, path[step]))
    return places


def _log_faces(writer: RecordingWriter, root: str, looks: Mapping[int, Look]) -> None:
    found = {frame: list(zip(look.corners, look.shades, strict=True)) for frame, look in looks.items()}

    def faces(flat: list[Any]) -> rr.ComponentColumnList:
        corners = np.array([one for one, _ in flat], dtype=np.float32).reshape(-1, 3)
        shades = np.repeat(np.array([shade for _, shade in flat], dtype=np.uint32), 3)
        return rr.Mesh3D.columns(vertex_positions=corners, vertex_colors=shades)

    send_moments(writer, f"{root}/faces", found, faces, each=3)
    both = rr.components.MeshFaceRendering.DoubleSided
    writer.static(f"{root}/faces", rr.Mesh3D.from_fields(face_rendering=both))
    # Faces of a rod are a pixel wide: a dot on each is seen.
    middles = {frame: [(one.mean(axis=0), shade) for one, shade in some] for frame, some in found.items()}
    _send_dots(writer, f"{root}/centroids", middles, 2.4)


def _log_path(writer: RecordingWriter, root: str, looks: Mapping[int, Look]) -> None:
    ways = {frame: [look.path.astype(np.float32)] for frame, look in looks.items()}
    send_moments(writer, f"{root}/best", ways, lambda flat: rr.LineStrips3D.columns(strips=flat))
    writer.static(f"{root}/best", rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.6), colors=packed([WHITE])))
    dots = {frame: list(zip(look.path, look.dots, strict=True)) for frame, look in looks.items()}
    _send_dots(writer, f"{root}/steps", {frame: one[:-1] for frame, one in dots.items()}, 4.0)
    _send_dots(writer, f"{root}/end", {frame: one[-1:] for frame, one in dots.items()}, 7.0)


def _log_words(writer: RecordingWriter, root: str, looks: Mapping[int, Look]) -> None:
    found = {
        frame: [(*one, look.end if k == len(look.words) - 1 else WHITE) for k, one in enumerate(look.words)]
        for frame, look in looks.items()
    }
    words = {
        frame: [(place, packed([colour])[0], text) for text, place, _, colour in some] for frame, some in found.items()
    }
    _send_dots(writer, f"{root}/words", words, 0.01)
    lines = {frame: [((place, about), colour) for _, place, about, colour in some] for frame, some in found.items()}
    send_moments(writer, f"{root}/leaders", lines, line_columns)
    writer.static(f"{root}/leaders", rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(0.6)))


def _send_dots(writer: RecordingWriter, path: str, dots: Mapping[int, Sequence[Any]], size: float) -> None:
    """Send dots of this size on the screen, each a place, a colour, and words if it has any."""

    def columns(flat: list[Any]) -> rr.ComponentColumnList:
        places = np.array([place for place, *_ in flat], dtype=np.float32).reshape(-1, 3)
        labels = [text for _, _, *words in flat for text in words]
        shades = np.array([shade for _, shade, *_ in flat], dtype=np.uint32)
        return rr.Points3D.columns(positions=places, colors=shades, labels=labels or None)

    send_moments(writer, path, dots, columns)
    labelled = True if any(len(one) > 2 for some in dots.values() for one in some) else None
    writer.static(path, rr.Points3D.from_fields(radii=rr.Radius.ui_points(size), show_labels=labelled))


def _log_list(writer: RecordingWriter, path: str, run: WatchedRun, assembly: Assembly) -> None:
    """One line per moment: a click on it moves the cursor there."""
    texts, colours = [], []
    for moment in run.moments:
        result = run.seen.search.noted[moment.looked, moment.pair].result
        what = f"{moment.kind:<9}  {assembly.pair_name(moment.pair)}"
        texts.append(f"{what}  {result.evaluations:4} face pairs, {result.iterations:2} iterations")
        colours.append({CONTACT: CONFIRMED, LOST: MISSED}.get(moment.kind, WHITE))
    levels = [moment.kind.replace(" ", "_") for moment in run.moments]
    columns = rr.TextLog.columns(text=texts, level=levels, color=packed(colours))
    writer.rows(path, [moment.frame for moment in run.moments], columns)
