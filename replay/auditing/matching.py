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
    reported: int
    overlap: int  # frames in common
    onset_error: float  # seconds by which the subject's begins late (negative: early)
    duration_error: float  # seconds by which the subject's is longer (negative: shorter)


@dataclass(frozen=True)
class EpisodeMatches:
    """The contacts of the oracle and of the subject, each in one class; all are numbers from 1."""

    matched: tuple[EpisodeMatch, ...] = ()  # one to one, in order of the oracle's contacts
    missed: tuple[int, ...] = ()  # contacts of the oracle that the subject never found
    false_contacts: tuple[int, ...] = ()  # contacts of the subject that overlap none of the oracle's
    split: tuple[int, ...] = ()  # contacts of the oracle that the subject reports as several
    merged: tuple[int, ...] = ()  # contacts of the subject that join several of the oracle's
    absorbed: tuple[int, ...] = ()  # contacts of the oracle that overlap only a merged one matched with another
    pieces: tuple[int, ...] = ()  # contacts of the subject that are further pieces of a split one
    # excused_truth, excused_found: unmatched and no error: undecided, within tolerance, or between frames
    excused_truth: tuple[int, ...] = ()
    excused_reports: tuple[int, ...] = ()
    # grasped_truth, grasped_reports: of a hand with what it holds, all the time; matched with nothing
    grasped_truth: tuple[int, ...] = ()
    grasped_reports: tuple[int, ...] = ()

    def status(self) -> dict[int, str]:
        """Number of a subject's contact -> ``matched``, ``piece``, ``invented``, ``excused`` or ``held``."""
        statuses = dict.fromkeys(self.pieces, "piece") | dict.fromkeys(self.false_contacts, "invented")
        statuses |= dict.fromkeys(self.excused_reports, "excused") | dict.fromkeys(self.grasped_reports, "held")
        return statuses | {match.reported: "matched" for match in self.matched}


def match_episodes(
    comparison: Comparison,
    reference_episodes: Sequence[Episode],
    subject_episodes: Sequence[Episode],
    counts: ContactCounts,
    most_gap_frames: int = 0,
) -> EpisodeMatches:
    """Match the contacts of a subject with those of the oracle.

    Parameters
    ----------
    comparison : the same two detections frame by frame; says which unmatched contacts are excused. reference_episodes,
    subject_episodes : episodes of the oracle and of the subject, in order. counts : what became of the oracle's
    contacts. most_frames_apart : frames after its last for which a subject's contact still speaks: 1 for instants
    beside intervals.
    """
    grasped_contacts, grasped_reports = (
        _grasped_contacts(comparison, episodes_of_side) for episodes_of_side in (reference_episodes, subject_episodes)
    )
    overlaps, matched_overlaps = _match_overlaps(
        reference_episodes, subject_episodes, most_gap_frames, grasped_contacts
    )
    of_truth, of_reported = (
        Counter(episode.truth for episode in overlaps),
        Counter(episode.reported for episode in overlaps),
    )
    matched_contacts, matched_reports = (
        {overlap.truth for overlap in matched_overlaps},
        {overlap.reported for overlap in matched_overlaps},
    )
    explained_numbers = of_reported.keys() | grasped_reports
    unexplained_reports = [
        (number, episode) for number, episode in enumerate(subject_episodes, 1) if number not in explained_numbers
    ]
    missed_numbers = counts.missed_numbers
    outcome = comparison.by_contact
    false_contacts = [
        number
        for number, episode in unexplained_reports
        if (outcome[episode.first : episode.last + 1, episode.pair] == Outcome.FALSE_CONTACT).any()
    ]
    return EpisodeMatches(
        matched=tuple(matched_overlaps),
        missed=tuple(missed_numbers),
        false_contacts=tuple(false_contacts),
        split=tuple(sorted(number for number, count in of_truth.items() if count > 1)),
        merged=tuple(sorted(number for number, count in of_reported.items() if count > 1)),
        absorbed=tuple(sorted(set(of_truth) - matched_contacts)),
        pieces=tuple(sorted(set(of_reported) - matched_reports)),
        excused_truth=tuple(
            sorted({*range(1, len(reference_episodes) + 1)} - set(of_truth) - set(missed_numbers) - grasped_contacts)
        ),
        excused_reports=tuple(sorted({number for number, _ in unexplained_reports} - set(false_contacts))),
        grasped_truth=tuple(sorted(grasped_contacts)),
        grasped_reports=tuple(sorted(grasped_reports)),
    )


