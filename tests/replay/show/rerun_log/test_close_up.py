"""Close-ups: how far the eye is from a moment, and what is drawn at it."""

from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Motion
from replay.auditing.fault import Evidence, Fault, FaultKind
from replay.auditing.outcome import Episode
from replay.show.camera import CLOSE_UP_M, Eye
from replay.show.rerun_log.close_up import (
    GAP_COLOUR,
    HALF_BAR_M,
    TEXT_DISTANCE_FRACTION,
    TEXT_HEIGHT,
    close_up_eyes,
    in_front,
    log_close_ups,
    point_on_screen,
    text_beside,
)
from sessions import Scene

TIME = (3, 0)
EYE = Eye(position=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0))
"""Looks along -Z, with +X on its right and +Y up."""


def fault_of(kind, nearest=None):
    """A fault of the detector ``hull`` about a cup and a rod in frame 3."""
    return Fault(1, "hull", 0, ("cup", "rod"), kind, 3, 4, 0.3, 0.5, 3, metres=0.02, evidence=Evidence(nearest=nearest))


def run_of_cup_and_rod():
    """A run of six frames whose only detector has no solids but the meshes."""
    poses = np.zeros((6, 2, 3)), np.tile(np.eye(3), (6, 2, 1, 1))
    bodies = [SimpleNamespace(name=name, mesh=object()) for name in ("cup", "rod")]
    assembly = SimpleNamespace(
        bodies=bodies, names=["cup", "rod"], pairs=np.array([[0, 1]]), motion=Motion(np.arange(6), *poses)
    )
    session = SimpleNamespace(scene=Scene())
    return SimpleNamespace(assembly=assembly, session=session, comparisons={"hull": None}, detectors={})


@pytest.mark.parametrize(
    ("moment", "radius", "distance"),
    [
        (fault_of(FaultKind.NEVER_REPORTED), 0.1, CLOSE_UP_M),
        (fault_of(FaultKind.NO_CONTACT), 0.1, 3.3 * 0.1),
        (Episode(0, 3, 4, 0.3, 0.5), 0.1, 3.3 * 0.1),
        (fault_of(FaultKind.NO_CONTACT), 0.2, 0.45),
        (fault_of(FaultKind.NO_CONTACT), 0.01, CLOSE_UP_M),
    ],
    ids=["miss", "false contact", "contact", "large body", "small body"],
)
def test_eye_sees_the_smaller_body_or_the_miss(moment, radius, distance):
    """``radius``: of the ball around the rod, the cup has 1 m. The eye is at most 45 cm away, as near as to a miss."""
    balls = [SimpleNamespace(radius=1.0), SimpleNamespace(radius=radius)]
    eye = close_up_eyes(run_of_cup_and_rod(), {TIME: moment}, balls)[TIME]
    assert np.linalg.norm(np.subtract(eye.position, eye.target)) == pytest.approx(distance)


def test_line_of_a_gap_has_a_bar_at_both_ends():
    """A gap of 2 cm along X, seen along Z: its bars are upright."""
    drawn = {}
    writer = SimpleNamespace(
        clock=SimpleNamespace(ns=range(6)),
        rows=lambda *_: None,
        static=lambda *_: None,
        steps=lambda path, steps, marks, columns: drawn.update({path: marks}),
    )
    false = fault_of(FaultKind.NO_CONTACT, nearest=((0.1, 0.05, 0.0), (0.12, 0.05, 0.0)))
    log_close_ups(writer, run_of_cup_and_rod(), {TIME: false}, {TIME: EYE}, balls=[])
    lines = [mark.places for mark in drawn["world/focus/lines"][TIME] if mark.colour == GAP_COLOUR][-3:]
    gap, first_bar, last_bar = (EYE.position + (line - EYE.position) / TEXT_DISTANCE_FRACTION for line in lines)
    assert gap == pytest.approx(np.array([[0.1, 0.05, 0.0], [0.12, 0.05, 0.0]]))
    for bar, x in ((first_bar, 0.1), (last_bar, 0.12)):
        upright = bar[np.argsort(bar[:, 1])]
        assert upright == pytest.approx(np.array([[x, 0.05 - HALF_BAR_M, 0.0], [x, 0.05 + HALF_BAR_M, 0.0]]))
    assert [mark.text for mark in drawn["world/focus/words"][TIME]] == ["cup and rod: 20 mm apart"]


def test_screen_points_are_right_and_up_in_eye_distances():
    """The eye is 2 m away: 0.25 to the right is 0.5 m, 0.1 down is 0.2 m; texts are 40 % of the way from the eye."""
    point = point_on_screen(EYE, right=0.25, up=-0.1)
    assert point == pytest.approx([0.5, -0.2, 0.0])
    assert in_front(EYE, point[None]) == pytest.approx(np.array([[0.2, -0.08, 1.2]]))


@pytest.mark.parametrize(("up", "line_begins"), [(0.3, 0.3 - TEXT_HEIGHT), (-0.3, -0.3)])
def test_line_from_text_above_begins_below_the_text(up, line_begins):
    """``up``: of the text, in distances of the eye (2 m); its line ends at the point, at a height of 0."""
    text, line = text_beside(EYE, np.zeros(3), "gap", GAP_COLOUR, right=0.0, up=up)
    heights = [TEXT_DISTANCE_FRACTION * 2.0 * height for height in (up, line_begins, 0.0)]
    assert [*text.places[:, 1], *line.places[:, 1]] == pytest.approx(heights)
