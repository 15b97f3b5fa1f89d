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


@pytest.fixture(scope="module")
def assembly(bumped):
    """Bodies, pairs and motion of a bench that is bumped."""
    return assemble(bumped)


def figures(assembly, spec, oracle="exact"):
    """A detector's figures over all sampling offsets."""
    (setting,) = settings_of(f"it={spec}")
    detection = make_detector(setting.spec, assembly, 0).detect(assembly.motion)
    return Scoring(assembly, parse_detector(oracle), 0, TWO_MICROMETRES).figures(detection, setting)


def wrong_by_hand(touching, every, first):
    """Contacts missed, late or cut short, and false, of samples every so many frames that are held until the next."""
    queries = [k for k in range(len(touching)) if k == 0 or k % every == first]
    reported = [touching[max(k for k in queries if k <= frame)] for frame in range(len(touching))]
    spans = "".join("C" if item else "." for item in touching)
    result = [sum(reported[span.start() : span.end()]) / len(span[0]) for span in re.finditer("C+", spans)]
    false = "".join("F" if item and not true else "." for item, true in zip(reported, touching, strict=True))
    return sum(not item for item in result), sum(0 < item < 1 for item in result), len(re.findall("F+", false))


def test_counts_of_step_rate_match_hand_counts_over_offsets(assembly):
    """20 Hz is every fifth frame; 16 offsets fall on five first frames, so that means differ a little."""
    reported = figures(assembly, "discrete[rate_hz=20]")
    by_hand = [wrong_by_hand([position < 1 for position in POSITIONS], every=5, first=first) for first in range(5)]
    for name, counts in zip(("missed", "late", "false_contacts"), zip(*by_hand, strict=True), strict=True):
        assert (reported[f"{name}_smallest"], reported[f"{name}_largest"]) == (min(counts), max(counts)), name
        assert reported[name] == pytest.approx(sum(counts) / 5, abs=2 / 36)
    assert reported["loss"] == pytest.approx(reported["missed"] / 2 + reported["not_reported"] + reported["false"])
    assert reported["offsets"] == 16


def test_oracle_has_no_faults_and_balls_are_false_where_overlapping(assembly):
    """Two contacts are true; a fraction is of frames."""
    exact, balls = figures(assembly, "exact"), figures(assembly, "sphere")
    assert (exact["contacts"], exact["loss"], exact["false"], exact["offsets"]) == (2, 0, 0, 1)
    # Balls overlap at 1.3 too, three times: in frames 1 and 2, in frames 6 and 7, and in frame 10.
    assert (balls["missed"], balls["late"], balls["false_contacts"]) == (0, 0, 3)
    assert balls["false"] == balls["loss"] == 5 / 8


def test_only_a_step_rate_beside_instants_has_sampling_offsets(assembly):
    """An oracle of intervals is compared once: offsets shift instants."""
    swept = "support.planted_detectors:Swept"
    assert figures(assembly, "discrete[rate_hz=20]", oracle=swept)["offsets"] == 1
    scoring = Scoring(assembly, parse_detector("exact"), 0, TWO_MICROMETRES)
    every_frame = make_detector(parse_detector("discrete"), assembly, 0).detect(assembly.motion)
    compared = scoring.reference.compare(every_frame)
    assert scoring.figures_of(compared, every_frame, rate_hz=None)["offsets"] == 1
    assert scoring.figures_of(compared, every_frame, rate_hz=20.0)["offsets"] == 16


def test_loss_without_true_contact_is_the_false_contact():
    """Unit cubes at 1.3 are apart, but spheres around them overlap: all of the reported contact is false."""
    assembly = assemble(unit_cubes_on_x({"a": [0, 0], "b": [3, 1.3]}))
    balls = figures(assembly, "sphere")
    assert (balls["contacts"], balls["missed"], balls["false_contacts"], balls["loss"]) == (0, 0, 1, 1.0)


@pytest.mark.parametrize(("false_contacts", "column"), [(3, 3), (0, 0), (None, None)])
def test_false_contacts_have_a_column_only_where_counted(false_contacts, column):
    """``None``: they were not counted; their part of the contact time, 1 of 4 frames, is known all the same."""
    no_contacts = ContactCounts(
        numbers=np.array([], dtype=int), pairs=np.array([], dtype=int), frames_by_outcome=np.zeros((0, len(Outcome)))
    )
    row = wrong_counts(no_contacts, false_contacts, proportion(1, 4), offsets=None)
    assert row["false"] == 0.25 and row.get("false_contacts") == column
