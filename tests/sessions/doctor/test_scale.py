import numpy as np
import pytest
from support.planted_faults import clean_draft
from support.small_worlds import cube

from sessions import MeshData, Scene, Session
from sessions.doctor.pose_pass import run_pose_pass
from sessions.doctor.scale import pivot_findings, roles_of, scale_findings
from sessions.model.scene import SceneBody


def test_only_heads_and_hands_are_recognised_by_name():
    """Role -> column of the body. A strap and a beaker are none, and neither is a headset that another body carries."""
    roles = roles_of(("camera", "leftHand", "right", "beaker-left", "head-strap"), Scene())
    assert roles == {"head": 0, "left": 1, "right": 2}
    roles = roles_of(("flask", "hand-right", "headset"), Scene(bodies=(SceneBody("headset", parent="flask"),)))
    assert roles == {"right": 1}


def test_facts_that_admit_a_left_handed_source_are_believed():
    """A recording from left-handed axes is reported, unless its facts say that it was mirrored."""
    outcome = run_pose_pass([clean_draft().session().frames])
    assert [item.code for item in scale_findings(outcome, Scene(), {"handedness": "left"})] == ["handedness"]
    reported = {"handedness": "left", "conversions": "handedness mirrored along Z"}
    assert [*scale_findings(outcome, Scene(), reported)] == []
    assert np.isfinite(outcome.position).all()


def head_of_height(height, away):
    """A head that is upright by its own axes, keeps ``height`` along one axis and walks along the others."""
    count = 200
    walk = np.stack([np.linspace(-2, 2, count), 0.05 * np.sin(np.arange(count)), np.linspace(3, -1, count)], axis=1)
    walk[:, 1] += height
    position = walk if away == "y" else walk[:, [0, 2, 1]]
    poses = {"head": (position, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))}
    return Session.from_arrays(np.arange(count) * 11_111_111, poses)


@pytest.mark.parametrize(("factor", "samples"), [(1e3, "down"), (1e2, "down"), (1e3, "ahead")])
def test_wrong_length_unit_is_not_mistaken_for_wrong_axes(factor, samples):
    """A head at 1.5 m in millimetres or centimetres, which looks down or ahead."""
    down = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5] if samples == "down" else [0.0, 0.0, 0.0, 1.0]
    position, quaternion = np.array([[0.0, 1.5, 0.4]]), np.array([down])
    walk = np.repeat(position, 200, axis=0) + 0.1 * np.sin(np.arange(200) / 90)[:, None]
    rotated = np.repeat(quaternion, 200, axis=0)
    poses = {"head": (factor * walk, rotated), "cup": (factor * (walk + 0.3), rotated)}
    outcome = run_pose_pass([Session.from_arrays(np.arange(200) * 11_111_111, poses).frames])
    assert {item.code for item in scale_findings(outcome, Scene(), {})} == {"unit-suspect"}


@pytest.mark.parametrize(("gap", "codes"), [(0.5, ["speed-suspect"]), (0.005, [])])
def test_two_alternating_sources_are_no_wrong_unit(gap, codes):
    """Each stamp has two sources 1 ms and ``gap`` metres from each other: 0.5 m would be 500 m/s."""
    stamps = np.arange(200) // 2 * 11_111_111 + np.arange(200) % 2 * 1_000_000
    position = np.column_stack([gap * (np.arange(200) % 2), 1 + np.arange(200) / 1000, np.full(200, -0.4)])
    poses = {"cup": (position, np.tile([0.0, 0.0, 0.0, 1.0], (200, 1)))}
    outcome = run_pose_pass([Session.from_arrays(stamps, poses).frames])
    assert [item.code for item in scale_findings(outcome, Scene(), {})] == codes


@pytest.mark.parametrize(("height", "away", "codes"), [(1.6, "y", []), (1.6, "z", ["up-axis"]), (0.0, "y", [])])
def test_head_with_constant_z_is_reported_in_any_axes(height, away, codes):
    """``away``: the axis along which the head keeps ``height``. Upright it is Y; at 0 m nothing can be said."""
    outcome = run_pose_pass([head_of_height(height, away).frames])
    result = [*scale_findings(outcome, Scene(), {})]
    assert [item.code for item in result] == codes
    assert not codes or result[0].message == "it keeps to 1.60 m along Z, and its height is 1.00 m"


@pytest.mark.parametrize(("count", "codes"), [(200, ["handedness"]), (15, [])], ids=["200 frames", "too few frames"])
def test_right_hand_often_left_of_head_is_reported(count, codes):
    """The head looks along -Z, so that +X is on its right; the hands are 30 cm aside, each on the other's side."""
    head, to_the_right = np.tile([0.0, 1.6, 0.0], (count, 1)), np.array([0.3, -0.5, -0.2])
    positions = {"head": head, "left": head + to_the_right, "right": head + to_the_right * [-1, 1, 1]}
    rotation = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    session = Session.from_arrays(
        np.arange(count), {name: (position, rotation) for name, position in positions.items()}
    )
    assert [item.code for item in scale_findings(run_pose_pass([session.frames]), Scene(), {})] == codes


@pytest.mark.parametrize(
    ("position", "shift", "is_reported"),
    [
        ((0.3, 0.9, -0.4), (1.5, 0.9, -2.0), True),
        ((0.3, 0.9, -0.4), (0.2, 0, 0), False),
        ((0, 0, 0), (1.5, 0.9, 0), False),
    ],
)
def test_mesh_drawn_where_it_stood_is_reported(position, shift, is_reported):
    """The mesh's corners are ``shift`` from its own origin, one far outlier aside; the cup stays at ``position``."""
    unit = cube()
    mesh = MeshData([*(0.1 * (unit.vertices - unit.bounds.mean(axis=0)) + shift), [1e6, 0, 0]], unit.faces)
    poses = {"cup": (np.tile(position, (200, 1)).astype(float), np.tile([0.0, 0.0, 0.0, 1.0], (200, 1)))}
    outcome = run_pose_pass([Session.from_arrays(np.arange(200) * 11_111_111, poses).frames])
    assert [item.code for item in pivot_findings(outcome, {"cup": mesh}, ["cup"])] == ["mesh-pivot"] * is_reported
