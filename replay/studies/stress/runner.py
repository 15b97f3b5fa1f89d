"""Detectors over the families of triangle pairs, over five relations of them, and over the cases of whole bodies."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Verdict
from cdcore.detectors import OPTIONAL, detector_names, load_detector
from cdcore.narrow.margins.triangle_margins import triangle_margins
from cdcore.narrow.triangles.integers import pair_intersects_integers
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.numerics import BoolArray, ByteArray, FloatArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.base.progress import Progress, Silent
from replay.comparison.tolerance import TAU
from replay.errors import OutputError, StressError
from replay.studies.stress.bodies import ask_case
from replay.studies.stress.families import FAMILIES, FIRST_SEED, Family
from replay.studies.stress.relations import RELATIONS
from replay.studies.stress.scenes import SCENES
from replay.studies.stress.tally import StressResult, Tally, judged
from replay.studies.stress.triangle_pairs import verdicts_of
from sessions.whole_files import whole_file

ALL: Final = "all"

NOT_IN_ALL: Final = {
    "sphere": "answers about bounding spheres, not about triangles",
    "collider": "answers about a solid that stands in for the mesh",
    **dict.fromkeys(OPTIONAL, "answers about the hull, which is another solid"),
    "image-space": "refuses open meshes, and one triangle is open",
    "static": "asks the same meshes as discrete, and its spheres would take nine minutes",
}
"""Detector -> why ``all`` leaves it out; it can still be asked by name. Every other row of the table is in ``all``."""


def detectors_of(names: str) -> list[str]:
    """The rows that ``--detectors`` means: names with commas between them, or ``all``; each once.

    Raises StressError: no name. Raises UnknownDetectorError: lists the names there are.
    """
    asked = [name.strip() for name in str(names).split(",") if name.strip()]
    if not asked:
        raise StressError(f"{names!r} names no detector; there are: {', '.join(detector_names())}, {ALL}")
    chosen: list[str] = []
    for name in asked:
        if name != ALL:
            load_detector(name)
        chosen += [row for row in detector_names() if row not in NOT_IN_ALL] if name == ALL else [name]
    return list(dict.fromkeys(chosen))


def relations_of(text: str) -> list[str]:
    """Relations named by ``all`` or ``swap,axes``. Raises StressError: a name that is none of them."""
    names = [*RELATIONS] if text == ALL else text.split(",")
    for name in names:
        if name not in RELATIONS:
            raise StressError(f"there is no relation {name!r}; there are: {', '.join(RELATIONS)}, or all")
    return names


def numbers_of(text: str, what: str, known: Sequence[int]) -> list[int]:
    """Numbers named by ``9``, ``3-5,12`` or ``all``. Raises StressError: one is not among the known ones.

    Examples
    --------
    >>> numbers_of("3-5,12", "family", range(1, 27))
    [3, 4, 5, 12]
    """
    if text == ALL:
        return [*known]
    wanted: set[int] = set()
    least, most = min(known), max(known)
    for part in text.split(","):
        first, _, last = (word.strip() for word in part.partition("-"))
        ends = first, last or first
        inside = all(map(str.isdecimal, ends)) and least <= int(ends[0]) <= int(ends[1]) <= most
        numbers = {number for number in known if inside and int(ends[0]) <= number <= int(ends[1])}
        if not numbers:
            raise StressError(f"there is no {what} {part!r}; they go from {least} to {most}, written as 9 or 3-5,12")
        wanted |= numbers
    return sorted(wanted)


@dataclass(frozen=True)
class Asking:
    """Who is asked, how it is repeated, and where failing pairs are written."""

    detectors: Sequence[str]
    seed: int = FIRST_SEED  # of the first family; family k takes this plus k - 1
    tau: float = TAU  # metres, see ``TAU``
    out: Path | None = None  # folder for a file per detector and family that failed; ``None``: none are written
    progress: Progress = field(default_factory=Silent)


def stress(
    detector: str = ALL,  # names of detectors, with commas between them, or ``"all"``
    *,
    families: Sequence[Family] = FAMILIES,
    pairs: int = 4000,  # how many of each
    seed: int = FIRST_SEED,
    tau: float = TAU,
    out: Path | None = None,
    progress: Progress | None = None,
) -> StressResult:
    """Ask detectors, or all, about hard triangle pairs whose answer is known exactly; the rest is as in ``Asking``.

    Raises UnknownDetectorError, StressError, OutputError.
    """
    asking = Asking(detectors_of(detector), seed, tau, out, progress or Silent())
    return StressResult(seed, pairs, tau, tuple(ask_families(asking, families, pairs)))


def ask_families(asking: Asking, families: Sequence[Family], pairs: int) -> list[Tally]:
    """``pairs`` of each family, detector after detector.

    The truth is the integer test, which shares no step with the filter and the sums that ``exact`` decides by.
    """
    check(asking, pairs)
    tallies: list[Tally] = []
    names = asking.detectors
    with asking.progress.stage("stress", len(names) * len(families), "families") as advance:
        for family in families:
            triangles = family.pairs(pairs, asking.seed)
            truth = np.array([pair_intersects_integers(pair.tolist()) for pair in triangles], dtype=np.bool_)
            for name in names:
                tallies.append(tally_of(asking, name, family, triangles, truth, verdicts_of(name, triangles)))
                advance(1)
    return sorted(tallies, key=lambda tally: names.index(tally.detector))


def ask_relations(asking: Asking, relations: Sequence[str], families: Sequence[Family], pairs: int) -> list[Tally]:
    """``pairs`` of each family, and again under each relation, detector after detector, relation after relation."""
    check(asking, pairs)
    tallies: list[Tally] = []
    names = asking.detectors
    with asking.progress.stage("relations", len(names) * len(families), "families") as advance:
        for name in names:
            for family in families:
                triangles = family.pairs(pairs, asking.seed)
                before = verdicts_of(name, triangles)
                for relation in relations:
                    random = np.random.default_rng((asking.seed, family.number))
                    moved = np.ascontiguousarray(RELATIONS[relation](triangles, random))
                    both = np.stack([triangles, moved], axis=1), np.stack([before, verdicts_of(name, moved)], axis=1)
                    tallies.append(tally_of_relation(asking, name, family, relation, *both))
                advance(1)
    return sorted(tallies, key=lambda tally: (names.index(tally.detector), relations.index(tally.relation)))


def ask_cases(asking: Asking, cases: Sequence[int]) -> list[Tally]:
    """Case after case, detector after detector."""
    tallies = []
    with asking.progress.stage("cases", len(cases) * len(asking.detectors), "cases") as advance:
        for number in cases:
            random = np.random.default_rng((asking.seed, number))
            scenes = [*SCENES[number][1](random)] if number in SCENES else []
            for name in asking.detectors:
                tallies.append(ask_case(name, number, scenes, seed=asking.seed, tau=asking.tau))
                advance(1)
    return tallies


def check(asking: Asking, pairs: int) -> None:
    """Raise StressError for numbers that mean nothing."""
    if pairs < 1 or asking.seed < 0 or not 0 <= asking.tau < float("inf"):
        given = f"{pairs} pairs, seed {asking.seed}, tau {asking.tau}"
        raise StressError(f"{given}: give 1 pair or more, and neither seed nor tau below 0")


def tally_of(
    asking: Asking, name: str, family: Family, triangles: FloatArray, truth: BoolArray, verdict: ByteArray
) -> Tally:
    """Count what the verdicts (n,) on triangle pairs (n, 2, 3, 3) are worth beside the truth (n,)."""

    def within(wrong: BoolArray) -> BoolArray:
        # With a tolerance of 0 none is, not even a touch.
        some = wrong & family.metric & (asking.tau > 0)
        some[some] = triangle_margins(triangles[some])[1] <= asking.tau
        return some

    found = judged(verdict, truth * np.uint8(Verdict.CONTACT), is_undecided(verdict), within)
    counts: dict[str, Any] = {word: int(rows.sum()) for word, rows in found.items()}
    tally = Tally(name, "family", family.number, family.name, asking.seed, len(triangles), **counts)
    row = np.flatnonzero(found["missed"] | found["invented"] | found["refused"])
    return _written(tally, asking.out, row=row, triangles=triangles[row], truth=truth[row], verdict=verdict[row])


def tally_of_relation(
    asking: Asking, name: str, family: Family, relation: str, triangles: FloatArray, verdict: ByteArray
) -> Tally:
    """Count what changed between two verdicts (n, 2) on pairs and the same moved (n, 2, 2, 3, 3)."""
    refused = is_undecided(verdict).any(axis=1)
    volumes = (verdict == Verdict.CANDIDATE).any(axis=1)
    contact = counts_as_contact(verdict)
    flipped = (contact[:, 0] != contact[:, 1]) & ~refused & ~volumes
    counts: dict[str, Any] = {"changed": int(flipped.sum()), "refused": int(refused.sum())}
    tally = Tally(name, "relation", family.number, family.name, asking.seed, len(triangles), relation, **counts)
    both = triangles[flipped].reshape(-1, 2, 3, 3)
    row = np.repeat(np.flatnonzero(flipped), 2)
    truth = triangles_intersect(both)
    return _written(tally, asking.out, row=row, triangles=both, truth=truth, verdict=verdict[flipped].ravel())


def _written(tally: Tally, out: Path | None, **arrays: NDArray[Any]) -> Tally:
    """The tally with the file of its failing pairs, ``family-09-hybrid-seed-100.npz``, if there are any."""
    if out is None or not len(arrays["row"]):
        return tally
    words = [f"family-{tally.number:02d}", re.sub("[^a-z0-9]+", "-", tally.detector.lower()), f"seed-{tally.seed}"]
    target = out / f"{'-'.join([*words, tally.relation] if tally.relation else words)}.npz"
    values: dict[str, Any] = {
        "family": tally.number, "seed": tally.seed, "count": tally.asked, "detector": tally.detector,
        "relation": tally.relation,
    }  # fmt: skip
    with whole_file(target, OutputError, parents=True) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays, **values)
    return replace(tally, file=str(target))
