"""Detectors under the relations: a flip is one answer to a question and another to the same question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cdcore import Verdict
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import FloatArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.base.progress import Progress, Silent
from replay.errors import StressError
from replay.studies.stress.cases import Cases, write_cases
from replay.studies.stress.families import FAMILIES, FIRST_SEED, Family
from replay.studies.stress.peers import answers_of
from replay.studies.stress.relations import RELATIONS, Relation

PAIRS = 200
"""Of each family: with 26 families the 5,200 pairs that the figures in the literature of this tool were counted on."""


@dataclass(frozen=True)
class Flips:
    """One detector on one family under one relation."""

    detector: str
    relation: str
    number: int
    name: str
    seed: int
    pairs: int  # asked twice
    flips: int  # pairs of answers that differ, both decided and neither of them a volume's candidate
    refused: int  # pairs that it did not decide before or after
    file: str | None = None  # where the flipped pairs were written, if they were


def count_flips(
    detectors: Sequence[str],  # names of detectors, or of peers that are installed
    relations: Mapping[str, Relation] = RELATIONS,  # name -> relation
    *,
    # families, pairs, seed, out, progress: as for ``replay.studies.stress.stress_runner.stress``
    families: Sequence[Family] = FAMILIES,
    pairs: int = PAIRS,
    seed: int = FIRST_SEED,
    out: Path | None = None,
    progress: Progress | None = None,
) -> tuple[Flips, ...]:
    """Ask each detector about the pairs of each family, and about each relation of them.

    Returns detector after detector, relation after relation, family after family.
    Raises UnknownDetectorError, StressError, OutputError.
    """
    if pairs < 1 or seed < 0:
        raise StressError(f"{pairs} pairs, seed {seed}: give 1 pair or more, and no seed below 0")
    found: list[Flips] = []
    with (progress or Silent()).stage("relations", len(detectors) * len(families), "families") as advance:
        for detector in detectors:
            for family in families:
                triangles = family.pairs(pairs, seed)
                before = answers_of(detector, triangles)
                for name, relation in relations.items():
                    moved = np.ascontiguousarray(relation(triangles, np.random.default_rng((seed, family.number))))
                    after = answers_of(detector, moved)
                    found.append(flips_of(detector, name, family, seed, (triangles, moved), (before, after), out=out))
                advance(1)
    order = list(relations)
    place = {detector: k for k, detector in enumerate(detectors)}
    return tuple(sorted(found, key=lambda one: (place[one.detector], order.index(one.relation), one.number)))


def flips_of(
    detector: str,
    relation: str,
    family: Family,
    seed: int,
    triangles: tuple[FloatArray, FloatArray],
    verdicts: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    *,
    out: Path | None = None,
) -> Flips:
    """Count what changed between two lists (n,) of verdicts on pairs (n, 2, 3, 3) that have one answer."""
    before, after = verdicts
    refused = is_undecided(before) | is_undecided(after)
    volumes = (before == Verdict.CANDIDATE) | (after == Verdict.CANDIDATE)
    flipped = (counts_as_contact(before) != counts_as_contact(after)) & ~refused & ~volumes
    file = None
    if out is not None and flipped.any():
        row = np.repeat(np.flatnonzero(flipped), 2)
        both = np.stack([triangles[0][flipped], triangles[1][flipped]], axis=1).reshape(-1, 2, 3, 3)
        said = np.stack([before[flipped], after[flipped]], axis=1).ravel()
        truth = triangles_intersect(both)
        cases = Cases(detector, family.number, seed, len(before), row, both, truth, said, relation)
        file = str(write_cases(cases, out))
    return Flips(
        detector, relation, family.number, family.name, seed, len(before), int(flipped.sum()), int(refused.sum()), file
    )
