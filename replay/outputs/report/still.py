"""The picture of a fault: one body white, the other blue glass, the collider yellow, and the gap with its length."""

import io
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import FloatArray, IntArray, place_points
from replay.comparison.false_contacts import FalseContact
from replay.comparison.outcome import Miss
from replay.outputs.camera import AZIMUTHS, overview, standing, towards_user
from replay.outputs.palette import INVENTED, MISSED, Rgba, albedo, is_ghost, tags_of
from replay.outputs.report.cage import cage
from replay.outputs.report.markup import Markup, element
from replay.outputs.report.rasteriser import Colour, Lines, Shape, View, drawn
from replay.pipeline.run_result import RunResult
from replay.prepare.assembly import Assembly

FIRST: Final = (470, 352)
CARD: Final = (300, 170)
"""Width and height of a picture, in its own units."""

SHARPER: Final = {FIRST: 1.8, CARD: 1.4}
"""Pixels a unit."""

WORDS: Final = 150
"""Units on the right of the first picture that its words take."""

MOST_LETTERS: Final = 20
"""That fit into it."""

WHITE: Final[Colour] = (0.95, 0.96, 0.97)
GLASS: Final[Colour] = (0.45, 0.70, 0.95)
GLASS_ALPHA: Final = 0.13
DARK: Final = np.array([18, 26, 37]) / 255
LIGHTER: Final = np.array([40, 55, 74]) / 255

HOLLOW: Final = 1.1
"""A solid of so many times the volume of its mesh differs from it enough to be drawn."""

LARGEST_MARK: Final = 0.03
"""Metres; a face that is larger is not painted red where bodies meet."""

SHORTEST_ARROW: Final = 14.0
"""Units; a shorter gap is a ring."""

RAISED: Final = np.radians(20.0)
"""From so far above the horizon: a lid is seen from above, and a gap below it."""

SIDE: Final = 0.6
"""What looking from the side opposite to the user costs, beside an arrow seen end on."""

Fault = Miss | FalseContact


@dataclass(frozen=True)
class Placed:
    """Two bodies at the moment of a fault."""

    names: tuple[str, str]
    meshes: tuple[TriangleMesh, TriangleMesh]
    poses: tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
    solids: tuple[TriangleMesh | None, TriangleMesh | None]
    point: FloatArray
    gap: FloatArray | None
    """Nearest points (2, 3) of the surfaces where they do not meet."""
    faces: tuple[IntArray, IntArray]
    """Faces that meet, of a miss."""
    hollow: str
    """Name of the body whose hull fills its hollow, or ``""``."""

    def points(self, body: int, mesh: TriangleMesh | None = None) -> FloatArray:
        """Vertices of a body or of what stands for it, world metres."""
        return place_points((mesh or self.meshes[body]).vertices, *self.poses[body])


def fault_still(result: RunResult, label: str, fault: Fault, size: tuple[int, int] = CARD) -> Markup:
    """A fault as SVG around a raster picture; in the first picture of a page each part is named."""
    placed = _placed(result, label, fault)
    glass = _glass(placed)
    away = _direction(result, placed, fault)
    factor = SHARPER[size]
    pixels = (round(size[0] * factor), round(size[1] * factor))
    worded = size == FIRST
    view = View.of(_shown(placed), away, pixels, round(WORDS * factor) if worded else 0)
    shapes, lines = _parts(placed, glass, view)
    picture, shape = drawn(view, shapes, lines, _background(pixels))
    arrow, place = _arrow(placed, view, factor)
    words = _words(placed, label, glass, view, shape, place) if worded else ()
    return element(
        "svg", _image(picture, size), arrow, *words, class_="still", viewBox=f"0 0 {size[0]} {size[1]}", role="img",
        aria_label=described(placed, label, glass),
    )  # fmt: skip


def colours(result: RunResult, label: str, fault: Fault) -> str:
    """Which body has which colour, for the line below a picture."""
    placed = _placed(result, label, fault)
    glass = _glass(placed)
    yellow = ", collider yellow" if any(placed.solids) else ""
    red = ", where they meet red" if isinstance(fault, Miss) else ""
    return f"{placed.names[1 - glass]} white, {placed.names[glass]} blue{yellow}{red}"


