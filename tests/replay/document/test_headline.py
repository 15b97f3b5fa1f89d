"""Notes beside the answer: what was not counted, what times are of, and how many pieces a compound has."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import audit_of, detector_of, document_with, times_of, zeros
from support.small_worlds import MEET_IN_4_AND_8_TO_10, jumping, unit_cubes_on_x

from replay.document.audit import GraspedCounts
from replay.document.cost import NO_SLOWEST_SENTENCE, TIMES_SENTENCE
from replay.document.diagnosis import answers_of_run
from replay.document.headline import compound_lines, doubts_of, grasped_notes, price_reason
from replay.document.ranking import Rank
from replay.engine import compute
from sessions import Finding, Severity


def detector_times(mean, p99, *, live=True, busy=0.0):
    """A detector that took so many seconds a frame, on a machine that was ``busy`` for a fraction of the time."""
    seconds = structs.replace(times_of(mean, p99), processor_fraction=1.0 - busy)
    return detector_of("discrete", live=live, seconds=seconds)


@pytest.mark.parametrize("busy", [0.03, 0.69])
def test_the_cost_is_the_reference_beside_a_busy_machine(busy):
    """``busy``: fraction of the time that other work took; above 5 % the slowest frames are not stated."""
    detectors = {"slow": detector_times(mean=1e-5, p99=2e-5, busy=busy), "exact": detector_times(mean=4.1e-5, p99=1e-4)}
    document = document_with(audit={"slow": audit_of()}, detectors=detectors, oracle="exact")
    reference = Rank("exact", "", "", contacts=3, mean=4.1e-5, p99=1e-4)
    ranks = (replace(reference, label="slow", mean=1e-5), reference)
    cost = price_reason(SimpleNamespace(document=document, ranking=ranks), decision_to_ship=None)
    slowest = "" if busy > 0.05 else ", 99 % within 0.1 ms"
    assert cost.text == f"exact takes 0.041 ms a frame{slowest}; slow 0.01 ms."
    assert cost.figures.startswith(f"exact takes 0.37 % of a 90 Hz frame on average. {TIMES_SENTENCE}")
    unknown = (*ranks[:1], replace(reference, p99=None))
    cost_without = price_reason(SimpleNamespace(document=document, ranking=unknown), decision_to_ship=None)
    assert "99 %" not in cost_without.text and NO_SLOWEST_SENTENCE in cost_without.figures
    sentence = "The machine was busy (69 %): run again for reliable times."
    assert cost.figures.endswith(sentence) == (busy > 0.05)
    assert (
        price_reason(
            SimpleNamespace(document=structs.replace(document, audit={}), ranking=()), decision_to_ship=None
        ).text
        == ""
    )


@pytest.mark.parametrize(
    ("code", "severity", "is_doubt"),
    [
        ("mesh-apart", Severity.ERROR, True),
        ("mesh-apart", Severity.WARNING, True),
        ("mesh-apart", Severity.NOTE, False),
        ("teleport", Severity.ERROR, True),
        ("teleport", Severity.WARNING, False),
        ("unit-suspect", Severity.NOTE, True),
    ],
)
def test_errors_wrong_scales_and_misplaced_meshes_are_doubts(code, severity, is_doubt):
    """A teleport doubts its moment alone; a wrong unit and a mesh apart from its track doubt every contact."""
    assert len(doubts_of([Finding(code, "m", own_severity=severity)])) == is_doubt


def test_cost_of_sampling_every_frame_is_measured_only_live():
    """A detector of 10 Hz is also timed at every frame, in seconds a frame; hybrid samples every frame anyway.

    Offline it is not timed so, but has the same counts over its sampling offsets (``phases``).
    """
    live = compute(jumping(), detectors="slow=discrete[rate_hz=10]", oracle="hybrid")
    seconds_a_frame = live.document.detectors["slow"].seconds.at_every_frame
    assert live.document.detectors["slow"].live
    assert live.phases["slow"].every_frame.seconds == seconds_a_frame > 0
    assert live.document.detectors["hybrid"].seconds.at_every_frame is None
    offline = compute(jumping(), detectors="slow=discrete[rate_hz=10]", oracle="hybrid", offline=True)
    assert offline.phases["slow"].every_frame.seconds is None
    assert offline.phases["slow"].proportions() == live.phases["slow"].proportions()


def test_a_note_names_contacts_not_counted_while_grasped():
    """``counts``: contacts and false frames while a hand holds a body; of none there is no note."""

    def notes_of_counts(**counts):
        audit = audit_of(while_grasped=zeros(GraspedCounts, **counts))
        return grasped_notes(SimpleNamespace(document=document_with(audit={"slow": audit})))

    assert notes_of_counts() == []
    assert notes_of_counts(false_contact=3) == [
        "While a hand holds it: not counted. There slow reports 3 false frames."
    ]
    assert notes_of_counts(contacts=1) == ["While a hand holds it: not counted. There slow misses 0 of 1 contact."]


@pytest.mark.parametrize(
    ("counts", "lines"),
    [
        ((), []),
        ((1,), ["it was limited to 4 convex pieces of a mesh: it made 1 piece of each, 1 in all."]),
        ((3, 1, 4), ["it was limited to 4 convex pieces of a mesh: it made 1 to 4 pieces of each, 8 in all."]),
    ],
)
def test_number_of_pieces_of_a_compound_is_printed(counts, lines):
    """``counts``: pieces of each mesh, of at most 4; a hull has none."""
    pieces = {str(k): (None,) * count for k, count in enumerate(counts)}
    shape = "compound" if counts else "hull"
    detector = SimpleNamespace(settings=SimpleNamespace(shape=shape, pieces=4), parts=pieces)
    assert compound_lines(SimpleNamespace(detectors={"it": detector})) == lines


def test_an_unmeasured_fix_is_a_command_with_the_other_settings():
    """Without figures over sampling offsets (``phases``) no fix is measured: meshes at every frame are advised.

    The first contact that meshes at 20 Hz miss begins in frame 4, at 10 ms a frame.
    """
    run = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=collider[shape=mesh,rate_hz=20]")
    (answer,) = answers_of_run(replace(run, phases={}), run.document, run.ranking)
    assert not answer.fix.measured and answer.fix.command.endswith(' --detectors "collider[shape=mesh]"')
    assert (answer.moment.frame, answer.moment.seconds) == (4, 0.04)


@pytest.mark.parametrize("detector", ["collider[shape=mesh]", "discrete[containment=false]"])
def test_a_contact_between_frames_is_fixed_by_continuous(detector):
    """A cube is 3 edges away at 10 ms and as far beyond at 20 ms: it touches after 2 of 6 edges, a third of the way."""
    (answer,) = compute(jumping(), detectors=detector, oracle="continuous").answers
    assert answer.fix.measured and "continuous" in answer.fix.text
    assert answer.moment.seconds == pytest.approx(0.01 + 0.01 / 3, abs=1e-6)
