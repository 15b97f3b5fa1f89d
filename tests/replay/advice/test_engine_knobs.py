"""Every row of an engine is a detector's setting, and every sentence of advice holds in every state."""

import re
from pathlib import Path

import pytest
from support.report_states import price_row
from support.small_worlds import cube

import replay.guide
from cdcore import Body, TriangleMesh, create_detector
from cdcore.detectors.detector_table import detector_row
from cdcore.protocol import Solids
from replay.advice.engine_knobs import advice_text, engine_named, engines
from replay.detection.detector_spec import parse_detector
from replay.errors import TradeoffError

CHOICES = [(name, choice) for name, engine in engines().items() for choice in engine.choices]
GUIDE = Path(replay.guide.__file__).with_name("what-to-ship.md").read_text("utf-8")


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("name", "choice"), CHOICES)
def test_every_engine_setting_is_documented_and_has_a_detector(name, choice):
    """A choice changes settings of the engine's first row, links to pages of the guide, and makes a detector."""
    engine = engines()[name]
    first = engine.choices[0]
    assert set(choice.knobs) <= set(first.knobs) and choice.pages
    assert choice is first or all(value != first.knobs[knob] for knob, value in choice.knobs.items())
    assert all(engine.pages[page] in GUIDE for page in choice.pages)
    if detector_row(choice.detector).engine:
        pytest.importorskip(detector_row(choice.detector).engine)
    spec, solid = parse_detector(choice.detector_text(1e9)), TriangleMesh(cube().vertices, cube().faces)
    bodies = [Body(name, solid, Solids((solid,), solid)) for name in "ab"]
    assert create_detector(spec.name, bodies, **spec.settings).name == spec.name


@pytest.mark.parametrize(("name", "choice"), CHOICES)
def test_engine_rows_follow_their_setting_and_engine_limits(name, choice):
    """Two triangle meshes, and continuous detection of meshes: neither reports contact in the engine."""
    knobs, settings = {**engines()[name].choices[0].knobs, **choice.knobs}, choice.settings
    assert not re.search("shape=mesh|continuous", choice.detector_text(1e9))
    assert not re.search("Continuous|sdf|Complex", " ".join(choice.knobs.values()))
    step = knobs.get("Fixed Timestep") or knobs.get("Async Fixed Time Step Size") or knobs["timestep"]
    pieces = "16" in " ".join(knobs.values())
    assert settings["rate_hz"] == (90 if "90" in step else pytest.approx(1 / float(step), rel=2e-3))
    assert (settings.get("pieces") == 16) == pieces
    if "Is Trigger" in knobs:
        trigger = knobs["Is Trigger"] == "on"
        assert settings.get("skin_m", 0.0) == (0.0 if trigger else float(knobs["Default Contact Offset"]))
        assert not trigger or "does not push" in choice.consequence
    if choice.detector == "mujoco":
        assert settings.get("margin_m", 0.0) == 2 * float(knobs["margin"])


def test_a_step_as_fast_as_the_recording_sees_every_frame():
    """A headset of 90 Hz records 89.94 frames a second."""
    fast = next(choice for _, choice in CHOICES if choice.settings["rate_hz"] == 90)
    assert "rate_hz" not in fast.detector_text(89.94) and "rate_hz=90" in fast.detector_text(120.0)


def test_unknown_engine_is_answered_with_known_engines():
    with pytest.raises(TradeoffError, match="no engine 'godot'; there are: unity, unreal, mujoco"):
        engine_named("godot")


def row(number, *counts, undecided=0, share=0.0, contacts=4, consequence="", **knobs):
    """A row of the table of an engine's settings: its number, counts of wrong contacts, and settings that differ."""
    made = {"number": number, "knobs": knobs, "contacts": contacts, "undecided": undecided, "consequence": consequence}
    return price_row("", 1.0, *counts) | made | {"false": share}


START = {"Step": "0.02", "Shape": "hull"}
STATES = {
    "no contact": ([row(1, 0, contacts=0, share=None, **START)], ["No contact happened that E could miss."]),
    "no contact, all of it false": ([row(1, 0, 0, 2, contacts=0, share=1.0, **START)], [
        "No contact happened that E could miss.", "All that row 1 reports is false."]),
    "one, found": ([row(1, 0, contacts=1, **START)], ["Row 1 gets each of 1 contact right."]),
    "mended, by the fewest knobs": ([
        row(1, (1, 2), 1, 3, share=0.9, **START), row(2, 0, 1, Step="1", Shape="box"), row(3, 0, (0, 2), Step="2")], [
        "Row 1: 1-2 of 4 contacts missed, 1 late or cut short, 90 % of its contact time false.",
        "Take row 3 (Step 2): 0 of 4 contacts missed, 0-2 late or cut short, 0 % of its contact time false "
        "(measured on this session)."]),
    "mended by two alike, the one that changes fewer settings": ([
        row(1, 3, **START), row(2, 0, share=None, Step="1", Shape="box"), row(3, 0, share=None, Step="2")], [
        "Row 1: 3 of 4 contacts missed, 0 late or cut short, 0 % of its contact time false.",
        "Take row 3 (Step 2): 0 of 4 contacts missed, 0 late or cut short (measured on this session)."]),
    "not mended": ([row(1, 0, 2, **START), row(2, 1, 2, Step="1")], [
        "Row 1: 0 of 4 contacts missed, 2 late or cut short, 0 % of its contact time false.",
        "No other row is clearly better."]),
    "another setting that gives the same": ([
        row(1, 0, 0, 40, share=0.86, **START), row(2, 0, 0, 39, share=0.858, Shape="box")], [
        "Row 1: 0 of 4 contacts missed, 0 late or cut short, 86 % of its contact time false.",
        "No other row is clearly better."]),
    "undecided": ([row(1, 1, undecided=1, share=None, **START), row(2, 0, Step="1", consequence="It reports only.")], [
        "Row 1: 1 of 4 contacts missed, 0 late or cut short, 1 undecided.",
        "Take row 2 (Step 1): 0 of 4 contacts missed, 0 late or cut short, 0 % of its contact time false "
        "(measured on this session).", "It reports only."]),
}  # fmt: skip


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_of_advice_holds_in_every_state(state):
    """A state of STATES: rows of an engine E, and all sentences of advice on them."""
    rows, sentences = STATES[state]
    assert advice_text("E", rows) == sentences