def bench_still(result: RunResult, size: tuple[int, int] = FIRST) -> Markup:
    """All bodies in the middle of the session, where there is no fault to show."""
    assembly, scene = result.assembly, result.session.scene
    frame = len(assembly.motion) // 2
    eye = overview(assembly, scene, np.zeros((0, 3)), frame)
    motion, shapes, near = assembly.motion, [], []
    for body in np.flatnonzero(motion.valid[frame]).tolist():
        tags = tags_of(assembly.bodies[body].name, scene)
        colour = albedo(tags)
        alpha = 0.1 if is_ghost(tags) else GLASS_ALPHA if colour[3] < 255 else 1.0
        points = place_points(
            assembly.bodies[body].mesh.vertices, motion.rotations[frame, body], motion.translations[frame, body]
        )
        shapes.append(Shape(points[assembly.bodies[body].mesh.faces], GLASS if alpha < 1 else _unit(colour), alpha))
        near.append(points if np.ptp(points, axis=0).max() < 0.6 else points.mean(axis=0, keepdims=True))
    pixels = (round(size[0] * SHARPER[size]), round(size[1] * SHARPER[size]))
    shown = np.concatenate(near) if near else np.zeros((1, 3))
    view = View.of(shown, np.subtract(eye.position, eye.target), pixels)
    picture, _ = drawn(view, shapes, (), _background(pixels))
    at = assembly.motion.times[frame]
    return element(
        "svg", _image(picture, size), class_="still", viewBox=f"0 0 {size[0]} {size[1]}", role="img",
        aria_label=f"The scene at {at:.2f} s",
    )  # fmt: skip


def described(placed: Placed, label: str, glass: int) -> str:
    """The picture in words, for those who cannot see it."""
    white, blue = placed.names[1 - glass], placed.names[glass]
    if placed.gap is None:
        return f"{white} and {blue} where they meet, and {label} reports nothing"
    length = 1e3 * float(np.linalg.norm(placed.gap[1] - placed.gap[0]))
    return f"{white} and {blue} are {length:.2g} mm apart, and {label} reports contact"


def _placed(result: RunResult, label: str, fault: Fault) -> Placed:
    assembly, row, gap = result.assembly, 0, None
    faces = (np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    if isinstance(fault, Miss):
        assembly, row = standing(result.assembly, fault)
        faces = _meeting(result, fault)
    else:
        row = fault.widest
        gap = _gap(assembly, fault)
    first, second = assembly.pairs[fault.pair].tolist()
    motion = assembly.motion
    return Placed(
        names=(fault.body_a, fault.body_b),
        meshes=(assembly.bodies[first].mesh, assembly.bodies[second].mesh),
        poses=(
            (motion.rotations[row, first], motion.translations[row, first]),
            (motion.rotations[row, second], motion.translations[row, second]),
        ),
        solids=(None, None) if isinstance(fault, Miss) else _solids(result, label, (first, second)),
        point=np.asarray(fault.point), gap=gap, faces=faces,
        hollow="" if isinstance(fault, Miss) else fault.hollow,
    )  # fmt: skip


def _gap(assembly: Assembly, fault: FalseContact) -> FloatArray | None:
    if np.isnan(fault.gap):
        return None
    from cdcore.narrow.fcl_meshes import FclMeshes

    ends, motion = assembly.pairs[fault.pair].tolist(), assembly.motion
    meshes = FclMeshes([assembly.bodies[body].mesh for body in ends])
    for place, body in enumerate(ends):
        meshes.place(place, motion.rotations[fault.widest, body], motion.translations[fault.widest, body])
    return meshes.gap(0, 1)[1]


def _meeting(result: RunResult, miss: Miss) -> tuple[IntArray, IntArray]:
    """Faces of both bodies that meet where the cut is longest."""
    reference = result.detections[result.oracle]
    faces = miss.faces if reference.face_sets is None else reference.faces(miss.deepest, miss.pair)
    if faces is None:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    return np.unique(faces[:, 0]), np.unique(faces[:, 1])


def _solids(result: RunResult, label: str, bodies: tuple[int, int]) -> tuple[TriangleMesh | None, TriangleMesh | None]:
    """What a detector asks in place of each mesh, where that differs to the eye."""
    colliders: Sequence[Any] = getattr(result.detectors.get(label), "colliders", ())
    if not colliders:
        return None, None
    meshes = [result.assembly.bodies[body].mesh for body in bodies]
    solids = [colliders[body].mesh for body in bodies]
    other = [solid is not mesh for solid, mesh in zip(solids, meshes, strict=True)]
    larger = [_volume(solid) > HOLLOW * _volume(mesh) for solid, mesh in zip(solids, meshes, strict=True)]
    first, second = larger if any(larger) else other
    return solids[0] if first else None, solids[1] if second else None


def _volume(mesh: TriangleMesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles - mesh.vertices.mean(axis=0), 1, 0)
    return abs(float((a * np.cross(b, c)).sum())) / 6


def _glass(placed: Placed) -> int:
    """Which of the two is drawn as glass: the one whose solid fills its hollow or fills most, else the larger."""
    if placed.hollow in placed.names:
        return placed.names.index(placed.hollow)
    filled = [
        0.0 if solid is None else _volume(solid) - _volume(mesh)
        for solid, mesh in zip(placed.solids, placed.meshes, strict=True)
    ]
    if filled[0] == filled[1]:
        filled = [float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) for mesh in placed.meshes]
    return int(filled[1] > filled[0])


