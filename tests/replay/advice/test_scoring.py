"""Wrong contacts of settings of a tradeoff, against counts by hand."""

import re

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from cdcore.tolerances import TWO_MICROMETRES
from replay.advice.scoring import Scoring, wrong_counts
from replay.advice.settings import settings_of
from replay.auditing.contact_counts import ContactCounts
from replay.auditing.outcome import Outcome
from replay.auditing.wilson import proportion
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.prepare.assemble import assemble

POSITIONS = (3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3)
"""Distance of two unit cubes in each frame, as in ``bumped``; below 1 m they are in contact."""


@pytest.fixture(scope="module")
def assembly(bumped):
    """Two unit cubes in 12 frames of 10 ms: in contact in frame 4 and in frames 8 and 9."""
    return assemble(bumped)


def figures_of(assembly, spec, oracle="exact"):
    """A detector's wrong contacts over all sampling offsets, against the detector ``oracle``."""
    (setting,) = settings_of(f"it={spec}")
    detection = make_detector(setting.spec, assembly, 0).detect(assembly.motion)
    return Scoring(assembly, parse_detector(oracle), 0, TWO_MICROMETRES).figures(detection, setting)


def wrong_by_hand(touching, every, first):
    """Contacts missed, late or cut short, and false, if every so many frames are sampled from ``first`` on.

    Frame 0 is sampled too; each answer is kept until the next sample.
    """
    samples = [frame for frame in range(len(touching)) if frame == 0 or frame % every == first]
    reported = [touching[max(sample for sample in samples if sample <= frame)] for frame in range(len(touching))]
    codes = "".join("C" if contact else "." for contact in touching)
    contacts = re.finditer("C+", codes)
    fractions = [sum(reported[contact.start() : contact.end()]) / len(contact[0]) for contact in contacts]
    false = "".join(
        "F" if reported_now and not true else "." for reported_now, true in zip(reported, touching, strict=True)
    )
    missed, late = sum(fraction == 0 for fraction in fractions), sum(0 < fraction < 1 for fraction in fractions)
    return missed, late, len(re.findall("F+", false))


@pytest.mark.parametrize(
    ("name", "number"),
    [pytest.param("missed", 0), pytest.param("late", 1), pytest.param("false_contacts", 2)],
    ids=["missed", "late or cut short", "false"],
)
def test_counts_of_step_rate_match_hand_counts_over_offsets(assembly, name, number):
    """At 20 Hz every fifth of 12 frames is sampled, from each of five first frames on; contact is in 4, 8 and 9.

    16 sampling offsets are spread evenly over these five frames, k + 0.5 sixteenths of them; the first sample is the
    next frame. So three offsets begin at each, but four at frame 3.
    """
    touching = [distance < 1 for distance in POSITIONS]
    by_hand = [wrong_by_hand(touching, every=5, first=first)[number] for first in range(5)]
    offsets_at_frame = [3, 3, 3, 4, 3]
    figures = figures_of(assembly, "discrete[rate_hz=20]")
    assert figures["offsets"] == 16
    assert (figures[f"{name}_smallest"], figures[f"{name}_largest"]) == (min(by_hand), max(by_hand))
    assert figures[name] == pytest.approx(np.average(by_hand, weights=offsets_at_frame))


def test_loss_is_the_sum_of_its_three_fractions(assembly):
    """At 20 Hz a detector misses some of two contacts. Its loss adds three parts, over all sampling offsets.

    They are contacts missed, of two, contact time not reported, of all, and reported time that is false.
    """
    figures = figures_of(assembly, "discrete[rate_hz=20]")
    assert figures["loss"] > 0
    assert figures["loss"] == pytest.approx(figures["missed"] / 2 + figures["not_reported"] + figures["false"])


def test_detector_that_is_the_oracle_has_no_faults(assembly):
    """The detector ``exact`` against itself: two contacts, no loss; without a step rate one sampling offset."""
    exact = figures_of(assembly, "exact", oracle="exact")
    assert (exact["contacts"], exact["loss"], exact["false"], exact["offsets"]) == (2, 0, 0, 1)


def test_spheres_are_false_where_they_alone_overlap(assembly):
    """Spheres around unit cubes overlap up to 1.73 m: in frames 1 and 2, 6 to 10, and 4; cubes touch in 4, 8 and 9.

    So three intervals are false (1 and 2, 6 and 7, 10), 5 of 8 reported frames; nothing is missed.
    """
    spheres = figures_of(assembly, "sphere")
    assert (spheres["missed"], spheres["late"], spheres["false_contacts"]) == (0, 0, 3)
    assert spheres["false"] == spheres["loss"] == 5 / 8


def test_detector_beside_an_oracle_of_intervals_has_a_single_offset(assembly):
    """At 20 Hz a detector is counted as if its sampling began at 16 moments (offsets), beside an oracle of frames.

    Here the oracle is ``Swept``, which judges the way between two frames: there is no moment of it to begin at, and the
    detector is counted once, as it ran.
    """
    figures = figures_of(assembly, "discrete[rate_hz=20]", oracle="support.planted_detectors:Swept")
    assert figures["offsets"] == 1


@pytest.mark.parametrize(
    ("rate_hz", "offsets"), [pytest.param(None, 1, id="every frame"), pytest.param(20.0, 16, id="20 Hz")]
)
def test_only_a_step_rate_has_sampling_offsets(assembly, rate_hz, offsets):
    """A detection of every frame is scored as it is, once, or as if it were sampled at a rate, from 16 moments on."""
    scoring = Scoring(assembly, parse_detector("exact"), 0, TWO_MICROMETRES)
    every_frame = make_detector(parse_detector("discrete"), assembly, 0).detect(assembly.motion)
    compared = scoring.reference.compare(every_frame)
    assert scoring.figures_of(compared, every_frame, rate_hz=rate_hz)["offsets"] == offsets


def test_loss_without_true_contact_is_the_false_contact():
    """Unit cubes 3 m, then 1.3 m apart from middle to middle never touch, but spheres around them overlap up to 1.73 m.

    So there is no contact to miss, one false contact, and all that is reported is false.
    """
    spheres = figures_of(assemble(unit_cubes_on_x({"a": [0, 0], "b": [3, 1.3]})), "sphere")
    assert (spheres["contacts"], spheres["missed"], spheres["false_contacts"]) == (0, 0, 1)
    assert spheres["loss"] == 1.0


@pytest.mark.parametrize(
    ("false_contacts", "columns"),
    [
        pytest.param(3, {"false": 0.25, "false_contacts": 3}, id="three"),
        pytest.param(0, {"false": 0.25, "false_contacts": 0}, id="none"),
        pytest.param(None, {"false": 0.25}, id="not counted"),
    ],
)
def test_false_contacts_have_a_column_only_where_counted(false_contacts, columns):
    """Their number may be unknown (None); their part of the reported time, 1 of 4 frames, is known all the same."""
    no_contacts = ContactCounts(
        numbers=np.array([], dtype=int), pairs=np.array([], dtype=int), frames_by_outcome=np.zeros((0, len(Outcome)))
    )
    row = wrong_counts(no_contacts, false_contacts, proportion(1, 4), offsets=None)
    assert {name: row[name] for name in ("false", "false_contacts") if name in row} == columns
