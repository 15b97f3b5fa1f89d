"""Hard cases of whole bodies: two of them, their poses, and the verdict that construction or all face pairs give.

Lengths are sums of few powers of two where a hair decides, so that what touches does exactly.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from cdcore import Body, Motion, TriangleMesh, Verdict
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.numerics import FloatArray, place_points
from cdcore.protocol.detection import Covers
from replay.base.constants import HEADSET_HZ
from replay.comparison.tolerance import TAU
from replay.studies.stress.families import FIRST_SEED, random_rotations
from replay.studies.stress.solids import ball_mesh, beaker_mesh, box_mesh, icosphere_mesh, merged, moved, rod_mesh

HAIR: Final = 2.0**-40
"""Metres, a picometre: far below what a tracker sees, far above the rounding of a metre."""

GONE: Final = (2.0**53, 1e17, 1e30, 1e160, 1e300)
"""Metres from the origin: finite, and no pose of a room; squares of the last two are not finite."""

LIFTS: Final = (1e-12, 1e-9, 1e-7, 5e-7, 1e-6, 2e-6, 1e-5)
"""Metres by which a resting glass is lifted or sunk."""


@dataclass(frozen=True, eq=False)
class StressScene:
    """Two bodies, a motion, and what is true of it."""

    name: str
    bodies: tuple[Body, Body]
    motion: Motion  # T poses of the two, in ``crossings`` equal parts
    # of instants (T,) uint8 verdicts, one a frame; of intervals (crossings,), whether each part has a contact
    truth: NDArray[np.uint8]
    covers: Covers = "instants"  # whether the frames are asked about, or all of the time between them too


def two(first: TriangleMesh, second: TriangleMesh) -> tuple[Body, Body]:
    """The meshes as bodies."""
    return Body("first", first), Body("second", second)


def posed(body: Body, motion: Motion, frame: int, number: int) -> FloatArray:
    """The triangles (f, 3, 3) of body ``number`` in a frame, as every detector places them."""
    triangles = body.mesh.triangles.reshape(-1, 3)
    placed = place_points(triangles, motion.rotations[frame, number], motion.translations[frame, number])
    return placed.reshape(-1, 3, 3)


def meeting(bodies: tuple[Body, Body], motion: Motion, frame: int) -> NDArray[np.int64]:
    """The face pairs (k, 2) that meet in a frame, from all there are."""
    return meeting_faces_exhaustive(*(posed(bodies[k], motion, frame, k) for k in range(2)))


def in_worlds(rng: Generator, count: int) -> Motion:
    """Both bodies in the same random pose, ``count`` times; the first time as they stand."""
    turn, place = random_rotations(rng, count), rng.normal(size=(count, 3))
    turn[0], place[0] = np.eye(3), 0.0
    return Motion(np.arange(count) / HEADSET_HZ, np.repeat(place[:, None], 2, 1), np.repeat(turn[:, None], 2, 1))


def at(places: ArrayLike) -> Motion:
    """The first body unturned at places (T, 3), the second at the origin."""
    first = np.asarray(places, dtype=np.float64)
    both = np.stack([first, np.zeros_like(first)], axis=1)
    return Motion(np.arange(len(first)) / HEADSET_HZ, both, np.tile(np.eye(3), (len(first), 2, 1, 1)))


def of_all_pairs(name: str, bodies: tuple[Body, Body], motion: Motion) -> StressScene:
    """A scene whose truth all face pairs tell; nothing is inside anything in it."""
    meets = [len(meeting(bodies, motion, frame)) > 0 for frame in range(len(motion))]
    return StressScene(name, bodies, motion, np.array(meets, dtype=np.uint8) * np.uint8(Verdict.CONTACT))


def _of_instants(
    name: str,
    meshes: tuple[TriangleMesh, TriangleMesh],
    motion: Motion,
    meets: ArrayLike,
    free: Verdict = Verdict.CLEAR,
) -> StressScene:
    """A scene of instants whose contacts are known."""
    truth = np.where(np.asarray(meets), Verdict.CONTACT, free).astype(np.uint8)
    return StressScene(name, two(*meshes), motion, truth)


def _of_intervals(name: str, meshes: tuple[TriangleMesh, TriangleMesh], motion: Motion, meets: bool) -> StressScene:
    """A scene of one motion that has a contact somewhere, or none."""
    return StressScene(name, two(*meshes), motion, np.array([meets], dtype=np.uint8), "intervals")


def _inside_out(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def containment(rng: Generator) -> Iterator[StressScene]:
    """27: a body wholly inside another."""
    inside = {"ball in a box": (ball_mesh(0.1), box_mesh()), "ball in a ball": (ball_mesh(0.2), ball_mesh(1.0))}
    for name, (inner, outer) in inside.items():
        for order, bodies in (("", two(inner, outer)), (", outer first", two(outer, inner))):
            motion = in_worlds(rng, 6)
            yield StressScene(name + order, bodies, motion, np.full(6, Verdict.CONTAINED, dtype=np.uint8))


def cavity(rng: Generator) -> Iterator[StressScene]:
    """28: a rod in the cavity of an open beaker, which is outside the glass."""
    rod, beaker = moved(rod_mesh(), [0.01, 0.005, 0.01]), beaker_mesh()
    for name, bodies in (("rod first", two(rod, beaker)), ("beaker first", two(beaker, rod))):
        yield StressScene(name, bodies, in_worlds(rng, 6), np.full(6, Verdict.CLEAR, dtype=np.uint8))


def odd_meshes(_rng: Generator) -> Iterator[StressScene]:
    """37: meshes with every common fault, beside a sound one; clear, in contact, far away."""
    box = box_mesh()
    stray = [*box.vertices.tolist(), [50.0, 0, 0]]
    odd = {
        "faces without area": TriangleMesh(box.vertices, [*box.faces.tolist(), [0, 0, 1], [3, 3, 3]]),
        "faces listed twice": TriangleMesh(box.vertices, np.concatenate([box.faces, box.faces])),
        "vertices not merged": TriangleMesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3)),
        "a far vertex of no face": TriangleMesh(stray, box.faces),
        "open": TriangleMesh(box.vertices, box.faces[:-1]),
        "faces turned round": TriangleMesh(box.vertices, box.faces[:, ::-1]),
        "an edge of three faces": TriangleMesh([*stray[:-1], [-1.0, -1, 0]], [*box.faces.tolist(), [0, 1, 8]]),
        "no area at all": TriangleMesh(np.zeros((3, 3)) + 0.5, [[0, 1, 2], [0, 0, 0]]),
    }
    for name, mesh in odd.items():
        yield of_all_pairs(name, two(ball_mesh(0.5), mesh), at(np.array([[1.1, 0, 0], [0.9, 0.1, 0.2], [3, 0, 0]])))


def far_away(_rng: Generator) -> Iterator[StressScene]:
    """38: thousands of kilometres from the origin, by the poses or in the vertices."""
    near = np.array([[x, 0.1, 0.2] for x in (0.9, 0.99, 1.0, 1 + 1e-9, 1.01)])
    for shift in (1e3, 1e5, 1e7):
        offset = np.array([shift, -shift / 3, shift / 7])
        ball, box, motion = ball_mesh(0.5), box_mesh(), at(near)
        there = Motion(motion.times, motion.translations + offset, motion.rotations)
        yield of_all_pairs(f"{shift:g} m in the pose", two(ball, box), there)
        yield of_all_pairs(f"{shift:g} m in the vertices", two(moved(ball, offset), moved(box, offset)), motion)


def scaled(_rng: Generator) -> Iterator[StressScene]:
    """39: all lengths times a power of two or of ten."""
    for scale in (2.0**-20, 2.0**-10, 2.0**10, 2.0**20, 1e-6, 1e-3, 1e3, 1e6):
        sized = (TriangleMesh(mesh.vertices * scale, mesh.faces) for mesh in (ball_mesh(0.5), box_mesh()))
        motion = at(np.array([[x, 0.1, 0.2] for x in (0.8, 0.9, 1.01, 1.1)]) * scale)
        yield of_all_pairs(f"times {scale:.3g}", two(*sized), motion)


def resting(rng: Generator) -> Iterator[StressScene]:
    """41: a glass on a table, lifted or sunk by a hair."""
    table = box_mesh((0.3, 0.3, 0.02), (0, 0, -0.01))
    for lift in (0.0, *LIFTS, *(-lift for lift in LIFTS)):
        yield of_all_pairs(f"lifted by {lift:g} m", two(moved(beaker_mesh(), [0, 0, lift]), table), in_worlds(rng, 6))


def degenerate(rng: Generator) -> Iterator[StressScene]:
    """42: a mesh on itself, kisses in one vertex, a rod on a wall, blocks on one lattice."""
    beaker, ball, rod = beaker_mesh(sides=10), icosphere_mesh(), rod_mesh(0.25, 4.0, 8)
    blocks = merged(*(box_mesh(centre=(x, y, 0)) for x in range(3) for y in range(2)))
    scenes = {
        "a mesh on itself": two(beaker, beaker),
        "icospheres kissing": two(ball, moved(ball, [0, 0, 2])),
        "a rod on a wall": two(rod, box_mesh((1.0, 6.0, 6.0), (0.75, 0, 2.0))),
        "blocks on a lattice": two(blocks, moved(blocks, [1, 1, 1])),
    }
    for name, bodies in scenes.items():
        yield of_all_pairs(name, bodies, in_worlds(rng, 6))


SPEEDS: Final = (0.4, 0.6, 1.0, 2.0, 4.0)
"""Metres a second of a 5 mm cube through a 1 mm plate."""

PHASES: Final = 100
REACH: Final = 0.003
"""Half the cube and half the plate, metres: the surfaces meet while the centres are no further apart."""


def crossing(speed: float, phases: int = PHASES, aside: ArrayLike = 0.0) -> Motion:
    """A cube through a plate at 90 Hz, ``phases`` times one after another, each a share of a step later.

    ``speed``: metres a second, downward.
    ``phases``: how many; the k-th is (k + 1/2) / phases of a step late.
    ``aside``: metres from the middle of the plate, one number or (phases,).
    """
    step = speed / HEADSET_HZ
    before = int(np.ceil(0.012 / step)) + 1
    frames = 2 * before + 2
    phase = (np.arange(phases) + 0.5) / phases
    place = np.zeros((phases, frames, 2, 3))
    place[:, :, 0, 2] = REACH + (phase[:, None] - 1 - np.arange(-before, frames - before)) * step
    place[:, :, 0, 0] = np.broadcast_to(aside, phases)[:, None]
    linked = np.ones((phases, frames, 2), dtype=bool)
    linked[:, 0] = False
    count = phases * frames
    turn = np.broadcast_to(np.eye(3), (count, 2, 3, 3))
    return Motion(np.arange(count) / HEADSET_HZ, place.reshape(count, 2, 3), turn, linked=linked.reshape(count, 2))


def thin_wall(_rng: Generator) -> Iterator[StressScene]:
    """29: every crossing has a contact, and a pass beside the plate by 3 um to 1 mm has none."""
    bodies = two(box_mesh((0.005,) * 3), box_mesh((0.2, 0.2, 0.001)))
    for speed in SPEEDS:
        yield StressScene(f"{speed:g} m/s", bodies, crossing(speed), np.ones(PHASES, dtype=np.uint8), "intervals")
        beside = crossing(speed, aside=0.1 + 0.0025 + np.geomspace(3e-6, 1e-3, PHASES))
        yield StressScene(f"{speed:g} m/s beside", bodies, beside, np.zeros(PHASES, dtype=np.uint8), "intervals")


def turning(degrees: float) -> Motion:
    """The first body turns about z from minus to plus half the angle, by the shortest arc; the second stands."""
    half = np.radians(degrees) / 2
    spin = np.zeros((2, 2, 3, 3)) + np.eye(3)
    for frame, angle in enumerate((-half, half)):
        spin[frame, 0, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return Motion([0, 1 / HEADSET_HZ], np.zeros((2, 2, 3)), spin)


def rotation_only(_rng: Generator) -> Iterator[StressScene]:
    """30: of 181 degrees the shortest arc is 179 the other way."""
    rod = box_mesh((0.1, 0.004, 0.004), (0.06, 0, 0))
    for degrees in (90.0, 179.0, 181.0):
        for side in (1, -1):
            post = box_mesh((0.01, 0.01, 0.1), (0.08 * side, 0, 0))
            name = f"{degrees:g} degrees, post {'before' if side > 0 else 'behind'}"
            yield _of_intervals(name, (rod, post), turning(degrees), (side > 0) == (degrees < 180))


def ends(_rng: Generator) -> Iterator[StressScene]:
    """31: contact only at the first instant, only at the last, and no motion at all."""
    meshes = box_mesh(), box_mesh()
    yield _of_intervals("at the start only", meshes, at([[1.0, 0, 0], [1.5, 0, 0]]), True)
    yield _of_intervals("at the end only", meshes, at([[1.5, 0, 0], [1.0, 0, 0]]), True)
    yield _of_intervals("standing in contact", meshes, at([[0.9, 0, 0], [0.9, 0, 0]]), True)
    yield _of_intervals("standing apart", meshes, at([[1.1, 0, 0], [1.1, 0, 0]]), False)


def grazing(_rng: Generator) -> Iterator[StressScene]:
    """32: two tips that pass each other at one instant, touching or by a hair."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    tip = TriangleMesh(corners, [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)])
    for gap in (0.0, TAU / 2, -TAU / 2, 2 * TAU, -2 * TAU):
        yield _of_intervals(f"gap {gap:g} m", (tip, tip), at([[-0.5, 0, 2 + gap], [0.5, 0, 2 + gap]]), gap <= 0)


