"""Hard cases of motion: what happens between two frames, and when, known in closed form.

Source: section 7.5 of the project's specification, cases 29 to 33.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from cdcore import Motion, TriangleMesh
from cdcore.numerics import FloatArray
from replay.base.constants import HEADSET_HZ
from replay.comparison.tolerance import TAU
from replay.studies.stress.scenes import Maker, Scene, at, two
from replay.studies.stress.solids import ball_mesh, box_mesh

SPEEDS: Final = (0.4, 0.6, 1.0, 2.0, 4.0)
"""Metres a second of a 5 mm cube through a 1 mm plate."""

PHASES: Final = 100
REACH: Final = 0.003
"""Half the cube and half the plate, metres: the surfaces meet while the centres are no further apart."""


def crossing(speed: float, phases: int = PHASES, aside: ArrayLike = 0.0) -> Motion:
    """A cube through a plate at 90 Hz, ``phases`` times one after another, each a share of a step later.

    Parameters
    ----------
    speed : metres a second, downward.
    phases : how many; the k-th is (k + 1/2) / phases of a step late.
    aside : metres from the middle of the plate, one number or (phases,).
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


def thin_wall(_rng: Generator) -> Iterator[Scene]:
    """29: every crossing has a contact, and a pass beside the plate by 3 um to 1 mm has none."""
    bodies = two(box_mesh((0.005,) * 3), box_mesh((0.2, 0.2, 0.001)))
    for speed in SPEEDS:
        yield Scene(f"{speed:g} m/s", bodies, crossing(speed), np.ones(PHASES, dtype=np.uint8), "intervals")
        beside = crossing(speed, aside=0.1 + 0.0025 + np.geomspace(3e-6, 1e-3, PHASES))
        yield Scene(f"{speed:g} m/s beside", bodies, beside, np.zeros(PHASES, dtype=np.uint8), "intervals")


def one(name: str, meshes: tuple[TriangleMesh, TriangleMesh], motion: Motion, meets: bool) -> Scene:
    """A scene of one motion that has a contact somewhere, or none."""
    return Scene(name, two(*meshes), motion, np.array([meets], dtype=np.uint8), "intervals")


def turning(degrees: float) -> Motion:
    """The first body turns about z from minus to plus half the angle, by the shortest arc; the second stands."""
    half = np.radians(degrees) / 2
    spin = np.zeros((2, 2, 3, 3)) + np.eye(3)
    for frame, angle in enumerate((-half, half)):
        spin[frame, 0, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return Motion([0, 1 / HEADSET_HZ], np.zeros((2, 2, 3)), spin)


def rotation_only(_rng: Generator) -> Iterator[Scene]:
    """30: of 181 degrees the shortest arc is 179 the other way."""
    rod = box_mesh((0.1, 0.004, 0.004), (0.06, 0, 0))
    for degrees in (90.0, 179.0, 181.0):
        for side in (1, -1):
            post = box_mesh((0.01, 0.01, 0.1), (0.08 * side, 0, 0))
            name = f"{degrees:g} degrees, post {'before' if side > 0 else 'behind'}"
            yield one(name, (rod, post), turning(degrees), (side > 0) == (degrees < 180))


def ends(_rng: Generator) -> Iterator[Scene]:
    """31: contact only at the first instant, only at the last, and no motion at all."""
    meshes = box_mesh(), box_mesh()
    yield one("at the start only", meshes, at([[1.0, 0, 0], [1.5, 0, 0]]), True)
    yield one("at the end only", meshes, at([[1.5, 0, 0], [1.0, 0, 0]]), True)
    yield one("standing in contact", meshes, at([[0.9, 0, 0], [0.9, 0, 0]]), True)
    yield one("standing apart", meshes, at([[1.1, 0, 0], [1.1, 0, 0]]), False)


def grazing(_rng: Generator) -> Iterator[Scene]:
    """32: two tips that pass each other at one instant, touching or by a hair."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    tip = TriangleMesh(corners, [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)])
    for gap in (0.0, TAU / 2, -TAU / 2, 2 * TAU, -2 * TAU):
        yield one(f"gap {gap:g} m", (tip, tip), at([[-0.5, 0, 2 + gap], [0.5, 0, 2 + gap]]), gap <= 0)


def reversed_and_split(rng: Generator) -> Iterator[Scene]:
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
                yield one(name, meshes, at(places + shift), meets)


OVER_INTERVALS: Final[dict[int, tuple[str, Maker]]] = {
    29: ("thin-wall phases", thin_wall),
    30: ("rotation only", rotation_only),
    31: ("start, end, no motion", ends),
    32: ("grazing", grazing),
    33: ("time reversal and splitting", reversed_and_split),
}
"""Number of a case -> its name, and what makes its scenes."""
