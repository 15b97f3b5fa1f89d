"""Which share of the face pairs that truly meet a detector listed, over the pair-frames in contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdcore.protocol import FaceSets
from replay.audit.outcome import Comparison, Outcome


@dataclass(frozen=True)
class FaceRecall:
    """Face pairs of the oracle, and how many of them the subject lists.

    Parameters
    ----------
    found, total : face pairs, summed over pair-frames.
    pair_frames : pair-frames with face pairs that both decided.
    invented : face pairs that only the subject lists, in these pair-frames.
    """

    found: int
    total: int
    pair_frames: int
    invented: int


def face_recall(subject: FaceSets, oracle: FaceSets, comparison: Comparison) -> FaceRecall:
    """Compare two lists of face pairs wherever the oracle has some and both decided; missed pair-frames count."""
    outcome = comparison.outcome
    decided = np.isin(outcome[oracle.frame, oracle.pair], [Outcome.BOTH, Outcome.MISSED])
    found = total = listed = 0
    for entry in np.flatnonzero(decided).tolist():
        truth = _keys(oracle.faces[oracle.start[entry] : oracle.stop[entry]])
        said = _keys(subject.at(int(oracle.frame[entry]), int(oracle.pair[entry])))
        found += len(np.intersect1d(truth, said, assume_unique=True))
        total += len(truth)
        listed += len(said)
    return FaceRecall(found, total, int(decided.sum()), listed - found)


def _keys(faces: NDArray[np.integer]) -> NDArray[np.int64]:
    """One number per face pair."""
    pairs = faces.astype(np.int64)
    return (pairs[:, 0] << 32) | pairs[:, 1]
