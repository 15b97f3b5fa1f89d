"""Who is asked which faces meet."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from cdcore import Detection, Detector, Motion
from replay.detection.detector_spec import TRUSTED, DetectorSpec
from replay.detection.run_detector import Run, make_detector
from replay.prepare.assembly import Assembly


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
