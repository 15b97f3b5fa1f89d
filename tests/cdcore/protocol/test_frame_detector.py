from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from support.shapes import lab_bodies_and_motion

from cdcore import FrameDetector, Verdict, create_detector, join
from cdcore.errors import InvalidPairError, OwnDetectorError
from cdcore.protocol import Detector, detect_live, stream_live


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


def detector_of_kind(kind, bodies):
    """A detector of this class over all pairs."""
    pairs = create_detector("sphere", bodies).pairs
    return kind(bodies, pairs)


def test_single_method_makes_a_detector_named_after_its_class():
    """40 frames and the 10 pairs of five bodies; a pair without a pose is NO_POSE and nothing else is."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    detector = detector_of_kind(Near, bodies)
    assert isinstance(detector, Detector) and detector.name == "Near" and detector.online
    result = detector.detect(motion)
    assert result.verdict.shape == (40, 10) and result.seconds["look"].shape == (40,)
    known = motion.valid[:, result.pairs[:, 0]] & motion.valid[:, result.pairs[:, 1]]
    assert np.array_equal(result.verdict == Verdict.NO_POSE, ~known)
    assert Verdict.CONTACT in result.verdict


@pytest.mark.parametrize("block", [1, 7])
def test_frame_detector_in_blocks_or_rerun_gives_equal_digests(block):
    """``Near`` keeps a state from frame to frame: it goes on from block to block, and begins anew with each run."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    detector = detector_of_kind(Near, bodies)
    whole = detector.detect(motion)
    assert join(detector.stream(motion.blocks(block))).digest == whole.digest == detector.detect(motion).digest


@pytest.mark.parametrize("block", [7, 40])
def test_live_session_keeps_its_state_between_blocks(block):
    """``Near`` needs two frames running; one live session answers all blocks, a frame at a time."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    detector = detector_of_kind(Near, bodies)
    live = join(stream_live(detector, motion.blocks(block)))
    assert live.digest == detector.detect(motion).digest and live.work == {"looks": 40}


class Plain:
    """No base class and no ``live``: only what the protocol asks for."""

    name, online, Settings, settings = "plain", True, object, None

    def __init__(self, inner):
        self.detect, self.stream = inner.detect, inner.stream


def test_live_detection_falls_back_to_streaming_single_frames():
    """``Plain`` has no ``live``: each of 40 frames is streamed alone, and its stages take no longer than the whole."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    inner, start = detector_of_kind(Near, bodies), perf_counter()
    result = detect_live(Plain(inner), motion)
    assert sum(stage.sum() for stage in result.seconds.values()) <= perf_counter() - start
    assert result.digest == inner.detect(motion).digest
    assert result.seconds["rest"].shape == (40,) and result.work["looks"] == 40


def test_answer_must_have_one_verdict_per_pair():
    """Five bodies are 10 pairs; the detector ``Wrong`` answers in another shape."""
    bodies, motion = lab_bodies_and_motion(frames=3)
    with pytest.raises(InvalidPairError, match=r"one per pair: \(10,\)"):
        detector_of_kind(Wrong, bodies).detect(motion)


def detector_that_answers(answer):
    """A detector that answers so in every frame, beside bodies and a motion."""

    class Says(FrameDetector):
        def look(self, rotations, translations):
            return answer

    bodies, motion = lab_bodies_and_motion(frames=3)
    return detector_of_kind(Says, bodies), motion


@pytest.mark.parametrize(
    "answer",
    [
        [True] * 10,
        np.ones(10, dtype=bool),
        np.full(10, Verdict.CONTACT, dtype=np.uint8),
        [Verdict.CONTACT] * 10,
        (Verdict.CONTACT,) * 10,
    ],
)
def test_bools_and_verdicts_are_answers(answer):
    """Five bodies have ten pairs."""
    detector, motion = detector_that_answers(answer)
    verdict = detector.detect(motion).verdict
    assert set(np.unique(verdict)) <= {Verdict.CONTACT, Verdict.NO_POSE} and (verdict == Verdict.CONTACT).any()


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ([5] * 10, "int64"),
        (np.full(10, 5), "int64"),
        ([0.3] * 10, "float64"),
        ([float("nan")] * 10, "float64"),
        (["yes"] * 10, "<U3"),
        ([None] * 10, "object"),
        ([True, Verdict.CONTACT] * 5, "int64"),
        (np.full(10, 9, dtype=np.uint8), "uint8 with the value 9, which is no Verdict"),
    ],
)
def test_counts_distances_and_other_numbers_are_refused_with_their_dtype(answer, text):
    """``text``: what the refusal calls the answer, for ten pairs."""
    detector, motion = detector_that_answers(answer)
    with pytest.raises(OwnDetectorError, match=rf"Says.look answered with {text}; answer with bools"):
        detector.detect(motion)


class Breaks(FrameDetector):
    """Fails in its 5th look, within a library that it calls."""

    def prepare(self):
        self.looks = 0

    def look(self, rotations, translations):
        self.looks += 1
        if self.looks == 5:
            np.linalg.inv(np.zeros((2, 2)))  # the line to name
        return [False] * len(self.pairs)


@pytest.mark.parametrize("block", [2, 40])
def test_an_exception_names_class_frame_file_and_line(block):
    """``Breaks`` fails in its fifth frame, number 4, whatever the block, at the line that is marked above."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    lines = Path(__file__).read_text("utf-8").splitlines()
    line = next(k for k, text in enumerate(lines, 1) if "# the line to name" in text)
    sentence = (
        rf"^Breaks failed in look, frame 4: LinAlgError: Singular matrix \(.*test_frame_detector.py, line {line}\)$"
    )
    with pytest.raises(OwnDetectorError, match=sentence):
        list(detector_of_kind(Breaks, bodies).stream(motion.blocks(block)))
