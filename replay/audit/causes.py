"""Why each contact was missed: the first stage that lost it, found by deciding the missed frames again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection, Motion, Verdict
from cdcore.protocol import Explains, Explanation, counts_as_contact
from replay.audit.misses import Stretch
from replay.audit.outcome import Comparison, Outcome

LOOKS_PER_MISS: Final = 16
"""A longer miss is decided again in this many frames, evenly spread with both ends."""

LOOKS_IN_ALL: Final = 4000
"""Pair-frames decided again of one detector, some seconds of work; misses beyond one look each are *not examined*."""

LOOKS_AT_ONCE: Final = 1024
"""Looks whose faces are held together."""

TIMES_MORE: Final = 10
"""A budget *ran out* where ten times as much finds the contact."""


class Cause(StrEnum):
    """The stage that lost a contact."""

    TOLERANCE = "within tolerance"
    """Contact by less than tau: nobody's fault, and no miss."""
    BETWEEN_FRAMES = "between frames"
    """No instant shows it; only an oracle of intervals does."""
    BETWEEN_LOOKS = "between looks"
    """The detector did not look at that frame."""
    CLOCK = "clock"
    """Within what is not known of the detector's clock."""
    COLLIDER_SHAPE = "collider shape"
    """What stands in place of the meshes does not meet."""
    CONTAINMENT = "inside, not asked"
    """One body is inside the other, and the detector does not ask that."""
    SPHERE_STAGE = "sphere stage"
    """Volumes dismissed it before any triangle was asked."""
    SAMPLING = "sampling"
    """No pair of faces that meets is in the sample."""
    BUDGET = "budget ran out"
    """Ten times the budget finds it."""
    SEARCH = "search"
    """In the sample, not found."""
    UNEXPLAINED = "unexplained"
    """Nobody can say."""
    NOT_EXAMINED = "not examined"
    """There were too many misses to look at this one."""


@dataclass(frozen=True)
class Causes:
    """The causes of one detector's misses.

    Parameters
    ----------
    of_misses : one word per miss, that of most of its looks.
    pair_frames : cause -> pair-frames decided again that have it; *within tolerance* counts all there are.
    examined, missed : pair-frames decided again, and pair-frames missed.
    """

    of_misses: tuple[Cause, ...] = ()
    pair_frames: Mapping[Cause, int] | None = None
    examined: int = 0
    missed: int = 0

    def table(self) -> dict[str, Any]:
        """As plain data: every cause with its misses and pair-frames, zeros included."""
        misses, frames = Counter(self.of_misses), self.pair_frames or {}
        return {
            "misses": {cause.value: misses[cause] for cause in Cause},
            "pair_frames": {cause.value: frames.get(cause, 0) for cause in Cause},
            "examined": self.examined,
            "missed": self.missed,
        }


@dataclass(frozen=True, eq=False)
class Scene:
    """What the causes of one detector are looked for in.

    Parameters
    ----------
    motion : as it was detected.
    subject, oracle : the two answers.
    detector : the subject itself, which may explain.
    faces : an exact answer with faces for some frames.
    """

    motion: Motion
    subject: Detection
    oracle: Detection
    detector: object
    faces: Callable[[Motion], Detection]


def find_causes(places: Sequence[Stretch], comparison: Comparison, scene: Scene) -> Causes:
    """Decide the missed frames again and say of every miss why.

    Parameters
    ----------
    places : the misses, in order of time.
    comparison : the subject beside the oracle.
    """
    found: list[list[Cause]] = [[] for _ in places]
    for number, cause in _causes(places, scene):
        found[number].append(cause)
    frames = Counter(cause for causes in found for cause in causes)
    frames[Cause.TOLERANCE] += _contact_within_tolerance(comparison, scene.oracle)
    words = tuple(Counter(causes).most_common(1)[0][0] if causes else Cause.NOT_EXAMINED for causes in found)
    return Causes(words, dict(frames), sum(map(len, found)), comparison.count(Outcome.MISSED))


