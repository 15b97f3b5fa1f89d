"""The oracle's answer, and the figures of a detection beside it: counted as the audit counts them."""

from functools import cached_property
from typing import Any

import numpy as np

from cdcore import Detection
from cdcore.protocol import FaceSets
from replay.base.wilson import share
from replay.comparison.compare import compare, face_recall
from replay.comparison.contact_counts import count_contacts, count_reports
from replay.comparison.episodes import episodes
from replay.comparison.holding import holdings
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
        self.spec = spec
        self._trusted, self._motion = make_detector(spec, assembly, seed), assembly.motion
        self.truth = self._trusted.detect(assembly.motion)
        found = episodes(self.truth)
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

    def figures(self, detection: Detection, *, same_faces: bool = True) -> dict[str, Any]:
        """Pair-frames, contacts and, where they were listed, face pairs found, missed and invented, with intervals.

        Without ``same_faces`` the detection's meshes are not the oracle's, and faces are not compared.
        """
        judge = self._tolerance.judge(detection, self.truth)
        comparison = compare(detection, self.truth, within=judge, holdings=self._held)
        count = np.bincount(comparison.outcome.ravel(), minlength=len(Outcome))
        both, missed, invented = (int(count[word]) for word in (Outcome.BOTH, Outcome.MISSED, Outcome.INVENTED))
        whole = count_contacts(comparison, self.contacts)
        lost, false = whole.share(Outcome.MISSED), count_reports(comparison).share(Outcome.INVENTED)
        contacts = share(whole.missed, whole.contacts)
        return {
            "both": both, "missed_pair_frames": missed, "invented_pair_frames": invented,
            "within_tolerance": int(count[Outcome.WITHIN_TOLERANCE]), "left_out": int(count[Outcome.LEFT_OUT]),
            "recall": None if lost["share"] is None else both / (both + missed),
            "recall_low": 1 - lost["high"], "recall_high": 1 - lost["low"],
            "missed": lost["share"], "missed_low": lost["low"], "missed_high": lost["high"],
            "precision": None if false["share"] is None else both / (both + invented),
            "precision_low": 1 - false["high"], "precision_high": 1 - false["low"],
            "contacts": whole.contacts, "contacts_missed": whole.missed,
            "contacts_undecided": whole.undecided, "contact_frames_undecided": whole.frames_undecided,
            "contacts_missed_low": contacts["low"], "contacts_missed_high": contacts["high"],
            **self._of_faces(detection if same_faces else None, comparison),
        }  # fmt: skip

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
