"""The protocol is a shape; who answers a frame or a pair becomes a detector that keeps the rest of its contract."""

import numpy as np
import pytest
from support.shapes import lab

from cdcore import Verdict, create_detector, join
from cdcore.errors import InvalidPoseError
from cdcore.protocol import Detector, Explains, Explanation, PairDetector


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


def test_a_detector_need_not_explain_and_says_nothing_of_stages_it_has_not():
    bodies, _ = lab(2)
    assert isinstance(create_detector("discrete", bodies), Explains)
    assert not isinstance(create_detector("exact", bodies), Explains)
    assert all(value is None for value in vars(Explanation()).values())


class Parity(PairDetector[str]):
    """CLEAR in frames with an even number, NOT_FOUND in the others, counted over all blocks."""

    name = "parity"

    def _fresh_memory(self):
        return {"frames": 0}

    def _run(self, motion, memory, faces):
        number = memory["frames"] + np.arange(len(motion))
        memory["frames"] += len(motion)
        return self._told(motion, np.where(number % 2, Verdict.NOT_FOUND, Verdict.CLEAR), faces)

    def _told(self, motion, words, faces):
        verdict = np.repeat(words.astype(np.uint8)[:, None], len(self.pairs), axis=1)
        why = ["refused: it counts"] * len(self.pairs)
        return self._detection(
            motion, verdict, containment=why, work={"faces": int(faces)}, seconds={}, approximate=True
        )


def made_pair_detector(kind):
    bodies, motion = lab(31)
    return kind(bodies, create_detector("sphere", bodies).pairs, "its settings"), motion


@pytest.mark.parametrize("block", [1, 4, 7, 31])
def test_memory_passes_from_block_to_block_and_starts_anew_with_every_call(block):
    detector, motion = made_pair_detector(Parity)
    whole = detector.detect(motion).verdict
    assert whole[:3, 0].tolist() == [Verdict.CLEAR, Verdict.NOT_FOUND, Verdict.CLEAR]
    for _ in range(2):
        assert np.array_equal(join(detector.stream(motion.blocks(block))).verdict, whole)


@pytest.mark.parametrize("ask", [lambda d, m: d.detect(m), lambda d, m: list(d.stream([m]))])
def test_a_motion_of_other_bodies_is_refused_with_the_names(ask):
    detector, _ = made_pair_detector(Parity)
    _, motion = lab(3)
    fewer = type(motion)(motion.times, motion.translations[:, 1:], motion.rotations[:, 1:], motion.valid[:, 1:])
    with pytest.raises(InvalidPoseError, match="give one column for each of: "):
        ask(detector, fewer)
