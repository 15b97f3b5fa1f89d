"""The oracle's answer, and the figures of a detection beside it: counted as the audit counts them."""

from functools import cached_property
from typing import Any

from cdcore import Detection
from cdcore.protocol import FaceSets
from replay.base.wilson import share, wilson
from replay.comparison.compare import compare, face_recall
from replay.comparison.contact_counts import count_contacts, count_reports
from replay.comparison.contact_duration import PHASES
from replay.comparison.episodes import episodes
from replay.comparison.holding import holdings
from replay.comparison.look_phases import OffsetCounts, offset_counts
from replay.comparison.outcome import Comparison, Outcome
from replay.comparison.tolerance import Tolerance
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.errors import TradeoffError
from replay.prepare.assembly import Assembly
from sessions import Session


class Scoring:
    """What an oracle found in a session, and figures of any other detection of it.

    Contacts of a hand with what it holds, as the ``session`` tells, are left out. A disagreement about less than
    ``tau`` metres is *within tolerance*. Raises ``TradeoffError``: the oracle finds no contact, so none can be missed.
    """

    def __init__(
        self, assembly: Assembly, spec: DetectorSpec, seed: int, tau: float, session: Session | None = None
    ) -> None:
        self.spec, self._assembly, self._seed = spec, assembly, seed
        self._trusted, self._motion = make_detector(spec, assembly, seed), assembly.motion
        self._seen: dict[str, Detection] = {}
        self.truth = self._trusted.detect(assembly.motion)
        found = episodes(self.truth, assembly.motion.valid)
        self._held = holdings(assembly, session, found)
        self.contacts = tuple(one for one in found if one not in set(self._held))
        if not self.contacts:
            raise TradeoffError(f"{spec.name} finds no contact in this session: nothing can be missed; take another")
        exact = make_detector(DetectorSpec("faces", "exact"), assembly, seed)
        self._tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), tau)

    @cached_property
    def _faces(self) -> FaceSets | None:
        """Every face pair that meets; ``None`` of an oracle that lists none at instants. Asked for once."""
        return None if self.truth.covers != "instants" else self._trusted.detect(self._motion, faces=True).face_sets

    def figures(
        self, detection: Detection, *, spec: DetectorSpec | None = None, other: Assembly | None = None
    ) -> dict[str, Any]:
        """Pair-frames, contacts and, where they were listed, face pairs found, missed and invented, with intervals.

        ``contacts_lost`` are missed whole or in part; where ``spec``, of the detector, has a step rate, in the mean
        over its phases. ``other``: what the detector saw where its meshes are not the oracle's; faces are not compared.
        """
        judge = self._tolerance.judge(detection, self.truth)
        comparison = compare(detection, self.truth, within=judge, holdings=self._held)
        count = comparison.counts
        both, missed, invented = (int(count[word]) for word in (Outcome.BOTH, Outcome.MISSED, Outcome.INVENTED))
        whole = count_contacts(comparison, self.contacts)
        frames, false = whole.share(Outcome.MISSED), count_reports(comparison).share(Outcome.INVENTED)
        contacts = share(whole.missed, whole.contacts)
        phases = None if spec is None else self._over_phases(spec, other or self._assembly)
        lost = float(whole.missed + whole.in_part)
        if phases is not None:
            lost = sum(one["mean"] for one in phases.spreads().values())
        ends = [end * whole.contacts for end in wilson(lost, whole.contacts)]
        return {
            "both": both, "missed_pair_frames": missed, "invented_pair_frames": invented,
            "within_tolerance": int(count[Outcome.WITHIN_TOLERANCE]), "left_out": int(count[Outcome.LEFT_OUT]),
            "recall": None if frames["share"] is None else both / (both + missed),
            "recall_low": 1 - frames["high"], "recall_high": 1 - frames["low"],
            "missed": frames["share"], "missed_low": frames["low"], "missed_high": frames["high"],
            "precision": None if false["share"] is None else both / (both + invented),
            "precision_low": 1 - false["high"], "precision_high": 1 - false["low"],
            "contacts": whole.contacts, "contacts_missed": whole.missed,
            "contacts_undecided": whole.undecided, "contact_frames_undecided": whole.frames_undecided,
            "contacts_missed_low": contacts["low"], "contacts_missed_high": contacts["high"],
            "contacts_lost": lost, "lost_low": ends[0], "lost_high": ends[1], "phases": 1 if phases is None else PHASES,
            **self._of_faces(detection if other is None else None, comparison),
        }  # fmt: skip

    def _over_phases(self, spec: DetectorSpec, assembly: Assembly) -> OffsetCounts | None:
        """What looks at the rate of a detector lose; ``None``: it has no rate, or intervals are at stake."""
        rate = spec.settings.get("rate_hz")
        if not rate or self.truth.covers != "instants":
            return None
        always = DetectorSpec("always", spec.name, {**spec.settings, "rate_hz": None})
        if (key := str(always)) not in self._seen:
            self._seen[key] = make_detector(always, assembly, self._seed).detect(self._motion)
        return offset_counts(float(rate), self._seen[key], self.truth, self.contacts, self._held, self._tolerance)

    def _of_faces(self, detection: Detection | None, comparison: Comparison) -> dict[str, Any]:
        """Face pairs of the oracle, how many of them were listed, and how many others."""
        listed = None if detection is None else detection.face_sets
        if listed is None or self._faces is None:
            return dict.fromkeys(("face_recall", "face_pairs", "face_pairs_listed", "face_pairs_invented"))
        found = face_recall(listed, self._faces, comparison, self.contacts)
        right, total = sum(found.found), sum(found.total)
        return {
            "face_recall": right / total if total else None, "face_pairs": total, "face_pairs_listed": right,
            "face_pairs_invented": found.invented,
        }  # fmt: skip
