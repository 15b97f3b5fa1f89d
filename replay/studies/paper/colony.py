"""What the colony is worth: near contacts found at equal evaluations, with each equation switched off in turn."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.search.search_settings import EQUATIONS
from replay.base.tables import Table
from replay.base.wilson import wilson
from replay.outputs.paper_table import Cell, paper_table
from replay.studies.paper.fixtures import FAMILY_NAMES, Ways, fixture
from sessions.synthetic.rng import random_stream

TARGET: Final = 500
"""The meshes of this column of Table I: about 2,700 to 5,300 faces each."""
BUDGET: Final = 2000
"""Evaluations of a pose."""
DEEPER: Final = 0.004
FARTHER: Final = 0.002
"""Metres by which a pose is moved from first touch, inwards or outwards at most."""
HALVINGS: Final = 16

VARIANTS: Final = ("memetic", "local", "corrected", "random", "printed")


@dataclass(frozen=True, eq=False)
class NearPoses:
    """Relative poses about first touch, those that collide and those that do not; each with a stamp of its own."""

    family: str
    bodies: tuple[Body, Body]
    colliding: Motion
    free: Motion


def near_poses(family: str, count: int, seed: int = 0) -> NearPoses:
    """``count`` random directions and turns; the distance of first touch by bisection, then moved a little."""
    bodies = fixture(TARGET, FAMILY_NAMES.index(family), seed).bodies
    rng = random_stream(seed, "paper/near", family)
    ways = Ways(rng, bodies, count)
    low, high = np.full(count, 0.3 * ways.reach), np.full(count, ways.reach)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        meets = ways.meet(middle)
        low, high = np.where(meets, middle, low), np.where(meets, high, middle)
    distances = low + rng.uniform(-DEEPER, FARTHER, size=count)
    posed, meets = ways.motion(distances), ways.meet(distances)
    return NearPoses(family, bodies, posed.take(np.flatnonzero(meets)), posed.take(np.flatnonzero(~meets)))


def detected(poses: NearPoses, name: str, **settings: Any) -> tuple[int, int, int]:
    """Colliding poses found, evaluations spent on all colliding ones, and free poses called contact."""
    detector = create_detector(name, poses.bodies, **settings)
    found = detector.detect(poses.colliding)
    false = detector.detect(poses.free)
    hits = int((found.verdict == Verdict.CONTACT).sum())
    spent = int(np.sum(found.work.get("evaluations", 0)))
    return hits, spent, int((false.verdict == Verdict.CONTACT).sum())


Rows = list[tuple[Cell, ...]]


def colony_rows(family: str, count: int, seed: int = 0) -> tuple[Rows, Rows]:
    """Rows of F7e and of the ablation: every detector and variant over ``count`` poses of a family, then the colony
    with each equation switched off.
    """
    rates: Rows = []
    without: Rows = []
    cold = {"warm_start": False, "budget": BUDGET, "seed": seed}
    poses = near_poses(family, count, seed)
    spent_at_random = detected(poses, "qaco", variant="random", **cold)[1]
    for name in ("exact", "hybrid", "rapid-style", "solid-style", "aabb", "obb"):
        rates.append(_rate(poses, name, detected(poses, name), None))
    for variant in VARIANTS:
        counts = detected(poses, "qaco", variant=variant, **cold)
        rates.append(_rate(poses, f"qaco {variant}", counts, spent_at_random))
    rates.append(_rate(poses, "hybrid-qaco", detected(poses, "hybrid-qaco", **cold), spent_at_random))
    for variant in ("memetic", "corrected"):
        for equation in (None, *EQUATIONS):
            counts = detected(poses, "qaco", variant=variant, without_equation=equation, **cold)
            word = "nothing" if equation is None else f"({equation})"
            cells = _rate(poses, "", counts, spent_at_random)
            without.append((family, variant, word, *cells[2:7], *cells[-2:]))
    return rates, without


def colony_tables(families: Sequence[tuple[Rows, Rows]]) -> list[Table]:
    """Fig. 7's random-collision rate, and the ablation."""
    rates, without = (tuple(row for rows in part for row in rows) for part in zip(*families, strict=True))
    return [
        paper_table(
            "F7e", f"Random poses about first touch, {BUDGET:,} evaluations each", RATE_HEAD, rates,
            "Intervals: Wilson, 95 %. Evaluations: mean of a colliding pose, missed ones included, without flood fill.",
        ),
        paper_table(
            "ablation", "The colony with one equation switched off", ABLATION_HEAD, without,
            "The same poses, budget and intervals as F7e.",
        ),
    ]  # fmt: skip


MEASURED: Final = ("colliding", "detected", "rate", "low", "high")
RATE_HEAD: Final = ("family", "algorithm", *MEASURED, "free", "reported though free", "evaluations", "to random")
ABLATION_HEAD: Final = ("family", "variant", "without", *MEASURED, "evaluations", "to random")


def _rate(poses: NearPoses, name: str, counts: tuple[int, int, int], spent_at_random: int | None) -> tuple[Cell, ...]:
    hits, spent, false = counts
    of = len(poses.colliding)
    evaluations = spent / of if spent_at_random is not None else None
    ratio = spent / spent_at_random if spent_at_random else None
    return (poses.family, name, of, hits, hits / of, *wilson(hits, of), len(poses.free), false, evaluations, ratio)
