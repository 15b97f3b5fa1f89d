import numpy as np
import pytest
from support.planted_faults import clean_draft
from support.small_worlds import cube

from sessions import MeshData, Scene, Session
from sessions.doctor.pose_pass import run_pose_pass
from sessions.doctor.scale import pivot_findings, roles_of, scale_findings
from sessions.model.scene import SceneBody


def test_only_heads_and_hands_are_recognised_by_name():
    """The head, the left and the right hand are columns 0, 1 and 2 of a recording; a strap and a beaker are none."""
    roles = roles_of(("camera", "leftHand", "right", "beaker-left", "head-strap"), Scene())
    assert roles == {"head": 0, "left": 1, "right": 2}


def test_headset_that_another_body_carries_is_no_head():
    """The scene says that the headset hangs on a flask; the hand in column 1 is one."""
    scene = Scene(bodies=(SceneBody("headset", parent="flask"),))
    assert roles_of(("flask", "hand-right", "headset"), scene) == {"right": 1}


@pytest.mark.parametrize(
    ("facts", "codes"),
    [
        pytest.param({"handedness": "left"}, ["handedness"], id="not mirrored"),
        pytest.param({"handedness": "left", "conversions": "handedness mirrored along Z"}, [], id="mirrored"),
    ],
)
def test_facts_that_admit_a_left_handed_source_are_believed(facts, codes):
    """Facts of a recording say that its source is left-handed: that is reported, unless they say it was mirrored."""
    outcome = run_pose_pass([clean_draft().session().frames])
    assert [finding.code for finding in scale_findings(outcome, Scene(), facts)] == codes


COUNT = 200
STAMPS = np.arange(COUNT) * 11_111_111
"""200 frames at 90 Hz, in ns."""
NO_ROTATION = np.tile([0.0, 0.0, 0.0, 1.0], (COUNT, 1))


def head_that_walks(height, height_axis):
    """A session of a head, upright by its own axes, at ``height`` m along an axis; it walks 4 m along both others."""
    walk = np.stack([np.linspace(-2, 2, COUNT), 0.05 * np.sin(np.arange(COUNT)), np.linspace(3, -1, COUNT)], axis=1)
    walk[:, 1] += height
    position = walk if height_axis == "y" else walk[:, [0, 2, 1]]
    return Session.from_arrays(STAMPS, {"head": (position, NO_ROTATION)})


FACING_DOWN = np.tile([-(0.5**0.5), 0.0, 0.0, 0.5**0.5], (COUNT, 1))
"""A quarter of a circle about X, so that -Z points down."""


@pytest.mark.parametrize(
    ("units_in_a_metre", "rotation"),
    [
        pytest.param(1000, FACING_DOWN, id="mm, looks down"),
        pytest.param(100, FACING_DOWN, id="cm, looks down"),
        pytest.param(1000, NO_ROTATION, id="mm, looks ahead"),
    ],
)
def test_wrong_length_unit_is_not_mistaken_for_wrong_axes(units_in_a_metre, rotation):
    """A head 1.5 m above the floor and a cup, both swinging by 0.1 m, are in millimetres or centimetres.

    Read as metres they are some 150 m or more from the origin, and no room has 25 m. A head that looks down by its own
    axes could also be one whose axes are wrong: only the unit is reported.
    """
    head = np.array([0.0, 1.5, 0.4]) + 0.1 * np.sin(np.arange(COUNT) / 90)[:, None]
    poses = {"head": (units_in_a_metre * head, rotation), "cup": (units_in_a_metre * (head + 0.3), rotation)}
    outcome = run_pose_pass([Session.from_arrays(STAMPS, poses).frames])
    assert {finding.code for finding in scale_findings(outcome, Scene(), {})} == {"unit-suspect"}


