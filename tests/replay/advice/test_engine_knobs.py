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


def test_every_engine_setting_links_to_a_page_of_the_guide():
    """A choice is a row of settings (knobs) of an engine; pages of its manual that it names are in the guide."""
    assert {name for name, _choice in CHOICES} == {"unity", "unreal", "mujoco"}
    for name, choice in CHOICES:
        engine = engines()[name]
        assert choice.pages, (name, choice)
        assert [page for page in choice.pages if engine.pages[page] not in GUIDE] == [], (name, choice)


def test_every_later_choice_changes_settings_of_the_first():
    """A choice is a row of settings (knobs) of an engine: the first row has all of them, as in a new project.

    Later rows have only those that differ from it, at least one.
    """
    for name, choice in CHOICES:
        first = engines()[name].choices[0]
        assert set(choice.knobs) <= set(first.knobs), (name, choice)
        if choice is not first:
            assert choice.knobs, (name, choice)
            assert [knob for knob, value in choice.knobs.items() if value == first.knobs[knob]] == [], (name, choice)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("name", "choice"), CHOICES)
def test_every_engine_setting_has_a_detector(name, choice):
    """A choice is a row of settings of an engine, with a detector that stands for it, which can be made for two cubes.

    The rate of the recording plays no role here. Skipped where it needs an engine that is not installed.
    """
    if detector_row(choice.detector).engine:
        pytest.importorskip(detector_row(choice.detector).engine)
    spec = parse_detector(choice.detector_text(frames_hz=1e9))
    mesh = TriangleMesh(cube().vertices, cube().faces)
    bodies = [Body(body, mesh, Solids((mesh,), mesh)) for body in "ab"]
    assert create_detector(spec.name, bodies, **spec.settings).name == spec.name


def knobs_of(name, choice):
    """All settings of an engine under a choice: those of its first row, with what the choice changes."""
    return {**engines()[name].choices[0].knobs, **choice.knobs}


def test_no_engine_setting_asks_what_the_engine_does_not_report():
    """A choice is a row of settings (knobs) of an engine, with a detector that stands for it.

    No engine reports contact of two triangle meshes, nor of meshes in continuous detection: neither detector nor knobs
    have such settings. The recording's rate is so high here that the detector's own rate is always stated.
    """
    for name, choice in CHOICES:
        assert not re.search("shape=mesh|continuous", choice.detector_text(frames_hz=1e9)), (name, choice)
        assert not re.search("Continuous|sdf|Complex", " ".join(choice.knobs.values())), (name, choice)


def test_detector_of_a_choice_steps_as_often_as_the_engine():
    """A choice is a row of settings (knobs) of an engine, with a detector that stands for it.

    The engine's time step is in seconds; "off, 90 frames a second" stands for the 90 Hz of a headset.
    """
    for name, choice in CHOICES:
        knobs = knobs_of(name, choice)
        step = knobs.get("Fixed Timestep") or knobs.get("Async Fixed Time Step Size") or knobs["timestep"]
        expected_hz = 90 if "90" in step else 1 / float(step)
        rounded_hz = pytest.approx(expected_hz, rel=2e-3)  # 0.0167 s stand for 60 Hz
        assert choice.settings["rate_hz"] == rounded_hz, (name, choice)


def test_detector_of_a_choice_has_the_engines_pieces_and_margins():
    """A choice is a row of settings (knobs) of an engine, with a detector that stands for it.

    Both have 16 convex pieces, or neither, and the same gap from which on contact is reported (Unity's contact offset).
    A trigger (Unity) reports overlap without a gap, and does not push. MuJoCo adds the margins of both bodies.
    """
    for name, choice in CHOICES:
        knobs, setting = knobs_of(name, choice), (name, choice)
        has_16_pieces = "16" in " ".join(knobs.values())
        assert (choice.settings.get("pieces") == 16) == has_16_pieces, setting
        if knobs.get("Is Trigger") == "on":
            assert choice.settings.get("skin_m", 0.0) == 0.0, setting
            assert "does not push" in choice.consequence, setting
        elif "Is Trigger" in knobs:
            assert choice.settings.get("skin_m", 0.0) == float(knobs["Default Contact Offset"]), setting
        if choice.detector == "mujoco":
            assert choice.settings.get("margin_m", 0.0) == 2 * float(knobs["margin"]), setting


