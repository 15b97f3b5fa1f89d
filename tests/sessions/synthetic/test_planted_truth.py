"""An engine that knows no formula finds in every made-up session what was planted, and nothing else."""

import itertools

import numpy as np
import pytest
from support.small_worlds import ANALYTIC

from cdcore import Verdict
from sessions.synthetic.scenes import SCENES
from sessions.synthetic.truth import CLEAR, PRESENT

FIRST, *REST = SCENES
QUICK = [FIRST, *ANALYTIC]
KINDS = {"contact": Verdict.CONTACT, "contained": Verdict.CONTAINED}


def pairs_of(run):
    """All pairs of bodies, but two fixed ones, two of a group, and a stopcock, which always touches its burette."""
    bodies = {body.id: body for body in run.session.scene.bodies}
    names = sorted({*run.session.names, *bodies} - {"stopcock"})
    pairs = itertools.combinations(names, 2)
    if not bodies:
        return list(pairs)
    return [
        (a, b)
        for a, b in pairs
        if (bodies[a].fixed is None or bodies[b].fixed is None)
        and not (bodies[a].group and bodies[a].group == bodies[b].group)
    ]


@pytest.mark.sampled(30)
@pytest.mark.parametrize(
    ("name", "noise"),
    [
        *((name, "off") for name in QUICK),
        *((name, "vive") for name in ANALYTIC),
        pytest.param(FIRST, "vive", marks=pytest.mark.slow),
        *(pytest.param(name, noise, marks=pytest.mark.slow) for name in REST for noise in ("off", "vive")),
    ],
)
def test_detector_reports_exactly_the_planted_contacts(name, noise, made, verdicts):
    """A made-up session knows, for each pair and frame, whether contact is sure (PRESENT), surely not there or open.

    The detector reports contact (or a body inside another) where it is sure and has poses, and nowhere where it surely
    is not. Without noise of a tracker it begins and ends within 1.5 frames of the planted times.
    """
    run = made(name, noise)
    pairs = pairs_of(run)
    result = verdicts(run.session, pairs)
    has_poses = result != Verdict.NO_POSE
    step = np.diff(run.times).max()
    for column, pair in enumerate(pairs):
        for kind, verdict in KINDS.items():
            expected = run.truth.expected(*pair, run.session.frames.stamp_ns, kind)
            reported = result[:, column] == verdict
            assert reported[(expected == PRESENT) & has_poses[:, column]].all(), (pair, kind)
            assert not reported[expected == CLEAR].any(), (pair, kind, run.times[reported & (expected == CLEAR)][:3])
            for episode in run.truth.of(*pair, kind) if noise == "off" else ():
                earliest, latest = episode.possibly  # seconds between which the contact may be, here with 0.1 s more
                times = run.times[reported & run.near(earliest - 0.1, latest + 0.1)]
                if episode.surely and len(times):
                    assert times[[0, -1]] == pytest.approx(episode.nominal, abs=1.5 * step), (pair, kind)
