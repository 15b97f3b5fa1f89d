"""Compares two detections of the same frames and pairs: every pair-frame gets exactly one outcome."""

from collections.abc import Callable, Sequence
from typing import Final, TypeAlias

import numpy as np

from cdcore import Detection
from cdcore.numerics import BoolArray, ByteArray, IntArray, true_indices
from cdcore.protocol import counts_as_contact, is_one_of, is_undecided
from replay.auditing.outcome import Comparison, Episode, Outcome
from replay.errors import AuditError

VERDICT_FRAMES: Final = 16384
"""Frames whose verdicts are processed together: some 9 MB for 66 pairs as numpy counts, however long the session."""

ToleranceCheck: TypeAlias = Callable[[IntArray, IntArray], BoolArray]
"""What says of K pair-frames, by their frames (K,) and columns (K,), which are within tolerance, (K,)."""


def compare(
    subject: Detection,
    oracle: Detection,
    labels: tuple[str, str] | None = None,
    within: ToleranceCheck | None = None,
    holdings: Sequence[Episode] = (),
) -> Comparison:
    """Give every pair-frame an outcome: the subject's verdict beside the oracle's.

    A detector of instants decides the pose at frame t, one of intervals the whole path from t-1 to t. So against an
    oracle of instants, what an interval detector finds beyond it is *between frames*; and against an oracle of
    intervals, a contact counts as found when the subject reports it at either end.

    Parameters
    ----------
    subject, oracle : detections of the same frames and pairs.
    labels : what the run calls them; ``None``: the detectors' names.
    within : which pair-frames have a deepest penetration or least clearance of at most tau; there they may disagree.
        Asked only of those missed or invented.
    holdings : stretches in which a pair is a hand and what it holds: their contacts are set apart.

    Raises ``AuditError``: their frames or pairs differ.
    """
    _require_same(subject, oracle)
    outcome = np.empty(oracle.verdict.shape, dtype=np.uint8)
    for start in range(0, len(outcome), VERDICT_FRAMES):
        block_rows = slice(start, start + VERDICT_FRAMES)
        outcome[block_rows] = _outcome(subject, oracle, block_rows, holdings)
        if within is not None:
            _excuse_within_tolerance(outcome[block_rows], start, within)
    outcome.setflags(write=False)
    compared_labels = labels or (subject.detector, oracle.detector)
    return Comparison(compared_labels[0], compared_labels[1], outcome)


def _excuse_within_tolerance(outcome: ByteArray, start: int, is_within_tolerance: ToleranceCheck) -> None:
    """Find the ill-posed among the missed and invented of a block that begins at frame ``start``."""
    disagreeing_frames, disagreeing_columns = true_indices(is_one_of(outcome, (Outcome.MISSED, Outcome.FALSE_CONTACT)))
    if len(disagreeing_frames):
        is_ill_posed = is_within_tolerance(disagreeing_frames + start, disagreeing_columns)
        outcome[disagreeing_frames[is_ill_posed], disagreeing_columns[is_ill_posed]] = Outcome.WITHIN_TOLERANCE


def _outcome(subject: Detection, oracle: Detection, rows: slice, holdings: Sequence[Episode]) -> ByteArray:
    subject_contact, reference_contact = (
        counts_as_contact(subject.verdict[rows]),
        counts_as_contact(oracle.verdict[rows]),
    )
    confirmed_contact, covers = subject_contact, (subject.covers, oracle.covers)
    if covers == ("instants", "intervals"):
        # An interval is found when a contact is reported at either of its ends.
        confirmed_contact = subject_contact.copy()
        confirmed_contact[1:] |= subject_contact[:-1]
        if rows.start:
            confirmed_contact[0] |= counts_as_contact(subject.verdict[rows.start - 1])
    outcome = np.full(reference_contact.shape, Outcome.NEITHER, dtype=np.uint8)
    outcome[reference_contact & confirmed_contact] = Outcome.BOTH
    outcome[reference_contact & ~confirmed_contact] = Outcome.MISSED
    outcome[subject_contact & ~reference_contact] = (
        Outcome.BETWEEN_FRAMES if covers == ("intervals", "instants") else Outcome.FALSE_CONTACT
    )
    is_undecided_frame = is_undecided(subject.verdict[rows]) | is_undecided(oracle.verdict[rows])
    # An interval found at its first end stays found, whatever the subject says at its second.
    outcome[is_undecided_frame & ~(reference_contact & confirmed_contact)] = Outcome.LEFT_OUT
    is_decided_by_reference = ~is_undecided(oracle.verdict[rows])
    for holding in holdings:
        block = slice(max(holding.first - rows.start, 0), max(holding.last + 1 - rows.start, 0)), holding.pair
        outcome[block][(reference_contact[block] | subject_contact[block]) & is_decided_by_reference[block]] = (
            Outcome.GRASPED
        )
    return outcome


def _require_same(subject: Detection, oracle: Detection) -> None:
    if not np.array_equal(subject.times, oracle.times):
        raise AuditError(
            f"{subject.detector} and {oracle.detector} cover different frames ({len(subject.times)} and "
            f"{len(oracle.times)}); run both on one motion"
        )
    if not np.array_equal(subject.pairs, oracle.pairs):
        raise AuditError(f"{subject.detector} and {oracle.detector} cover different pairs; give both the same pairs")
