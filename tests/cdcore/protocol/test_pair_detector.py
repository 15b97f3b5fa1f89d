"""A detector that counts its frames answers the same in blocks as at once, and refuses what is not its own."""

import numpy as np
import pytest
from support.shapes import lab

from cdcore import Verdict, create_detector, join
from cdcore.errors import InvalidPoseError
from cdcore.protocol import PairDetector


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


class Forgetful(Parity):
    """CLEAR where it is handed no memory."""

    _fresh_memory = PairDetector._fresh_memory

    def _run(self, motion, memory, faces):
        return self._told(motion, np.full(len(motion), Verdict.CLEAR if memory is None else Verdict.CONTACT), faces)


def made(kind):
    bodies, motion = lab(31)
    return kind(bodies, create_detector("sphere", bodies).pairs, "its settings"), motion


def test_it_keeps_what_it_was_made_of_and_signs_its_detections():
    detector, motion = made(Parity)
    found = detector.detect(motion)
    assert detector.settings == "its settings" and found.detector == "parity" and found.approximate
    assert found.names == tuple(body.name for body in detector.bodies) and found.times is motion.times
    assert found.containment == ("refused: it counts",) * len(detector.pairs) and found.work == {"faces": 0}
    assert detector.detect(motion, faces=True).work == {"faces": 1}


@pytest.mark.parametrize("block", [1, 4, 7, 31])
def test_memory_passes_from_block_to_block_and_starts_anew_with_every_call(block):
    detector, motion = made(Parity)
    whole = detector.detect(motion).verdict
    assert whole[:3, 0].tolist() == [Verdict.CLEAR, Verdict.NOT_FOUND, Verdict.CLEAR]
    for _ in range(2):
        assert np.array_equal(join(detector.stream(motion.blocks(block))).verdict, whole)


def test_a_detector_that_says_nothing_of_memory_is_handed_none():
    detector, motion = made(Forgetful)
    assert not detector.detect(motion).verdict.any() and not join(detector.stream(motion.blocks(7))).verdict.any()


@pytest.mark.parametrize("ask", [lambda d, m: d.detect(m), lambda d, m: list(d.stream([m]))])
def test_a_motion_of_other_bodies_is_refused_with_the_names(ask):
    detector, _ = made(Parity)
    _, motion = lab(3)
    fewer = type(motion)(motion.times, motion.translations[:, 1:], motion.rotations[:, 1:], motion.valid[:, 1:])
    with pytest.raises(InvalidPoseError, match="give one column for each of: "):
        ask(detector, fewer)


def test_blocks_out_of_order_are_refused():
    detector, motion = made(Parity)
    first, second = list(motion.blocks(16))
    with pytest.raises(InvalidPoseError, match="stream the blocks in order of time"):
        list(detector.stream([second, first]))
