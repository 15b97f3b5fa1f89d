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


def gap_of_approach(least, centre=2.0, width=0.1):
    """Metres between the middles of two cubes of 1 m, 400 frames of 10 ms: surfaces are 0.2 m apart.

    From ``width`` seconds before ``centre`` to as long after it they are ``least`` metres apart.
    """
    seconds = np.arange(FRAMES) * 0.01
    return 1.0 + np.where(np.abs(seconds - centre) <= width, least, 0.2)


def near_intervals(middles_apart):
    """Intervals in which the surfaces of two cubes of 1 m are within CLOSE_GAP_M, 10 mm, of each other."""
    assembly = assemble(unit_cubes_on_x({"a": np.zeros(FRAMES), "b": middles_apart}))
    return close_intervals(assembly, np.arange(len(assembly.pairs)))


@pytest.mark.parametrize(
    ("centres", "count"),
    [
        pytest.param((1.0, 3.0), 2, id="1.8 s apart"),
        pytest.param((2.0, 2.3), 1, id="0.1 s apart"),
    ],
)
def test_two_approaches_count_twice_and_a_flicker_once(centres, count):
    """Two approaches to 4 mm, each from 0.1 s before to 0.1 s after its centre; less than 0.5 s apart they are one."""
    first, second = (gap_of_approach(least=0.004, centre=centre) for centre in centres)
    assert len(near_intervals(np.minimum(first, second))) == count


def test_near_misses_of_two_fingers_count_once_for_the_hand():
    """Index and thumb, which are a hand, come within 4 mm of the cup at 2.0 and at 2.4 s: one near miss of the hand.

    A contact of the hand from 2.6 to 2.7 s is within half a second of that: then it is no near miss.
    """
    scene = parse_scene(
        '[[body]]\nid = "index"\n[[body]]\nid = "thumb"\n[[body]]\nid = "cup"\n'
        '[[group]]\nname = "hand"\nmembers = ["index", "thumb"]\n'
    )
    positions = {
        "index": gap_of_approach(least=0.004, centre=2.0),
        "thumb": -gap_of_approach(least=0.004, centre=2.4),
        "cup": np.zeros(FRAMES),
    }
    assembly = assemble(unit_cubes_on_x(positions, scene=scene))
    (near_miss,) = close_intervals(assembly, np.arange(len(assembly.pairs)))
    hand_and_cup = assembly.contact_columns[0]
    assert near_miss.pair == hand_and_cup
    assert without_contact([near_miss], np.array([[hand_and_cup, 2.6, 2.7]])) == ()


def gap_by_fcl(mesh, rotations, positions):
    """Metres between two poses of a mesh, by python-fcl."""
    tree = fcl.BVHModel()
    tree.beginModel(len(mesh.faces), len(mesh.vertices))
    tree.addSubModel(mesh.vertices, mesh.faces)
    tree.endModel()
    objects = [
        fcl.CollisionObject(tree, fcl.Transform(rotation, position))
        for rotation, position in zip(rotations, positions, strict=True)
    ]
    return fcl.distance(*objects, fcl.DistanceRequest(), fcl.DistanceResult())


@pytest.mark.slow
@pytest.mark.parametrize("largest_angle", [0.2, 0.002, 0.0])
def test_close_is_the_distance_by_fcl_at_every_sample(largest_angle):
    """Two cubes of 1 m in forty poses, the second rotated at random by up to so many radians, from touch to 20 mm.

    They are near each other where python-fcl finds less than CLOSE_GAP_M, 10 mm: in more than 5 of 40 poses, while in
    more than 5 they are not.
    """
    rng, count = np.random.default_rng(1), 40
    middles_apart = np.linspace(1.0, 1.02 + 2 * largest_angle, count)  # a rotated cube reaches farther
    assembly = assemble(unit_cubes_on_x({"a": np.zeros(count), "b": middles_apart}))
    motion, mesh, near_frames = assembly.motion, assembly.bodies[0].mesh, 0
    rotations = motion.rotations.copy()
    rotations[:, 1] = Rotation.from_rotvec(rng.uniform(-largest_angle, largest_angle, (count, 3))).as_matrix()
    for frame in range(count):
        # At rest for a second, so that a sample sees this pose.
        at_rest = Motion([0.0, 1.0], motion.translations[[frame, frame]], rotations[[frame, frame]])
        is_near = gap_by_fcl(mesh, rotations[frame], motion.translations[frame]) < CLOSE_GAP_M
        only_pair = np.array([0])
        assert bool(close_intervals(replace(assembly, motion=at_rest), only_pair)) is is_near
        near_frames += is_near
    assert 5 < near_frames < count - 5


@pytest.mark.parametrize("is_lost", [False, True])
def test_a_lost_pose_is_not_close_to_anything(is_lost):
    """The second body comes within 4 mm of the first from 1.9 to 2.1 s; from 1.5 to 2.5 s its pose may be lost."""
    positions, status = np.zeros((FRAMES, 2, 3)), np.ones((FRAMES, 2))
    positions[:, 1, 0] = gap_of_approach(least=0.004)
    positions[0, 1, 0] = 9.0
    status[150:250, 1] = not is_lost
    assembly = assemble(session_of_frames(np.arange(FRAMES) * 10_000_000, status, positions))
    only_pair = np.array([0])
    assert (close_intervals(assembly, only_pair) == ()) == is_lost


@pytest.mark.parametrize(
    ("contacts", "remains"),
    [
        pytest.param([(0, 1.0, 4.4)], True, id="ends 0.6 s before"),
        pytest.param([(0, 1.0, 4.6)], False, id="ends 0.4 s before"),
        pytest.param([(0, 5.2, 5.4)], False, id="within"),
        pytest.param([(0, 6.4, 9.0)], False, id="starts 0.4 s after"),
        pytest.param([(0, 6.6, 9.0)], True, id="starts 0.6 s after"),
        pytest.param([(1, 5.2, 5.4)], True, id="of another pair"),
        pytest.param([], True, id="no contact"),
    ],
)
def test_contact_within_half_a_second_is_no_near_miss(contacts, remains):
    """Surfaces of pair 0 are near each other from 5 to 6 s; a contact is (pair, start, end in seconds)."""
    near_miss = NearMiss(pair=0, start=5.0, end=6.0)
    contact_intervals = np.array(contacts, dtype=float).reshape(-1, 3)
    assert without_contact([near_miss], contact_intervals) == ((near_miss,) if remains else ())
