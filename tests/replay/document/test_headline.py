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


def price_of_slow_and_exact(busy, p99=1e-4):
    """The cost of a run of slow (0.01 ms a frame) and exact, the reference (0.041 ms).

    ``busy``: fraction of the time in which other work took the processor; ``p99``: seconds that 99 % of the frames of
    exact do not exceed, None: not measured.
    """
    detectors = {
        "slow": detector_times(mean=1e-5, p99=2e-5, busy=busy),
        "exact": detector_times(4.1e-5, p99, busy=busy),
    }
    document = document_with(audit={"slow": audit_of()}, detectors=detectors, oracle="exact")
    reference = Rank("exact", "", "", contacts=3, mean=4.1e-5, p99=p99)
    ranking = (replace(reference, label="slow", mean=1e-5), reference)
    return price_reason(SimpleNamespace(document=document, ranking=ranking), decision_to_ship=None)


def test_cost_is_the_reference_time_beside_the_worst_detector():
    """exact takes 0.041 ms a frame, 0.37 % of the 11.1 ms at 90 Hz, and slow, the only other detector, 0.01 ms.

    Other work took 3 % of the processor, which does not matter.
    """
    cost = price_of_slow_and_exact(busy=0.03)
    assert cost.text == "exact takes 0.041 ms a frame, 99 % within 0.1 ms; slow 0.01 ms."
    assert cost.figures == f"exact takes 0.37 % of a 90 Hz frame on average. {TIMES_SENTENCE}"


def test_cost_on_a_busy_machine_leaves_out_the_slowest_frames():
    """Other work took 69 % of the processor, more than the 5 % that do not matter: slow frames may be due to that."""
    cost = price_of_slow_and_exact(busy=0.69)
    assert cost.text == "exact takes 0.041 ms a frame; slow 0.01 ms."
    assert cost.figures.endswith(f"{TIMES_SENTENCE} The machine was busy (69 %): run again for reliable times.")


def test_cost_says_that_slowest_frames_were_not_measured():
    """The reference was not timed frame by frame, so that there is no 99 % of them."""
    cost = price_of_slow_and_exact(busy=0.03, p99=None)
    assert "99 %" not in cost.text
    assert NO_SLOWEST_SENTENCE in cost.figures


def test_run_without_an_audit_has_no_cost_to_state():
    """No detector was compared with a reference, so that the ranking is empty."""
    assert price_reason(SimpleNamespace(document=document_with(), ranking=()), decision_to_ship=None).text == ""


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
    """A finding about the recording; a wrong unit and a mesh apart from its track doubt every contact.

    A teleport doubts its moment alone, unless it is an error.
    """
    assert len(doubts_of([Finding(code, "any message", own_severity=severity)])) == (1 if is_doubt else 0)


def test_cost_of_sampling_every_frame_is_measured_only_live():
    """A detector of 10 Hz, run frame by frame, is also timed at every frame: ``phases`` has it beside other samplings.

    hybrid, the reference, samples every frame anyway.
    """
    live = compute(jumping(), detectors="slow=discrete[rate_hz=10]", oracle="hybrid")
    assert live.document.detectors["slow"].live
    seconds_a_frame = live.document.detectors["slow"].seconds.at_every_frame
    assert live.phases["slow"].every_frame.seconds == seconds_a_frame > 0
    assert live.document.detectors["hybrid"].seconds.at_every_frame is None


def test_offline_run_has_equal_counts_but_no_times_of_frames():
    """A detector of 10 Hz gets frames one by one, or all at once; ``phases``: its counts over sampling offsets."""
    live, offline = (
        compute(jumping(), detectors="slow=discrete[rate_hz=10]", oracle="hybrid", offline=offline)
        for offline in (False, True)
    )
    assert offline.phases["slow"].every_frame.seconds is None
    assert offline.phases["slow"].proportions() == live.phases["slow"].proportions()


@pytest.mark.parametrize(
    ("counts", "notes"),
    [
        pytest.param({}, [], id="nothing"),
        pytest.param(
            {"false_contact": 3},
            ["While a hand holds it: not counted. There slow reports 3 false frames."],
            id="three false frames",
        ),
        pytest.param(
            {"contacts": 1},
            ["While a hand holds it: not counted. There slow misses 0 of 1 contact."],
            id="one contact",
        ),
    ],
)
def test_a_note_names_contacts_not_counted_while_grasped(counts, notes):
    """``counts``: of contacts, and of frames that ``slow`` reports falsely, while a hand holds a body."""
    audit = audit_of(while_grasped=zeros(GraspedCounts, **counts))
    assert grasped_notes(SimpleNamespace(document=document_with(audit={"slow": audit}))) == notes


@pytest.mark.parametrize(
    ("shape", "pieces_of_meshes", "lines"),
    [
        ("hull", (), []),
        ("compound", (1,), ["it was limited to 4 convex pieces of a mesh: it made 1 piece of each, 1 in all."]),
        (
            "compound",
            (3, 1, 4),
            ["it was limited to 4 convex pieces of a mesh: it made 1 to 4 pieces of each, 8 in all."],
        ),
    ],
    ids=["hull", "one mesh", "three meshes"],
)
def test_number_of_pieces_of_a_compound_is_printed(shape, pieces_of_meshes, lines):
    """A collider called "it" splits each mesh into at most 4 convex pieces; a hull has none."""
    parts = {str(mesh): (None,) * count for mesh, count in enumerate(pieces_of_meshes)}
    detector = SimpleNamespace(settings=SimpleNamespace(shape=shape, pieces=4), parts=parts)
    assert compound_lines(SimpleNamespace(detectors={"it": detector})) == lines


def test_an_unmeasured_fix_is_a_command_with_the_other_settings():
    """Without figures over sampling offsets (``phases``) no fix is measured: meshes at every frame are advised.

    Cubes touch in frame 4 and in frames 8 to 10, of 10 ms each; meshes at 20 Hz, every fifth frame, miss frame 4.
    """
    run = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=collider[shape=mesh,rate_hz=20]")
    (answer,) = answers_of_run(replace(run, phases={}), run.document, run.ranking)
    assert not answer.fix.measured
    assert answer.fix.command.endswith(' --detectors "collider[shape=mesh]"')
    assert (answer.moment.frame, answer.moment.seconds) == (4, 0.04)


@pytest.mark.parametrize("detector", ["collider[shape=mesh]", "discrete[containment=false]"])
def test_a_contact_between_frames_is_fixed_by_continuous(detector):
    """A cube is 3 edges away at 10 ms and as far beyond at 20 ms: it touches after 2 of 6 edges, a third of the way.

    Both detectors judge frames alone, and miss it; ``continuous``, the reference, judges the way between them.
    """
    (answer,) = compute(jumping(), detectors=detector, oracle="continuous").answers
    assert answer.fix.measured
    assert "continuous" in answer.fix.text
    assert answer.moment.seconds == pytest.approx(0.01 + 0.01 / 3, abs=1e-6)
