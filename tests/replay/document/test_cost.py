"""Sentences about time: the share of a frame, the slowest frames, and whether the machine was busy."""

import pytest
from msgspec import structs
from support.report_states import audit_of, detector_of, document_with, times_of

from replay.document.cost import BATCH_TIMING_SENTENCE, BUSY_FRACTION, busy_sentence, busy_text, cost_sentence


def document_of_reference(processor_fraction, *, p99=None, live=True):
    """A document whose reference takes 1 ms a frame, and had this fraction of the processor.

    ``p99``: seconds that 99 % of its frames do not exceed, if measured; ``live``: it was timed frame by frame.
    """
    seconds = structs.replace(times_of(1e-3, p99), processor_fraction=processor_fraction)
    detectors = {"exact": detector_of("exact", seconds=seconds, live=live)}
    return document_with(oracle="exact", audit={"slow": audit_of()}, detectors=detectors)


@pytest.mark.parametrize(
    ("processor_fraction", "p99", "has_slowest"),
    [
        pytest.param(1.0, 4e-3, True, id="idle machine"),
        pytest.param(None, 4e-3, True, id="load of the machine not known"),
        pytest.param(0.6, 4e-3, False, id="busy machine"),
        pytest.param(1.0, None, False, id="not timed frame by frame"),
        pytest.param(0.6, None, False, id="neither"),
    ],
)
def test_slowest_frames_are_stated_when_timed_on_an_idle_machine(processor_fraction, p99, has_slowest):
    """1 ms is 9 % of the 11.1 ms of a frame at 90 Hz; ``processor_fraction``: what the detector had, if known."""
    text = cost_sentence(document_of_reference(processor_fraction, p99=p99))
    assert text.startswith("exact takes 1 ms a frame, 9 % of a 90 Hz frame")
    assert ("99 % of frames within 4 ms" in text) == has_slowest


@pytest.mark.parametrize(("live", "is_stated"), [(True, False), (False, True)])
def test_cost_of_a_batch_states_how_it_was_timed(live, is_stated):
    """A reference that did not run live got all frames at once and was timed as a whole."""
    text = cost_sentence(document_of_reference(processor_fraction=1.0, live=live))
    assert text.endswith(BATCH_TIMING_SENTENCE) == is_stated


def test_run_without_an_audit_has_no_cost():
    """No detector was compared with a reference, so that there is none whose time could be stated."""
    assert cost_sentence(document_with()) == ""


def test_machine_is_busy_above_a_twentieth_of_the_clock():
    """Other programs had so much of the processor; BUSY_FRACTION, 5 %, is not worth a sentence."""
    assert busy_sentence(BUSY_FRACTION) == ""
    assert busy_sentence(BUSY_FRACTION + 0.001) != ""


def test_other_programs_have_what_a_detector_did_not_have():
    """0.6 of the processor leaves them 40 %; with all of it, or without detectors, nobody else is mentioned."""
    assert busy_text(document_of_reference(processor_fraction=0.6)) == busy_sentence(0.4)
    assert busy_text(document_of_reference(processor_fraction=1.0)) == ""
    assert busy_text(document_with()) == ""
