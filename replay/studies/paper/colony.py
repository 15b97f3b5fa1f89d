"""Ablation of the colony: near contacts detected at equal evaluations, each equation switched off in turn."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.search.search_settings import EQUATIONS
from replay.auditing.wilson import wilson_interval
from replay.document.tables import Table
from replay.show.paper_table import Cell, paper_table
from replay.studies.paper.fixtures import FAMILY_NAMES, SeparationPaths, make_fixture
from sessions.synthetic.rng import random_stream

TARGET_FACES: Final = 500
"""The meshes of this column of Table I: about 2,700 to 5,300 faces each."""
EVALUATIONS_PER_POSE: Final = 2000
"""Evaluations of a pose."""
DEEPEST_M: Final = 0.004
FARTHEST_M: Final = 0.002
"""Metres by which a pose is moved from first touch, inwards or outwards at most."""
HALVINGS: Final = 16

COLONY_VARIANTS: Final = ("memetic", "local", "corrected", "random", "printed")


@dataclass(frozen=True, eq=False)
class NearPoses:
    """Relative poses about first touch, those that collide and those that do not; each with a stamp of its own."""

    family: str
    bodies: tuple[Body, Body]
    colliding: Motion
    free: Motion


def near_poses(family: str, count: int, seed: int = 0) -> NearPoses:
    """``count`` random directions and turns; the distance of first touch by bisection, then moved a little."""
    bodies = make_fixture(TARGET_FACES, FAMILY_NAMES.index(family), seed).bodies
    rng = random_stream(seed, "paper/near", family)
    paths = SeparationPaths(rng, bodies, count)
    lower, upper = np.full(count, 0.3 * paths.reach), np.full(count, paths.reach)
    for _ in range(HALVINGS):
        middle_distance = (lower + upper) / 2
        is_meeting = paths.do_meet(middle_distance)
        lower, upper = np.where(is_meeting, middle_distance, lower), np.where(is_meeting, upper, middle_distance)
    distances = lower + rng.uniform(-DEEPEST_M, FARTHEST_M, size=count)
    posed_motion, is_meeting = paths.motion(distances), paths.do_meet(distances)
    return NearPoses(
        family, bodies, posed_motion.take(np.flatnonzero(is_meeting)), posed_motion.take(np.flatnonzero(~is_meeting))
    )


@dataclass(frozen=True)
class DetectionCounts:
    """Answers of a detector about near poses: of a search one count a search seed, of any other detector one count.

    ``hits``: colliding poses detected; ``false``: free poses called contact; ``evaluations``: of all colliding poses.
    """

    hits: tuple[int, ...]
    false: tuple[int, ...]
    evaluations: tuple[int, ...]


def count_detections(near: NearPoses, name: str, seeds: Sequence[int] = (), **settings: Any) -> DetectionCounts:
    """Ask a detector about near poses, with each search seed in turn; without ``seeds`` once."""
    answers = []
    for seed in seeds or (None,):
        seeded_settings = settings if seed is None else settings | {"seed": seed}
        detector = create_detector(name, near.bodies, **seeded_settings)
        colliding_detection = detector.detect(near.colliding)
        disjoint_detection = detector.detect(near.free)
        hit_count = int((colliding_detection.verdict == Verdict.CONTACT).sum())
        false_count = int((disjoint_detection.verdict == Verdict.CONTACT).sum())
        answers.append((hit_count, false_count, int(np.sum(colliding_detection.work.get("evaluations", 0)))))
    hits_of_seeds, false_of_seeds, evaluations = zip(*answers, strict=True)
    return DetectionCounts(hits_of_seeds, false_of_seeds, evaluations)


Rows = list[tuple[Cell, ...]]


def colony_rows(family: str, count: int, seed: int = 0, search_seeds: int = 1) -> tuple[Rows, Rows]:
    """Rows of F7e and of the ablation: every detector and variant over ``count`` poses of a family, then the colony
    with each equation switched off; every search with ``search_seeds`` seeds over the same poses.
    """
    rates: Rows = []
    ablation_rows: Rows = []
    seeds = range(seed, seed + search_seeds)
    cold_settings = {"warm_start": False, "budget": EVALUATIONS_PER_POSE}
    poses = near_poses(family, count, seed)
    random_counts = count_detections(poses, "qaco", seeds, variant="random", **cold_settings)
    for name in ("exact", "hybrid", "rapid-style", "solid-style", "aabb", "obb"):
        rates.append((family, name, *_rate_cells(poses, count_detections(poses, name)), None, None))
    for variant in COLONY_VARIANTS:
        answers = count_detections(poses, "qaco", seeds, variant=variant, **cold_settings)
        rates.append(
            (family, f"qaco {variant}", *_rate_cells(poses, answers), *_work_cells(poses, answers, random_counts))
        )
    answers = count_detections(poses, "hybrid-qaco", seeds, **cold_settings)
    rates.append((family, "hybrid-qaco", *_rate_cells(poses, answers), *_work_cells(poses, answers, random_counts)))
    for variant in ("memetic", "corrected"):
        for equation in (None, *EQUATIONS):
            answers = count_detections(
                poses, "qaco", seeds, variant=variant, without_equation=equation, **cold_settings
            )
            name = "nothing" if equation is None else f"({equation})"
            measured_cells = _rate_cells(poses, answers)[: len(RATE_COLUMNS)]
            ablation_rows.append((family, variant, name, *measured_cells, *_work_cells(poses, answers, random_counts)))
    return rates, ablation_rows


def colony_tables(families: Sequence[tuple[Rows, Rows]], search_seeds: int) -> list[Table]:
    """Fig. 7's random-collision rate, and the ablation."""
    rates, ablation_rows = (tuple(row for rows in tables for row in rows) for tables in zip(*families, strict=True))
    seeds = f"A search was run with {search_seeds} seeds" if search_seeds > 1 else "A search was run with 1 seed"
    return [
        paper_table(
            "F7e",
            f"Random poses about first touch, {EVALUATIONS_PER_POSE:,} evaluations each",
            RATE_HEAD,
            rates,
            f"{seeds}: detected is the mean, fewest and most are those of one seed. Intervals: Wilson, 95 %, of poses. "
            "Evaluations: mean of a colliding pose, missed ones included, without flood fill.",
        ),
        paper_table(
            "ablation",
            "The colony with one equation switched off",
            ABLATION_HEAD,
            ablation_rows,
            "The same poses, seeds, budget and intervals as F7e. These seeds do not distinguish two rows whose "
            "ranges overlap.",
        ),
    ]


