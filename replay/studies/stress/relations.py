"""Five relations between questions that have one answer: nothing in them rounds, so no verdict may change.

Source: section 7.3 of the project's specification. Rounded rotations and translations are no such relation: they
change the exact answer itself.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.random import Generator

from cdcore import Verdict
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import ByteArray, FloatArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.base.progress import Progress, Silent
from replay.errors import StressError
from replay.studies.stress.cases import Cases, write_cases
from replay.studies.stress.families import FAMILIES, FIRST_SEED, Family
from replay.studies.stress.peers import answers_of

Relation = Callable[[FloatArray, Generator], FloatArray]
"""Triangle pairs (n, 2, 3, 3) to as many that meet where they met."""


def swapped(pairs: FloatArray, _rng: Generator) -> FloatArray:
    """The other triangle first."""
    return pairs[:, ::-1]


def reordered(pairs: FloatArray, rng: Generator) -> FloatArray:
    """The corners of each triangle in a random order, so that windings are reversed too."""
    order = np.array(list(itertools.permutations(range(3))))
    first, second = (order[rng.integers(0, 6, len(pairs))] for _ in range(2))
    rows = np.arange(len(pairs))[:, None]
    return np.stack([pairs[rows, 0, first], pairs[rows, 1, second]], axis=1)


def turned(pairs: FloatArray, rng: Generator) -> FloatArray:
    """The axes permuted, each with a sign."""
    order = list(rng.permutation(3))
    signs: FloatArray = rng.choice([-1.0, 1.0], 3)
    return pairs[..., order] * signs


def scaled(pairs: FloatArray, rng: Generator) -> FloatArray:
    """Each pair times a power of two from 2^-10 to 2^10."""
    return pairs * 2.0 ** rng.integers(-10, 11, (len(pairs), 1, 1, 1))


def shifted(pairs: FloatArray, rng: Generator) -> FloatArray:
    """Each pair moved by multiples of 8, where that rounds no coordinate; elsewhere as it is."""
    moved = pairs + 8.0 * rng.integers(-4, 5, (len(pairs), 1, 1, 3))
    shift = moved - pairs
    exact = (moved - shift == pairs).all(axis=(1, 2, 3))
    exact &= (shift == shift[:, :1, :1]).all(axis=(1, 2, 3))
    return np.where(exact[:, None, None, None], moved, pairs)


RELATIONS: Final[dict[str, Relation]] = {
    "swap": swapped, "order": reordered, "axes": turned, "scale": scaled, "shift": shifted,
}  # fmt: skip
"""Name -> what makes the second question of the first."""


def relations_of(text: str) -> dict[str, Relation]:
    """Relations named by ``all`` or ``swap,axes``. Raises StressError: a name that is none of them."""
    names = list(RELATIONS) if text == "all" else text.split(",")
    for name in names:
        if name not in RELATIONS:
            raise StressError(f"there is no relation {name!r}; there are: {', '.join(RELATIONS)}, or all")
    return {name: RELATIONS[name] for name in names}


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
    order = [(detector, name) for detector in detectors for name in relations]
    return tuple(sorted(found, key=lambda one: (order.index((one.detector, one.relation)), one.number)))


def flips_of(
    detector: str, relation: str, family: Family, seed: int, triangles: tuple[FloatArray, FloatArray],
    verdicts: tuple[ByteArray, ByteArray], *, out: Path | None = None,
) -> Flips:  # fmt: skip
    """Count what changed between two lists (n,) of verdicts on pairs (n, 2, 3, 3) that have one answer."""
    before, after = verdicts
    refused = is_undecided(before) | is_undecided(after)
    volumes = (before == Verdict.CANDIDATE) | (after == Verdict.CANDIDATE)
    flipped = (counts_as_contact(before) != counts_as_contact(after)) & ~refused & ~volumes
    file = None
    if out is not None and flipped.any():
        row = np.repeat(np.flatnonzero(flipped), 2)
        both, said = (np.stack(some, axis=1)[flipped] for some in (triangles, verdicts))
        both, said = both.reshape(-1, 2, 3, 3), said.ravel()
        cases = Cases(detector, family.number, seed, len(before), row, both, triangles_intersect(both), said, relation)
        file = str(write_cases(cases, out))
    return Flips(
        detector, relation, family.number, family.name, seed, len(before), int(flipped.sum()), int(refused.sum()), file
    )