def _direction(result: RunResult, placed: Placed, fault: Fault) -> FloatArray:
    """From where to look: across the gap, or along the surfaces that meet, from the user's side."""
    along = np.asarray(fault.normal) if isinstance(fault, Miss) else np.zeros(3)
    if placed.gap is not None:
        along = placed.gap[1] - placed.gap[0]
    along = along / max(float(np.linalg.norm(along)), 1e-12)
    row = fault.deepest if isinstance(fault, Miss) else fault.widest
    user = towards_user(result.assembly, result.session.scene, row, tuple(placed.point.tolist()))
    turn = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
    across, up = np.cos(RAISED), np.full(AZIMUTHS, np.sin(RAISED))
    choices = np.stack([across * np.sin(turn), up, across * np.cos(turn)], axis=1)
    cost = np.abs(choices @ along) - SIDE * (choices @ user)
    chosen: FloatArray = choices[int(np.argmin(cost))]
    return chosen


def _shown(placed: Placed) -> FloatArray:
    """Points that the picture must hold: both bodies, no farther from the fault than the smaller is large."""
    points = [placed.points(k, placed.solids[k]) for k in range(2)]
    near = min(float(np.linalg.norm(np.ptp(some, axis=0))) for some in points)
    if placed.gap is None:
        near *= 0.5
    every = np.concatenate(points)
    return np.concatenate([placed.point[None], every[np.linalg.norm(every - placed.point, axis=1) < near]])


def _parts(placed: Placed, glass: int, view: View) -> tuple[list[Shape], list[Lines]]:
    shapes, lines = [], list[Lines]()
    for body in range(2):
        corners = placed.points(body)[placed.meshes[body].faces]
        colour, alpha = (GLASS, GLASS_ALPHA) if body == glass else (WHITE, 1.0)
        marked = placed.faces[body]
        # Two triangles of a bench top would paint it red.
        marked = marked[np.ptp(corners[marked], axis=1).max(axis=1) < LARGEST_MARK]
        plain = np.setdiff1d(np.arange(len(corners)), marked)
        shapes.append(Shape(corners[plain], colour, alpha))
        shapes.append(Shape(corners[marked], _unit(MISSED)))
        solid = placed.solids[body]
        if solid is not None:
            walls, edges = cage(solid, placed.meshes[body], placed.poses[body], view, _unit(INVENTED))
            shapes.append(walls)
            lines += edges
    return shapes, lines


def _unit(colour: Rgba) -> Colour:
    return colour[0] / 255, colour[1] / 255, colour[2] / 255


def _background(size: tuple[int, int]) -> FloatArray:
    """Dark, lighter in the middle."""
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    away = np.hypot(x / size[0] - 0.4, (y / size[1] - 0.42) * size[1] / size[0]) / 0.8
    share = np.clip(1.0 - away, 0.0, 1.0)[..., None]
    return DARK + share * (LIGHTER - DARK)


def _image(picture: FloatArray, size: tuple[int, int]) -> Markup:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.round(picture * 255).astype(np.uint8)).save(out, "WEBP", quality=82, method=2)
    source = "data:image/webp;base64," + b64encode(out.getvalue()).decode()
    return Markup(f'<image href="{source}" width="{size[0]}" height="{size[1]}"/>')


