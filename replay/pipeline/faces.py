"""Faces, beside the verdicts: which a detector finds of those that meet, and who is asked for those that do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from cdcore import Detection, Detector, Motion
from replay.base.progress import Progress
from replay.comparison.compare import FaceRecall, face_recall
from replay.comparison.outcome import Comparison, Episode
from replay.detection.detector_spec import TRUSTED, DetectorSpec
from replay.detection.run_detector import Run, face_sets_again, make_detector
from replay.prepare.assembly import Assembly

if TYPE_CHECKING:
    from cdcore.search.tracing import Watched


def recall_of_faces(
    comparisons: Mapping[str, Comparison], found: Mapping[str, tuple[Episode, ...]], runs: dict[str, Run],
    assembly: Assembly, progress: Progress,
) -> tuple[dict[str, FaceRecall], dict[str, Watched | None]]:  # fmt: skip
    """By label: face pairs found, and what a search did that had to be watched for them."""
    recalls, watched = dict[str, FaceRecall](), dict[str, "Watched | None"]()
    for label, comparison in comparisons.items():
        truth, said = runs[comparison.oracle].detection, None
        if truth.face_sets is not None and truth.covers == "instants":
            with progress.stage(f"Comparing faces of {label}", len(assembly.motion)) as advance:
                said, watched[label] = face_sets_again(runs[label], assembly, advance)
        if said and truth.face_sets:
            recalls[label] = face_recall(said, truth.face_sets, comparison, found[comparison.oracle])
    return recalls, watched


def face_source(assembly: Assembly, seed: int, oracle: Run | None) -> Callable[[Motion], Detection]:
    """The faces of some of the motion's frames by the most trusted detector of instants, made on first use.

    An oracle of intervals, of volumes or of a lower rate says that there is contact, but not in which faces at a frame;
    one that is that detector, and listed faces, has said it.
    """
    if oracle is not None and oracle.spec.name == TRUSTED and not oracle.spec.settings and oracle.detection.face_sets:
        known = oracle.detection
        return lambda motion: known.take(np.searchsorted(known.times, motion.times))

    @cache
    def trusted() -> Detector:
        return make_detector(DetectorSpec("faces", TRUSTED), assembly, seed)

    return lambda motion: trusted().detect(motion, faces=True)
