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
from replay.auditing.wilson import wilson_interval
from replay.document.tables import Table
from replay.show.paper_table import Cell, paper_table
from replay.studies.paper.colony import EVALUATIONS_PER_POSE, near_poses

SAMPLE_SIZES: Final[tuple[int | None, ...]] = (50, 100, 200, 400, 800, 1600, None)
"""Faces sampled of each mesh; ``None``: all."""
SEARCH_VARIANTS: Final = ("random", "corrected", "memetic", "local")
SAMPLE_DRAWS: Final = 4
MOST_EVALUATIONS: Final = 20_000
"""Evaluations after which a search is given up."""
TARGET_RATE: Final = 0.9
"""Detection rate that is to be reached."""
ALL_FACES: Final = "all"
LEAST_COVERED: Final = 20
"""Covered poses without which a share of nine in ten says nothing."""


@dataclass(frozen=True)
class SampleSearches:
    """The poses of a family, searched within samples of every size."""

    family: str
    meeting_counts: dict[int | None, list[int]]  # size -> how many pairs that meet are in the sample, a pose each
    # searcher and size -> evaluations until the first hit, ``None``: none within the limit; covered poses only
    evaluations_to_hit: dict[tuple[str, int | None], list[int | None]]


def search_samples(family: str, pose_count: int, seed: int) -> SampleSearches:
    """Search the colliding ones of ``pose_count`` poses; each draw of samples serves every ``DRAWS``-th of them."""
    poses = near_poses(family, pose_count, seed)
    exact = create_detector("exact", poses.bodies, containment=False).detect(poses.colliding, faces=True)
    features = [features_of(body.mesh) for body in poses.bodies]
    searches = SampleSearches(family, defaultdict(list), defaultdict(list))
    for draw_number, size in product(range(SAMPLE_DRAWS), SAMPLE_SIZES):
        sample_seed = seed * SAMPLE_DRAWS + draw_number
        first_faces, second_faces = (
            features_of_mesh.face[sample_of(features_of_mesh, size, sample_seed, body.name).pick]
            for features_of_mesh, body in zip(features, poses.bodies, strict=True)
        )
        covered_poses = []
        for k in range(draw_number, len(poses.colliding), SAMPLE_DRAWS):
            pairs = exact.faces(k, 0)
            sampled_pair_count = int((np.isin(pairs[:, 0], first_faces) & np.isin(pairs[:, 1], second_faces)).sum())
            searches.meeting_counts[size].append(sampled_pair_count)
            if sampled_pair_count:
                covered_poses.append(poses.colliding.frames(k, k + 1))
        for searcher in SEARCH_VARIANTS:
            detector = create_detector(
                "qaco",
                poses.bodies,
                variant=searcher,
                seed=sample_seed,
                samples=size,
                budget=MOST_EVALUATIONS,
                warm_start=False,
            )
            searches.evaluations_to_hit[searcher, size] += [
                int(answer.work["evaluations"]) if answer.verdict[0, 0] == Verdict.CONTACT else None
                for answer in map(detector.detect, covered_poses)
            ]
    return searches


def least_evaluations(evaluations_to_hit: Sequence[int | None], pose_count: int) -> int | None:
    """The least budget within which ``TARGET_RATE`` of ``pose_count`` poses are detected; ``None``: none is enough."""
    sorted_evaluations = sorted(evaluations for evaluations in evaluations_to_hit if evaluations is not None)
    target = ceil(TARGET_RATE * pose_count)
    return sorted_evaluations[target - 1] if 0 < target <= len(sorted_evaluations) else None


def feature_sample_tables(families: Sequence[SampleSearches]) -> list[Table]:
    """F8: coverage and search."""
    return [_coverage_table(families), _search_table(families)]


def _coverage_table(families: Sequence[SampleSearches]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for searches in families:
        for size, meeting_counts in searches.meeting_counts.items():
            pose_count, missed_count = len(meeting_counts), meeting_counts.count(0)
            rows.append(
                (
                    searches.family,
                    _size_text(size),
                    pose_count,
                    missed_count,
                    missed_count / pose_count,
                    *wilson_interval(missed_count, pose_count),
                )
            )
    column_names = ("family", "faces sampled", "poses", "coverage misses", "rate", "low", "high")
    note = (
        "No pair that meets has both its faces in the sample: no search can find what is not there. Samples of each "
        f"mesh are drawn by area, {SAMPLE_DRAWS} draws. Intervals: Wilson, 95 %."
    )
    return paper_table(
        "F8 coverage", "Contacts of which a sample of faces holds no pair", column_names, tuple(rows), note
    )


def _search_table(families: Sequence[SampleSearches]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for searches in families:
        for searcher in SEARCH_VARIANTS:
            for size in SAMPLE_SIZES:
                evaluations_to_hit, pose_count = (
                    searches.evaluations_to_hit[searcher, size],
                    len(searches.meeting_counts[size]),
                )
                missed_count = sum(hit is None or hit > EVALUATIONS_PER_POSE for hit in evaluations_to_hit)
                evaluations_of_covered = (
                    least_evaluations(evaluations_to_hit, len(evaluations_to_hit))
                    if len(evaluations_to_hit) >= LEAST_COVERED
                    else None
                )
                rate = (
                    (missed_count / len(evaluations_to_hit), *wilson_interval(missed_count, len(evaluations_to_hit)))
                    if evaluations_to_hit
                    else (None, None, None)
                )
                success_rate = (len(evaluations_to_hit) - missed_count) / pose_count
                evaluations_of_all = least_evaluations(evaluations_to_hit, pose_count)
                rows.append(
                    (
                        searches.family,
                        searcher,
                        _size_text(size),
                        len(evaluations_to_hit),
                        missed_count,
                        *rate,
                        success_rate,
                        evaluations_of_covered,
                        evaluations_of_all,
                    )
                )
    column_names = (
        "family",
        "search",
        "faces sampled",
        "poses covered",
        f"misses at {EVALUATIONS_PER_POSE:,}",
        "rate",
        "low",
        "high",
        "detected of all poses",
        f"evaluations to {TARGET_RATE:g} of covered",
        f"evaluations to {TARGET_RATE:g} of all",
    )
    note = (
        "Search misses: a pair that meets is in the sample and is not found. A dash: not reached within "
        f"{MOST_EVALUATIONS:,} evaluations, or fewer than {LEAST_COVERED} poses covered. Intervals: Wilson, 95 %."
    )
    return paper_table(
        "F8 search", "Misses and evaluations of a search within the sample", column_names, tuple(rows), note
    )


def _size_text(size: int | None) -> str:
    return ALL_FACES if size is None else str(size)
