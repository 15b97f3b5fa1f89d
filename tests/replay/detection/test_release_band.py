"""A contact lasts while the shapes are within the release distance."""

from dataclasses import make_dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Verdict
from cdcore.detectors.detector_table import settings_of
from replay.detection.recorded import RECORDED_DETECTOR
from replay.detection.release_band import ReleaseBand, shape_settings

VERDICTS = {
    "c": Verdict.CONTACT, "-": Verdict.CLEAR, "n": Verdict.NOT_FOUND, "?": Verdict.NO_POSE, "u": Verdict.UNRESOLVED,
}  # fmt: skip


@pytest.mark.parametrize(
    ("samples", "near", "expected"),
    [
        ("c--", "yyy", "ccc"), ("c--", "yny", "c--"), ("--c", "yyy", "--c"), ("cn-", "yyy", "ccc"),
        ("c?-", "yyy", "c?c"), ("cu-", "yyy", "cu-"), ("-c-c", "yyyn", "-ccc"), ("---", "yyy", "---"),
    ],
    ids=["near", "parted", "not begun", "not found", "lost pose", "unresolved", "again", "no contact"],
)  # fmt: skip
def test_contact_lasts_while_samples_are_near(samples, near, expected):
    """A letter is a sample: c contact, - clear, n not found, ? no pose, u unresolved; y: within the release distance.

    After a contact samples that are clear or find nothing stay contact as long as the shapes are near.
    """
    verdict = np.array([[VERDICTS[letter]] for letter in samples], dtype=np.uint8)
    # Every second frame is sampled; the others, which must not count, have the opposite.
    is_near = np.repeat([letter == "y" for letter in near], 2)[:, None]
    is_sampled = np.arange(len(is_near)) % 2 == 0
    is_near[~is_sampled] = ~is_near[~is_sampled]
    prolonged = ReleaseBand(is_near).prolonged_verdicts(verdict, is_sampled)
    assert prolonged[:, 0].tolist() == [VERDICTS[letter] for letter in expected]


@pytest.mark.parametrize(
    ("name", "settings", "shape"),
    [
        (RECORDED_DETECTOR, {"shape": ""}, "shipped"),
        (RECORDED_DETECTOR, {"shape": "box"}, "box"),
        ("collider", {"shape": "box"}, "box"),
        ("collider", {}, "hull"),
        ("exact", {}, "mesh"),
    ],
)
def test_release_distance_is_measured_between_the_detectors_shapes(name, settings, shape):
    """``name``, ``settings``: of a detector; ``shape``: between which the distance is measured that releases a contact.

    "shipped" are the colliders that were recorded with the bodies: an engine's recorded reports are of these, where
    its settings name no shape.
    """
    is_recorded = name == RECORDED_DETECTOR
    values = make_dataclass("Reports", settings)(**settings) if is_recorded else settings_of(name, settings)
    assert shape_settings(SimpleNamespace(name=name, settings=values))["shape"] == shape
