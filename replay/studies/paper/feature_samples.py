"""F8: a search over S sampled faces misses in two ways, told apart: no pair that meets is in the sample, or it is there
and is not found.

The poses are those about first touch that collide. Each draw of faces serves a part of them, so that no figure hangs on
one lucky sample.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil
from typing import Final

import numpy as np

from cdcore import Verdict, create_detector
from cdcore.search.features import features_of, sample_of
from replay.auditing.wilson import wilson
from replay.document.tables import Table
from replay.show.paper_table import Cell, paper_table
from replay.studies.paper.colony import BUDGET, near_poses

SIZES: Final[tuple[int | None, ...]] = (50, 100, 200, 400, 800, 1600, None)
"""Faces sampled of each mesh; ``None``: all."""
SEARCHERS: Final = ("random", "corrected", "memetic", "local")
DRAWS: Final = 4
LIMIT: Final = 20_000
"""Evaluations after which a search is given up."""
RATE: Final = 0.9
"""Detection rate that is to be reached."""
ALL: Final = "all"
ENOUGH: Final = 20
"""Covered poses without which a share of nine in ten says nothing."""


@dataclass(frozen=True)
class Drawn:
    """The poses of a family, searched within samples of every size."""

    family: str
    meeting: dict[int | None, list[int]]  # size -> how many pairs that meet are in the sample, a pose each
    # searcher and size -> evaluations until the first hit, ``None``: none within ``LIMIT``; covered poses only
    spent: dict[tuple[str, int | None], list[int | None]]


def search_samples(family: str, near: int, seed: int) -> Drawn:
    """Search the colliding ones of ``near`` poses; each draw of samples serves every ``DRAWS``-th of them."""
    poses = near_poses(family, near, seed)
    exact = create_detector("exact", poses.bodies, containment=False).detect(poses.colliding, faces=True)
    features = [features_of(body.mesh) for body in poses.bodies]
    drawn = Drawn(family, defaultdict(list), defaultdict(list))
    for draw, size in product(range(DRAWS), SIZES):
        key = seed * DRAWS + draw
        first, second = (
            some.face[sample_of(some, size, key, body.name).pick]
            for some, body in zip(features, poses.bodies, strict=True)
        )
        covered = []
        for k in range(draw, len(poses.colliding), DRAWS):
            pairs = exact.faces(k, 0)
            count = int((np.isin(pairs[:, 0], first) & np.isin(pairs[:, 1], second)).sum())
            drawn.meeting[size].append(count)
            if count:
                covered.append(poses.colliding.frames(k, k + 1))
        for searcher in SEARCHERS:
            detector = create_detector(
                "qaco", poses.bodies, variant=searcher, seed=key, samples=size, budget=LIMIT, warm_start=False
            )
            drawn.spent[searcher, size] += [
                int(answer.work["evaluations"]) if answer.verdict[0, 0] == Verdict.CONTACT else None
                for answer in map(detector.detect, covered)
            ]
    return drawn


def least_evaluations(spent: Sequence[int | None], of: int) -> int | None:
    """The least budget within which ``RATE`` of ``of`` poses are detected; ``None``: ``LIMIT`` does not do."""
    hits = sorted(hit for hit in spent if hit is not None)
    target = ceil(RATE * of)
    return hits[target - 1] if 0 < target <= len(hits) else None


def feature_sample_tables(families: Sequence[Drawn]) -> list[Table]:
    """F8: coverage and search."""
    return [_coverage(families), _search(families)]


def _coverage(families: Sequence[Drawn]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for drawn in families:
        for size, meeting in drawn.meeting.items():
            of, missed = len(meeting), meeting.count(0)
            rows.append((drawn.family, _word(size), of, missed, missed / of, *wilson(missed, of)))
    head = ("family", "faces sampled", "poses", "coverage misses", "rate", "low", "high")
    note = (
        "No pair that meets has both its faces in the sample: no search can find what is not there. Samples of each "
        f"mesh are drawn by area, {DRAWS} draws. Intervals: Wilson, 95 %."
    )
    return paper_table("F8 coverage", "Contacts of which a sample of faces holds no pair", head, tuple(rows), note)


def _search(families: Sequence[Drawn]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for drawn in families:
        for searcher in SEARCHERS:
            for size in SIZES:
                spent, of = drawn.spent[searcher, size], len(drawn.meeting[size])
                missed = sum(hit is None or hit > BUDGET for hit in spent)
                least = least_evaluations(spent, len(spent)) if len(spent) >= ENOUGH else None
                rate = (missed / len(spent), *wilson(missed, len(spent))) if spent else (None, None, None)
                success_rate = (len(spent) - missed) / of
                whole = least_evaluations(spent, of)
                rows.append(
                    (drawn.family, searcher, _word(size), len(spent), missed, *rate, success_rate, least, whole)
                )
    head = (
        "family",
        "search",
        "faces sampled",
        "poses covered",
        f"misses at {BUDGET:,}",
        "rate",
        "low",
        "high",
        "detected of all poses",
        f"evaluations to {RATE:g} of covered",
        f"evaluations to {RATE:g} of all",
    )
    note = (
        "Search misses: a pair that meets is in the sample and is not found. A dash: not reached within "
        f"{LIMIT:,} evaluations, or fewer than {ENOUGH} poses covered. Intervals: Wilson, 95 %."
    )
    return paper_table("F8 search", "Misses and evaluations of a search within the sample", head, tuple(rows), note)


def _word(size: int | None) -> str:
    return ALL if size is None else str(size)
