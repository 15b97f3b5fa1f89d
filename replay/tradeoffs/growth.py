"""Where accuracy starts to cost: a session grown in bodies, faces and rate until a live look leaves its budget."""

from collections.abc import Sequence
from dataclasses import replace
from math import exp, log
from time import perf_counter
from typing import Any, Final

import numpy as np

from cdcore import Motion
from replay.base.constants import HEADSET_HZ
from replay.comparison.first_touch import poses_between
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.pipeline.engine import prepared
from replay.prepare.assembly import Assembly
from replay.tradeoffs.decimation import with_faces
from replay.tradeoffs.pareto import budget_ms
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.timing import LiveFrames, Timed
from sessions import Session

GROWN: Final = ("exact", "solid-style", "hybrid", "hybrid-qaco")
"""Two complete ones, the engine behind them, and the paper's pipeline."""

SIZES: Final[dict[str, tuple[float, ...]]] = {
    "bodies": (1, 2, 4, 8), "faces": (500, 5_000, 50_000, 500_000), "rate": (22.5, 45.0, 90.0, 180.0, 360.0),
}  # fmt: skip
"""Copies of all bodies, faces that each mesh is to have, frames a second."""

UNITS: Final = {"faces": "faces a mesh", "bodies": "bodies", "rate": "Hz"}

SHIFT: Final = 0.11
"""Metres from one copy to the next along x: near enough to be asked, and to touch now and then."""

FRAMES, PASSES = 450, 3
"""Timed at each size, and how often."""

HOPELESS: Final = 8.0
"""Budgets a frame: whatever took longer is not grown further."""

Row = dict[str, Any]


def grow(
    session: Session, *, detectors: Sequence[str] = GROWN, time_limit: float = 150.0, **asked: Any
) -> tuple[Row, ...]:
    """Time live looks at every size within a time limit, sizes that ascend; ``asked``: as for ``prepared``.

    A row says ``axis``, ``size`` (as it came out, of faces the mean), ``detector``, ``p99_ms``, ``passes``, ``pairs``
    and ``budget_ms``: that of 90 Hz, and on the axis *rate* that of the rate.
    """
    assembly, began = prepared(session, **asked).assembly, perf_counter()
    rows: list[Row] = []
    for number, (axis, sizes) in enumerate(SIZES.items(), 1):
        left = list(detectors)
        for wanted in sizes:
            if not left or (rows and perf_counter() - began > time_limit * number / len(SIZES)):
                break
            size, bigger = grown(assembly, axis, wanted)
            budget = budget_ms(wanted if axis == "rate" else HEADSET_HZ)
            shared = {"axis": axis, "size": size, "pairs": len(bigger.pairs), "budget_ms": budget, "passes": PASSES}
            prices = _timed(bigger, left)
            rows += [{**shared, "detector": name, "p99_ms": price} for name, price in prices.items()]
            left = [name for name in left if prices[name] < HOPELESS * budget]
    return tuple(rows)


def _timed(assembly: Assembly, names: Sequence[str]) -> dict[str, float]:
    """Milliseconds of the p99 of a frame by each, in turns."""
    timed = [Timed(name, make_detector(DetectorSpec(name, name), assembly, 0), assembly.motion) for name in names]
    frames = LiveFrames(assembly.motion, FRAMES)
    LiveFrames(assembly.motion.frames(0, min(len(assembly.motion), 20)), 20).live_pass(timed)
    passes = [frames.live_pass(timed, number) for number in range(PASSES)]
    medians = {one.label: np.median([each[k] for each in passes], axis=0) for k, one in enumerate(timed)}
    return {name: 1e3 * float(np.quantile(seconds, 0.99)) for name, seconds in medians.items()}


def grown(assembly: Assembly, axis: str, wanted: float) -> tuple[float, Assembly]:
    """The session at another size, and the size as it came out."""
    if axis == "faces":
        meshes = {id(body.mesh): with_faces(body.mesh, round(wanted)) for body in assembly.bodies}
        bodies = tuple(replace(body, mesh=meshes[id(body.mesh)]) for body in assembly.bodies)
        return float(np.mean([len(body.mesh.faces) for body in bodies])), replace(assembly, bodies=bodies)
    if axis == "rate":
        return wanted, replace(assembly, motion=at_rate(assembly.motion, wanted))
    return wanted * len(assembly.bodies), copied(assembly, round(wanted))


def copied(assembly: Assembly, copies: int) -> Assembly:
    """All bodies so many times, each copy further along x, and every pair of them asked."""
    motion = assembly.motion
    places = [motion.translations + np.array([SHIFT * k, 0.0, 0.0]) for k in range(copies)]
    bodies = tuple(replace(body, name=f"{body.name}-{k}") for k in range(copies) for body in assembly.bodies)
    turns, valid = np.tile(motion.rotations, (1, copies, 1, 1)), np.tile(motion.valid, (1, copies))
    pairs = np.stack(np.triu_indices(len(bodies), 1), axis=1).astype(np.int64)
    motion = Motion(motion.times, np.concatenate(places, axis=1), turns, valid)
    return replace(assembly, bodies=bodies, motion=motion, pairs=pairs)


def at_rate(motion: Motion, rate_hz: float) -> Motion:
    """The same motion with so many frames a second; a pose between two is there where both are."""
    times = np.arange(motion.times[0], motion.times[-1], 1.0 / rate_hz)
    known = motion.valid[:, :, None]
    turns = np.where(known[..., None], motion.rotations, np.eye(3))
    filled = Motion(motion.times, np.where(known, motion.translations, 0.0), turns)
    between = poses_between(filled, np.arange(motion.body_count), times)
    after = np.clip(np.searchsorted(motion.times, times), 1, len(motion) - 1)
    valid = motion.valid[after] & motion.valid[after - 1]
    return Motion(times, between.translations, between.rotations, valid)


def leaves_at(rows: Sequence[Row], axis: str, detector: str) -> float | None:
    """The size at which a detector fills its budget, between two sizes along a power law; ``None``: it does not."""
    some = [row for row in rows if (row["axis"], row["detector"]) == (axis, detector)]
    share = [log(row["p99_ms"] / row["budget_ms"]) for row in some]
    over = next((k for k, one in enumerate(share) if one >= 0), None)
    if not over:
        return None if over is None else float(some[0]["size"])
    low, high = (log(some[k]["size"]) for k in (over - 1, over))
    return exp(low + (high - low) * -share[over - 1] / (share[over] - share[over - 1]))


def growth_answer(rows: Sequence[Row]) -> str:
    """On which axes a complete detector leaves the budget, and on which none does."""
    names = {row["detector"] for row in rows if Setting(row["detector"], row["detector"]).complete}
    axes = dict.fromkeys(row["axis"] for row in rows)
    left = {axis: any(leaves_at(rows, axis, name) for name in names) for axis in axes}
    cost, free = (" and ".join(axis for axis, over in left.items() if over == wanted) for wanted in (True, False))
    if not cost:
        return "No size tried takes a complete detector out of its budget"
    return f"Accuracy starts to cost with {cost}" + (f", not with {free}" if free else "")
