"""The protocol recognises a detector by its shape, and one that explains says where it looked."""

from __future__ import annotations

import numpy as np
from support.shapes import lab

from cdcore import create_detector
from cdcore.protocol import Detector, Explains, Explanation


class Stub:
    name, online, Settings = "stub", False, object

    @property
    def settings(self):
        return None

    def detect(self, motion, *, faces=False):
        return None

    def stream(self, motions, *, faces=False):
        return None


def test_a_class_that_inherits_nothing_is_a_detector_by_its_shape():
    assert isinstance(Stub(), Detector)


def test_a_class_without_the_methods_is_none(monkeypatch):
    assert not isinstance(object(), Detector)
    monkeypatch.delattr(Stub, "stream")
    assert not isinstance(Stub(), Detector)


NOTHING = np.zeros((0, 2), dtype=np.int64)


def test_a_detector_need_not_explain_and_says_nothing_of_stages_it_has_not():
    bodies, _ = lab(2)
    assert isinstance(create_detector("discrete", bodies), Explains)
    assert not isinstance(create_detector("exact", bodies), Explains)
    assert all(value is None for value in vars(Explanation()).values())


def test_a_detector_of_a_fixed_step_looked_exactly_where_its_answer_may_change():
    bodies, motion = lab(60)
    for name in ("discrete", "collider"):
        detector = create_detector(name, bodies, rate_hz=13.0)
        looked = [detector.explain(motion, frame, 0, NOTHING).looked for frame in range(60)]
        assert all(create_detector(name, bodies).explain(motion, frame, 0, NOTHING).looked for frame in range(60))
        assert False in looked and True in looked
        assert sum(looked) == detector.detect(motion).work["looks"]
        changes = np.flatnonzero((np.diff(detector.detect(motion).verdict.astype(int), axis=0) != 0).any(axis=1)) + 1
        known = motion.valid.all(axis=1)
        assert all(looked[frame] for frame in changes if known[frame] and known[frame - 1])
