"""F8: a search over S sampled faces misses in two ways, told apart: no pair that meets is in the sample, or it is there
and is not found.

The poses are those about first touch that collide. Each draw of faces serves a part of them, so that no figure hangs on
one lucky sample.
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, log
from time import perf_counter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import create_detector
from cdcore.search.features import features_of
from cdcore.search.settings import SearchSettings
from replay.base.wilson import wilson
from replay.outputs.paper_table import Cell, PaperTable
from replay.studies.paper.colony import BUDGET, near_poses
from replay.studies.paper.contestants import SearchEngine
from replay.studies.paper.fixtures import FAMILY_NAMES

SIZES: Final[tuple[int | None, ...]] = (50, 100, 200, 400, 800, 1600, None)
"""Faces sampled of each mesh; ``None``: all."""
SEARCHERS: Final = ("random", "corrected", "memetic", "local")
DRAWS: Final = 4
LIMIT: Final = 20_000
"""Evaluations after which a search is given up."""
RATE: Final = 0.9
"""Detection rate that is to be reached."""
ALL: Final = "all"
EXPECTED: Final = "random, expected"
ENOUGH: Final = 20
"""Covered poses without which a share of nine in ten says nothing."""

Pace = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Family -> searcher -> faces sampled, as text -> seconds of an evaluation."""


@dataclass(frozen=True)
class Drawn:
    """Some poses of a family searched within one draw of every size."""

    family: str
    meeting: Mapping[int | None, list[int]]  # size -> how many pairs that meet are in the sample, a pose each
    chances: Mapping[int | None, list[float]]  # size -> of a random pair of the sample to meet; covered poses only
    # searcher and size -> evaluations until the first hit, ``None``: none within ``LIMIT``; covered poses only
    spent: Mapping[tuple[str, int | None], list[int | None]]
    # searcher and size -> seconds of an evaluation; ``None``: nothing was evaluated
    pace: Mapping[tuple[str, int | None], float | None]


def search_samples(family: str, draw: int, near: int, seed: int) -> Drawn:
    """Every ``DRAWS``-th colliding one of ``near`` poses, searched within samples of a draw of its own."""
    poses = near_poses(family, near, seed)
    chosen = range(draw, len(poses.colliding), DRAWS)
    frames = [poses.colliding.frames(k, k + 1) for k in chosen]
    exact = create_detector("exact", poses.bodies, containment=False)
    truth = [exact.detect(frame, faces=True).faces(0, 0) for frame in frames]
    features = [features_of(body.mesh) for body in poses.bodies]
    key = seed * DRAWS + draw
    meeting: dict[int | None, list[int]] = {}
    chances: dict[int | None, list[float]] = {}
    spent: dict[tuple[str, int | None], list[int | None]] = {}
    pace: dict[tuple[str, int | None], float | None] = {}
    for searcher in SEARCHERS:
        engine = SearchEngine(poses.bodies, features, SearchSettings(variant=searcher, seed=key))
        for size in SIZES:
            if size not in meeting:
                sampled = engine.sampled_faces(size, key)
                meeting[size] = [_meeting_within(sampled, true) for true in truth]
                pairs = len(sampled[0]) * len(sampled[1])
                chances[size] = [count / pairs for count in meeting[size] if count > 0]
            engine.sample(size, key)
            begin = perf_counter()
            hits = [engine.first_hit(frame, LIMIT) for frame, there in zip(frames, meeting[size], strict=True) if there]
            seconds, evaluations = perf_counter() - begin, sum(LIMIT if hit is None else hit for hit in hits)
            spent[searcher, size] = hits
            pace[searcher, size] = seconds / evaluations if evaluations else None
    return Drawn(family, meeting, chances, spent, pace)


def _meeting_within(sampled: Sequence[NDArray[np.int64]], pairs: NDArray[np.integer]) -> int:
    """How many face pairs (k, 2) have both their faces in the samples."""
    return int((np.isin(pairs[:, 0], sampled[0]) & np.isin(pairs[:, 1], sampled[1])).sum())


def pace_of(drawn: Sequence[Drawn]) -> Pace:
    """Seconds of an evaluation, the least of all draws: whatever else the machine did only adds."""
    shares: dict[str, dict[str, dict[str, float]]] = {}
    for family in FAMILY_NAMES:
        shares[family] = {searcher: {} for searcher in SEARCHERS}
        for searcher in SEARCHERS:
            for size in SIZES:
                found = [one.pace[searcher, size] for one in drawn if one.family == family]
                known = [seconds for seconds in found if seconds is not None]
                if known:
                    shares[family][searcher][_word(size)] = min(known)
    return shares


def least_evaluations(spent: Sequence[int | None], of: int) -> int | None:
    """The least budget within which ``RATE`` of ``of`` poses are detected; ``None``: ``LIMIT`` does not do."""
    found = sorted(one for one in spent if one is not None)
    wanted = ceil(RATE * of)
    return found[wanted - 1] if 0 < wanted <= len(found) else None


