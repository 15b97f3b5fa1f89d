"""The figures of an audit as plain data: every share with its count, its whole and its interval."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from cdcore import Verdict
from replay.audit.face_recall import FaceRecall
from replay.audit.matching import EpisodeMatches
from replay.audit.misses import MISS_KINDS, NEVER_FOUND
from replay.audit.outcome import Outcome
from replay.audit.wilson import share
from replay.run_result import Measured

NOT_EXAMINED: Final = "not examined"
"""Said of contacts between frames where the oracle looks at instants only."""


def score(result: Measured, label: str) -> dict[str, Any]:
    """Everything counted about one audited detector."""
    comparison, missed = result.comparisons[label], result.misses[label]
    frames = {outcome.name: comparison.count(outcome) for outcome in Outcome}
    contact = frames[Outcome.BOTH.name] + frames[Outcome.MISSED.name]
    reported = frames[Outcome.BOTH.name] + frames[Outcome.INVENTED.name]
    unconfirmed = (result.detections[label].verdict == Verdict.CANDIDATE) & (comparison.outcome == Outcome.INVENTED)
    figures: dict[str, Any] = {
        "pair_frames": frames,
        "missed": share(frames[Outcome.MISSED.name], contact),
        "invented": share(frames[Outcome.INVENTED.name], reported),
        "between_frames": _between(result, label),
        "unconfirmed": int(unconfirmed.sum()),
        "contacts": len(result.episodes[result.oracle]),
        "contacts_missed": len({miss.episode for miss in missed if miss.kind == NEVER_FOUND}),
        "misses": len(missed),
        "by_kind": {kind: sum(miss.kind == kind for miss in missed) for kind in MISS_KINDS},
        "faces": _faces(result.face_recall.get(label)),
    }
    if label in result.causes:
        figures["causes"] = result.causes[label].table()
    if label in result.matches:
        figures["episodes"] = episode_figures(
            result.matches[label], len(result.episodes[result.oracle]), len(result.episodes[label])
        )
    return figures


def episode_figures(matches: EpisodeMatches, truth: int, found: int) -> dict[str, Any]:
    """Matched and unmatched contacts, and by how much the matched ones are off.

    Parameters
    ----------
    truth, found : contacts of the oracle and of the subject.
    """
    asked = truth - len(matches.excused_truth)
    return {
        "truth": truth,
        "found": found,
        "matched": len(matches.matched),
        "missed": len(matches.missed),
        "absorbed": len(matches.absorbed),
        "excused_truth": len(matches.excused_truth),
        "invented": len(matches.invented),
        "pieces": len(matches.pieces),
        "excused_found": len(matches.excused_found),
        "split": len(matches.split),
        "merged": len(matches.merged),
        "missed_share": share(len(matches.missed), asked),
        "invented_share": share(len(matches.invented), found - len(matches.excused_found)),
        "onset_error": _spread([match.onset_error for match in matches.matched]),
        "duration_error": _spread([match.duration_error for match in matches.matched]),
    }


def _between(result: Measured, label: str) -> int | str:
    """Pair-frames of contact that only the way between frames shows, if anybody looked there."""
    if "intervals" not in (result.detections[label].covers, result.detections[result.oracle].covers):
        return NOT_EXAMINED
    return result.comparisons[label].count(Outcome.BETWEEN_FRAMES)


def _faces(recall: FaceRecall | None) -> dict[str, Any] | None:
    if recall is None:
        return None
    return {"recall": share(recall.found, recall.total), "pair_frames": recall.pair_frames, "invented": recall.invented}


def _spread(errors: list[float]) -> dict[str, float] | None:
    """Seconds: the middle, and how far off the worst of 20 and the worst are; nothing matched: nothing to say."""
    if not errors:
        return None
    away = np.abs(errors)
    return {
        "mean": float(np.mean(errors)),
        "median": float(np.median(errors)),
        "p95_off": float(np.quantile(away, 0.95)),
        "most_off": float(away.max()),
    }
