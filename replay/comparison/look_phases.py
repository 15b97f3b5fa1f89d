"""What a detector of a fixed rate misses and invents in the mean over look phases: where its looks fall is chance."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cdcore import Detection, Verdict
from cdcore.detectors import DETECTORS, OPTIONAL
from cdcore.protocol import detect_live
from cdcore.protocol.blocks import HeldVerdicts, looks_of
from replay.base.constants import HELD_FRAMES
from replay.base.wilson import share_of_clusters
from replay.comparison.compare import compare
from replay.comparison.contact_counts import REPORTED, count_contacts
from replay.comparison.contact_duration import PHASES
from replay.comparison.episodes import column_runs
from replay.comparison.outcome import Episode, Outcome
from replay.comparison.tolerance import Tolerance
from replay.detection.run_detector import Run, make_detector
from replay.prepare.assembly import Assembly

Shares = Mapping[str, dict[str, Any]]
"""``contacts_missed``, ``contacts_in_part`` and ``invented``: counts over all phases, and their shares."""


def over_phases(
    runs: Mapping[str, Run], assembly: Assembly, oracle: Detection, contacts: Sequence[Episode],
    holdings: Sequence[Episode], tolerance: Tolerance, seed: int,
) -> tuple[dict[str, Shares], dict[str, float]]:  # fmt: skip
    """The shares over all phases of each run with a rate, and, where it was asked live, seconds a frame without one.

    Each is asked once more, about every frame, as it was in the run: so both times are alike. A detector that is none
    of our table, and a recording of more than an hour, keep the phase of the run.
    """
    shares, seconds, frames = dict[str, Shares](), dict[str, float](), len(assembly.motion)
    for label, run in runs.items():
        if run.settings.get("rate_hz") and run.spec.name in (*DETECTORS, *OPTIONAL) and frames <= HELD_FRAMES:
            often = replace(run.spec, settings={**run.spec.settings, "rate_hz": None})
            detector = make_detector(often, assembly, seed)
            every = detect_live(detector, assembly.motion) if run.live else detector.detect(assembly.motion)
            shares[label] = phase_shares(run.settings["rate_hz"], every, oracle, contacts, holdings, tolerance)
            if run.live:
                seconds[label] = sum(float(np.sum(stage)) for stage in every.seconds.values()) / frames
    return shares, seconds


def phase_shares(
    rate_hz: float, every: Detection, oracle: Detection, contacts: Sequence[Episode], holdings: Sequence[Episode],
    tolerance: Tolerance,
) -> Shares:  # fmt: skip
    """The shares over all phases of looks at a rate, each of which holds what they see of ``every`` frame.

    ``contacts`` are the oracle's that count.
    """
    looked = [looks_of(every.times - (k + 0.5) / PHASES / rate_hz, rate_hz)[0] for k in range(PHASES)]
    lost, part = np.zeros((2, len(contacts)), dtype=np.int64)
    said, false, known = np.zeros((3, *every.verdict.shape), dtype=np.uint8)
    for looks in looked:
        believed, _ = HeldVerdicts(len(every.pairs)).hold(every.verdict[looks], looks, every.verdict != Verdict.NO_POSE)
        subject = replace(every, verdict=believed)
        comparison = compare(subject, oracle, within=tolerance.judge(subject, oracle, known), holdings=holdings)
        outcome, counts = comparison.outcome, count_contacts(comparison, contacts).frames
        missed, found = counts[:, Outcome.MISSED] > 0, counts[:, Outcome.BOTH] > 0
        lost, part = lost + (missed & ~found), part + (missed & found)
        said += np.isin(outcome, REPORTED)
        false += outcome == Outcome.INVENTED
    runs, whole = column_runs((said > 0).T), [len(looked)] * len(contacts)
    sums = [[int(one[a : b + 1, pair].sum(dtype=np.int64)) for pair, a, b in runs.tolist()] for one in (false, said)]
    return {
        "contacts_missed": share_of_clusters(lost, whole), "contacts_in_part": share_of_clusters(part, whole),
        "invented": share_of_clusters(*sums),
    }  # fmt: skip
