from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from support.shapes import lab_bodies_and_motion

from cdcore import FrameDetector, Verdict, create_detector, join
from cdcore.errors import InvalidPairError, OwnDetectorError
from cdcore.protocol import Detector, detect_live, stream_live


class Near(FrameDetector):
    """Contact of pairs whose origins are within 0.3 m, in this frame and in the one before."""

    def prepare(self):
        self.before = np.zeros(len(self.pairs), dtype=bool)

    def look(self, rotations, translations):
        distance = np.linalg.norm(translations[self.pairs[:, 0]] - translations[self.pairs[:, 1]], axis=1)
        now, self.before = (distance < 0.3) & self.before, distance < 0.3
        return now


class SingleAnswer(FrameDetector):
    """One verdict, however many pairs there are."""

    def look(self, rotations, translations):
        return [True]


def detector_of_kind(kind, bodies):
    """A detector of a class of one's own, over all pairs of bodies."""
    pairs = create_detector("sphere", bodies).pairs
    return kind(bodies, pairs)


def test_single_method_makes_a_detector_named_after_its_class():
    """``Near`` defines ``look``, asked once a frame: 40 frames and the 5 * 4 / 2 = 10 pairs of five bodies.

    A pair without a pose is NO_POSE and nothing else is.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    detector = detector_of_kind(Near, bodies)
    assert isinstance(detector, Detector)
    assert detector.name == "Near"
    assert detector.online
    detection = detector.detect(motion)
    assert detection.verdict.shape == (40, 10)
    assert detection.seconds["look"].shape == (40,)
    first, second = detection.pairs.T
    has_pose = motion.valid[:, first] & motion.valid[:, second]
    assert np.array_equal(detection.verdict == Verdict.NO_POSE, ~has_pose)
    assert Verdict.CONTACT in detection.verdict


@pytest.mark.parametrize("block", [1, 7], ids="blocks of {}".format)
def test_frame_detector_in_blocks_or_rerun_gives_equal_digests(block):
    """``Near`` has a state, where pairs were in the last frame: it goes on from block to block, and begins anew with
    each run.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    detector = detector_of_kind(Near, bodies)
    first_run = detector.detect(motion)
    assert join(detector.stream(motion.blocks(block))).digest == first_run.digest
    assert detector.detect(motion).digest == first_run.digest


@pytest.mark.parametrize("block", [7, 40], ids="blocks of {}".format)
def test_live_session_keeps_its_state_between_blocks(block):
    """``Near`` needs the frame before; one live session answers all 40 frames, one by one, block after block."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    detector = detector_of_kind(Near, bodies)
    live = join(stream_live(detector, motion.blocks(block)))
    assert live.digest == detector.detect(motion).digest
    assert live.work == {"looks": 40}


class WithoutLive:
    """No base class and no method ``live``: only what the protocol requires; answers as another detector."""

    name, online, Settings, settings = "plain", True, object, None

    def __init__(self, inner):
        self.detect, self.stream = inner.detect, inner.stream


def test_live_detection_falls_back_to_streaming_single_frames():
    """A detector has no ``live``: each of 40 frames is streamed by itself, in stages that take no
    longer than the call.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    inner = detector_of_kind(Near, bodies)
    start = perf_counter()
    detection = detect_live(WithoutLive(inner), motion)
    elapsed = perf_counter() - start
    assert detection.digest == inner.detect(motion).digest
    assert detection.work["looks"] == 40
    assert detection.seconds["rest"].shape == (40,)
    assert sum(seconds.sum() for seconds in detection.seconds.values()) <= elapsed


def test_answer_must_have_one_verdict_per_pair():
    """Five bodies are 10 pairs, and the detector gives a single verdict a frame."""
    bodies, motion = lab_bodies_and_motion(frames=3)
    with pytest.raises(InvalidPairError, match=r"one per pair: \(10,\)"):
        detector_of_kind(SingleAnswer, bodies).detect(motion)


def detector_that_answers(answer):
    """A detector, called Says, that gives this answer in every frame; and a motion of its five bodies, ten pairs."""

    class Says(FrameDetector):
        def look(self, rotations, translations):
            return answer

    bodies, motion = lab_bodies_and_motion(frames=3)
    return detector_of_kind(Says, bodies), motion


@pytest.mark.parametrize(
    "answer",
    [
        pytest.param([True] * 10, id="list of bools"),
        pytest.param(np.ones(10, dtype=bool), id="array of bools"),
        pytest.param(np.full(10, Verdict.CONTACT, dtype=np.uint8), id="array of verdicts"),
        pytest.param([Verdict.CONTACT] * 10, id="list of verdicts"),
        pytest.param((Verdict.CONTACT,) * 10, id="tuple of verdicts"),
    ],
)
def test_bools_and_verdicts_are_answers(answer):
    """A detector says contact of all ten pairs in every frame; pairs without a pose are NO_POSE all the same."""
    detector, motion = detector_that_answers(answer)
    verdict = detector.detect(motion).verdict
    assert set(verdict.ravel().tolist()) == {Verdict.CONTACT, Verdict.NO_POSE}


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        pytest.param([5] * 10, "int64", id="list of integers"),
        pytest.param(np.full(10, 5), "int64", id="array of integers"),
        pytest.param([0.3] * 10, "float64", id="distances"),
        pytest.param([float("nan")] * 10, "float64", id="nan"),
        pytest.param(["yes"] * 10, "<U3", id="texts"),
        pytest.param([None] * 10, "object", id="None"),
        pytest.param([True, Verdict.CONTACT] * 5, "int64", id="bools and verdicts mixed"),
        pytest.param(
            np.full(10, 9, dtype=np.uint8), "uint8 with the value 9, which is no Verdict", id="bytes above all verdicts"
        ),
    ],
)
def test_counts_distances_and_other_numbers_are_refused_with_their_dtype(answer, text):
    """A detector of ten pairs gives ten values that are neither bools nor verdicts; ``text``: how they are called."""
    detector, motion = detector_that_answers(answer)
    with pytest.raises(OwnDetectorError, match=rf"Says.look answered with {text}; answer with bools"):
        detector.detect(motion)


class Breaks(FrameDetector):
    """Fails in its fifth frame, number 4, within a library that it calls."""

    def prepare(self):
        self.frames = 0

    def look(self, rotations, translations):
        self.frames += 1
        if self.frames == 5:
            np.linalg.inv(np.zeros((2, 2)))  # the line to name
        return [False] * len(self.pairs)


@pytest.mark.parametrize("block", [2, 40], ids="blocks of {}".format)
def test_an_exception_names_class_frame_file_and_line(block):
    """``Breaks`` inverts a matrix of zeros in frame 4, at the line of this file that is marked above."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    lines = Path(__file__).read_text("utf-8").splitlines()
    line = next(k for k, text in enumerate(lines, 1) if "# the line to name" in text)
    sentence = (
        rf"^Breaks failed in look, frame 4: LinAlgError: Singular matrix \(.*test_frame_detector.py, line {line}\)$"
    )
    with pytest.raises(OwnDetectorError, match=sentence):
        list(detector_of_kind(Breaks, bodies).stream(motion.blocks(block)))
