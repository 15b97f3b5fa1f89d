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
    """The outcome of a replay under one reading of a file: contacts, and how much of them is deep at rest."""
    contact = np.ones((1, 1), dtype=bool)
    return Outcome(
        contacts, contact, deepest=0.01, closest=0.0, closest_frame=0, closest_pair=0, deep_at_rest=deep_fraction
    )


@pytest.mark.parametrize(
    ("fractions", "marked"),
    [
        ((0.1, 0.6, 0.9), "a"),
        ((0.3, 0.5), "a"),
        ((0.1, 0.4), ""),
        ((0.1, 0.2, 0.9), ""),
        ((0.6, 0.9), ""),
        ((0.4, 0.9), ""),
        ((0.1,), ""),
    ],
)
def test_reading_is_plausible_if_alone_without_deep_contact(fractions, marked):
    """``fractions``, of contact that is deep, of readings a, b, c: one has at most 0.3, and all others at least 0.5."""
    assert more_plausible({"abc"[k]: outcome(fraction) for k, fraction in enumerate(fractions)}) == marked


def test_a_reading_without_contact_is_as_plausible_as_shallow_contacts():
    """Beside one whose contact is deep it is marked; beside one whose contacts are shallow neither is."""
    assert more_plausible({"a": outcome(deep_fraction=0.0, contacts=0), "b": outcome(deep_fraction=0.0)}) == ""
    assert more_plausible({"a": outcome(deep_fraction=0.0, contacts=0), "b": outcome(deep_fraction=0.8)}) == "a"


@pytest.mark.parametrize(("until", "expected"), [(2.0, 0.0), (1.0, 1.0)], ids=["passes through", "comes to rest"])
def test_only_resting_bodies_speak_against_a_reading(until, expected):
    """A tool that swept through a tray's post marked the wrong reading, in which it missed the post."""
    cube = make_shape("box", {"x": 0.1, "y": 0.1, "z": 0.1})
    seconds = np.arange(180) / 90.0
    still, upright = np.zeros((180, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (180, 1))
    moving = np.stack([0.28 - 0.25 * np.minimum(seconds, until), 0.03 + 0 * seconds, 0 * seconds], axis=1)
    bodies = {"tray": (still, upright), "tool": (moving, upright)}
    session = Session.from_arrays((seconds * 1e9).astype(np.int64), bodies, meshes=dict.fromkeys(bodies, cube))
    result = examine_assumptions(session).outcome
    assert result.deepest > 0.03 and result.deep_at_rest == expected


@pytest.mark.parametrize(("farthest", "unit"), [(4000.0, "mm"), (1000.0, ""), (3.0, ""), (10.0**6, "")])
def test_only_unit_with_all_poses_in_a_room_is_marked(farthest, unit):
    """Poses up to ``farthest`` from each other fit into a room in one of m, cm and mm, in none, or in several."""
    positions = np.array([[0.0, 0.0, 0.0], [farthest, 0.0, 0.0]])
    track = Track(np.array([0, 10**7]), positions, np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)))
    row = Assumption(Subject.LENGTH_UNIT, "m", Origin.GUESS, alternatives=("m", "cm", "mm"))
    assert plausible_length_unit(Session.from_tracks({"cup": track}), row) == unit


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
    """How many planted guesses that change contacts are marked right, wrong, and not at all."""
    session, _ = make_scene_session(scene, seed=3, rate_hz=30.0, faces=600)
    counts = Counter()
    for right, guess in planted_guesses(session):
        for question in examine_assumptions(guess).questions:
            counts["none" if not question.plausible else question.plausible == right] += 1
    return counts


@pytest.mark.slow
def test_marks_of_planted_guesses_are_right():
    """At least 97 of 100 marks are right, and three in ten guesses are marked."""
    counts = sum(map(marks_of_planted_guesses, PLANTED), Counter())
    print(dict(counts))
    assert counts[False] <= 0.03 * (counts[True] + counts[False]), counts
    assert counts[True] >= 0.3 * counts.total(), counts