def reversed_and_split(rng: Generator) -> Iterator[StressScene]:
    """33: a crossing, the same backwards, and the same with a frame at a half, a quarter or a third of it."""
    meshes = ball_mesh(0.01), box_mesh((0.3, 0.3, 0.002))
    for number in range(3):
        start, end = np.array([*rng.uniform(-0.02, 0.02, 2), 0.05]), np.array([*rng.uniform(-0.02, 0.02, 2), -0.05])
        for aside, meets in ((0.0, True), (0.5, False)):
            shift = np.array([aside, 0, 0])
            ways: dict[str, FloatArray] = {"forth": np.array([start, end]), "back": np.array([end, start])}
            ways |= {f"split at {s:.3g}": np.array([start, start + s * (end - start), end]) for s in (0.5, 0.25, 1 / 3)}
            for way, places in ways.items():
                name = f"path {number} {'through' if meets else 'beside'} {way}"
                yield _of_intervals(name, meshes, at(places + shift), meets)


def glancing_spins(_rng: Generator) -> Iterator[StressScene]:
    """44: a rod turns by up to 179 degrees in a frame; the corner of its tip passes a wall by a hair, or not."""
    tip, thick = 0.11, 0.004
    rod, reach = box_mesh((0.1, thick, thick), (tip - 0.05, 0, 0)), float(np.hypot(tip, thick / 2))
    for degrees, gap in product((60.0, 120.0, 170.0, 179.0), (TAU / 2, 2 * TAU, 1e-4, 2e-3)):
        for side, travel in product((1, -1), (0.0, 0.02)):
            wall = box_mesh((0.01, 0.1, 0.2), (reach + side * gap + 0.005, 0, 0))
            spin = turning(degrees)
            place = np.zeros((2, 2, 3))
            place[:, 0, 2] = -travel, travel
            motion = Motion(spin.times, place, spin.rotations)
            yield _of_intervals(
                f"{degrees:g} degrees, gap {side * gap:g} m, {travel:g} m along", (rod, wall), motion, side < 0
            )


