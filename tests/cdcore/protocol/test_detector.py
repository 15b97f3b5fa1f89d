"""The protocol recognises a detector by its shape, whoever wrote it."""

from __future__ import annotations

from cdcore.protocol import Detector


class Stub:
    name, online, Settings = "stub", False, object

    @property
    def settings(self):
        return None

    def detect(self, motion, *, faces=False):
        return None

    def stream(self, motions, *, faces=False):
        return None


class Silent(Stub):
    stream = None


def test_a_class_that_inherits_nothing_is_a_detector_by_its_shape():
    assert isinstance(Stub(), Detector)


def test_a_class_without_the_methods_is_none():
    assert not isinstance(object(), Detector)
    del Stub.stream
    try:
        assert not isinstance(Stub(), Detector)
    finally:
        Stub.stream = lambda self, motions, faces=False: iter(())
