"""The oracle's answer, and what a detection makes of its contacts: counted as the audit counts them."""

from typing import Any

from cdcore import Detection
from replay.advice.settings import Setting
from replay.auditing.contact_counts import ContactCounts, count_contacts, count_reports
from replay.auditing.episodes import column_runs
from replay.auditing.loss import loss
from replay.auditing.outcome import Comparison, Outcome
from replay.auditing.sampling_offsets import OFFSET_COUNT, OffsetCounts, count_spread, offset_counts
from replay.auditing.tolerance import Reference, Tolerance
from replay.auditing.wilson import Proportion, proportion
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.prepare.assembly import Assembly
from sessions import Session


def wrong_counts(
    counts_at_own_offset: ContactCounts, false_contacts: int | None, false: Proportion, offsets: OffsetCounts | None
) -> dict[str, Any]:
    """Errors of a detector, as columns.

    ``missed``, ``late`` (or cut short) and ``false_contacts`` are numbers of contacts: means over the sampling offsets,
    beside ``missed_smallest`` and ``missed_largest``, and so on; without ``offsets`` they are counted
    ``counts_at_own_offset``, and with ``false_contacts`` ``None``, not counted, there is no column of them.
    ``not_reported`` is the share of the contact time that is not reported, ``false`` the share of the reported time
    that is false, with ``false_low`` and ``false_high``; ``loss`` is that of ``replay.auditing.loss``.
    """
    if offsets is None:
        counts_of_error = {"missed": [counts_at_own_offset.missed], "late": [counts_at_own_offset.late_or_cut_short]}
        if false_contacts is not None:
            counts_of_error["false_contacts"] = [false_contacts]
        contacts_missed, time_missed = (
            proportion(counts_at_own_offset.missed, counts_at_own_offset.contacts),
            counts_at_own_offset.proportion(Outcome.MISSED),
        )
    else:
        missed, late_counts = (fault_counts.sum(axis=1).tolist() for fault_counts in offsets.faults.values())
        counts_of_error = {"missed": missed, "late": late_counts, "false_contacts": offsets.false_contacts.tolist()}
        proportions = offsets.proportions()
        contacts_missed, time_missed, false = (
            proportions[name] for name in ("contacts_missed", "missed", "false_contact")
        )
    row: dict[str, Any] = {
        "loss": loss(
            contacts_missed, time_missed, false, counts_at_own_offset.undecided / max(1, counts_at_own_offset.contacts)
        ),
        "not_reported": time_missed.value,
        "false": false.value,
        "false_low": false.lower,
        "false_high": false.upper,
    }
    for name, values in counts_of_error.items():
        spread_over_offsets = count_spread(values)
        row |= {
            name: spread_over_offsets["mean"],
            f"{name}_smallest": spread_over_offsets["smallest"],
            f"{name}_largest": spread_over_offsets["largest"],
        }
    return row


class Scoring:
    """Contacts of an oracle in a session, and scores of any other detection of it.

    Contacts of a hand with what it holds, as the ``session`` tells, are left out. A disagreement about less than
    ``tau`` metres is *within tolerance*. Where the oracle finds no contact none can be missed, and others may be false.
    """

    def __init__(
        self, assembly: Assembly, spec: DetectorSpec, seed: int, tau: float, session: Session | None = None
    ) -> None:
        self.spec, self._assembly, self._seed = spec, assembly, seed
        exact = make_detector(DetectorSpec("faces", "exact"), assembly, seed)
        tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), tau)
        reference_detection = make_detector(spec, assembly, seed).detect(assembly.motion)
        self.reference = Reference.of(reference_detection, assembly, session, tolerance)
        self.contacts = self.reference.contacts
        self._every_frame: dict[str, Detection] = {}

    def figures(self, detection: Detection, setting: Setting) -> dict[str, Any]:
        """Contacts missed, late or cut short, and false ones, and the share of false frames of those reported.

        A setting with a step rate is counted at 16 sampling offsets, another one once, as by ``wrong_counts``.
        """
        comparison, rate_hz = self.reference.compare(detection), setting.rate_hz
        if not rate_hz or self.reference.detection.covers != "instants":
            return self.figures_of(comparison)
        return self.figures_of(comparison, self._at_every_frame(setting), rate_hz)

    def figures_of(
        self, comparison: Comparison, every_frame_detection: Detection | None = None, rate_hz: float | None = None
    ) -> dict[str, Any]:
        """The same of a detection that is compared.

        ``every_frame_detection``: what it says at every frame, of one with a step rate.
        """
        contact_counts, offsets = count_contacts(comparison, self.contacts), None
        if every_frame_detection is not None and rate_hz:
            offsets = offset_counts(rate_hz, every_frame_detection, self.reference)
        false_contact_count = len(column_runs((comparison.outcome == Outcome.FALSE_CONTACT).T))
        return {
            "contacts": contact_counts.contacts,
            "offsets": 1 if offsets is None else OFFSET_COUNT,
            "contacts_undecided": contact_counts.undecided,
            "contact_frames_undecided": contact_counts.frames_undecided,
            **wrong_counts(
                contact_counts,
                false_contact_count,
                count_reports(comparison).proportion(Outcome.FALSE_CONTACT),
                offsets,
            ),
        }

    def _at_every_frame(self, setting: Setting) -> Detection:
        """The answer of a setting without its step rate, which every rate samples."""
        setting_without_rate = DetectorSpec("always", setting.detector, {**setting.settings, "rate_hz": None})
        key = str(setting_without_rate)
        if key not in self._every_frame:
            detector = make_detector(setting_without_rate, self._assembly, self._seed)
            self._every_frame[key] = detector.detect(self._assembly.motion)
        return self._every_frame[key]