def expected_evaluations(chances: Sequence[float]) -> int | None:
    """The least number of random pairs that detects ``RATE`` of the poses on average.

    ``chances``: of a random pair to meet, a pose each; ``None`` is the answer to none, or one of 0.
    """
    if not len(chances) or min(chances) <= 0.0:
        return None
    # A chance of 1 would be the logarithm of 0; with this one pair detects all but 1e-12 of the poses.
    misses = np.log1p(-np.minimum(np.asarray(chances, dtype=np.float64), 1.0 - 1e-12))

    def detected(evaluations: int) -> float:
        return float(1.0 - np.exp(evaluations * misses).mean())

    most = 1
    while detected(most) < RATE:
        most *= 2
    return 1 + bisect_left(range(1, most), RATE, key=detected)


def feature_sample_tables(drawn: Sequence[Drawn], pace: Pace) -> list[PaperTable]:
    """F8: coverage, search, and how the work grows with the sample."""
    families = [_joined([one for one in drawn if one.family == family]) for family in FAMILY_NAMES]
    return [_coverage(families), _search(families, pace), _growth(families)]


def _joined(draws: Sequence[Drawn]) -> Drawn:
    """All draws of a family as one."""
    meeting = {size: [count for one in draws for count in one.meeting[size]] for size in SIZES}
    chances = {size: [chance for one in draws for chance in one.chances[size]] for size in SIZES}
    spent = {key: [hit for one in draws for hit in one.spent[key]] for key in draws[0].spent}
    return Drawn(draws[0].family, meeting, chances, spent, {})


def _coverage(families: Sequence[Drawn]) -> PaperTable:
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
    return PaperTable("F8 coverage", "Contacts of which a sample of faces holds no pair", head, tuple(rows), note)


def _search(families: Sequence[Drawn], pace: Pace) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for drawn in families:
        family = drawn.family
        for size, chances in drawn.chances.items():
            expected = expected_evaluations(chances) if len(chances) >= ENOUGH else None
            nothing = (None, None, None, None, None)
            rows.append((family, EXPECTED, _word(size), len(chances), *nothing, expected, None, None))
        for searcher in SEARCHERS:
            for size in SIZES:
                spent, of = drawn.spent[searcher, size], len(drawn.meeting[size])
                missed = sum(hit is None or hit > BUDGET for hit in spent)
                least = least_evaluations(spent, len(spent)) if len(spent) >= ENOUGH else None
                whole = least_evaluations(spent, of)
                rate = (missed / len(spent), *wilson(missed, len(spent))) if spent else (None, None, None)
                seconds = pace.get(family, {}).get(searcher, {}).get(_word(size))
                took = None if least is None or seconds is None else 1e3 * least * seconds
                found = (len(spent) - missed) / of
                rows.append((family, searcher, _word(size), len(spent), missed, *rate, found, least, took, whole))
    head = (
        "family", "search", "faces sampled", "poses covered", f"misses at {BUDGET:,}", "rate", "low", "high",
        "detected of all poses", f"evaluations to {RATE:g} of covered", f"ms to {RATE:g} of covered",
        f"evaluations to {RATE:g} of all",
    )  # fmt: skip
    note = (
        "Search misses: a pair that meets is in the sample and is not found. A dash: not reached within "
        f"{LIMIT:,} evaluations, or fewer than {ENOUGH} poses covered. Expected: computed from how many pairs "
        "meet. Milliseconds: evaluations times the calibrated time of one. Intervals: Wilson, 95 %."
    )
    return PaperTable("F8 search", "What a search within the sample misses and takes", head, tuple(rows), note)


def _growth(families: Sequence[Drawn]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for drawn in families:
        sizes = [size for size in SIZES if size is not None and len(drawn.chances[size]) >= ENOUGH]
        expected = {size: expected_evaluations(drawn.chances[size]) for size in sizes}
        rows.append((drawn.family, EXPECTED, *growth(expected)))
        for searcher in SEARCHERS:
            found = {size: drawn.spent[searcher, size] for size in sizes}
            least = {size: least_evaluations(spent, len(spent)) for size, spent in found.items()}
            rows.append((drawn.family, searcher, *growth(least)))
    head = ("family", "search", "from", "evaluations", "to", "evaluations there", "exponent")
    note = (
        f"Evaluations to {RATE:g} of the covered poses grow with the faces sampled to this power, by least squares of "
        f"the logarithms, over samples that cover {ENOUGH} poses or more."
    )
    return PaperTable("F8 growth", "How evaluations grow with the faces sampled", head, tuple(rows), note)


def growth(least: Mapping[int, int | None]) -> tuple[Cell, ...]:
    """Smallest size and its evaluations, largest and its, and the exponent; ``None`` of fewer than two sizes."""
    points = [(size, spent) for size, spent in sorted(least.items()) if spent is not None]
    if len(points) < 2:
        return None, None, None, None, None
    sizes, work = np.array([[log(size), log(spent)] for size, spent in points]).T
    away = sizes - sizes.mean()
    return (*points[0], *points[-1], float((away * work).sum() / (away * away).sum()))


def _word(size: int | None) -> str:
    return ALL if size is None else str(size)