def test_a_step_as_fast_as_the_recording_sees_every_frame():
    """A headset of 90 Hz records 89.94 frames a second: a step of 90 Hz sees each, so the detector has no rate.

    In a recording of 120 frames a second it has.
    """
    step_of_90_hz = next(choice for _, choice in CHOICES if choice.settings["rate_hz"] == 90)
    assert "rate_hz" not in step_of_90_hz.detector_text(frames_hz=89.94)
    assert "rate_hz=90" in step_of_90_hz.detector_text(frames_hz=120.0)


def test_unknown_engine_is_answered_with_known_engines():
    """Godot has no table of settings; the error lists the engines that have."""
    with pytest.raises(TradeoffError, match="no engine 'godot'; there are: unity, unreal, mujoco"):
        engine_named("godot")


def row(number, missed=0, late=0, false=0, undecided=0, false_fraction=0.0, contacts=4, consequence="", **knobs):
    """A row of the table of an engine's settings, numbered from 1: wrong contacts, and settings that differ.

    A count may be a range over sampling offsets (least, most); ``false_fraction``: of the contact time that is false.
    """
    made = {"number": number, "knobs": knobs, "contacts": contacts, "undecided": undecided, "consequence": consequence}
    return price_row("", ms=1.0, missed=missed, late=late, false=false) | made | {"false": false_fraction}


START = {"Step": "0.02", "Shape": "hull"}
STATES = {
    "no contact": (
        [row(1, contacts=0, false_fraction=None, **START)],
        ["No contact happened that E could miss."],
    ),
    "no contact, all of it false": (
        [row(1, false=2, contacts=0, false_fraction=1.0, **START)],
        ["No contact happened that E could miss.", "All that row 1 reports is false."],
    ),
    "a contact, found": (
        [row(1, contacts=1, **START)],
        ["Row 1 gets each of 1 contact right."],
    ),
    "mended, by the fewest knobs": (
        [
            row(1, missed=(1, 2), late=1, false=3, false_fraction=0.9, **START),
            row(2, late=1, Step="1", Shape="box"),
            row(3, late=(0, 2), Step="2"),
        ],
        [
            "Row 1: 1-2 of 4 contacts missed, 1 late or cut short, 90 % of its contact time false.",
            "Take row 3 (Step 2): 0 of 4 contacts missed, 0-2 late or cut short, 0 % of its contact time false "
            "(measured on this session).",
        ],
    ),
    "mended by two alike, of which the one that changes fewer settings": (
        [
            row(1, missed=3, **START),
            row(2, false_fraction=None, Step="1", Shape="box"),
            row(3, false_fraction=None, Step="2"),
        ],
        [
            "Row 1: 3 of 4 contacts missed, 0 late or cut short, 0 % of its contact time false.",
            "Take row 3 (Step 2): 0 of 4 contacts missed, 0 late or cut short (measured on this session).",
        ],
    ),
    "not mended": (
        [row(1, late=2, **START), row(2, missed=1, late=2, Step="1")],
        [
            "Row 1: 0 of 4 contacts missed, 2 late or cut short, 0 % of its contact time false.",
            "No other row that was tried is clearly better.",
        ],
    ),
    "another setting that gives the same": (
        [row(1, false=40, false_fraction=0.86, **START), row(2, false=39, false_fraction=0.858, Shape="box")],
        [
            "Row 1: 0 of 4 contacts missed, 0 late or cut short, 86 % of its contact time false.",
            "No other row that was tried is clearly better.",
        ],
    ),
    "undecided": (
        [
            row(1, missed=1, undecided=1, false_fraction=None, **START),
            row(2, Step="1", consequence="It reports only."),
        ],
        [
            "Row 1: 1 of 4 contacts missed, 0 late or cut short, 1 undecided.",
            "Take row 2 (Step 1): 0 of 4 contacts missed, 0 late or cut short, 0 % of its contact time false "
            "(measured on this session).",
            "It reports only.",
        ],
    ),
}


@pytest.mark.parametrize(("rows", "sentences"), STATES.values(), ids=STATES)
def test_every_sentence_of_advice_holds_in_every_state(rows, sentences):
    """Rows of settings of an engine E, each with its wrong contacts of 4 (unless another number is said).

    Row 1 has the settings of a new project; others name those that they change. All sentences of advice are compared.
    """
    assert advice_text("E", rows) == sentences
