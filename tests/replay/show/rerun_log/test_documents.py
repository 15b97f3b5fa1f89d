"""Texts and dots of the picture: settings of a tradeoff, and what was replayed."""

from dataclasses import replace

import pytest
from support.report_states import price_row, traded
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.engine import compute
from replay.show.rerun_log.documents import dots_of, replayed_sentence, session_text


def test_setting_is_plotted_at_its_mean_time_and_loss():
    """Two settings of a tradeoff: milliseconds a frame, and wrong contacts of 18, as in ``price_row``.

    "slow" misses 0 or 1 contact, half of one in the mean, and gets one late: 1.5/18 = 0.083; "quick" 5/18 = 0.28.
    """
    slow, quick = price_row("slow", ms=0.5, missed=(0, 1), late=1), price_row("quick", ms=0.05, missed=2, late=3)
    dots = [dot for dot, _ in dots_of(traded(slow, quick))]
    assert [(dot.name, dot.x) for dot in dots] == [("slow: 0.083", 0.5), ("quick: 0.28", 0.05)]
    assert [dot.y for dot in dots] == pytest.approx([1.5 / 18, 5 / 18])


def test_replayed_sentence_states_the_length_of_the_window():
    """Twelve frames at 10 Hz are at 0 to 1.1 s; from 0.5 s on, frames 5 to 11 are replayed: 7 frames, 0.6 s."""
    run = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, step_ns=100_000_000), detectors=(), start=0.5)
    assert replayed_sentence(run).startswith("600 ms, 7 frames")


def test_names_in_the_recordings_texts_stand_as_written():
    """A viewer shows Markdown: "&" and "<" of a scene's name are no entities of HTML there."""
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    named = replace(session, scene=replace(session.scene, name="acid & base, pH < 7"))
    text = session_text(compute(named, detectors=()))
    assert text.startswith("# acid & base, pH < 7\n")
