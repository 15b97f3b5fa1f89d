import numpy as np
import pytest
from support.shapes import lab

from cdcore import FrameDetector, Verdict, create_detector, join
from cdcore.errors import InvalidPairError
from cdcore.protocol import Detector


class Near(FrameDetector):
    """Pairs whose origins are within 0.3 m, in two frames running."""

    def prepare(self):
        self.before = np.zeros(len(self.pairs), dtype=bool)

    def look(self, rotations, translations):
        away = np.linalg.norm(translations[self.pairs[:, 0]] - translations[self.pairs[:, 1]], axis=1)
        now, self.before = (away < 0.3) & self.before, away < 0.3
        return now


class Wrong(FrameDetector):
    def look(self, rotations, translations):
        return [True]


def made(kind, bodies):
    pairs = create_detector("sphere", bodies).pairs
    return kind(bodies, pairs)


def test_one_method_makes_a_whole_detector_named_after_its_class():
    bodies, motion = lab(40)
    detector = made(Near, bodies)
    assert isinstance(detector, Detector) and detector.name == "Near" and detector.online
    found = detector.detect(motion)
    assert found.verdict.shape == (40, 10) and found.seconds["look"].shape == (40,)
    known = motion.valid[:, found.pairs[:, 0]] & motion.valid[:, found.pairs[:, 1]]
    assert np.array_equal(found.verdict == Verdict.NO_POSE, ~known)
    assert Verdict.CONTACT in found.verdict


@pytest.mark.parametrize("block", [1, 7])
def test_blocks_give_the_answer_of_the_whole_and_asking_again_starts_anew(block):
    bodies, motion = lab(40)
    detector = made(Near, bodies)
    whole = detector.detect(motion)
    assert join(detector.stream(motion.blocks(block))).digest == whole.digest == detector.detect(motion).digest


def test_an_answer_of_another_shape_or_none_is_refused():
    bodies, motion = lab(3)
    with pytest.raises(InvalidPairError, match=r"one per pair: \(10,\)"):
        made(Wrong, bodies).detect(motion)
