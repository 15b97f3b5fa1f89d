"""Hysteresis of a detector: a contact that has begun lasts until its shapes are a release distance apart."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from cdcore import Detector, Verdict
from cdcore.detectors.detector_table import detector_row
from cdcore.numerics import BoolArray, ByteArray
from cdcore.protocol import counts_as_contact, is_one_of
from replay.detection.detector_spec import DetectorSpec
from replay.detection.recorded import RECORDED_DETECTOR

PARTED_VERDICTS: Final = (Verdict.CLEAR, Verdict.NOT_FOUND)
"""Verdicts of a sample that a release distance can turn into contact."""


@dataclass(frozen=True, eq=False)
class ReleaseBand:
    """The frames in which the shapes of each pair are at most the release distance apart, ``is_near`` (T, P)."""

    is_near: BoolArray

    def prolonged_verdicts(self, sample_verdict: ByteArray, sampled_frames: BoolArray) -> ByteArray:
        """Return the verdicts of L samples (L, P) with every contact prolonged to the release distance.

        ``sampled_frames`` (T,): the frames of these samples. A lost pose ends no contact.
        """
        contact = counts_as_contact(sample_verdict)
        pose_lost = sample_verdict == Verdict.NO_POSE
        are_parted = is_one_of(sample_verdict, PARTED_VERDICTS)
        has_ended = ~contact & ~pose_lost & ~(are_parted & self.is_near[sampled_frames])
        samples = np.arange(len(sample_verdict))[:, None]
        last_contact = np.maximum.accumulate(np.where(contact, samples, -1), axis=0)
        last_end = np.maximum.accumulate(np.where(has_ended, samples, -1), axis=0)
        is_prolonged = are_parted & (last_contact > last_end)
        return np.where(is_prolonged, np.uint8(Verdict.CONTACT), sample_verdict)


def shape_settings(detector: Detector) -> dict[str, Any]:
    """Return the settings of ``collider`` that put the shapes of a detector in place of the meshes."""
    settings: Mapping[str, Any] = asdict(detector.settings)
    if detector.name == RECORDED_DETECTOR:
        return {"shape": settings["shape"] or "shipped"}
    if not detector_row(detector.name).contact_offset:
        return {"shape": "mesh"}
    shape_settings = {key: settings[key] for key in ("shape", "pieces", "method", "cut") if settings.get(key)}
    return {"shape": "hull"} | shape_settings


def near_spec(detector: Detector, release_distance: float) -> DetectorSpec:
    """Return the detector that tells whether the shapes of a detector are at most a release distance apart."""
    return DetectorSpec("near", "collider", shape_settings(detector) | {"skin_m": 0.5 * release_distance})
