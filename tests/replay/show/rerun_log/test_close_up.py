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
    """A fault of the detector ``hull`` about a cup and a rod in frames 3 and 4, 2 cm wide."""
    return Fault(
        number=1, detector="hull", pair=0, bodies=("cup", "rod"), kind=kind, first=3, last=4, start=0.3, end=0.5,
        frame=3, metres=0.02, evidence=Evidence(nearest=nearest),
    )  # fmt: skip


def run_of_cup_and_rod():
    """A run of six frames whose only detector has no solids but the meshes."""
    poses = np.zeros((6, 2, 3)), np.tile(np.eye(3), (6, 2, 1, 1))
    bodies = [SimpleNamespace(name=name, mesh=object()) for name in ("cup", "rod")]
    assembly = SimpleNamespace(
        bodies=bodies, names=["cup", "rod"], pairs=np.array([[0, 1]]), motion=Motion(np.arange(6), *poses)
    )
    session = SimpleNamespace(scene=Scene())
    return SimpleNamespace(assembly=assembly, session=session, comparisons={"hull": None}, detectors={})


def test_eye_sees_the_smaller_body_or_the_miss():
    """Balls around the bodies of a moment have radii of 1 m (cup) and ``rod_radius``.

    The eye is 3.3 radii of the smaller one away, at most 45 cm, and not nearer than ``CLOSE_UP_M``, its distance from
    the point of a miss.
    """
    rows = {
        "miss": (fault_of(FaultKind.NEVER_REPORTED), 0.1, CLOSE_UP_M),
        "false contact": (fault_of(FaultKind.NO_CONTACT), 0.1, 3.3 * 0.1),
        "contact": (Episode(pair=0, first=3, last=4, start=0.3, end=0.5), 0.1, 3.3 * 0.1),
        "false contact of large bodies": (fault_of(FaultKind.NO_CONTACT), 0.2, 0.45),
        "false contact of a small body": (fault_of(FaultKind.NO_CONTACT), 0.01, CLOSE_UP_M),
    }
    for row, (moment, rod_radius, distance) in rows.items():
        balls = [SimpleNamespace(radius=1.0), SimpleNamespace(radius=rod_radius)]
        eye = close_up_eyes(run_of_cup_and_rod(), {TIME: moment}, balls)[TIME]
        assert np.linalg.norm(np.subtract(eye.position, eye.target)) == pytest.approx(distance), row


@pytest.fixture
def drawn_gap():
    """Marks of the close-up of a false contact by what they are, of a gap of 2 cm along X, seen along -Z.

    Marks stand in front of the bodies, at a fraction of the way from the eye.
    """
    drawn = {}
    writer = SimpleNamespace(
        clock=SimpleNamespace(ns=range(6)),
        rows=lambda *_: None,
        static=lambda *_: None,
        steps=lambda path, steps, marks, columns: drawn.update({path.rpartition("/")[2]: marks[TIME]}),
    )
    nearest_points = ((0.1, 0.05, 0.0), (0.12, 0.05, 0.0))
    false_contact = fault_of(FaultKind.NO_CONTACT, nearest=nearest_points)
    log_close_ups(writer, run_of_cup_and_rod(), {TIME: false_contact}, {TIME: EYE}, balls=[])
    return drawn


def test_line_of_a_gap_has_a_bar_at_both_ends(drawn_gap):
    """The gap goes from x = 0.1 to 0.12 m at y = 0.05 m; seen along Z, its bars reach ``HALF_BAR_M`` up and down.

    Lines are pulled towards the eye; the test moves them back.
    """
    lines = [mark.places for mark in drawn_gap["lines"] if mark.colour == GAP_COLOUR]
    gap, first_bar, last_bar = (EYE.position + (line - EYE.position) / TEXT_DISTANCE_FRACTION for line in lines[-3:])
    assert gap == pytest.approx(np.array([[0.1, 0.05, 0.0], [0.12, 0.05, 0.0]]))
    for bar, x in ((first_bar, 0.1), (last_bar, 0.12)):
        upwards = bar[np.argsort(bar[:, 1])]
        assert upwards == pytest.approx(np.array([[x, 0.05 - HALF_BAR_M, 0.0], [x, 0.05 + HALF_BAR_M, 0.0]]))


def test_gap_is_named_with_its_bodies_and_width(drawn_gap):
    """The false contact is of cup and rod; the gap is 2 cm wide."""
    assert [mark.text for mark in drawn_gap["words"]] == ["cup and rod: 20 mm apart"]


def test_screen_points_are_right_and_up_in_eye_distances():
    """The eye is at z = 2 m and looks at the origin: 0.25 distances to the right are 0.5 m, 0.1 down are 0.2 m."""
    assert point_on_screen(EYE, right=0.25, up=-0.1) == pytest.approx([0.5, -0.2, 0.0])


def test_texts_stand_at_40_percent_of_the_eye_distance():
    """From the eye, at z = 2 m, to the point (0.5, -0.2, 0): 0.4 of that is (0.2, -0.08) and 0.8 m less of height z."""
    assert in_front(EYE, np.array([[0.5, -0.2, 0.0]])) == pytest.approx(np.array([[0.2, -0.08, 2.0 - 0.8]]))


@pytest.mark.parametrize(
    ("up", "line_begins"),
    [pytest.param(0.3, 0.3 - TEXT_HEIGHT, id="text above"), pytest.param(-0.3, -0.3, id="text below")],
)
def test_line_from_text_above_begins_below_the_text(up, line_begins):
    """A text 0.3 eye distances (of 2 m) above or below a point at height 0, and a line from it to the point.

    A text hangs down from its position, by ``TEXT_HEIGHT``; text and line are pulled to a fraction of the way from the
    eye, which makes heights smaller.
    """
    text, line = text_beside(EYE, np.zeros(3), "gap", GAP_COLOUR, right=0.0, up=up)
    eye_distance = 2.0
    expected = [TEXT_DISTANCE_FRACTION * eye_distance * height for height in (up, line_begins, 0.0)]
    heights = [*text.places[:, 1], *line.places[:, 1]]
    assert heights == pytest.approx(expected)