def _arrow(placed: Placed, view: View, factor: float) -> tuple[Markup, tuple[float, float]]:
    """The gap as an arrow with two heads, a small one or a contact as a ring; and its middle."""
    if placed.gap is None:
        x, y, _ = (view.pixels(placed.point) / factor).tolist()
        return element("circle", class_="ring missed", cx=f"{x:.1f}", cy=f"{y:.1f}", r=11), (x, y)
    ends = view.pixels(placed.gap)[:, :2] / factor
    (x, y), along = ends.mean(axis=0).tolist(), ends[1] - ends[0]
    length = float(np.hypot(*along))
    if length < SHORTEST_ARROW:
        return element("circle", class_="ring", cx=f"{x:.1f}", cy=f"{y:.1f}", r=9), (x, y)
    step = along / length
    aside = np.array([-step[1], step[0]])
    strokes = [f"M{_at(ends[0])}L{_at(ends[1])}"]
    for tip, inward in ((ends[0], step), (ends[1], -step)):
        barbs = (tip + 6 * inward + 4 * aside, tip + 6 * inward - 4 * aside)
        strokes.append(f"M{_at(barbs[0])}L{_at(tip)}L{_at(barbs[1])}")
    path = "".join(strokes)
    return element("g", *(element("path", class_=kind, d=path) for kind in ("halo", "arrow"))), (x, y)


def _at(point: FloatArray) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


def _words(
    placed: Placed, label: str, glass: int, view: View, shape: IntArray, middle: tuple[float, float]
) -> list[Markup]:
    """Names beside the picture: each a line to what it names, from top to bottom without overlap."""
    factor = SHARPER[FIRST]
    names: list[tuple[tuple[float, float], str, str, str]] = []
    white, blue = placed.names[1 - glass], placed.names[glass]
    rows, columns = np.nonzero(shape == _numbers(placed)[1 - glass])
    if len(rows):
        row = int(np.quantile(rows, 0.25))
        column = int(columns[rows == row].max()) if (rows == row).any() else int(columns.max())
        what = "touches nothing" if placed.gap is not None else "touches"
        names.append(((column / factor, row / factor), _short(white, "white"), what, ""))
    solid = placed.solids[glass]
    if solid is not None:
        points = view.pixels(placed.points(glass, solid))[:, :2] / factor
        right = points[np.argmax(points[:, 0] - 0.3 * np.abs(points[:, 1] - FIRST[1] * 0.42))]
        names.append(((float(right[0]), float(right[1])), "collider", _short(f"what {label} asks", "asked"), "yellow"))
    else:
        points = view.pixels(placed.points(glass))[:, :2] / factor
        points = points[(points[:, 1] > 0) & (points[:, 1] < FIRST[1]) & (points[:, 0] < FIRST[0] - WORDS)]
        if len(points):
            right = points[np.argmax(points[:, 0])]
            names.append(((float(right[0]), float(right[1])), _short(blue, "blue"), "the other body", "blue"))
    if placed.gap is not None:
        length = 1e3 * float(np.linalg.norm(placed.gap[1] - placed.gap[0]))
        names.append((middle, f"{length:.2g} mm", _short(f"from {white} to {blue}", "apart"), ""))
    else:
        names.append((middle, "contact", _short(f"{label} reports none", "not reported"), "red"))
    names.sort(key=lambda name: name[0][1])
    made, free = list[Markup](), 44.0
    for left, (target, name, what, kind) in enumerate(names):
        y = min(max(target[1], free), FIRST[1] - 22 - 44.0 * (len(names) - 1 - left))
        free = y + 44.0
        x = FIRST[0] - WORDS + 8
        made.append(element("path", class_=f"lead {kind}", d=f"M{x - 5} {y:.0f}L{target[0]:.1f} {target[1]:.1f}"))
        made.append(element("text", name, class_=f"c {kind}", x=x, y=f"{y:.0f}"))
        made.append(element("text", what, class_="c2", x=x, y=f"{y + 16:.0f}"))
    return made


def _short(words: str, instead: str) -> str:
    """Words that fit beside the picture, or others."""
    return words if len(words) <= MOST_LETTERS else instead


def _numbers(placed: Placed) -> tuple[int, int]:
    """Numbers of the shapes that are the two bodies."""
    return 0, 2 + (placed.solids[0] is not None)
