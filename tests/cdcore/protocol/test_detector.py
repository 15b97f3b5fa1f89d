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


def made_pair_detector(kind):
    bodies, motion = lab(31)
    return kind(bodies, create_detector("sphere", bodies).pairs, "its settings"), motion


def test_it_keeps_what_it_was_made_of_and_signs_its_detections():
    detector, motion = made_pair_detector(Parity)
    found = detector.detect(motion)
    assert detector.settings == "its settings" and found.detector == "parity" and found.approximate
    assert found.names == tuple(body.name for body in detector.bodies) and found.times is motion.times
    assert found.containment == ("refused: it counts",) * len(detector.pairs) and found.work == {"faces": 0}
    assert detector.detect(motion, faces=True).work == {"faces": 1}


@pytest.mark.parametrize("block", [1, 4, 7, 31])
def test_memory_passes_from_block_to_block_and_starts_anew_with_every_call(block):
    detector, motion = made_pair_detector(Parity)
    whole = detector.detect(motion).verdict
    assert whole[:3, 0].tolist() == [Verdict.CLEAR, Verdict.NOT_FOUND, Verdict.CLEAR]
    for _ in range(2):
        assert np.array_equal(join(detector.stream(motion.blocks(block))).verdict, whole)


def test_a_detector_that_says_nothing_of_memory_is_handed_none():
    detector, motion = made_pair_detector(Forgetful)
    assert not detector.detect(motion).verdict.any() and not join(detector.stream(motion.blocks(7))).verdict.any()


@pytest.mark.parametrize("ask", [lambda d, m: d.detect(m), lambda d, m: list(d.stream([m]))])
def test_a_motion_of_other_bodies_is_refused_with_the_names(ask):
    detector, _ = made_pair_detector(Parity)
    _, motion = lab(3)
    fewer = type(motion)(motion.times, motion.translations[:, 1:], motion.rotations[:, 1:], motion.valid[:, 1:])
    with pytest.raises(InvalidPoseError, match="give one column for each of: "):
        ask(detector, fewer)


def test_blocks_out_of_order_are_refused():
    detector, motion = made_pair_detector(Parity)
    first, second = list(motion.blocks(16))
    with pytest.raises(InvalidPoseError, match="stream the blocks in order of time"):
        list(detector.stream([second, first]))
