"""Detections and misses agree with formulas: sessions whose every contact is known in closed form."""

import pytest
from support.second_opinions import predicted
from support.small_worlds import ANALYTIC, make_analytic

from cdcore.protocol import counts_as_contact
from replay.auditing.fault import FaultKind
from replay.detection.detector_spec import TRUSTED_DETECTOR as EXACT
from replay.engine import compute
from sessions.synthetic.truth import CLEAR, PRESENT

SLOW_RATE_HZ = 22.5
"""Samples a second of a detector: one in four of the 90 frames."""

FRAME_S = 1.001 / 90.0
"""Seconds from frame to frame, and 0.1 % for the rounding of stamps."""

RECORDINGS = [
    pytest.param({"noise": "off", "jitter": "even"}, id="clean"),
    pytest.param({"noise": "vive", "jitter": "steady", "seed": 3}, id="tracker noise"),
    pytest.param({"noise": "vive", "jitter": "browser", "seed": 5}, id="tracker noise and uneven frames"),
]


@pytest.mark.sampled(5)
@pytest.mark.parametrize("how", RECORDINGS)
@pytest.mark.parametrize("name", ANALYTIC)
def test_no_frame_contradicts_the_closed_form(name, how):
    """Six seconds of a world whose contacts are known in closed form, recorded with or without a tracker's noise.

    ``exact`` says contact where surfaces surely meet or a body surely is inside the other, and none where neither can
    be; between these, noise and the faces of round bodies leave the answer open. Frames without a pose do not count.
    """
    session, truth = make_analytic(name, seconds=6.0, **how)
    result = compute(session, detectors=EXACT, oracle="none")
    contact = counts_as_contact(result.detections[EXACT].verdict)
    has_poses = result.assembly.motion.valid.all(axis=1)
    for pair in range(contact.shape[1]):
        a, b = (result.assembly.names[body] for body in result.assembly.pairs[pair])
        stamps = result.assembly.stamp_ns
        surfaces = truth.expected(a, b, stamps)
        inside = truth.expected(a, b, stamps, "contained")
        surely_contact = ((surfaces == PRESENT) | (inside == PRESENT)) & has_poses
        surely_none = (surfaces == CLEAR) & (inside == CLEAR) & has_poses
        # A graze of a few tenths of a millimetre is nowhere certain under five sigma of tracker noise.
        grazes_in_noise = (name, how["noise"]) == ("grazing-ball", "vive")
        assert surely_none.any() and (surely_contact.any() or grazes_in_noise)
        assert contact[surely_contact, pair].all()
        assert not contact[surely_none, pair].any()


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", ANALYTIC)
def test_contact_intervals_match_the_closed_form_to_a_frame(name):
    """Six seconds at 90 Hz of a world whose contacts are known in closed form.

    ``exact`` reports as many contacts, each begins and ends within a frame of the formula's (``nominal``: of smooth
    shapes without noise); those of the formula that no frame falls into do not count. Of grazes, a few frames long,
    only those that are reported must be planted.
    """
    session, truth = make_analytic(name, seconds=6.0)
    result = compute(session, detectors=EXACT, oracle="none")
    times = result.assembly.motion.times
    assert truth.pairs
    for pair in truth.pairs:
        nominal = sorted(episode.nominal for episode in truth.episodes if episode.pair == pair and episode.nominal)
        expected = [span for span in _joined(nominal) if ((times >= span[0]) & (times <= span[1])).any()]
        column = next(p for p in range(len(result.assembly.pairs)) if _names(result, p) == pair)
        actual = [(contact.start, contact.end) for contact in result.episodes[EXACT] if contact.pair == column]
        if name == "grazing-ball":  # whether it touches, the faces of the ball decide
            assert all(any(_overlap(contact, span, FRAME_S) for span in expected) for contact in actual)
            continue
        assert len(actual) == len(expected), (actual, expected)
        for (start, end), (expected_start, expected_end) in zip(actual, expected, strict=True):
            assert abs(start - expected_start) <= FRAME_S + 1e-9, (pair, start, expected_start)
            assert abs(end - expected_end) <= FRAME_S + 1e-9, (pair, end, expected_end)


def _names(result, pair):
    """Names of both bodies of a pair, sorted."""
    return tuple(sorted(result.assembly.names[k] for k in result.assembly.pairs[pair]))


def _overlap(first, other, slack):
    """Whether two intervals overlap, or are within ``slack`` of it."""
    return first[0] <= other[1] + slack and other[0] <= first[1] + slack


def _joined(spans):
    """Contact that turns into containment and back is one contact of the audit."""
    out = []
    for start, end in spans:
        if out and start <= out[-1][1] + 1e-9:
            out[-1] = (out[-1][0], max(end, out[-1][1]))
        else:
            out.append((start, end))
    return out


@pytest.mark.sampled(15)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
@pytest.mark.parametrize("name", sorted(ANALYTIC, reverse=True))  # the quick case is the rod, which misses most
def test_misses_at_22_5_hz_match_the_closed_form(name, seed):
    """Six seconds at 90 Hz; a detector samples every fourth frame.

    Contacts that by their closed form lie between two samples and on a frame are never reported; others are, but those
    that the faces of round bodies leave open (``undecided``).
    """
    session, truth = make_analytic(name, seconds=6.0, seed=seed)
    expected = predicted(truth, session.frames.stamp_ns, SLOW_RATE_HZ)
    slow = f"slow=discrete[rate_hz={SLOW_RATE_HZ},sampling_offset_s=0]"
    # The closed form counts contacts of any depth, so no overlap is too shallow to be missed (tau).
    result = compute(session, detectors=slow, oracle=EXACT, tau=0.0)
    never_reported = [miss for miss in result.misses["slow"] if miss.kind == FaultKind.NEVER_REPORTED]
    for contact in expected.missed:
        assert any(_is(miss, contact) for miss in never_reported), contact
    for miss in never_reported:
        assert any(_is(miss, contact) for contact in (*expected.missed, *expected.undecided)), miss


def _is(miss, episode):
    """Whether a miss is of a planted contact; ``possibly``: the seconds outside which no frame can have it."""
    lower, upper = episode.possibly
    same_pair = tuple(sorted(miss.bodies)) == episode.pair
    # A contact lasts until the frame after its last.
    return same_pair and lower <= miss.start < upper and miss.end <= upper + FRAME_S
