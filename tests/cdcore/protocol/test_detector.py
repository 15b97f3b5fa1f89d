"""The protocol is a shape: a class that has it is a detector, whatever it inherits."""

from support.shapes import lab_bodies_and_motion

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


def test_class_without_bases_is_a_detector_by_shape():
    """``Stub`` inherits nothing; it has the attributes of the protocol, and its methods ``detect`` and ``stream``."""
    assert Stub.__bases__ == (object,)
    assert isinstance(Stub(), Detector)


def test_class_without_the_protocol_methods_is_no_detector(monkeypatch):
    """Any object, and ``Stub`` without its method ``stream``."""
    assert not isinstance(object(), Detector)
    monkeypatch.delattr(Stub, "stream")
    assert not isinstance(Stub(), Detector)


def test_explanations_are_optional():
    """``discrete`` has a method that explains its verdicts, ``exact`` has none."""
    bodies, _motion = lab_bodies_and_motion(frames=2)
    assert isinstance(create_detector("discrete", bodies), Explains)
    assert not isinstance(create_detector("exact", bodies), Explains)


def test_stages_that_an_explanation_does_not_mention_are_unknown():
    """Whether a frame was tested, shapes or spheres meet, etc.: ``None``."""
    answers = vars(Explanation())
    assert answers
    assert set(answers.values()) == {None}