RATE_COLUMNS: Final = ("colliding", "detected", "fewest", "most", "rate", "low", "high")
WORK_COLUMNS: Final = ("evaluations", "to random")
RATE_HEAD: Final = ("family", "algorithm", *RATE_COLUMNS, "free", "reported though free", *WORK_COLUMNS)
ABLATION_HEAD: Final = ("family", "variant", "without", *RATE_COLUMNS, *WORK_COLUMNS)


def _rate_cells(poses: NearPoses, answers: DetectionCounts) -> tuple[Cell, ...]:
    """Columns ``RATE_COLUMNS``, then free poses, and free poses that any seed reported."""
    colliding = len(poses.colliding)
    mean = sum(answers.hits) / len(answers.hits)
    interval = wilson_interval(round(mean), colliding)
    extremes = min(answers.hits), max(answers.hits)
    return (colliding, mean, *extremes, mean / colliding, *interval, len(poses.free), max(answers.false))


def _work_cells(poses: NearPoses, answers: DetectionCounts, random_counts: DetectionCounts) -> tuple[Cell, ...]:
    """Columns ``WORK_COLUMNS``: evaluations of a colliding pose, and their ratio to those of random pairs."""
    evaluations_spent = sum(answers.evaluations) / len(answers.evaluations)
    random = sum(random_counts.evaluations) / len(random_counts.evaluations)
    return evaluations_spent / len(poses.colliding), evaluations_spent / random if random else None
