"""Episodes of two detections matched one to one, so that the frames they share are as many as can be.

Episodes of one pair in one detection do not overlap each other, so overlaps of two detections never cross: the best
assignment, the one that the Hungarian method finds, comes out of one pass over the overlaps in order of time.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from replay.auditing.contact_counts import ContactCounts
from replay.auditing.outcome import Comparison, Episode, Outcome


@dataclass(frozen=True, slots=True)
class EpisodeMatch:
    """One contact of the oracle and the contact of the subject that matches it."""

    # truth, found: their numbers, from 1 in order of time
    truth: int
    found: int
    overlap: int  # frames in common
    onset_error: float  # seconds by which the subject's begins late (negative: early)
    duration_error: float  # seconds by which the subject's is longer (negative: shorter)


@dataclass(frozen=True)
class EpisodeMatches:
    """The contacts of the oracle and of the subject, each in one class; all are numbers from 1."""

    matched: tuple[EpisodeMatch, ...] = ()  # one to one, in order of the oracle's contacts
    missed: tuple[int, ...] = ()  # contacts of the oracle that the subject never found
    invented: tuple[int, ...] = ()  # contacts of the subject that overlap none of the oracle's
    split: tuple[int, ...] = ()  # contacts of the oracle that the subject reports as several
    merged: tuple[int, ...] = ()  # contacts of the subject that join several of the oracle's
    absorbed: tuple[int, ...] = ()  # contacts of the oracle that overlap only a merged one matched with another
    pieces: tuple[int, ...] = ()  # contacts of the subject that are further pieces of a split one
    # excused_truth, excused_found: unmatched and no error: undecided, within tolerance, or between frames
    excused_truth: tuple[int, ...] = ()
    excused_found: tuple[int, ...] = ()
    # held_truth, held_found: of a hand with what it holds, all the time; matched with nothing
    held_truth: tuple[int, ...] = ()
    held_found: tuple[int, ...] = ()

    def status(self) -> dict[int, str]:
        """Number of a subject's contact -> ``matched``, ``piece``, ``invented``, ``excused`` or ``held``."""
        statuses = dict.fromkeys(self.pieces, "piece") | dict.fromkeys(self.invented, "invented")
        statuses |= dict.fromkeys(self.excused_found, "excused") | dict.fromkeys(self.held_found, "held")
        return statuses | {match.found: "matched" for match in self.matched}


def match_episodes(
    comparison: Comparison, truth: Sequence[Episode], found: Sequence[Episode], counts: ContactCounts, reach: int = 0
) -> EpisodeMatches:  # fmt: skip
    """Match the contacts of a subject with those of the oracle.

    Parameters
    ----------
    comparison : the same two detections frame by frame; says which unmatched contacts are excused.
    truth, found : episodes of the oracle and of the subject, in order.
    counts : what became of the oracle's contacts.
    reach : frames after its last for which a subject's contact still speaks: 1 for instants beside intervals.
    """
    held, held_found = (_held(comparison, some) for some in (truth, found))
    overlaps, chosen = _matched(truth, found, reach, held)
    of_truth, of_found = Counter(episode.truth for episode in overlaps), Counter(episode.found for episode in overlaps)
    taken, used = {episode.truth for episode in chosen}, {episode.found for episode in chosen}
    extra = [(number, episode) for number, episode in enumerate(found, 1) if number not in of_found.keys() | held_found]
    missed = counts.missed_numbers
    outcome = comparison.outcome
    invented = [
        number
        for number, episode in extra
        if (outcome[episode.first : episode.last + 1, episode.pair] == Outcome.INVENTED).any()
    ]
    return EpisodeMatches(
        matched=tuple(chosen), missed=tuple(missed),
        invented=tuple(invented), split=tuple(sorted(number for number, count in of_truth.items() if count > 1)),
        merged=tuple(sorted(number for number, count in of_found.items() if count > 1)),
        absorbed=tuple(sorted(set(of_truth) - taken)), pieces=tuple(sorted(set(of_found) - used)),
        excused_truth=tuple(sorted({*range(1, len(truth) + 1)} - set(of_truth) - set(missed) - held)),
        excused_found=tuple(sorted({number for number, _ in extra} - set(invented))),
        held_truth=tuple(sorted(held)), held_found=tuple(sorted(held_found)),
    )  # fmt: skip


def partners(episode: Sequence[Episode], other: Sequence[Episode]) -> list[tuple[int, int]]:
    """Numbers, from 1, of the episodes of two lists that belong together: one to one, by most frames in common."""
    return [(overlap.truth, overlap.found) for overlap in _matched(episode, other, 0, set())[1]]


def _held(comparison: Comparison, episodes: Sequence[Episode]) -> set[int]:
    """Numbers of the contacts that are held in every frame."""
    outcome = comparison.outcome
    outcomes = (
        (number, outcome[episode.first : episode.last + 1, episode.pair]) for number, episode in enumerate(episodes, 1)
    )
    return {number for number, outcomes_of in outcomes if (outcomes_of == Outcome.HELD).all()}


def _matched(
    truth: Sequence[Episode], found: Sequence[Episode], reach: int, held: set[int]
) -> tuple[list[EpisodeMatch], list[EpisodeMatch]]:
    """All overlaps but those of ``held`` contacts of the first list, and the best assignment in that list's order."""
    overlaps = [episode for episode in _overlaps(truth, found, reach) if episode.truth not in held]
    return overlaps, sorted(_best(overlaps), key=lambda episode: episode.truth)


def _overlaps(truth: Sequence[Episode], found: Sequence[Episode], reach: int) -> Iterator[EpisodeMatch]:
    """Overlaps, pair by pair in order of time."""
    left, right = (
        sorted(enumerate(episodes, 1), key=lambda entry: (entry[1].pair, entry[1].first)) for episodes in (truth, found)
    )
    i = j = 0
    while i < len(left) and j < len(right):
        (number, episode), (other_number, other) = left[i], right[j]
        first, last = max(episode.first, other.first), min(episode.last, other.last + reach)
        frames = last - first + 1 - episode.lost_within(first, last)
        if episode.pair == other.pair and frames > 0:
            longer = (other.end - other.start) - (episode.end - episode.start)
            yield EpisodeMatch(number, other_number, frames, other.start - episode.start, longer)
        if (episode.pair, episode.last) <= (other.pair, other.last + reach):
            i += 1
        else:
            j += 1


def _best(overlaps: Sequence[EpisodeMatch]) -> list[EpisodeMatch]:
    """The overlaps of most frames in all that share no episode.

    An overlap is at odds only with the run of overlaps right before it that share one of its episodes.
    """
    most, before = [0], [0]
    run = 0
    for k, episode in enumerate(overlaps):
        previous = overlaps[k - 1] if k else None
        if previous is None or not _share(episode, previous):
            run = k
        elif k >= 2 and not _share(episode, overlaps[k - 2]):
            run = k - 1
        before.append(run)
        most.append(max(most[k], episode.overlap + most[run]))
    chosen, k = [], len(overlaps)
    while k:
        if most[k] > most[k - 1]:
            chosen.append(overlaps[k - 1])
            k = before[k]
        else:
            k -= 1
    return chosen


def _share(episode: EpisodeMatch, other: EpisodeMatch) -> bool:
    return episode.truth == other.truth or episode.found == other.found
