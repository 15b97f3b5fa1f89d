"""The figures of an audit as plain data: every share with its count, its whole and its interval; and the faults.

Of misses and false contacts there are as many as the report has cards for; the tables of the run hold them all.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from cdcore import Detection, Verdict
from cdcore.protocol import INSIDE_UNDECIDED, is_undecided
from cdcore.protocol.reasons import NO_REASON
from replay.auditing.contact_counts import ContactCounts, count_reports, held_counts
from replay.auditing.fault import MISS_KINDS
from replay.auditing.look_phases import OffsetCounts, spread
from replay.auditing.matching import EpisodeMatches
from replay.auditing.noisy_contacts import HOLDS
from replay.auditing.outcome import Outcome, counts_by_pair
from replay.base.wilson import pooled, share, share_of_clusters
from replay.pipeline.run_result import RunResult

NOT_EXAMINED: Final = "not examined"
"""Stands for a count of contacts between frames where both detectors decide at instants only."""

OF_PAIR: Final = (Outcome.BOTH, Outcome.MISSED, Outcome.INVENTED, Outcome.WITHIN_TOLERANCE, Outcome.HELD)
"""Outcomes that are counted pair by pair."""

SPREADS: Final = ("onset_error", "duration_error", "end_error")
"""Errors of matched contacts do not add up from their middles; each session keeps its own."""


def score(result: RunResult, label: str) -> dict[str, Any]:
    """Everything counted about one audited detector."""
    comparison, missed, contacts = result.comparisons[label], result.misses[label], result.counts[label]
    frames = {outcome.name: comparison.count(outcome) for outcome in Outcome}
    truth = counts_by_pair(result.detections[result.oracle].verdict, len(Verdict)).sum(axis=0)
    false = result.false.get(label, ())
    # Column by column, here and below: a table of flags for hours of frames is as large as the verdicts.
    columns = zip(result.detections[label].verdict.T, comparison.outcome.T, strict=True)
    unconfirmed = sum(int(((one == Verdict.CANDIDATE) & (as_ == Outcome.INVENTED)).sum()) for one, as_ in columns)
    held_pairs = sorted({one.pair for one in result.holdings})
    figures: dict[str, Any] = {
        "pair_frames": frames, "missed": contacts.share(Outcome.MISSED),
        "invented": count_reports(comparison).share(Outcome.INVENTED), "undecided": undecided_share(result, label),
        "undecided_reasons": reasons_of(result.detections[label]),
        "undecided_alone": undecided_alone(result, label),
        "oracle_undecided": int(truth[[Verdict.UNRESOLVED, Verdict.INVALID]].sum()),
        "oracle_undecided_reasons": reasons_of(result.detections[result.oracle]),
        "oracle_inside_undecided": inside_undecided(result.detections[result.oracle]),
        "between_frames": _between(result, label),
        "unconfirmed": unconfirmed, "contacts": contacts.contacts,
        "contacts_cut": sum(one.cuts > 0 for one in result.loose),
        "contacts_missed": contacts.missed, "contacts_in_part": contacts.in_part,
        "contacts_undecided": contacts.undecided, "contact_frames_undecided": contacts.frames_undecided,
        "held": _held(result, label, held_pairs), "misses": len(missed),
        "by_kind": {kind: sum(miss.kind == kind for miss in missed) for kind in MISS_KINDS},
        "false_contacts": len(false), "false_causes": dict(Counter(one.cause for one in false)),
    }  # fmt: skip
    offsets = result.phases.get(label)
    figures |= _over_offsets(contacts, offsets)
    if result.noise is not None:
        holds = np.array([result.noise.words[number - 1] == HOLDS for number in contacts.numbers.tolist()], np.bool_)
        firm = contacts.only(holds)
        figures["holds"] = {
            "contacts": firm.contacts,
            "contacts_missed": firm.missed,
            "missed": firm.share(Outcome.MISSED),
            **_over_offsets(firm, None if offsets is None else offsets.only(holds)),
        }
    if label in result.causes:
        figures["causes"] = result.causes[label].table()
    if label in result.matches:
        matches = result.matches[label]
        counts = len(result.episodes[result.oracle]) - len(matches.held_truth), len(result.episodes[label])
        figures["episodes"] = episode_figures(matches, counts[0], counts[1] - len(matches.held_found))
    return figures


def _over_offsets(contacts: ContactCounts, offsets: OffsetCounts | None) -> dict[str, Any]:
    """Smallest, largest and mean counts over the sampling offsets; of a detector of no rate all are the same.

    Of a rate ``phases`` are the shares over all offsets.
    """
    if offsets is not None:
        return {"offsets": offsets.spreads(), "phases": dict(offsets.shares())}
    counts = {"contacts_missed": contacts.missed, "contacts_in_part": contacts.in_part}
    return {"offsets": {name: spread([count]) for name, count in counts.items()}}


def episode_figures(matches: EpisodeMatches, truth: int, found: int) -> dict[str, Any]:
    """Matched and unmatched contacts of ``truth`` by the oracle and ``found``, and the errors of the matched ones."""
    asked = truth - len(matches.excused_truth)
    return {
        "truth": truth, "found": found, "matched": len(matches.matched), "missed": len(matches.missed),
        "absorbed": len(matches.absorbed), "excused_truth": len(matches.excused_truth),
        "invented": len(matches.invented), "pieces": len(matches.pieces), "excused_found": len(matches.excused_found),
        "split": len(matches.split), "merged": len(matches.merged), "missed_share": share(len(matches.missed), asked),
        "invented_share": share(len(matches.invented), found - len(matches.excused_found)),
        "onset_error": _spread([match.onset_error for match in matches.matched]),
        "duration_error": _spread([match.duration_error for match in matches.matched]),
        "end_error": _spread([match.onset_error + match.duration_error for match in matches.matched]),
    }  # fmt: skip


def pair_figures(result: RunResult) -> list[dict[str, Any]]:
    """Of every pair its contacts by detector, in seconds, and what audited detectors made of it; of no contact nothing.

    Contacts of a hand with what it holds stand apart.
    """
    rows: list[dict[str, Any]] = [{} for _ in result.assembly.pairs]
    apart = set(result.holdings)
    for label, found in result.episodes.items():
        for one in found:
            kind = "held_contacts" if label == result.oracle and one in apart else "contacts"
            start = {"count": 0, "seconds": 0.0, "longest": 0.0, "cut": 0}
            own = rows[one.pair].setdefault(kind, {}).setdefault(label, start)
            length = one.end - one.start
            own |= {"count": own["count"] + 1, "seconds": own["seconds"] + length, "cut": own["cut"] + (one.cuts > 0)}
            own["longest"] = max(own["longest"], length)
    for label, comparison in result.comparisons.items():
        became = result.counts[label]
        for pair, row in enumerate(rows):
            counts = {outcome.name: int(comparison.by_pair[pair, outcome]) for outcome in OF_PAIR}
            if any(counts.values()) or result.oracle in (*row.get("contacts", ()), *row.get("held_contacts", ())):
                own = became.of_pair(pair)
                told = {"contacts_missed": own.missed, "contacts_in_part": own.in_part, "pair_frames": counts}
                if counts[Outcome.HELD.name]:
                    told["held"] = _held(result, label, [pair])
                row.setdefault("audit", {})[label] = told
    return rows


def _held(result: RunResult, label: str, pairs: Sequence[int]) -> dict[str, int]:
    """What a detector says of some pairs while a hand holds the body."""
    verdicts = result.detections[result.oracle].verdict, result.detections[label].verdict
    apart = tuple(set(result.episodes[result.oracle]) - set(result.loose))
    return held_counts(result.comparisons[label], verdicts, apart, pairs)


def _between(result: RunResult, label: str) -> int | str:
    """Pair-frames of contact that only the motion between frames shows, if a detector decides there."""
    if "intervals" not in (result.detections[label].covers, result.detections[result.oracle].covers):
        return NOT_EXAMINED
    return result.comparisons[label].count(Outcome.BETWEEN_FRAMES)


MOST_REASONS: Final = 3
"""Reasons why a detector did not decide that a summary lists, the most frequent first."""


def reasons_of(detection: Detection) -> dict[str, int]:
    """Why pair-frames are undecided, where the detector says so -> how many, the most frequent first."""
    return dict(_all_reasons(detection).most_common(MOST_REASONS))


def inside_undecided(detection: Detection) -> int:
    """Pair-frames that are undecided because nobody knows what is inside a mesh."""
    return sum(count for why, count in _all_reasons(detection).items() if why.startswith(INSIDE_UNDECIDED))


def _all_reasons(detection: Detection) -> Counter[str]:
    return Counter(why for why in detection.reasons.values() if why != NO_REASON)


def undecided_share(result: RunResult, label: str) -> dict[str, Any]:
    """Pair-frames with a pose in which one of the two did not decide: left out, though there was something to see.

    The interval is over pairs.
    """
    left, whole = [], []
    for verdict, outcome in zip(
        result.detections[result.oracle].verdict.T, result.comparisons[label].outcome.T, strict=True
    ):
        posed = verdict != Verdict.NO_POSE
        left.append(int((posed & (outcome == Outcome.LEFT_OUT)).sum()))
        whole.append(int(posed.sum()))
    return share_of_clusters(left, whole)


def undecided_alone(result: RunResult, label: str) -> int:
    """Pair-frames left out because this detector did not decide, where the reference did."""
    columns = zip(result.detections[result.oracle].verdict.T, result.comparisons[label].outcome.T, strict=True)
    return sum(int((~is_undecided(verdict) & (outcome == Outcome.LEFT_OUT)).sum()) for verdict, outcome in columns)


def _spread(errors: list[float]) -> dict[str, float] | None:
    """Seconds: mean and median error, and the absolute error of the 95th percentile and of the worst."""
    if not errors:
        return None
    away = np.abs(errors)
    return {
        "mean": float(np.mean(errors)), "median": float(np.median(errors)),
        "p95_off": float(np.quantile(away, 0.95)), "most_off": float(away.max()),
    }  # fmt: skip


def pool(audits: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Label -> figures, from the ``audit`` tables of several summaries; detectors in the order first met."""
    tables = list(audits)
    if len(tables) == 1:
        return dict(tables[0])
    pooled_tables = {}
    for label in dict.fromkeys(label for table in tables for label in table):
        parts = [table[label] for table in tables if label in table]
        if not all("phases" in part for part in parts):
            # A session of hours is sampled at its own offset alone: then there is no mean over all of them.
            parts = [{key: value for key, value in part.items() if key != "phases"} for part in parts]
        pooled_tables[label] = _sum(parts)
    return pooled_tables


def _sum(values: list[Any]) -> Any:
    """One value for several: shares from their counts, tables key by key, counts added, words joined."""
    there = [value for value in values if value is not None]
    if not there:
        return None
    if isinstance(there[0], Mapping):
        if "low" in there[0]:
            return pooled(there)
        keys = dict.fromkeys(key for value in there for key in value if key not in SPREADS)
        return {key: _sum([value.get(key) for value in there]) for key in keys}
    if isinstance(there[0], str):
        return there[0] if len(set(there)) == 1 else "; ".join(dict.fromkeys(there))
    return sum(there)


MOST_CARDS: Final = 1000
"""Misses of a detector with a card of their own, some 700 kB of page, and as many that no frame shows."""

LISTED: Final = 200
"""Moments of one detector of each kind at most in the picture: the longest cuts, the longest false contacts."""