def first_failed(told: Explanation, verdict: int, *, at_instant: bool, asks_inside: bool = True) -> Cause:
    """The first stage that lost a contact.

    Parameters
    ----------
    told : what the detector says of its stages.
    verdict : its verdict there.
    at_instant : whether the contact shows at the frame itself.
    asks_inside : False where one body is inside the other and the detector refuses to say so.
    """
    no, yes = _saying(told, False), _saying(told, True)
    asked = (
        (not at_instant, Cause.BETWEEN_FRAMES),
        ("looked" in no, Cause.BETWEEN_LOOKS),
        ("within_clock" in yes, Cause.CLOCK),
        ("shapes_meet" in no, Cause.COLLIDER_SHAPE),
        (not asks_inside, Cause.CONTAINMENT),
        ("spheres_meet" in no, Cause.SPHERE_STAGE),
        ("sample_meets" in no, Cause.SAMPLING),
        ("found_with_more" in yes, Cause.BUDGET),
        ("sample_meets" in yes or verdict == Verdict.NOT_FOUND, Cause.SEARCH),
    )
    return next((cause for failed, cause in asked if failed), Cause.UNEXPLAINED)


def _saying(told: Explanation, answer: bool) -> set[str]:
    """The stages that answered so; a detector may answer with numpy's booleans."""
    return {name for name, value in vars(told).items() if value is not None and bool(value) is answer}


def _causes(places: Sequence[Stretch], scene: Scene) -> Iterator[tuple[int, Cause]]:
    """Number of a miss and the cause at one of its frames, for every look."""
    instants = scene.oracle.covers == "instants"
    for group in _groups(_looks(places)):
        frames = np.unique([frame for _, _, looked in group for frame in looked])
        truth = scene.faces(scene.motion.take(_with_before(frames, scene)))
        row = {frame: k for k, frame in enumerate(_with_before(frames, scene).tolist())}
        contact = counts_as_contact(truth.verdict)
        for number, pair, looked in group:
            for frame in looked:
                asked = (frame,) if instants else (frame, frame - 1)
                ends = [end for end in asked if end in row and contact[row[end], pair]]
                # An interval whose contact shows where it begins is explained there: at its end there is none to miss.
                at = ends[0] if ends else frame
                told = _told(scene, at, pair, truth.faces(row[at], pair))
                asks = int(truth.verdict[row[at], pair]) != Verdict.CONTAINED or _asks_inside(scene.subject, pair)
                verdict, at_instant = int(scene.subject.verdict[at, pair]), bool(ends) or instants
                yield number, first_failed(told, verdict, at_instant=at_instant, asks_inside=asks)


def _asks_inside(subject: Detection, pair: int) -> bool:
    return not (subject.containment and subject.containment[pair].startswith("refused"))


def _told(scene: Scene, frame: int, pair: int, faces: NDArray[np.int64]) -> Explanation:
    if isinstance(scene.detector, Explains):
        return scene.detector.explain(scene.motion, frame, pair, faces)
    return Explanation()


def _with_before(frames: NDArray[np.int64], scene: Scene) -> NDArray[np.int64]:
    """With an oracle of intervals, the frame at which each interval begins as well."""
    if scene.oracle.covers == "instants":
        return frames
    before: NDArray[np.int64] = np.unique(np.concatenate([frames, np.maximum(frames - 1, 0)]))
    return before


Look = tuple[int, int, list[int]]
"""Number of a miss, its pair, and frames."""


def _looks(places: Sequence[Stretch]) -> Iterator[Look]:
    most = min(LOOKS_PER_MISS, max(1, LOOKS_IN_ALL // max(1, len(places))))
    every = max(1, -(-len(places) // LOOKS_IN_ALL))
    for number, place in enumerate(places):
        if number % every == 0:
            count = min(most, place.last - place.first + 1)
            frames = np.linspace(place.first, place.last, count) if count > 1 else [(place.first + place.last) // 2]
            yield number, place.pair, np.unique(np.round(frames).astype(np.int64)).tolist()


def _groups(looks: Iterator[Look]) -> Iterator[list[Look]]:
    group: list[Look] = []
    size = 0
    for look in looks:
        if group and size + len(look[2]) > LOOKS_AT_ONCE:
            yield group
            group, size = [], 0
        group.append(look)
        size += len(look[2])
    if group:
        yield group


def _contact_within_tolerance(comparison: Comparison, oracle: Detection) -> int:
    rows, columns = np.nonzero(comparison.outcome == Outcome.WITHIN_TOLERANCE)
    return int(counts_as_contact(oracle.verdict[rows, columns]).sum())