def flush(_rng: Generator) -> Iterator[StressScene]:
    """45: a block that slides along a table and past its end, or stands on it, or in a slot of its own width."""
    table, block = box_mesh((2.0, 2.0, 0.25), (0, 0, -0.125)), box_mesh((0.25,) * 3)
    way = np.concatenate([np.zeros(8), np.arange(-16, 25) / 16])
    for lift in (0.0, HAIR, -HAIR, 2.0**-20, -(2.0**-20)):
        places = np.stack([way, 0 * way, 0 * way + 0.125 + lift], axis=1)
        yield _of_instants(f"lifted by {lift:g} m", (block, table), at(places), (lift <= 0) & (np.abs(way) <= 1.125))
        slot = merged(*(box_mesh((2.0, 0.25, 1.0), (0, side * (0.25 + lift), 0)) for side in (1, -1)))
        along = np.stack([way, 0 * way, 0 * way], axis=1)
        yield _of_instants(
            f"a slot wider by {2 * lift:g} m", (block, slot), at(along), (lift <= 0) & (np.abs(way) <= 1.125)
        )


def nested_shells(_rng: Generator) -> Iterator[StressScene]:
    """46: a box or a shell in a solid or in the cavity of a shell: free, touching by face, edge or corner, or out."""
    box, solid = box_mesh(), box_mesh((2.0,) * 3)
    inner, outer = merged(box, _inside_out(box_mesh((0.5,) * 3))), merged(box_mesh((3.0,) * 3), _inside_out(solid))
    axes = np.array([[1, 0, 0], [1, 1, 0], [1, -1, 1], [0, 0, -1]])
    away = np.array([0.0, 0.25, 0.5 - HAIR, 0.5, 0.5 + HAIR, 0.5 + 2.0**-10])
    places = (away[:, None, None] * axes).reshape(-1, 3)
    meets = np.repeat(away >= 0.5, len(axes))
    for inside, around in product({"box": box, "shell": inner}.items(), {"solid": solid, "shell": outer}.items()):
        free = Verdict.CONTAINED if around[0] == "solid" else Verdict.CLEAR
        name, meshes = f"{inside[0]} in a {around[0]}", (inside[1], around[1])
        yield _of_instants(name, meshes, at(places), meets, free)
        yield _of_instants(f"{name}, outer first", meshes[::-1], at(-places), meets, free)


