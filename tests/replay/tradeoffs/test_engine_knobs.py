"""Every row of an engine is a detector's setting, and every sentence of advice holds in every state."""

import pytest
from support.small_worlds import cube

from cdcore import Body, TriangleMesh, create_detector
from cdcore.protocol import Solids
from replay.detection.detector_spec import parse_detector
from replay.errors import TradeoffError
from replay.tradeoffs.engine_knobs import ENGINES, EXTRA, advice_words, engine_named

CHOICES = [(name, choice) for name, engine in ENGINES.items() for choice in engine.choices]


@pytest.mark.parametrize(("name", "choice"), CHOICES)
def test_every_row_turns_knobs_of_the_first_and_can_be_audited(name, choice):
    first = ENGINES[name].choices[0]
    assert set(choice.knobs) <= set(first.knobs)
    assert choice is first or all(value != first.knobs[knob] for knob, value in choice.knobs.items())
    spec, solid = parse_detector(choice.setting), TriangleMesh(*(getattr(cube(), key) for key in ("vertices", "faces")))
    if any(part in choice.setting for part in EXTRA):
        pytest.importorskip(next(module for part, module in EXTRA.items() if part in choice.setting))
    bodies = [Body(name, solid, Solids((solid,), solid)) for name in "ab"]
    assert create_detector(spec.name, bodies, **spec.settings).name == spec.name


def test_a_step_a_collider_and_an_offset_are_those_of_the_setting():
    for name, choice in CHOICES:
        knobs, settings = {**ENGINES[name].choices[0].knobs, **choice.knobs}, parse_detector(choice.setting).settings
        step = knobs.get("Fixed Timestep") or knobs.get("Async Fixed Time Step Size") or knobs["timestep"]
        assert settings["rate_hz"] == (90 if "90" in step else pytest.approx(1 / float(step), rel=2e-3)), choice
        pieces = "16" in " ".join(knobs.values())
        assert (settings.get("shape") == "compound") == pieces
        if "Is Trigger" in knobs:
            offset = float(knobs["Default Contact Offset"]) if knobs["Is Trigger"] == "off" else 0.0
            assert settings.get("skin_m", 0.0) == offset
        if "mujoco" in choice.setting:
            assert settings.get("margin_m", 0.0) == 2 * float(knobs["margin"])


def test_an_engine_that_is_not_known_is_answered_with_those_that_are():
    with pytest.raises(TradeoffError, match="no engine 'godot'; there are: unity, unreal, mujoco"):
        engine_named("godot")


def row(number, *, missed=0, part=0, undecided=0, false=0.0, contacts=4, **knobs):
    return {
        "number": number, "knobs": knobs, "contacts": contacts, "missed": missed, "in_part": part, "false": false,
        "undecided": undecided, "undecided_in_part": 0, "words": f"{missed} of {contacts} contacts missed",
    }  # fmt: skip


START = {"Step": "0.02", "Shape": "hull"}
STATES = {
    "no contact": ([row(1, contacts=0, false=None, **START)], [
        "The oracle finds no contact in this session, so none for E to miss."]),
    "no contact, all of it false": ([row(1, contacts=0, false=1.0, **START), row(2, contacts=0, false=1.0, Step="1")], [
        "The oracle finds no contact in this session, so none for E to miss.",
        "100 % of the contact time that row 1 reports is false. No row halves that without missing more."]),
    "one, found": ([row(1, contacts=1, **START)], ["Nothing is missed in row 1: it finds each of 1 contact."]),
    "several, found": ([row(1, **START)], ["Nothing is missed in row 1: it finds each of 4 contacts."]),
    "one missed, mended": ([row(1, missed=1, **START), row(2, part=1, Step="1"), row(3, Step="2")], [
        "Row 1: 1 of 4 contacts missed. The smallest change that finds every contact whole: row 3 (Step 2)."]),
    "several missed, the least knobs and then the least false count": ([
        row(1, missed=2, **START), row(2, Step="1", Shape="mesh"), row(3, Step="2", false=0.5), row(4, Shape="box")], [
        "Row 1: 2 of 4 contacts missed. The smallest change that finds every contact whole: row 4 (Shape box)."]),
    "in part, not mended": ([row(1, part=2, **START), row(2, part=1, Step="1")], [
        "Row 1: 0 of 4 contacts missed. No row finds every contact whole."]),
    "undecided is not mended": ([row(1, missed=1, **START), row(2, undecided=1, Step="1")], [
        "Row 1: 1 of 4 contacts missed. No row finds every contact whole."]),
    "false, mended": ([
        row(1, false=0.9, **START), row(2, false=0.1, missed=1, Step="1"), row(3, false=0.2, Step="2")], [
        "Nothing is missed in row 1: it finds each of 4 contacts.",
        "90 % of the contact time that row 1 reports is false. The smallest change that halves that and "
        "misses no more: row 3 (Step 2), 20 %."]),
    "false, not mended": ([row(1, false=0.9, **START), row(2, false=0.5, Step="1")], [
        "Nothing is missed in row 1: it finds each of 4 contacts.",
        "90 % of the contact time that row 1 reports is false. No row halves that without missing more."]),
}  # fmt: skip


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_of_advice_holds_in_every_state(state):
    rows, sentences = STATES[state]
    assert advice_words("E", rows) == sentences
