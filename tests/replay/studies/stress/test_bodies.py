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

ANY_CASE = 41
"""Number under which scenes of a test are counted; any but 43, "repeated answers", which asks without scenes."""

STRICT = {"seed": 0, "tau": 0.0}
"""Nothing is drawn from the seed here, and no wrong answer is excused: a tolerance of 0 m."""


def tallies_of_cases(detectors, cases, **settings):
    """Counts of a detector's answers in each hard case: asked, missed, invented (false), within tau, refused, ...

    ``settings``: ``tau`` is the depth or gap in metres within which a wrong answer is excused, 2 um unless given.
    """
    number_of_name = {name: number for number, name in CASE_NAMES.items()}
    numbers = [number_of_name[case] for case in cases]
    return stress(",".join(detectors), families=(), cases=numbers, **settings).tallies


def test_containment_that_a_detector_refuses_is_no_miss():
    """A box of 1 m inside one of 4 m, then 9 m beside it, where the two are clear.

    A detector without the question of containment says so of itself; of the first frame it is refused and not wrong,
    though no wrong answer is excused here (STRICT: ``tau`` is 0).
    """
    motion = motion_at([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    truth = [Verdict.CONTAINED, Verdict.CLEAR]
    scene = scene_of_instants("", (box_mesh((4.0, 4.0, 4.0)), box_mesh()), motion, truth)
    tally = ask_case("discrete[containment=false]", ANY_CASE, [scene], **STRICT)
    assert (tally.asked, tally.refused, tally.missed, tally.invented) == (2, 1, 0, 0)
    assert tally.reason != ""


# "thin-wall phases", a cube through a plate, has tests of its own (tests/acceptance/test_thin_wall.py).
@pytest.mark.sampled(8)
@pytest.mark.parametrize("case", [name for name in CASE_NAMES.values() if name != "thin-wall phases"])
def test_exact_passes_or_speaks_of_frames(case):
    """Exact decides at frames: it misses contacts between them, about which it promises nothing, and nothing else.

    "start, end, no motion" asks about the time between frames too, but its bodies meet at frames.
    """
    (tally,) = tallies_of_cases(["exact"], [case])
    assert tally.asked > 0
    assert tally.invented == tally.within == tally.refused == tally.changed == 0
    assert (tally.missed > 0) == (case in MISSED_BETWEEN_FRAMES)
    assert tally.promised == (case not in (*MISSED_BETWEEN_FRAMES, "start, end, no motion"))
    assert StressResult(seed=100, pairs=1, tau=0.0, tallies=(tally,)).broken == [], "no promise is broken"


CASES_WITH_MOTION = [
    "start, end, no motion",
    *(
        pytest.param(name, marks=pytest.mark.slow) if name == "glancing spins" else name
        for name in MISSED_BETWEEN_FRAMES
    ),
]
"""Cases that ask about the time between frames, where bodies may meet that are apart at every frame."""


@pytest.mark.parametrize("case", CASES_WITH_MOTION)
def test_continuous_detector_passes_all_cases_with_motion(case):
    """The detector ``continuous`` is asked for contact between frames: it is right each time, as it promises to be."""
    (tally,) = tallies_of_cases(["continuous"], [case])
    assert tally.asked > 0
    assert (tally.words, tally.promised, tally.reason) == ("passed", True, "")


def test_python_fcl_errors_on_degenerate_meshes_need_tau():
    """hybrid decides by python-fcl, whose errors in two hard cases are about gaps and depths below 2 um.

    With that tau they are counted as within, not as missed or false; with a tau of 0 they are wrong.
    """
    resting, degenerate = tallies_of_cases(["hybrid"], ["resting contact", "mesh degeneracies"])
    assert resting.missed == resting.invented == resting.refused == 0
    assert degenerate.missed == degenerate.invented == degenerate.refused == 0
    assert degenerate.within > 0
    (strict,) = tallies_of_cases(["hybrid"], ["mesh degeneracies"], tau=0.0)
    assert strict.within == 0
    assert strict.missed + strict.invented > 0


SLAB_1_M_THICK = box_mesh((8.0, 8.0, 1.0))


@pytest.mark.parametrize(
    ("other", "position", "is_within"),
    [
        pytest.param(SLAB_1_M_THICK, [0.1, 0.2, 1.0 - 0.005], True, id="5 mm deep in a slab"),
        pytest.param(SLAB_1_M_THICK, [0.1, 0.2, 1.0 - 0.015], False, id="15 mm deep in a slab"),
        # Every two faces meet 0 deep, though a shift by tau does not part the cubes.
        pytest.param(box_mesh(), [0.5, 0.0, 0.0], False, id="half in a cube that shares planes with it"),
    ],
)
def test_missed_contact_is_within_tolerance_only_when_no_deeper(other, position, is_within):
    """A detector that never reports contact, about a cube of 1 m in another body; tau is 1 cm."""
    scene = scene_of_instants("", (box_mesh(), other), motion_at([position]))
    tally = ask_case("support.planted_detectors:Blamed", ANY_CASE, [scene], seed=0, tau=0.01)
    assert (tally.within, tally.missed, tally.reason) == ((1, 0, "") if is_within else (0, 1, ""))


def test_sphere_detector_refuses_stress_cases_about_containment():
    """Four scenes of six frames have a body inside another: spheres overlap, which is a candidate and no contact.

    Each of the 24 answers is either refused or unconfirmed; none is wrong.
    """
    (tally,) = tallies_of_cases(["sphere"], ["containment"])
    assert tally.asked == 4 * 6
    assert tally.refused + tally.unconfirmed == 24
    assert tally.missed == tally.invented == 0


def test_stress_detects_answers_that_depend_on_blocks(monkeypatch):
    """97 frames are asked whole and in blocks of 1, 10, 64 and 4096 frames, and joined; here only the first block is.

    Three of the four answers differ: 4096 frames are one block. That breaks the promise of exact.
    """
    monkeypatch.setattr(bodies, "join", lambda blocks: blocks[0])
    (tally,) = tallies_of_cases(["exact"], ["repeated answers"])
    assert (tally.asked, tally.changed) == (4, 3)
    assert "blocks 1" in tally.reason
    assert len(StressResult(seed=100, pairs=1, tau=0.0, tallies=(tally,)).broken) == 1


def test_exact_states_that_it_decides_at_frames_only():
    """A box of 1 m goes through another between two frames, from 3 m on one side to 3 m on the other.

    Whether they meet on the way is missed, not promised, and explained; nothing is excused (STRICT: ``tau`` is 0).
    """
    boxes, through = (box_mesh(), box_mesh()), motion_at([[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    scene = scene_of_intervals("", boxes, through, meets=True)
    tally = ask_case("exact", ANY_CASE, [scene], **STRICT)
    assert (tally.missed, tally.promised, tally.reason) == (1, False, FRAMES_ONLY_REASON)


def test_continuous_detector_answers_instants_frame_by_frame():
    """Boxes of 1 m touch in the first frame; between the second and the third they pass through each other.

    A detector of whole intervals is asked about each frame alone, so that it does not report the passage. No wrong
    answer is excused (STRICT: ``tau`` is 0).
    """
    truth = [Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    motion = motion_at([[0.5, 0.0, 0.0], [3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]])
    scene = scene_of_instants("boxes", (box_mesh(), box_mesh()), motion, truth)
    tally = ask_case("continuous", ANY_CASE, [scene], **STRICT)
    assert (tally.asked, tally.failed) == (3, 0)