def matching_numbers(episode: Sequence[Episode], other_episodes: Sequence[Episode]) -> list[tuple[int, int]]:
    """Numbers, from 1, of the episodes of two lists that belong together: one to one, by most frames in common."""
    return [(overlap.truth, overlap.reported) for overlap in _match_overlaps(episode, other_episodes, 0, set())[1]]


def _grasped_contacts(comparison: Comparison, episodes: Sequence[Episode]) -> set[int]:
    """Numbers of the contacts that are held in every frame."""
    outcome = comparison.by_contact
    outcomes = (
        (number, outcome[episode.first : episode.last + 1, episode.pair]) for number, episode in enumerate(episodes, 1)
    )
    return {number for number, outcomes_of in outcomes if (outcomes_of == Outcome.GRASPED).all()}


def _match_overlaps(
    reference_episodes: Sequence[Episode],
    subject_episodes: Sequence[Episode],
    most_gap_frames: int,
    grasped_numbers: set[int],
) -> tuple[list[EpisodeMatch], list[EpisodeMatch]]:
    """Overlaps but those of ``grasped_numbers`` contacts of the first list, and the best assignment in its order."""
    overlaps = [
        episode
        for episode in _overlaps(reference_episodes, subject_episodes, most_gap_frames)
        if episode.truth not in grasped_numbers
    ]
    return overlaps, sorted(_best_assignment(overlaps), key=lambda episode: episode.truth)


def _overlaps(
    reference_episodes: Sequence[Episode], subject_episodes: Sequence[Episode], most_gap_frames: int
) -> Iterator[EpisodeMatch]:
    """Overlaps, pair by pair in order of time."""
    reference_sorted, subject_sorted = (
        sorted(enumerate(episodes, 1), key=lambda entry: (entry[1].pair, entry[1].first))
        for episodes in (reference_episodes, subject_episodes)
    )
    i = j = 0
    while i < len(reference_sorted) and j < len(subject_sorted):
        (number, episode), (other_number, other) = reference_sorted[i], subject_sorted[j]
        first, last = max(episode.first, other.first), min(episode.last, other.last + most_gap_frames)
        shared_frames = last - first + 1 - episode.lost_within(first, last)
        if episode.pair == other.pair and shared_frames > 0:
            extra_seconds = (other.end - other.start) - (episode.end - episode.start)
            yield EpisodeMatch(number, other_number, shared_frames, other.start - episode.start, extra_seconds)
        # Between two episodes of a side is a frame, so nothing of the next one begins within the gap.
        if (episode.pair, episode.last) <= (other.pair, other.last):
            i += 1
        else:
            j += 1


def _best_assignment(overlaps: Sequence[EpisodeMatch]) -> list[EpisodeMatch]:
    """The overlaps of most frames in all that share no episode.

    An overlap is at odds only with the run of overlaps right before it that share one of its episodes.
    """
    most_frames, previous_indices = [0], [0]
    run = 0
    for k, episode in enumerate(overlaps):
        previous_overlap = overlaps[k - 1] if k else None
        if previous_overlap is None or not _overlap_same_episode(episode, previous_overlap):
            run = k
        elif k >= 2 and not _overlap_same_episode(episode, overlaps[k - 2]):
            run = k - 1
        previous_indices.append(run)
        most_frames.append(max(most_frames[k], episode.overlap + most_frames[run]))
    assignment, k = [], len(overlaps)
    while k:
        if most_frames[k] > most_frames[k - 1]:
            assignment.append(overlaps[k - 1])
            k = previous_indices[k]
        else:
            k -= 1
    return assignment


def _overlap_same_episode(episode: EpisodeMatch, other_match: EpisodeMatch) -> bool:
    return episode.truth == other_match.truth or episode.reported == other_match.reported
