"""A fix is another setting than its subject, better where it was measured, and it mends what it is said to mend."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.planted_sessions import channel
from support.small_worlds import cube, unit_cubes_on_x

from replay.auditing.fault import Cause, Fault, FaultKind
from replay.detection.detector_spec import parse_detectors
from replay.document.diagnosis import pieces_may_help
from replay.document.ranking import Rank
from replay.engine import compute
from sessions import Session

SEPARATE = {"a": [0.0] * 12, "b": [3, 3, 1.015, 1.015, 1.015, 3, 3, 0.9, 0.9, 3, 3, 3]}
"""Metres on X of two cubes of 1 m that pass 15 mm apart, in frames 2 to 4, and touch in frames 7 and 8."""


def separate_cubes():
    """A session of two cubes of 1 m that pass 15 mm apart, and touch later."""
    return unit_cubes_on_x(SEPARATE)


def cube_inside_another():
    """A session of a cube of 0.1 m that goes through one of 1 m: across the wall, inside, and out again."""
    session = unit_cubes_on_x({"a": [0.0] * 12, "b": [3, 0.5, 0.3, 0.1, 0, -0.1, -0.3, -0.5, -3, -3, -3, -3]})
    return replace(session, meshes={"a": cube(edge=1.0), "b": cube(edge=0.1)})


def crumb_in_hollow():
    """A session of a crumb that stays in the hollow of a channel without a touch, and then falls onto its floor.

    The convex hull of the channel fills the hollow, so that hulls report contact all the time.
    """
    heights = np.concatenate([np.linspace(0.1, 0.01, 8), np.linspace(0.01, -0.015, 20), np.linspace(-0.02, -0.03, 4)])
    positions = np.zeros((len(heights), 3))
    positions[:, 1] = heights
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(heights), 1))
    poses = {"a": (np.zeros_like(positions), still), "b": (positions, still)}
    return Session.from_arrays(np.arange(len(heights)) * 10_000_000, poses, {"a": channel(), "b": cube(edge=0.01)})


def loss_with_fix(session, answer):
    """The loss, 0 where nothing is wrong, of the detector that a fix names in its command, run on the session."""
    (spec,) = parse_detectors(answer.fix.command.split('"')[1])
    with_fix, _reference = compute(session, detectors=[spec], oracle="exact=exact").ranking
    return with_fix.loss


@pytest.mark.parametrize(
    ("make_session", "detector", "setting"),
    [
        pytest.param(separate_cubes, "collider[shape=hull,skin_m=0.01]", "skin_m=0.0", id="offset of hulls"),
        pytest.param(separate_cubes, "collider[shape=box,skin_m=0.02]", "skin_m=0.0", id="offset of boxes"),
        pytest.param(separate_cubes, "collider[shape=mesh,skin_m=0.01]", "skin_m=0.0", id="offset of meshes"),
        pytest.param(cube_inside_another, "discrete[containment=false]", "containment=true", id="inside, discrete"),
        pytest.param(cube_inside_another, "hybrid[containment=false]", "containment=true", id="inside, hybrid"),
    ],
)
def test_a_fix_changes_the_setting_that_is_the_cause(make_session, detector, setting):
    """Cubes pass 15 mm apart, or a cube is inside another; the fix is a command with the detector in this setting.

    So run it makes no error; the run itself had not measured that. ``skin_m`` is a contact offset of each body in
    metres, ``containment`` a test of what is inside.
    """
    (answer,) = compute(make_session(), detectors=f"it={detector},exact").answers
    assert not answer.fix.measured
    assert setting in answer.fix.command.lower()
    assert loss_with_fix(make_session(), answer) == 0.0


def test_fix_measured_as_no_better_is_not_advised():
    """A crumb is in the hollow of a channel, which its hull fills, at 50 Hz as at every frame: both are as wrong.

    So neither sampling every frame is advised, nor the other detector of the run, by its label.
    """
    detectors = "at50=collider[shape=hull,rate_hz=50],each=collider[shape=hull],exact"
    run = compute(crumb_in_hollow(), detectors=detectors)
    answers = {answer.label: answer for answer in run.answers}
    (rank,) = (rank for rank in run.ranking if rank.label == "at50")
    assert rank.leads_false and "fills its hollow" in answers["at50"].why
    assert answers.keys() == {"at50", "each"}
    for answer in answers.values():
        assert "Sample every frame" not in answer.fix.text
        assert "(at50)" not in answer.fix.text and "(each)" not in answer.fix.text


def test_pieces_of_a_cube_are_not_advised_its_offset_is():
    """Two cubes pass 15 mm apart, in contact for a contact offset (``skin_m``) of 10 mm each.

    A cube is convex: up to 64 convex pieces of it are one piece, so that more pieces would mend nothing.
    """
    pieces = "it=collider[shape=compound,pieces=64,method=box,skin_m=0.01]"
    (answer,) = compute(separate_cubes(), detectors=f"{pieces},exact").answers
    assert "pieces" not in answer.fix.text
    assert "skin_m=0" in answer.fix.text


@pytest.mark.parametrize(
    ("setting", "cause", "undecided", "may_help"),
    [
        ("collider[shape=hull]", Cause.HULL_FILLS_HOLLOW, 0, True),
        ("collider[shape=hull]", Cause.CONTACT_OFFSET, 0, False),
        ("collider[shape=hull]", Cause.HULL_FILLS_HOLLOW, 1, False),
        ("collider[shape=mesh]", Cause.COLLIDER_SHAPE, 0, False),
        ("discrete", Cause.COLLIDERS_MEET, 0, False),
        ("collider[shape=hull]", None, 0, False),
    ],
)
def test_pieces_may_help_where_a_closed_collider_is_wrong(setting, cause, undecided, may_help):
    """Convex pieces may replace a hull that fills a hollow; they mend no contact offset, no undecided contact, no mesh.

    ``cause``: of the only false contact, if any; ``undecided``: contacts that the detector left undecided.
    """
    fault = Fault(1, "it", 0, ("a", "b"), FaultKind.NO_CONTACT, 0, 1, 0.0, 0.1, 0, cause=cause)
    result = SimpleNamespace(misses={}, false={"it": [] if cause is None else [fault]})
    rank = Rank("it", "", setting, contacts=1, mean=None, p99=None, undecided=undecided)
    assert pieces_may_help(result, rank) == may_help


@pytest.mark.slow
def test_two_numbers_of_pieces_are_two_settings():
    """A crumb in the hollow of a channel, by its hull and by up to 1, 2 and 4 convex pieces of it, cut by planes.

    One piece is the hull. The fix of each is twice as many pieces, with the figures of that row of the ranking.
    """
    compounds = [f"c{pieces}=collider[shape=compound,pieces={pieces},method=planes]" for pieces in (1, 2, 4)]
    run = compute(crumb_in_hollow(), detectors=["hull=collider[shape=hull]", *compounds, "exact"])
    answers = {answer.label: answer for answer in run.answers}
    ranks = {rank.label: rank for rank in run.ranking}
    assert ranks["hull"].loss == ranks["c1"].loss > ranks["c2"].loss > ranks["c4"].loss
    for label, better_label, pieces in (("c1", "c2", 2), ("c2", "c4", 4)):
        fix = answers[label].fix
        assert f"Up to {pieces} convex pieces" in fix.text and f"({better_label})" in fix.text
        before, after = (100 * ranks[row].false.value for row in (label, better_label))
        assert fix.change.startswith(f"False {before:.3g} % -> {after:.3g} %")
