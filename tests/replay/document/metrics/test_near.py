from dataclasses import replace

import fcl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.small_worlds import session_of_frames, unit_cubes_on_x

from cdcore import Motion
from replay.document.metrics.near import CLOSE_GAP_M, NearMiss, close_intervals, without_contact
from replay.prepare.assemble import assemble
from sessions.scene_files.scene_toml import parse_scene

FRAMES = 400


def approach(least, centre=2.0, width=0.1):
    """A unit cube comes to within ``least`` metres of another about a time, 0.2 m away otherwise; 100 Hz."""
    t = np.arange(FRAMES) * 0.01
    return 1.0 + np.where(np.abs(t - centre) <= width, least, 0.2)


def near(gap):
    """Intervals in which two unit cubes with such distances of their middles are near each other."""
    assembly = assemble(unit_cubes_on_x({"a": np.zeros(FRAMES), "b": gap}))
    return close_intervals(assembly, np.arange(len(assembly.pairs)))


def test_two_approaches_count_twice_and_a_flicker_once():
    """Each approach is to 4 mm, 0.1 s before and after its centre: two are 1.8 s from each other, or only 0.1 s."""
    assert len(near(np.minimum(approach(least=0.004, centre=1.0), approach(least=0.004, centre=3.0)))) == 2
    assert len(near(np.minimum(approach(least=0.004, centre=2.0), approach(least=0.004, centre=2.3)))) == 1


def test_near_miss_needs_half_a_second_without_contact():
    """The bodies are close from 1.9 to 2.1 s: what ends at 1.6 or begins at 2.5 s is within half a second of them.

    A contact is (pair, start, end in seconds); pair 1 is of other bodies.
    """
    result = near(approach(least=0.004))
    assert without_contact(result, np.array([[0, 2.5, 2.6]])) == ()
    assert without_contact(result, np.array([[0, 1.5, 1.6]])) == ()
    assert without_contact(result, np.array([[0, 2.7, 2.8]])) == result
    assert without_contact(result, np.array([[0, 1.2, 1.3]])) == result
    assert without_contact(result, np.array([[1, 2.0, 2.1]])) == result
    assert without_contact(result, np.zeros((0, 3))) == result


def test_near_misses_of_two_fingers_count_once_for_the_hand():
    """Index and thumb pass the cup in turn within half a second: one near miss, or none where one of them touches."""
    scene = parse_scene(
        '[[body]]\nid = "index"\n[[body]]\nid = "thumb"\n[[body]]\nid = "cup"\n'
        '[[group]]\nname = "hand"\nmembers = ["index", "thumb"]\n'
    )
    gaps = {
        "index": approach(least=0.004, centre=2.0),
        "thumb": -approach(least=0.004, centre=2.4),
        "cup": np.zeros(FRAMES),
    }
    assembly = assemble(unit_cubes_on_x(gaps, scene=scene))
    result = close_intervals(assembly, np.arange(len(assembly.pairs)))
    assert [close.pair for close in result] == [assembly.contact_columns[0]]
    assert without_contact(result, np.array([[assembly.contact_columns[0], 2.6, 2.7]])) == ()


def fcl_gap(mesh, turns, positions):
    """The smallest gap of two poses of a mesh, by python-fcl."""
    tree = fcl.BVHModel()
    tree.beginModel(len(mesh.faces), len(mesh.vertices))
    tree.addSubModel(mesh.vertices, mesh.faces)
    tree.endModel()
    objects = [
        fcl.CollisionObject(tree, fcl.Transform(rotation, position))
        for rotation, position in zip(turns, positions, strict=True)
    ]
    return fcl.distance(*objects, fcl.DistanceRequest(), fcl.DistanceResult())


@pytest.mark.slow
@pytest.mark.parametrize("rotations", [0.2, 0.002, 0.0])
def test_close_is_the_distance_by_fcl_at_every_sample(rotations):
    """Forty gaps of two cubes, the second turned at random by up to ``rotations`` radians."""
    rng, count = np.random.default_rng(1), 40
    assembly = assemble(unit_cubes_on_x({"a": np.zeros(count), "b": np.linspace(1.0, 1.02 + 2 * rotations, count)}))
    whole = assembly.motion
    poses = whole.rotations.copy()
    poses[:, 1] = Rotation.from_rotvec(rng.uniform(-rotations, rotations, (count, 3))).as_matrix()
    mesh, truth = assembly.bodies[0].mesh, []
    for frame in range(count):
        # At rest for a second, so that every look sees this pose.
        motion = Motion(np.arange(2.0), *(piece[[frame, frame]] for piece in (whole.translations, poses)))
        truth.append(fcl_gap(mesh, poses[frame], whole.translations[frame]) < CLOSE_GAP_M)
        assert bool(close_intervals(replace(assembly, motion=motion), np.array([0]))) is truth[-1]
    assert 5 < sum(truth) < count - 5


@pytest.mark.parametrize("lost", [False, True])
def test_a_lost_pose_is_not_close_to_anything(lost):
    """The second body comes within 4 mm of the first, in frames in which its tracking may be lost."""
    positions, status = np.zeros((FRAMES, 2, 3)), np.ones((FRAMES, 2))
    positions[:, 1, 0] = np.append(9.0, approach(least=0.004)[1:])
    status[150:250, 1] = not lost
    assembly = assemble(session_of_frames(np.arange(FRAMES) * 10_000_000, status, positions))
    assert (close_intervals(assembly, np.array([0])) == ()) == lost


@pytest.mark.parametrize(
    ("pair", "start", "end", "remains"),
    [
        (0, 1.0, 4.4, True),
        (0, 1.0, 4.6, False),
        (0, 5.2, 5.4, False),
        (0, 6.4, 9.0, False),
        (0, 6.6, 9.0, True),
        (1, 5.2, 5.4, True),
    ],
)
def test_contact_within_half_a_second_is_no_near_miss(pair, start, end, remains):
    """The bodies of pair 0 are close from 5 to 6 s: contacts until 4.5 s or from 6.5 s on are apart from that."""
    near_miss = NearMiss(0, 5.0, 6.0)
    contacts = np.array([[pair, start, end]])
    assert without_contact([near_miss], contacts) == ((near_miss,) if remains else ())
