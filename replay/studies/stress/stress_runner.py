"""Detectors over the twenty-six families: per family what was missed, invented, within tolerance and refused."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore import Verdict
from cdcore.detectors import OPTIONAL, detector_names, load_detector
from cdcore.narrow.margins.triangle_margins import triangle_margins
from cdcore.narrow.triangles.integers import pair_intersects_integers
from cdcore.numerics import BoolArray, ByteArray, FloatArray
from cdcore.protocol import is_undecided
from replay.base.progress import Progress, Silent
from replay.comparison.tolerance import TAU
from replay.errors import StressError
from replay.studies.stress.cases import Cases, write_cases
from replay.studies.stress.effect_cases import EFFECTS
from replay.studies.stress.families import FAMILIES, FIRST_SEED, Family
from replay.studies.stress.peers import PEERS, answers_of, installed_peers
from replay.studies.stress.relations import Flips
from replay.studies.stress.system import CaseTally, judged, numbers_of

ALL: Final = "all"

NOT_IN_ALL: Final = {
    "sphere": "answers about bounding spheres, not about triangles",
    "collider": "answers about a solid that stands in for the mesh",
    **dict.fromkeys(OPTIONAL, "answers about the hull, which is another solid"),
    "image-space": "refuses open meshes, and one triangle is open",
    "static": "asks the same meshes as discrete, and its spheres would take nine minutes",
}
"""Detector -> why ``all`` leaves it out; it can still be asked by name. Every other row of the table is in ``all``."""

CLAIM_EXACTNESS: Final = frozenset({"exact", "continuous", "aabb", "obb", "rapid-style", "solid-style"})
"""Detectors that promise the exact answer on every finite input: one wrong or refused pair is a failure."""


@dataclass(frozen=True)
class Tally:
    """One detector on one family."""

    detector: str
    number: int
    name: str
    seed: int
    pairs: int
    # missed, invented: disagreements with the exact answer by more than tau
    missed: int
    invented: int
    within: int  # disagreements about at most tau (none in families whose coordinates are not metres)
    refused: int  # pairs it did not decide
    unconfirmed: int  # reported by bounding volumes alone where nothing meets; never counted as invented
    file: str | None = None  # where the failing pairs were written, if they were

    @property
    def failed(self) -> int:
        """Pairs without the exact answer, tolerance or not."""
        return self.missed + self.invented + self.within + self.refused


@dataclass(frozen=True)
class StressResult:
    """All tallies, detector after detector, what changed under relations, the cases of bodies, and how to repeat it."""

    seed: int
    pairs: int
    tau: float
    tallies: tuple[Tally, ...]
    flips: tuple[Flips, ...] = ()
    cases: tuple[CaseTally, ...] = ()

    @property
    def broken(self) -> list[str]:
        """A sentence for each broken promise: a detector that claims exactness, wrong or undecided."""
        wrong = [
            f"{tally.detector} claims exactness and failed {tally.failed:,} of {tally.pairs:,} pairs of "
            f"{tally.number:02d} {tally.name} (seed {tally.seed})"
            for tally in self.tallies
            if tally.detector in CLAIM_EXACTNESS and tally.failed
        ]
        wrong += [
            f"{one.detector} claims exactness and changed its answer to {one.flips + one.refused:,} of {one.pairs:,} "
            f"pairs of {one.number:02d} {one.name} under {one.relation} (seed {one.seed})"
            for one in self.flips
            if one.detector in CLAIM_EXACTNESS and one.flips + one.refused
        ]
        wrong += [
            f"{one.detector} claims exactness and failed case {one.number} {one.name}: {one.words} of {one.asked:,}"
            for one in self.cases
            if one.detector in CLAIM_EXACTNESS and one.promised and one.missed + one.invented + one.within
        ]
        return wrong + [
            f"the effects failed case {one.number} {one.name}: {one.missed:,} of {one.asked:,} wrong, {one.reason}"
            for one in self.cases
            if one.detector == EFFECTS and one.missed
        ]

    def by_detector(self) -> Iterator[tuple[str, list[Tally]]]:
        """The tallies of one detector after the other."""
        for name in dict.fromkeys(tally.detector for tally in self.tallies):
            yield name, [tally for tally in self.tallies if tally.detector == name]

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def detectors_of(names: str) -> list[str]:
    """The rows that ``--detectors`` means: names with commas between them, or ``all``; each once.

    Raises StressError: no name, or a peer that is not installed.
    Raises UnknownDetectorError: lists the names there are.
    """
    asked = [name.strip() for name in str(names).split(",") if name.strip()]
    if not asked:
        raise StressError(f"{names!r} names no detector; there are: {', '.join([*detector_names(), *PEERS])}, {ALL}")
    found: list[str] = []
    for name in asked:
        if name in PEERS and name not in installed_peers():
            raise StressError(f"{name} is not installed; install it, or ask another of: {', '.join(detector_names())}")
        if name not in (ALL, *PEERS):
            load_detector(name)
        usual = [row for row in detector_names() if row not in NOT_IN_ALL] + installed_peers()
        found += usual if name == ALL else [name]
    return list(dict.fromkeys(found))


def families_of(text: str) -> list[Family]:
    """Families named by ``01-26``, ``9`` or ``3-5,12``.

    Raises StressError: not numbers from 1 to 26.

    Examples
    --------
    >>> [family.number for family in families_of("3-5,12")]
    [3, 4, 5, 12]
    """
    return [FAMILIES[number - 1] for number in numbers_of(text, "family", 1, len(FAMILIES))]


def stress(
    detector: str = ALL,  # names of detectors and peers, with commas between them, or ``"all"``
    *,
    families: Sequence[Family] = FAMILIES,
    pairs: int = 4000,  # how many pairs of each
    seed: int = FIRST_SEED,  # of the first family; family k takes this plus k - 1
    tau: float = TAU,  # metres, see ``TAU``
    out: Path | None = None,  # folder for a file per detector and family that failed; ``None``: none are written
    progress: Progress | None = None,  # told how far the work is
) -> StressResult:
    """Ask detectors, or all, about hard triangle pairs whose answer is known exactly.

    The truth is the integer test, which shares no step with the filter and the sums that ``exact`` decides by.

    Raises UnknownDetectorError, StressError, OutputError.
    """
    if pairs < 1 or seed < 0 or not 0 <= tau < float("inf"):
        raise StressError(
            f"{pairs} pairs, seed {seed}, tau {tau}: give 1 pair or more, and neither seed nor tau below 0"
        )
    names = detectors_of(detector)
    tallies: list[Tally] = []
    with (progress or Silent()).stage("stress", len(names) * len(families), "families") as advance:
        for family in families:
            triangles = family.pairs(pairs, seed)
            truth = np.array([pair_intersects_integers(pair.tolist()) for pair in triangles], dtype=np.bool_)
            for name in names:
                verdict = answers_of(name, triangles)
                tallies.append(tally_of(name, family, seed, triangles, truth, verdict, tau=tau, out=out))
                advance(1)
    return StressResult(seed, pairs, tau, tuple(sorted(tallies, key=lambda tally: names.index(tally.detector))))


def tally_of(
    name: str, family: Family, seed: int, triangles: FloatArray, truth: BoolArray, verdict: ByteArray, *, tau: float,
    out: Path | None = None,
) -> Tally:  # fmt: skip
    """Count what the verdicts (n,) on triangle pairs (n, 2, 3, 3) are worth beside the truth (n,)."""

    def within(wrong: BoolArray) -> BoolArray:
        # With a tolerance of 0 none is, not even a touch.
        some = wrong & family.metric & (tau > 0)
        some[some] = triangle_margins(triangles[some])[1] <= tau
        return some

    found = judged(verdict, truth * np.uint8(Verdict.CONTACT), is_undecided(verdict), within)
    failed = found["missed"] | found["invented"] | found["refused"]
    file = None
    if out is not None and failed.any():
        row = np.flatnonzero(failed)
        cases = Cases(name, family.number, seed, len(triangles), row, triangles[row], truth[row], verdict[row])
        file = str(write_cases(cases, out))
    counts = {word: int(rows.sum()) for word, rows in found.items()}
    return Tally(name, family.number, family.name, seed, len(triangles), **counts, file=file)
