"""Cases are counted under the right word, say why, and gate only what the detector promised."""

import pytest

from cdcore import Verdict
from replay.studies.stress import bodies
from replay.studies.stress.bodies import CASE_NAMES, FRAMES_ONLY_REASON, ask_case
from replay.studies.stress.runner import stress
from replay.studies.stress.scenes import motion_at, scene_of_instants, scene_of_intervals
from replay.studies.stress.solids import box_mesh
from replay.studies.stress.tally import StressResult

MISSED_BETWEEN_FRAMES = (
    "rotation only",
    "grazing",
    "time reversal and splitting",
    "glancing spins",
    "crossings far away",
)
"""Hard cases with contacts that begin and end between two frames."""


def tallies_of_cases(detectors, cases, **more):
    """The counts of answers to hard cases, which are named here and numbered in the product."""
    numbers = {name: number for number, name in CASE_NAMES.items()}
    return stress(",".join(detectors), families=(), cases=[numbers[case] for case in cases], **more).tallies


def test_containment_that_a_detector_refuses_is_no_miss():
    """A box inside another, and beside it: without the question of containment both look clear."""
    motion = motion_at([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    truth = [Verdict.CONTAINED, Verdict.CLEAR]
    scene = scene_of_instants("", (box_mesh((4.0, 4.0, 4.0)), box_mesh()), motion, truth)
    any_case_of_scenes = 41
    item = ask_case("discrete[containment=false]", any_case_of_scenes, [scene], seed=0, tau=0.0)
    assert (item.asked, item.refused, item.missed, item.invented) == (2, 1, 0, 0)
    assert item.reason


@pytest.mark.sampled(8)
@pytest.mark.parametrize("case", [name for name in CASE_NAMES.values() if name != "thin-wall phases"])
def test_exact_passes_or_speaks_of_frames(case):
    """A detector that speaks of frames cannot see contacts between them; end poses are frames again."""
    (item,) = tallies_of_cases(["exact"], [case])
    assert item.invented == item.within == item.refused == item.changed == 0 and item.asked > 0
    assert (item.missed > 0) == (case in MISSED_BETWEEN_FRAMES)
    assert item.promised == (case not in (*MISSED_BETWEEN_FRAMES, "start, end, no motion"))
    assert StressResult(seed=100, pairs=1, tau=0.0, tallies=(item,)).broken == []


def test_continuous_detector_passes_all_stress_families_with_motion():
    """The six cases whose bodies meet between frames."""
    results = tallies_of_cases(["continuous"], [*MISSED_BETWEEN_FRAMES, "start, end, no motion"])
    assert len(results) == 6
    for item in results:
        assert item.words == "passed" and item.promised and item.reason == "", item


def test_python_fcl_errors_on_degenerate_meshes_need_tau():
    """With the usual tau hybrid has no error in two hard cases; with 0 its errors in mesh degeneracies count."""
    reported = tallies_of_cases(["hybrid"], ["resting contact", "mesh degeneracies"])
    assert all(item.missed == item.invented == item.refused == 0 for item in reported) and reported[1].within > 0
    (strict,) = tallies_of_cases(["hybrid"], ["mesh degeneracies"], tau=0.0)
    assert strict.within == 0 and strict.missed + strict.invented > 0


def test_missed_contact_is_within_tolerance_only_when_no_deeper():
    """Tau is 1 cm: a cube 5 mm deep in a slab of 1 m, one 15 mm deep.

    Of cubes that share planes every two faces meet 0 deep, though the cubes are in each other by a half.
    """
    slab = box_mesh((8.0, 8.0, 1.0))
    for other, position, within in (
        (slab, [0.1, 0.2, 0.995], 1),
        (slab, [0.1, 0.2, 0.985], 0),
        (box_mesh(), [0.5, 0.0, 0.0], 0),
    ):
        scene = scene_of_instants("", (box_mesh(), other), motion_at([position]))
        item = ask_case("support.planted_detectors:Blamed", 41, [scene], seed=0, tau=0.01)
        assert (item.within, item.missed, item.reason) == (within, 1 - within, "")


def test_sphere_detector_refuses_stress_cases_about_containment():
    """24 questions: spheres that overlap are unconfirmed, and containment is refused."""
    (item,) = tallies_of_cases(["sphere"], ["containment"])
    assert item.missed == item.invented == 0 and item.asked == 24
    assert item.refused + item.unconfirmed == 24


def test_stress_detects_answers_that_depend_on_blocks(monkeypatch):
    """Joining is broken: only the first block is kept."""
    monkeypatch.setattr(bodies, "join", lambda parts: parts[0])
    (item,) = tallies_of_cases(["exact"], ["repeated answers"])
    assert (item.asked, item.changed) == (4, 3) and "blocks 1" in item.reason
    assert len(StressResult(seed=100, pairs=1, tau=0.0, tallies=(item,)).broken) == 1


def test_exact_states_that_it_decides_at_frames_only():
    """A box goes through another between two frames: missed, and not promised."""
    boxes, through = (box_mesh(), box_mesh()), motion_at([[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    item = ask_case("exact", 44, [scene_of_intervals("", boxes, through, meets=True)], seed=0, tau=0.0)
    assert (item.missed, item.promised, item.reason) == (1, False, FRAMES_ONLY_REASON)


def test_continuous_detector_answers_instants_frame_by_frame():
    """Between the second frame and the third the boxes pass through each other."""
    truth = [Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    motion = motion_at([[0.5, 0.0, 0.0], [3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]])
    scene = scene_of_instants("boxes", (box_mesh(), box_mesh()), motion, truth)
    any_case_of_scenes = 41
    tally = ask_case("continuous", any_case_of_scenes, [scene], seed=0, tau=0.0)
    assert (tally.asked, tally.failed) == (len(motion), 0)
