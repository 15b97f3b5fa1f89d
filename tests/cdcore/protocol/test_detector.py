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
    """``Stub`` inherits nothing; it has the names and the methods of the protocol."""
    assert isinstance(Stub(), Detector)


def test_class_without_the_protocol_methods_is_no_detector(monkeypatch):
    """Any object, and ``Stub`` without its method ``stream``."""
    assert not isinstance(object(), Detector)
    monkeypatch.delattr(Stub, "stream")
    assert not isinstance(Stub(), Detector)


def test_explanations_are_optional_and_omit_absent_stages():
    """``discrete`` explains, ``exact`` does not; an explanation of nothing is None for every stage."""
    bodies, _ = lab_bodies_and_motion(frames=2)
    assert isinstance(create_detector("discrete", bodies), Explains)
    assert not isinstance(create_detector("exact", bodies), Explains)
    assert all(value is None for value in vars(Explanation()).values())
