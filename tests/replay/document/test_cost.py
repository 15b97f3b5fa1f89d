"""Sentences about time: the share of a frame, the slowest frames, and whether the machine was busy."""

import pytest
from msgspec import structs
from support.report_states import audit_of, detector_of, document_with, times_of

from replay.document.cost import BATCH_TIMING_SENTENCE, BUSY_FRACTION, busy_sentence, busy_text, cost_sentence


def document_of_reference(processor_fraction, *, p99, live=True):
    """A document whose reference takes 1 ms a frame, and had this fraction of the processor."""
    seconds = structs.replace(times_of(1e-3, p99), processor_fraction=processor_fraction)
    detectors = {"exact": detector_of("exact", seconds=seconds, live=live)}
    return document_with(oracle="exact", audit={"slow": audit_of()}, detectors=detectors)


@pytest.mark.parametrize(
    ("processor_fraction", "p99", "has_slowest"),
    [(1.0, 4e-3, True), (None, 4e-3, True), (0.6, 4e-3, False), (1.0, None, False), (0.6, None, False)],
)
def test_slowest_frames_are_stated_when_timed_on_an_idle_machine(processor_fraction, p99, has_slowest):
    """1 ms is 9 % of the 11.1 ms of a frame at 90 Hz; ``processor_fraction``: what the detector had, if known."""
    text = cost_sentence(document_of_reference(processor_fraction, p99=p99))
    assert text.startswith("exact takes 1 ms a frame, 9 % of a 90 Hz frame")
    assert ("99 % of frames within 4 ms" in text) == has_slowest


def test_cost_of_a_batch_states_how_it_was_timed():
    """Not live, a detector got all frames at once and was timed as a whole; without detectors nothing is said."""
    texts = [cost_sentence(document_of_reference(1.0, p99=None, live=live)) for live in (True, False)]
    assert [text.endswith(BATCH_TIMING_SENTENCE) for text in texts] == [False, True]
    assert cost_sentence(document_with()) == ""


def test_machine_is_busy_above_a_twentieth_of_the_clock():
    """Other programs had what a detector did not have: 0.6 of the processor leaves them 40 %."""
    assert busy_sentence(BUSY_FRACTION) == "" and busy_sentence(BUSY_FRACTION + 0.001) != ""
    assert busy_text(document_of_reference(0.6, p99=None)) == busy_sentence(0.4)
    assert busy_text(document_of_reference(1.0, p99=None)) == busy_text(document_with()) == ""
