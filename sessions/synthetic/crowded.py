"""A crowded laboratory, in which accuracy costs: 25 glasses tremble a hair apart, among two hands of fingers.

Glasses of a row share one mesh of 50,000 faces; each hand is seven rigid bodies, a palm and fingers. Nothing is
planted: contacts are whatever an exact detector finds.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from sessions.geometry.rotations import Array
from sessions.geometry.shapes import make_shape
from sessions.model.constants import HEADSET_HZ
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Session
from sessions.synthetic.analytic import identity_rotations
from sessions.synthetic.assembly import MADE_UP, START_NS, Recording, record_paths
from sessions.synthetic.bench import BENCH_TOP, SIDES, STAND_M, Instruments, Placed, with_text
from sessions.synthetic.paths import Path, Point, Poses, Standing, carried_poses
from sessions.synthetic.rng import random_stream
from sessions.synthetic.truth import Truth

NAME: Final = "crowded-lab"
SECONDS: Final = 20.0
FACES: Final = 50_000
ROWS: Final = ("beaker_100", "erlenmeyer_flask", "graduated_cylinder", "reagent_bottle", "beaker_250")
COLUMNS: Final = 5

GAP_M: Final = 0.001
TREMBLE_M: Final = 0.00055
"""Amplitude of each glass: two neighbours touch when both lean together."""

FINGER: Final = {"radius": 0.008, "length": 0.07}
PALM: Final = {"x": 0.08, "y": 0.025, "z": 0.09}
FINGERS: Final = {
    "thumb": (-0.045, -0.02, 0.02),
    "thumb-tip": (-0.055, -0.045, 0.03),
    "index": (-0.03, -0.045, -0.045),
    "middle": (-0.01, -0.05, -0.05),
    "ring": (0.01, -0.05, -0.05),
    "little": (0.03, -0.045, -0.045),
}
"""Where the middle of each hangs below the palm, metres."""


def make_crowded_lab(
    seed: int = 0, rate_hz: float = HEADSET_HZ, noise: str = "off", *, faces: int = FACES, seconds: float = SECONDS
) -> tuple[Session, Truth]:
    """The session of 40 bodies, 20 s, and a truth without episodes; the same arguments give the same session.

    ``noise`` is of the tracker of the hands. Raises ``SessionError``: an unknown noise, a rate that is not positive.
    """
    how = Recording(seed=seed, rate_hz=rate_hz, seconds=seconds, noise=noise)
    glasses = {f"{kind.replace('_', '-')}-{k}": Placed(kind) for kind in ROWS for k in range(COLUMNS)}
    layout = Instruments({"bench": Placed("bench", faces=500, moves=False)} | glasses, faces)
    meshes = dict(layout.meshes)
    palm, finger = make_shape("box", PALM), make_shape("capsule", FINGER, 2_000)
    observed = record_paths(
        {f"{side}-palm": _sweeping_palm(side, random_stream(seed, NAME, side)) for side in SIDES}, how
    )
    times = observed.stamps.astype(np.float64) * 1e-9
    things = {
        name: _trembling_glass(position, times, random_stream(seed, NAME, name))
        for name, position in zip(glasses, _packed_positions(layout, list(glasses)), strict=True)
    }
    hands = []
    for side in SIDES:
        meshes[f"{side}-palm"] = palm
        for finger_name, offset in FINGERS.items():
            things[f"{side}-{finger_name}"] = carried_poses(observed.poses[f"{side}-palm"], offset)
            meshes[f"{side}-{finger_name}"] = finger
        hands += [SceneBody(f"{side}-{finger_name}", group=side, tags=("hand",)) for finger_name in ("palm", *FINGERS)]
    scene = with_text(Scene(NAME, (*layout.bodies(), *hands)), ("A shaker full of glasses, and two hands of fingers.",))
    facts = {"synthetic": NAME, "seed": str(seed), "noise": noise, **MADE_UP, "vr_type": "immersive"}
    session = Session.from_tracks(observed.tracks(things), meshes=meshes, scene=scene, facts=facts)
    return session, Truth(NAME, seed, START_NS, seconds, noise, (), observed.facts)


def _packed_positions(layout: Instruments, names: Sequence[str]) -> Iterator[Point]:
    """The position of each glass: a row of its kind along x, `GAP_M` apart; rows behind one another."""
    depth = -0.25
    for row in range(len(ROWS)):
        width, _, deep = np.ptp(layout.meshes[names[row * COLUMNS]].bounds, axis=0).tolist()
        depth += deep / 2 if row else 0.0
        for k in range(COLUMNS):
            yield (k - (COLUMNS - 1) / 2) * (width + GAP_M), BENCH_TOP + STAND_M, depth
        depth += deep / 2 + GAP_M


def _trembling_glass(center: Point, times: Array, rng: np.random.Generator) -> Poses:
    """A glass on the shaker: upright, in circles of its own phase."""
    rate, phase = rng.uniform(2.0, 4.0), rng.uniform(0.0, 2 * np.pi)
    position, rotation = Standing(center)(times)
    position[:, 0] += TREMBLE_M * np.sin(2 * np.pi * rate * times + phase)
    position[:, 2] += TREMBLE_M * np.cos(2 * np.pi * rate * times + phase)
    return position, rotation


def _sweeping_palm(side: str, rng: np.random.Generator) -> Path:
    """A palm that goes to and fro over the glasses and dips its fingers among them."""
    middle, phase = {"left": -0.15, "right": 0.15}[side], rng.uniform(0.0, 2 * np.pi)

    def path(times: Array) -> Poses:
        height = BENCH_TOP + 0.20 + 0.06 * np.sin(2 * np.pi * 0.7 * times + phase)
        x = middle + 0.1 * np.sin(2 * np.pi * 0.23 * times)
        z = 0.18 * np.sin(2 * np.pi * 0.17 * times + phase)
        return np.stack([x, height, z], axis=-1), identity_rotations(times)

    return path
