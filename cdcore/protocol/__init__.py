"""The vocabulary that detectors share: bodies, motions, verdicts, detections."""

from cdcore.protocol.body import Body, Solids, ordered_by_name, resolve_pairs
from cdcore.protocol.detection import (
    DECIDED,
    INSIDE_UNDECIDED,
    NO_FACES,
    PARTLY_DECIDED,
    REFUSED,
    Detection,
    FaceSets,
    join,
)
from cdcore.protocol.detector import Detector, Explains, Explanation
from cdcore.protocol.live import REST, Live, detect_live, live_session, stream_live
from cdcore.protocol.motion import Motion, blocks_in_order, pair_has_pose
from cdcore.protocol.pair_detector import FrameDetector, PairDetector, contact_or_clear, own_failure, require_bodies
from cdcore.protocol.verdict import Verdict, counts_as_contact, is_one_of, is_undecided
from cdcore.protocol.zero_order_hold import LiveAtRate, ZeroOrderHold, is_sampled

__all__ = [
    "DECIDED",
    "INSIDE_UNDECIDED",
    "NO_FACES",
    "PARTLY_DECIDED",
    "REFUSED",
    "REST",
    "Body",
    "Detection",
    "Detector",
    "Explains",
    "Explanation",
    "FaceSets",
    "FrameDetector",
    "Live",
    "LiveAtRate",
    "Motion",
    "PairDetector",
    "Solids",
    "Verdict",
    "ZeroOrderHold",
    "blocks_in_order",
    "contact_or_clear",
    "counts_as_contact",
    "detect_live",
    "is_one_of",
    "is_sampled",
    "is_undecided",
    "join",
    "live_session",
    "ordered_by_name",
    "own_failure",
    "pair_has_pose",
    "require_bodies",
    "resolve_pairs",
    "stream_live",
]