def gone_wrong(_rng: Generator) -> Iterator[StressScene]:
    """47: poses that are finite and impossible, among sound ones, whose answers they must not change."""
    sound = np.array([[0.75, 0, 0], [1.5, 0, 0], [0.75, 0.25, 0]])
    for value, axis, sign in product(GONE, range(3), (1, -1)):
        lost = np.zeros((1, 3))
        lost[0, axis] = sign * value
        places = np.concatenate([sound, lost, sound, -lost, lost, sound])
        meets = np.abs(places).max(axis=1) <= 1.0
        yield _of_instants(f"{sign * value:g} m along {'xyz'[axis]}", (box_mesh(), box_mesh()), at(places), meets)
    tiny = np.array([[0.75, 5e-324, -5e-324], [1.5, 5e-324, -0.0], [1.0, 0.0, -0.0]])
    yield _of_instants("the smallest numbers", (box_mesh(), box_mesh()), at(tiny), [True, False, True])
    motion = at(sound)
    stretched = Motion(motion.times, motion.translations, motion.rotations * (1 + 4e-4))
    yield _of_instants("rotations to repair", (box_mesh(), box_mesh()), stretched, [True, False, True])


def far_crossings(_rng: Generator) -> Iterator[StressScene]:
    """48: a cube through a thin plate, and beside it, a kilometre to eight thousand from the origin."""
    bodies = two(box_mesh((0.005,) * 3), box_mesh((0.2, 0.2, 0.001)))
    for far, aside in product((2.0**10, 2.0**17, 2.0**23), (0.0, 0.1 + 0.0025 + 1e-3)):
        motion = crossing(1.0, 10, aside)
        place = motion.translations + np.array([far, -far, far])
        there = Motion(motion.times, place, motion.rotations, linked=motion.linked)
        truth = np.full(10, not aside, dtype=np.uint8)
        yield StressScene(f"{far:g} m away{', beside' if aside else ''}", bodies, there, truth, "intervals")


Maker = Callable[[Generator], Iterator[StressScene]]

SCENES: Final[dict[int, tuple[str, Maker]]] = {
    27: ("containment", containment),
    28: ("cavity", cavity),
    29: ("thin-wall phases", thin_wall),
    30: ("rotation only", rotation_only),
    31: ("start, end, no motion", ends),
    32: ("grazing", grazing),
    33: ("time reversal and splitting", reversed_and_split),
    37: ("malformed meshes", odd_meshes),
    38: ("far from the origin", far_away),
    39: ("unit errors", scaled),
    41: ("resting contact", resting),
    42: ("mesh degeneracies", degenerate),
    44: ("glancing spins", glancing_spins),
    45: ("flush over a span", flush),
    46: ("nested shells", nested_shells),
    47: ("poses gone wrong", gone_wrong),
    48: ("crossings far away", far_crossings),
}
"""Number of a case -> its name, and what makes its scenes: 29 to 33, 44 and 48 ask about the time between frames."""


def scenes_of(number: int, seed: int = FIRST_SEED) -> list[StressScene]:
    """The scenes of a case; none of one that has no bodies of its own."""
    return [*SCENES[number][1](np.random.default_rng((seed, number)))] if number in SCENES else []