@pytest.mark.parametrize(("gap_m", "codes"), [(0.5, ["speed-suspect"]), (0.005, [])])
def test_two_alternating_sources_are_no_wrong_unit(gap_m, codes):
    """Two programs record one cup: each sample is followed, 1 ms later, by the other's, ``gap_m`` further along X.

    0.5 m in 1 ms are 500 m/s, above the 20 m/s of any hand: reported as a speed, not as a unit; 5 m/s are not.
    """
    source = np.arange(COUNT) % 2
    stamps = np.arange(COUNT) // 2 * 11_111_111 + source * 1_000_000
    position = np.column_stack([gap_m * source, 1 + np.arange(COUNT) / 1000, np.full(COUNT, -0.4)])
    poses = {"cup": (position, NO_ROTATION)}
    outcome = run_pose_pass([Session.from_arrays(stamps, poses).frames])
    assert [item.code for item in scale_findings(outcome, Scene(), {})] == codes


def test_head_with_constant_z_is_reported_in_any_axes():
    """A head keeps to 1.6 m along Z, as heads do along the axis up, while its Y goes from 3 to -1 m, median 1 m."""
    outcome = run_pose_pass([head_that_walks(height=1.6, height_axis="z").frames])
    (finding,) = scale_findings(outcome, Scene(), {})
    assert finding.code == "up-axis"
    assert finding.message == "it keeps to 1.60 m along Z, and its height is 1.00 m"


@pytest.mark.parametrize("height", [1.6, 0.0])
def test_head_with_constant_height_is_not_reported(height):
    """The head keeps to its height along Y, as heads do; a headset may also lie on the floor."""
    outcome = run_pose_pass([head_that_walks(height, height_axis="y").frames])
    assert [*scale_findings(outcome, Scene(), {})] == []


@pytest.mark.parametrize(("count", "codes"), [(200, ["handedness"]), (15, [])], ids=["200 frames", "too few frames"])
def test_right_hand_often_left_of_head_is_reported(count, codes):
    """The head looks along -Z, so that +X is on its right; the hands are 30 cm aside, each on the other's side.

    Fewer than 20 frames say nothing.
    """
    head, to_the_right = np.tile([0.0, 1.6, 0.0], (count, 1)), np.array([0.3, -0.5, -0.2])
    positions = {"head": head, "left": head + to_the_right, "right": head + to_the_right * [-1, 1, 1]}
    rotation = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    session = Session.from_arrays(
        np.arange(count), {name: (position, rotation) for name, position in positions.items()}
    )
    assert [item.code for item in scale_findings(run_pose_pass([session.frames]), Scene(), {})] == codes


@pytest.mark.parametrize(
    ("position", "middle_of_mesh", "codes"),
    [
        pytest.param((0.3, 0.9, -0.4), (1.5, 0.9, -2.0), ["mesh-pivot"], id="2.6 m from its origin"),
        pytest.param((0.3, 0.9, -0.4), (0.2, 0, 0), [], id="0.2 m from its origin"),
        pytest.param((0, 0, 0), (1.5, 0.9, 0), [], id="the poses are at 0"),
    ],
)
def test_mesh_drawn_where_it_stood_is_reported(position, middle_of_mesh, codes):
    """A cup of 10 cm stays at ``position``; its mesh is drawn about a point far from the mesh's own origin, or near it.

    Over 0.5 m from it a mesh would not stand where its body is, unless all poses are at 0, which may be meant so. A
    vertex that no face has, 1,000 km away, does not count.
    """
    unit = cube()
    centred = unit.vertices - unit.bounds.mean(axis=0)
    mesh = MeshData([*(0.1 * centred + middle_of_mesh), [1e6, 0, 0]], unit.faces)
    poses = {"cup": (np.tile(position, (COUNT, 1)).astype(float), NO_ROTATION)}
    outcome = run_pose_pass([Session.from_arrays(STAMPS, poses).frames])
    assert [finding.code for finding in pivot_findings(outcome, {"cup": mesh}, ["cup"])] == codes
