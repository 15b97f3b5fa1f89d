"""Compares advised colliders with those that others ship, for hollow bodies on one planted motion.

python .ci/collider_comparison.py KEPT              prints the table of five bodies with at most 8, 16 and 32 pieces
python .ci/collider_comparison.py KEPT mug-8 bowl-32   prints some of its rows

Each body is cut by V-HACD and by CoACD at their defaults but for the most pieces; KEPT is a folder in which these
pieces are kept, since CoACD takes a minute for some. The pieces of `replay fix` may be no more than either gives.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_collider, hull_of
from cdcore.numerics import FloatArray
from cdcore.tolerances import TWO_MICROMETRES
from replay.advice.collider_search import ColliderSearch, Deadline, Limits
from replay.advice.scoring import Scoring
from replay.advice.settings import Setting
from replay.cutting.convex_solids import manifold_of, solids_of
from replay.cutting.surface_distance import Surface
from replay.detection.detector_spec import TRUSTED_DETECTOR, parse_detector
from replay.detection.run_detector import make_detector
from replay.engine import prepare
from replay.words import as_percentage
from sessions import MeshData, Session
from sessions.geometry.profile import rounded_strokes, sampled_polyline
from sessions.geometry.rings import revolved_solid
from sessions.geometry.shapes import make_shape
from sessions.glassware.catalogue import make_instrument
from sessions.synthetic.choreography import Script
from sessions.synthetic.paths import Key, KeyPath
from sessions.synthetic.rng import random_stream

COUNTS: Final = (8, 16, 32)
TOLERANCE: Final = 0.001
"""Fraction of contact time by which two colliders differ at least: 0.1 points."""

RATE_HZ: Final = 90.0
FACES: Final = 1200
HOVER: Final = 0.006
"""Metres between a probe and a surface before it is touched."""

DEPTH: Final = 0.0004
"""Metres by which a touch goes into the surface."""

TIP: Final = 0.008
ROD: Final = 0.003
SECONDS: Final = 300.0
"""Time limit of a search, as for `replay fix --time-limit 300`."""


@dataclass(frozen=True)
class Touch:
    """A straight approach of a probe: from a free point ``start``, ``towards`` the surface."""

    probe: str
    start: tuple[float, float, float]
    towards: tuple[float, float, float]
    via: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Case:
    """A hollow body with touches from outside and inside; probes enter its hollow from ``over`` it."""

    mesh: MeshData
    touches: Sequence[Touch]


def turned(degrees: float, height: float, radius: float = 0.0) -> tuple[float, float, float]:
    """The point at an angle around the axis, a height and a radius, metres."""
    angle = np.radians(degrees)
    return float(radius * np.cos(angle)), height, float(radius * np.sin(angle))


def around(probe: str, heights: Sequence[float], first: float, start: float) -> list[Touch]:
    """Touches at so many heights, 100 degrees apart: inwards from a radius, or outwards where that is 0."""
    touches = []
    for number, height in enumerate(heights):
        degrees = first + 100.0 * number
        inwards = -1.0 if start else 1.0
        towards = turned(degrees, 0.0, inwards)
        touches.append(Touch(probe, turned(degrees, height, start), towards))
    return touches


def beaker() -> Case:
    """A beaker of 250 mL with a spout."""
    inside = [*around("rod", (0.05, 0.06, 0.07), 20.0, 0.0), *around("finger", (0.03, 0.07), 200.0, 0.0)]
    floor = [Touch("rod", (0.012, 0.06, 0.0), (0.0, -1.0, 0.0))]
    return Case(
        make_instrument("beaker_250", FACES).mesh, [*inside, *floor, *around("finger", (0.02, 0.05), 30.0, 0.1)]
    )


def mug() -> Case:
    """A mug of 80 x 95 mm with a handle through which a finger fits."""
    from manifold3d import CrossSection, Manifold

    outline = sampled_polyline(
        rounded_strokes([[0, 0], [0.04, 0, 0.004], [0.04, 0.095], [0.036, 0.095], [0.036, 0.005, 0.004], [0, 0.005]]),
        24,
    )
    cup = manifold_of(as_mesh(revolved_solid(outline, 28)))
    ring = CrossSection.circle(0.005, 8).translate((0.027, 0.0)).revolve(20)
    bore = Manifold.cylinder(0.2, 0.038, 0.038, 28).rotate((-90.0, 0.0, 0.0)).translate((0.0, 0.004, 0.0))
    assert cup is not None
    made = (cup + (ring.translate((0.042, 0.048, 0.0)) - bore)).to_mesh64()
    mesh = MeshData(made.vert_properties[:, :3], np.asarray(made.tri_verts).astype(np.int64))
    hole = (0.052, 0.048, 0.0)
    handle = [
        Touch("finger", (0.052, 0.048, 0.06), towards, via=hole)
        for towards in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    ]
    inside = [*around("rod", (0.05, 0.06), 20.0, 0.0), *around("finger", (0.03, 0.07), 200.0, 0.0)]
    return Case(mesh, [*inside, *handle, *around("finger", (0.03, 0.06), 80.0, 0.1)])


def bowl() -> Case:
    """A bowl of 140 mm, half of a sphere on a flat foot."""
    outer = [(0.0, 0.0), *[turned_profile(angle, 0.07) for angle in np.linspace(-70.0, 0.0, 8)]]
    inner = [turned_profile(angle, 0.066) for angle in np.linspace(0.0, -90.0, 9)]
    mesh = revolved_solid(np.array([*outer, *inner[:-1], (0.0, inner[-1][1])]), 32)
    inside = [
        Touch("finger", (0.0, 0.05, 0.0), (0.6, -0.8, 0.0)),
        Touch("finger", (0.0, 0.05, 0.0), (-0.3, -0.9, 0.3)),
        Touch("finger", (0.0, 0.05, 0.0), (0.0, -0.2, -1.0)),
        *around("rod", (0.06, 0.065), 45.0, 0.0),
    ]
    return Case(mesh, [*inside, *around("finger", (0.03, 0.055), 30.0, 0.13)])


def turned_profile(degrees: float, radius: float) -> tuple[float, float]:
    """A point of a half-section of the bowl, (r, y)."""
    angle = np.radians(degrees)
    return float(radius * np.cos(angle)), float(0.066 + radius * np.sin(angle))


def flask() -> Case:
    """An Erlenmeyer flask of 250 mL."""
    inside = [*around("rod", (0.035, 0.04, 0.05), 10.0, 0.0), *around("rod", (0.12,), 90.0, 0.0)]
    outside = [*around("finger", (0.02, 0.06, 0.09), 30.0, 0.12), *around("finger", (0.12, 0.125), 200.0, 0.12)]
    return Case(make_instrument("erlenmeyer_flask", FACES).mesh, [*inside, *outside])


def rack() -> Case:
    """A rack for six test tubes, open to its front."""
    gap = (-0.06, 0.045, 0.0)
    within = [
        Touch("finger", (-0.06, 0.045, 0.09), towards, via=gap)
        for towards in ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (-1.0, 0.0, 0.0))
    ]
    holes = [
        Touch("rod", (x, 0.085, 0.0), towards) for x, towards in ((0.054, (1.0, 0.0, 0.0)), (-0.018, (0.0, 0.0, 1.0)))
    ]
    recess = [Touch("rod", (0.09, 0.05, 0.0), (0.0, -1.0, 0.0))]
    outside = [
        Touch("finger", (0.17, 0.05, 0.0), (-1.0, 0.0, 0.0)),
        Touch("finger", (0.036, 0.13, 0.02), (0.0, -1.0, 0.0)),
    ]
    return Case(make_instrument("test_tube_rack", FACES).mesh, [*within, *holes, *recess, *outside])


CASES: Final = {"beaker": beaker, "mug": mug, "bowl": bowl, "flask": flask, "rack": rack}

PROBES: Final = {
    "finger": make_shape("sphere", {"radius": TIP}, 320),
    "thumb": make_shape("sphere", {"radius": TIP}, 320),
    "rod": make_shape("capsule", {"radius": ROD, "length": 0.06}, 320),
}


def as_mesh(data: MeshData) -> TriangleMesh:
    """The mesh for the collision core."""
    return TriangleMesh(data.vertices, data.faces)


def spheres(probe: str) -> tuple[FloatArray, float]:
    """Middles (n, 3) of spheres that fill a probe, and their radius."""
    if probe == "rod":
        heights = np.linspace(-0.03 + ROD, 0.03 - ROD, 55)
        return np.column_stack([0.0 * heights, heights, 0.0 * heights]), ROD
    return np.zeros((1, 3)), TIP


def first_contact(surface: Surface, touch: Touch) -> FloatArray:
    """Where a probe touches a surface first, by steps as long as it is away from it."""
    middles, radius = spheres(touch.probe)
    position = np.array(touch.via or touch.start)
    direction = np.array(touch.towards) / np.linalg.norm(touch.towards)
    for _ in range(200):
        away = float(surface.distances(position + middles)[0].min()) - radius
        position = position + away * direction
        if away < 1e-7:
            return position
    raise ValueError(f"{touch} meets nothing")


def session_of(case: Case) -> Session:
    """Probes touch a body one after the other, then thumb and finger close on it, lift it and put it down."""
    surface, top = Surface(as_mesh(case.mesh).triangles), float(case.mesh.vertices[:, 1].max()) + 0.12
    scripts = {name: Script((0.3, top, 0.1 * number)) for number, name in enumerate(PROBES)}
    now = 0.0
    for touch in case.touches:
        script = scripts[touch.probe]
        script.wait_until(now)
        direction = np.array(touch.towards) / np.linalg.norm(touch.towards)
        contact = first_contact(surface, touch)
        script.over(touch.start, top)
        for stop in [touch.via] if touch.via else []:
            script.go(stop)
        tap(script, contact, direction)
        for stop in [touch.via, touch.start] if touch.via else [touch.start]:
            script.go(stop)
        script.over((0.3, top, script.position[2]), top)
        now = script.now
    keys = grasp(scripts, surface, top, now, 0.9 * float(case.mesh.vertices[:, 1].max()))
    seconds = max(script.now for script in scripts.values()) + 0.5
    stamps = np.arange(round(seconds * RATE_HZ)) * round(1e9 / RATE_HZ)
    times = stamps * 1e-9
    poses = {"body": KeyPath(keys)(times)}
    for name, script in scripts.items():
        poses[name] = script.path(random_stream(0, "collider-comparison", name))(times)
    return Session.from_arrays(stamps, poses, {"body": case.mesh, **PROBES})


def tap(script: Script, contact: FloatArray, direction: FloatArray) -> None:
    """Wait near the surface, touch it, and wait again."""
    script.go(contact - HOVER * direction)
    script.wait(0.3)
    script.go(contact + DEPTH * direction, 0.15)
    script.wait(0.15)
    script.go(contact - HOVER * direction, 0.15)
    script.wait(0.3)


def grasp(scripts: Mapping[str, Script], surface: Surface, top: float, now: float, height: float) -> list[Key]:
    """Thumb and finger close on the body from both sides and lift it by 50 mm; the poses of the body."""
    rest, lifted = np.zeros(3), np.array([0.0, 0.05, 0.0])
    for name, side in (("thumb", -1.0), ("finger", 1.0)):
        script, direction = scripts[name], np.array([0.0, 0.0, -side])
        script.wait_until(now)
        start = (0.0, height, side * 0.14)
        contact = first_contact(surface, Touch(name, start, (0.0, 0.0, -side)))
        script.over(start, top)
        script.wait_until(now + 6.0)
        script.go(contact - HOVER * direction, 1.0)
        for stop in (rest, lifted, lifted, rest):
            script.go(contact + DEPTH * direction + stop, 0.8)
        script.go(contact - HOVER * direction, 0.5)
        script.go(start, 0.5)
    closed = now + 7.8
    return [
        Key(0.0, rest), Key(closed, rest), Key(closed + 0.8, lifted), Key(closed + 1.6, lifted), Key(closed + 2.4, rest)
    ]  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """The errors of some pieces on the motion, as fractions of contact time."""

    pieces: int
    false: float
    missed: float

    def is_worse(self, other: "Outcome") -> bool:
        """Whether more is false, or more missed, than with another collider."""
        return self.false > other.false + TOLERANCE or self.missed > other.missed + TOLERANCE

    def is_less(self, other: "Outcome") -> bool:
        """Whether nothing is worse, and something is less, than with another collider."""
        return not self.is_worse(other) and other.is_worse(self)

    @property
    def text(self) -> str:
        """``7: 8 % + 0.4 %``: pieces, false and missed."""
        return f"{self.pieces}: {as_percentage(self.false)} + {as_percentage(self.missed)}"


class Bench:
    """The motion of one body, and the errors of any pieces of it."""

    def __init__(self, name: str) -> None:
        case = CASES[name]()
        self.mesh = as_mesh(case.mesh)
        session = session_of(case)
        pairs = [("body", probe) for probe in PROBES]
        prepared = prepare(session, pairs=pairs)
        self.assembly = prepared.assembly
        self.mesh = self.assembly.bodies[self.assembly.names.index("body")].mesh
        self.scoring = Scoring(
            prepared.assembly, parse_detector(TRUSTED_DETECTOR), 0, TWO_MICROMETRES, prepared.repaired.session
        )

    def outcome(self, pieces: Sequence[TriangleMesh]) -> Outcome:
        """The errors of pieces in place of the body."""
        bodies = tuple(
            replace(body, colliders=solids_of(pieces if body.name == "body" else [hull_collider(body.mesh)]))
            for body in self.assembly.bodies
        )
        assembly = replace(self.assembly, bodies=bodies)
        setting = Setting("pieces", "collider", {"shape": "shipped"})
        detection = make_detector(setting.spec, assembly, 0).detect(assembly.motion)
        figures = self.scoring.figures(detection, setting)
        return Outcome(len(pieces), figures["false"] or 0.0, figures["not_reported"] or 0.0)

    def advised(self, most: int) -> Sequence[TriangleMesh]:
        """The pieces that `replay fix` advises, at most so many."""
        limits = Limits(false=0.0, missed=0.0, pieces=most)
        search = ColliderSearch(self.assembly, self.scoring, {}, limits, Deadline(SECONDS, lambda _: None))
        search.run()
        return search.pieces()["body"]


def vhacd(mesh: TriangleMesh, most: int) -> list[FloatArray]:
    """Corners of the pieces of V-HACD at its defaults, in one thread: with more, pieces change from call to call."""
    from vhacdx import compute_vhacd

    counted = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).astype(np.uint32).ravel()
    pieces = compute_vhacd(np.ascontiguousarray(mesh.vertices), counted, maxConvexHulls=most, asyncACD=False)
    return [np.array(corners) for corners, _ in pieces]


def coacd(mesh: TriangleMesh, most: int) -> list[FloatArray]:
    """Corners of the pieces of CoACD at its defaults."""
    import coacd as library

    library.set_log_level("off")
    return [
        np.array(corners)
        for corners, _ in library.run_coacd(library.Mesh(mesh.vertices, mesh.faces), max_convex_hull=most)
    ]


OTHERS: Final = {"V-HACD": vhacd, "CoACD": coacd}


def kept_pieces(folder: FilePath, method: str, mesh: TriangleMesh, most: int) -> list[TriangleMesh]:
    """The pieces of a method, cut once."""
    file = folder / f"{method}-{most}-{mesh.content_hash[:24]}.npz"
    if not file.is_file():
        corners = OTHERS[method](mesh, most)
        folder.mkdir(parents=True, exist_ok=True)
        np.savez(file, **{f"{number:03d}": points for number, points in enumerate(corners)})
    with np.load(file) as kept:
        pieces = [hull_of(kept[name]) for name in sorted(kept.files)]
    return [piece for piece in pieces if piece is not None]


@dataclass(frozen=True)
class Row:
    """One comparison: a body with at most so many pieces."""

    name: str
    others: Mapping[str, Outcome]
    ours: Outcome

    @property
    def verdict(self) -> str:
        """``less`` than both, ``worse`` than one, or ``tie``."""
        if any(self.ours.is_worse(other) for other in self.others.values()):
            return "worse"
        return "less" if all(self.ours.is_less(other) for other in self.others.values()) else "tie"

    @property
    def text(self) -> str:
        """The row of the table."""
        cells = [self.name, *(other.text for other in self.others.values()), self.ours.text, self.verdict]
        return f"| {' | '.join(cells)} |"


def compared(names: Sequence[str], folder: FilePath) -> Iterator[Row]:
    """The rows of these names, such as ``mug-8``."""
    benches: dict[str, Bench] = {}
    for name in names:
        body, most = name.rsplit("-", 1)
        bench = benches.setdefault(body, Bench(body)) if body not in benches else benches[body]
        others = {method: bench.outcome(kept_pieces(folder, method, bench.mesh, int(most))) for method in OTHERS}
        fewest = min(other.pieces for other in others.values())
        yield Row(name, others, bench.outcome(bench.advised(fewest)))


def main(folder: str, *names: str) -> None:
    """Print the table."""
    print(f"| body, most pieces | {' | '.join(OTHERS)} | replay fix | false and missed |\n|---|---|---|---|---|")
    verdicts = []
    for row in compared(names or [f"{name}-{most}" for name in CASES for most in COUNTS], FilePath(folder)):
        print(row.text, flush=True)
        verdicts.append(row.verdict)
    print(", ".join(f"{verdict}: {verdicts.count(verdict)}" for verdict in ("less", "tie", "worse")))


if __name__ == "__main__":
    main(*sys.argv[1:])
