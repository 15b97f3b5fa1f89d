"""Hard cases of whole bodies that use has found: spins that glance, bodies flush, shells that touch, poses gone wrong.

Lengths are sums of few powers of two where a hair decides, so that what touches does exactly; the verdict follows from
the construction.
"""

from collections.abc import Iterator
from itertools import product
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from cdcore import Motion, TriangleMesh, Verdict
from replay.comparison.tolerance import TAU
from replay.studies.stress.scenes import SPECIFIED, Maker, StressScene, at, crossing, one, turning, two
from replay.studies.stress.solids import box_mesh, merged

HAIR: Final = 2.0**-40
"""Metres, a picometre: far below what a tracker sees, far above the rounding of a metre."""

GONE: Final = (2.0**53, 1e17, 1e30, 1e160, 1e300)
"""Metres from the origin: finite, and no pose of a room; squares of the last two are not finite."""


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
            yield one(f"{degrees:g} degrees, gap {side * gap:g} m, {travel:g} m along", (rod, wall), motion, side < 0)


def flush(_rng: Generator) -> Iterator[StressScene]:
    """45: a block that slides along a table and past its end, or stands on it, or in a slot of its own width."""
    table, block = box_mesh((2.0, 2.0, 0.25), (0, 0, -0.125)), box_mesh((0.25,) * 3)
    way = np.concatenate([np.zeros(8), np.arange(-16, 25) / 16])
    for lift in (0.0, HAIR, -HAIR, 2.0**-20, -(2.0**-20)):
        places = np.stack([way, 0 * way, 0 * way + 0.125 + lift], axis=1)
        yield _known(f"lifted by {lift:g} m", (block, table), at(places), (lift <= 0) & (np.abs(way) <= 1.125))
        slot = merged(*(box_mesh((2.0, 0.25, 1.0), (0, side * (0.25 + lift), 0)) for side in (1, -1)))
        along = np.stack([way, 0 * way, 0 * way], axis=1)
        yield _known(f"a slot wider by {2 * lift:g} m", (block, slot), at(along), (lift <= 0) & (np.abs(way) <= 1.125))


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
        yield _known(name, meshes, at(places), meets, free)
        yield _known(f"{name}, outer first", meshes[::-1], at(-places), meets, free)


def gone_wrong(_rng: Generator) -> Iterator[StressScene]:
    """47: poses that are finite and impossible, among sound ones, whose answers they must not change."""
    sound = np.array([[0.75, 0, 0], [1.5, 0, 0], [0.75, 0.25, 0]])
    for value, axis, sign in product(GONE, range(3), (1, -1)):
        lost = np.zeros((1, 3))
        lost[0, axis] = sign * value
        places = np.concatenate([sound, lost, sound, -lost, lost, sound])
        meets = np.abs(places).max(axis=1) <= 1.0
        yield _known(f"{sign * value:g} m along {'xyz'[axis]}", (box_mesh(), box_mesh()), at(places), meets)
    tiny = np.array([[0.75, 5e-324, -5e-324], [1.5, 5e-324, -0.0], [1.0, 0.0, -0.0]])
    yield _known("the smallest numbers", (box_mesh(), box_mesh()), at(tiny), [True, False, True])
    motion = at(sound)
    stretched = Motion(motion.times, motion.translations, motion.rotations * (1 + 4e-4))
    yield _known("rotations to repair", (box_mesh(), box_mesh()), stretched, [True, False, True])


def far_crossings(_rng: Generator) -> Iterator[StressScene]:
    """48: a cube through a thin plate, and beside it, a kilometre to eight thousand from the origin."""
    bodies = two(box_mesh((0.005,) * 3), box_mesh((0.2, 0.2, 0.001)))
    for far, aside in product((2.0**10, 2.0**17, 2.0**23), (0.0, 0.1 + 0.0025 + 1e-3)):
        motion = crossing(1.0, 10, aside)
        place = motion.translations + np.array([far, -far, far])
        there = Motion(motion.times, place, motion.rotations, linked=motion.linked)
        truth = np.full(10, not aside, dtype=np.uint8)
        yield StressScene(f"{far:g} m away{', beside' if aside else ''}", bodies, there, truth, "intervals")


def _inside_out(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def _known(
    name: str, meshes: tuple[TriangleMesh, TriangleMesh], motion: Motion, meets: ArrayLike,
    free: Verdict = Verdict.CLEAR,
) -> StressScene:  # fmt: skip
    """A scene of instants whose contacts are known."""
    truth = np.where(np.asarray(meets), Verdict.CONTACT, free).astype(np.uint8)
    return StressScene(name, two(*meshes), motion, truth)


SCENES: Final[dict[int, tuple[str, Maker]]] = SPECIFIED | {
    44: ("glancing spins", glancing_spins),
    45: ("flush over a span", flush),
    46: ("nested shells", nested_shells),
    47: ("poses gone wrong", gone_wrong),
    48: ("crossings far away", far_crossings),
}
"""Number of a case -> its name, and what makes its scenes: 29 to 33, 44 and 48 ask about the time between frames."""
