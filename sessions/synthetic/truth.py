"""The planted truth of a synthetic session; written and read again it is equal.

A truth file lies beside its session for those who check the tool. The tool itself never reads it.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import SessionError
from sessions.whole_files import whole_file

Interval = tuple[float, float]
Pair = tuple[str, str]
Level = Callable[[float], list[Interval]]
"""Metres -> intervals in which two surfaces are at most this far apart (negative: at least that deep)."""

TRUTH_FORMAT = "vrlab-truth/1"
CLEAR, PRESENT, OPEN = 0, 1, -1
"""Answers of `Truth.expected`: no contact, contact, within what the truth leaves open."""


@dataclass(frozen=True)
class PlantedEpisode:
    """One planted episode of a pair, in seconds after the session's first stamp, ends included.

    Parameters
    ----------
    pair : body names, sorted.
    kind : ``contact`` (surfaces meet) or ``contained`` (one wholly inside the other, surfaces apart).
    nominal : where the smooth, noise-free shapes have it; ``None`` for a near miss.
    surely : every frame in it has it, for any tessellation and noise; ``None`` when there is no such time.
    possibly : no frame outside it has it.
    note : for a reader.
    """

    pair: Pair
    kind: str
    nominal: Interval | None
    surely: Interval | None
    possibly: Interval
    note: str = ""


@dataclass(frozen=True)
class Fact:
    """Something planted that is no contact: a grasp, a pour, an end point.

    Parameters
    ----------
    kind : ``grasp``, ``release``, ``pour``, ``spill``, ``drop``, ``break``, ``end_point``, ``loss``, ...
    start, end : seconds after the session's first stamp.
    bodies : who took part.
    values : numbers and words, units in their names.
    """

    kind: str
    start: float
    end: float
    bodies: tuple[str, ...] = ()
    values: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Truth:
    """Everything planted in one session.

    Parameters
    ----------
    name, seed : how to make the session again.
    start_ns : stamp of the first frame; all times here are seconds after it.
    seconds : length of the session.
    noise : ``off`` or ``vive``.
    episodes : in any order; kept by pair, kind and time.
    facts : in any order; kept by time.
    """

    name: str
    seed: int
    start_ns: int
    seconds: float
    noise: str
    episodes: Sequence[PlantedEpisode]
    facts: Sequence[Fact] = ()

    def __post_init__(self) -> None:
        episodes = sorted(self.episodes, key=lambda episode: (episode.pair, episode.kind, episode.possibly))
        facts = sorted(self.facts, key=lambda fact: (fact.start, fact.kind, fact.bodies))
        object.__setattr__(self, "episodes", tuple(episodes))
        object.__setattr__(self, "facts", tuple(facts))

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Pairs that have an episode; every other pair never touches."""
        return tuple(sorted({episode.pair for episode in self.episodes}))

    def of(self, a: str, b: str, kind: str = "contact") -> tuple[PlantedEpisode, ...]:
        """Episodes of one pair, in either order of names."""
        pair = ordered_pair(a, b)
        return tuple(episode for episode in self.episodes if episode.pair == pair and episode.kind == kind)

    def seconds_of(self, stamps_ns: ArrayLike) -> NDArray[np.float64]:
        """Stamps (n,) in nanoseconds as seconds on the clock of this truth."""
        after = np.asarray(stamps_ns, dtype=np.int64) - np.int64(self.start_ns)
        return after.astype(np.float64) * 1e-9

    def expected(self, a: str, b: str, stamps_ns: ArrayLike, kind: str = "contact") -> NDArray[np.int8]:
        """For each stamp (n,): `PRESENT`, `CLEAR`, or `OPEN` where tessellation or noise may decide either way."""
        times = self.seconds_of(stamps_ns)
        answer = np.full(times.shape, CLEAR, dtype=np.int8)
        episodes = self.of(a, b, kind)
        spans = [(episode.possibly, OPEN) for episode in episodes]
        spans += [(episode.surely, PRESENT) for episode in episodes if episode.surely]
        losses = [fact for fact in self.facts if fact.kind == "loss" and {a, b} & set(fact.bodies)]
        spans += [((loss.start, loss.end), OPEN) for loss in losses]
        for span, value in spans:
            answer[inside(times, span)] = value
        return answer


def ordered_pair(a: str, b: str) -> Pair:
    """Two body names as a sorted pair."""
    return (a, b) if a <= b else (b, a)


def inside(times: NDArray[np.float64], span: Interval) -> NDArray[np.bool_]:
    """Mask of the times (n,) in a closed interval."""
    return (times >= span[0]) & (times <= span[1])


def truth_path(session_path: str | Path) -> Path:
    """The path of the truth of a session file: ``x.mcap`` -> ``x.truth.json``."""
    path = Path(session_path)
    return path.with_name(f"{path.stem}.truth.json")


def write_truth(truth: Truth, path: str | Path) -> None:
    """Write a truth as JSON: sorted keys, floats by their shortest exact form, so that equal truths are equal bytes."""
    text = json.dumps({"format": TRUTH_FORMAT, **asdict(truth)}, sort_keys=True, indent=1, allow_nan=False)
    with whole_file(Path(path), SessionError) as file:
        file.write(f"{text}\n".encode())


def levelled_episodes(
    pair: Pair, kind: str, level: Level, noise: float, tessellation: float, clock: tuple[float, float]
) -> list[PlantedEpisode]:
    """Episodes of a pair from its intervals at three levels.

    By ``noise`` metres rounding and noise may move the surfaces either way, by ``tessellation`` the meshes may be
    farther apart than the smooth shapes; ``clock``: how much later than it happened a pose is recorded, and the length
    of the session, in seconds.
    """
    near = noise + (tessellation if kind == "contained" else 0.0)
    deep = noise + (tessellation if kind == "contact" else 0.0)
    possibly, nominal, surely = (_shifted_intervals(level(height), clock) for height in (near, 0.0, -deep))
    episodes: list[PlantedEpisode] = []
    for outer in possibly:
        within = [span for span in nominal if outer[0] <= span[0] and span[1] <= outer[1]]
        if not within:
            episodes.append(PlantedEpisode(pair, kind, None, None, outer))
        for span in within:
            sure = next((inner for inner in surely if span[0] <= inner[0] and inner[1] <= span[1]), None)
            episodes.append(PlantedEpisode(pair, kind, span, sure, outer))
    return episodes


def _shifted_intervals(spans: list[Interval], clock: tuple[float, float]) -> list[Interval]:
    latency, seconds = clock
    late = [(start + latency if start > 0.0 else 0.0, min(end + latency, seconds)) for start, end in spans]
    return [span for span in late if span[0] <= seconds]
