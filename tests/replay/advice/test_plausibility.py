"""Readings that are marked as more plausible, on guesses planted in scenes whose right reading is known."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from replay.advice.assumptions import examine_assumptions
from replay.advice.plausibility import more_plausible, plausible_length_unit
from replay.advice.scene_outcome import Outcome
from sessions import Session, Track, make_shape
from sessions.meshes.conventions import convention
from sessions.meshes.mesh_axes import mesh_axes_alternatives
from sessions.meshes.mesh_match import possible_units
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Confidence, Origin, Subject, assumptions_fact
from sessions.synthetic.scenes import make_scene_session

PLANTED = ("silver-chloride", "titration")


def outcome(deep_fraction, contacts=3):
    """The outcome of a replay under a reading of a file: contacts, and the fraction of them that is deep at rest."""
    contact = np.ones((1, 1), dtype=bool)
    return Outcome(
        contacts, contact, deepest=0.01, closest=0.0, closest_frame=0, closest_pair=0, deep_at_rest=deep_fraction
    )


@pytest.mark.parametrize(
    ("fractions", "marked"),
    [
        pytest.param({"a": 0.1, "b": 0.6, "c": 0.9}, "a", id="clear"),
        pytest.param({"a": 0.3, "b": 0.5}, "a", id="just clear"),
        pytest.param({"a": 0.1, "b": 0.4}, "", id="the other between both limits"),
        pytest.param({"a": 0.1, "b": 0.2, "c": 0.9}, "", id="two are shallow"),
        pytest.param({"a": 0.6, "b": 0.9}, "", id="all are deep"),
        pytest.param({"a": 0.4, "b": 0.9}, "", id="the best between both limits"),
        pytest.param({"a": 0.1}, "", id="no other reading"),
    ],
)
def test_reading_is_plausible_if_alone_without_deep_contact(fractions, marked):
    """Readings of a file with the fraction of contact of bodies at rest that is deep: real bodies rest on each other.

    The plausible one has at most 0.3, and all others have at least 0.5; else none is marked ("").
    """
    assert more_plausible({value: outcome(fraction) for value, fraction in fractions.items()}) == marked


@pytest.mark.parametrize(
    ("deep_fraction_of_other", "marked"),
    [pytest.param(0.0, "", id="beside shallow contacts"), pytest.param(0.8, "no contact", id="beside deep contacts")],
)
def test_a_reading_without_contact_is_as_plausible_as_shallow_contacts(deep_fraction_of_other, marked):
    """Two readings of a file: in one nothing touches, in the other bodies at rest do, in part deep in each other."""
    readings = {"no contact": outcome(deep_fraction=0.0, contacts=0), "contacts": outcome(deep_fraction_of_other)}
    assert more_plausible(readings) == marked


@pytest.mark.parametrize(
    ("stops_at_s", "deep_at_rest"),
    [pytest.param(2.0, 0.0, id="passes through"), pytest.param(1.0, 1.0, id="comes to rest")],
)
def test_only_resting_bodies_speak_against_a_reading(stops_at_s, deep_at_rest):
    """A tool, a cube of 0.1 m, moves at 0.25 m/s from x = 0.28 m into a tray, an equal cube at the origin, 3 cm lower.

    In 2 s it comes to x = -0.22 m, through the tray; or it stops after 1 s at x = 0.03 m, where both overlap by 7 cm:
    deep, as more than 5 mm is. A tool that swept through a tray's post once marked the wrong reading.
    """
    cube = make_shape("box", {"x": 0.1, "y": 0.1, "z": 0.1})
    seconds = np.arange(180) / 90.0
    still, upright = np.zeros((180, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (180, 1))
    x = 0.28 - 0.25 * np.minimum(seconds, stops_at_s)
    moving = np.stack([x, np.full(180, 0.03), np.zeros(180)], axis=1)
    bodies = {"tray": (still, upright), "tool": (moving, upright)}
    session = Session.from_arrays((seconds * 1e9).astype(np.int64), bodies, meshes=dict.fromkeys(bodies, cube))
    result = examine_assumptions(session).outcome
    assert result.deepest > 0.03  # 0.05 by geometry, where a side of the tool passes the middle of the tray
    assert result.deep_at_rest == deep_at_rest


@pytest.mark.parametrize(
    ("farthest", "unit"),
    [
        pytest.param(4000.0, "mm", id="4 m in mm, a room, 40 m in cm"),
        pytest.param(1000.0, "", id="1 m in mm, 10 m in cm: both a room"),
        pytest.param(3.0, "", id="3 m and 3 cm: both a room"),
        pytest.param(10.0**6, "", id="1 km in mm: none a room"),
    ],
)
def test_only_unit_with_all_poses_in_a_room_is_marked(farthest, unit):
    """A cup at the origin, then at x = ``farthest``; the unit of lengths is a guess: m, cm or mm.

    It is plausible if in that unit alone the distance is one within a room, 2 cm to 30 m.
    """
    positions = np.array([[0.0, 0.0, 0.0], [farthest, 0.0, 0.0]])
    track = Track(np.array([0, 10**7]), positions, np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
    guess = Assumption(Subject.LENGTH_UNIT, "m", Origin.GUESS, alternatives=("m", "cm", "mm"))
    assert plausible_length_unit(Session.from_tracks({"cup": track}), guess) == unit


def with_guess(session, poses, subject, value, bodies, alternatives):
    """The recording as if an import had guessed this, and guessed right."""
    rows = (
        Assumption(Subject.POSE_AXES, poses, Origin.USER),
        Assumption(
            subject=subject,
            value=value,
            origin=Origin.GUESS,
            confidence=Confidence.OPEN,
            bodies=bodies,
            files=tuple(f"{body}.obj" for body in bodies),
            alternatives=alternatives,
        ),
    )
    return replace(session, facts={**session.facts, ASSUMPTIONS_FACT: assumptions_fact(rows)})


def planted_guesses(session):
    """The recording with guesses on the axes of all meshes or of one, and on the unit of one."""
    names = tuple(session.meshes)
    for poses in ("unity", "ros"):
        values = mesh_axes_alternatives("body", convention(poses))
        for value in values:
            yield value, with_guess(session, poses, Subject.MESH_AXES, value, names, values)
        for name in names:
            yield "body", with_guess(session, poses, Subject.MESH_AXES, "body", (name,), values)
    for name in names:
        for unit in ("m", "cm", "mm"):
            units = possible_units(session.meshes[name], unit)
            if len(units) > 1:
                yield unit, with_guess(session, "canonical", Subject.MESH_UNIT, unit, (name,), units)


def marks_of_planted_guesses(scene):
    """How often the right value of a planted guess is marked as plausible (right), another (wrong), or none.

    Guesses that change no contact are not asked about, so not counted.
    """
    session, _truth = make_scene_session(scene, seed=3, rate_hz=30.0, faces=600)
    counts = Counter()
    for right_value, guess in planted_guesses(session):
        for question in examine_assumptions(guess).questions:
            if not question.plausible:
                counts["none"] += 1
            else:
                counts["right" if question.plausible == right_value else "wrong"] += 1
    return counts


@pytest.mark.slow
def test_marks_of_planted_guesses_are_right():
    """Right guesses on axes and units of meshes, planted in two made-up experiments; each may be marked as plausible.

    At most 3 of 100 marks are wrong, and at least 3 in 10 guesses are marked right.
    """
    counts = sum(map(marks_of_planted_guesses, PLANTED), Counter())
    assert counts["wrong"] <= 0.03 * (counts["right"] + counts["wrong"]), counts
    assert counts["right"] >= 0.3 * counts.total() > 0, counts
