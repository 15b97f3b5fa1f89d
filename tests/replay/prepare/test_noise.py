"""Noise in words, and drawn: sizes and correlations are those planted."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.errors import NoiseError
from replay.prepare.assemble import assemble
from replay.prepare.noise import BodyNoise, NoisyCopies, noise_of, parse_noise
from sessions import Session
from sessions.model.scene import Pose, Scene, SceneBody
from sessions.synthetic.tracker import VIVE, TrackerNoise


@pytest.mark.parametrize(
    ("text", "size"),
    [
        pytest.param("vive", VIVE, id="a tracker"),
        pytest.param(
            "0.3 mm, 0.05 deg, 0.1 s",
            TrackerNoise(position_rms_m=3e-4, rotation_rms_deg=0.05, correlation_s=0.1),
            id="all three",
        ),
        pytest.param("0.5m,0deg", TrackerNoise(position_rms_m=0.5, rotation_rms_deg=0.0), id="no time, no blanks"),
        pytest.param("50 ms, 1 cm", TrackerNoise(position_rms_m=0.01, correlation_s=0.05), id="time first, no angle"),
    ],
)
def test_noise_size_has_units_and_defaults_to_vive(text, size):
    """Units of length, angle and time in any order; what is not stated is that of TrackerNoise(), which is VIVE.

    With a name in front the noise is that body's.
    """
    assert TrackerNoise() == VIVE
    assert parse_noise([text]).usual == size
    assert parse_noise([f"cup={text}"]).noise_of_body == {"cup": size}


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("3 miles", id="unknown unit"),
        pytest.param("much", id="no size"),
        pytest.param("1 mm, 2 mm", id="two lengths"),
        pytest.param("1001 m", id="more than 1 km"),
        pytest.param("361 deg", id="more than a turn"),
        pytest.param("0 s", id="no correlation time"),
    ],
)
def test_noise_without_a_known_unit_or_possible_size_is_refused(text):
    """A tracker errs by at most 1 km and one turn; the time over which errors correlate is divided by."""
    with pytest.raises(NoiseError, match="is no noise; write vive or"):
        parse_noise([text])


def noise_of_cup(size, copies=400, seed=1):
    """Noise of this size for copies of the poses of one body, "cup"."""
    return NoisyCopies(BodyNoise(roots=("cup",), anchors=(0,), noise={"cup": size}), copies, seed)


def test_noisy_copies_have_the_requested_size_and_correlation():
    """400 copies of four instants: root mean squares to 10 %, and correlations that fall by e in 0.05 s.

    0.1 is more than twice the standard error of a correlation of 400 copies, 1 / sqrt(400).
    """
    size = TrackerNoise(position_rms_m=0.002, rotation_rms_deg=0.3, correlation_s=0.05)
    instants = np.array([0.0, 0.01, 0.06, 2.0])
    errors_by_copy = noise_of_cup(size, copies=400).errors(instants)["cup"].swapaxes(0, 1)
    position_errors, rotation_errors = np.split(errors_by_copy, 2, axis=2)
    position_rms_m = np.sqrt((position_errors**2).sum(axis=2).mean(axis=0))
    rotation_rms_rad = np.sqrt((rotation_errors**2).sum(axis=2).mean(axis=0))
    assert position_rms_m == pytest.approx(0.002, rel=0.1)
    assert np.degrees(rotation_rms_rad) == pytest.approx(0.3, rel=0.1)
    for instant in (1, 2, 3):
        covariance = (position_errors[:, 0] * position_errors[:, instant]).sum(axis=1).mean()
        seconds_between = instants[instant] - instants[0]
        assert covariance / 0.002**2 == pytest.approx(np.exp(-seconds_between / 0.05), abs=0.1)


def test_noisy_copy_is_independent_of_blocks_and_bodies():
    """Errors of a cup at 50 instants have the same bits drawn at once, in four blocks, and beside a jug.

    Only another seed draws others. Each body is its own tracker (``roots``: the names, ``anchors``: the numbers).
    """
    times = np.sort(np.random.default_rng(0).uniform(0, 3, 50))
    at_once = noise_of_cup(VIVE, copies=5, seed=1).errors(times)["cup"].tobytes()
    assert noise_of_cup(VIVE, copies=5, seed=2).errors(times)["cup"].tobytes() != at_once

    drawn_in_blocks = noise_of_cup(VIVE, copies=5, seed=1)
    blocks = [drawn_in_blocks.errors(block)["cup"] for block in np.split(times, [1, 7, 30])]
    assert np.concatenate(blocks).tobytes() == at_once

    jug_and_cup = BodyNoise(roots=("jug", "cup"), anchors=(0, 1), noise={"jug": VIVE, "cup": VIVE})
    assert NoisyCopies(jug_and_cup, copies=5, seed=1).errors(times)["cup"].tobytes() == at_once


HAND, ROD, BENCH = 0, 1, 2
"""Numbers of the bodies of ``carried_rod``."""


@pytest.fixture
def carried_rod():
    """A hand, a rod that it carries, and a fixed bench, of four frames; and their noise of 1 mm and 1 degree."""
    poses = {name: along_x([at, at + 0.1, at, at]) for name, at in (("hand", 1.0), ("rod", 0.5))}
    bodies = (
        SceneBody("hand"),
        SceneBody("rod", parent="hand"),
        SceneBody("bench", fixed=Pose((0, 0, 0), (0, 0, 0, 1))),
    )
    meshes = {name: cube(edge=0.1) for name in ("hand", "rod", "bench")}
    session = Session.from_arrays(np.arange(4) * 10_000_000, poses, meshes, Scene(bodies=bodies))
    assembly = assemble(session)
    assert assembly.names == ("hand", "rod", "bench")
    return assembly, noise_of(parse_noise(["1 mm, 1 deg"]), assembly, session.scene)


def test_noise_moves_a_child_against_others_than_its_tracker(carried_rod):
    """Noise brings hand and rod no nearer to each other (a reach of 0 m); rod and bench it does.

    The reach is that of surfaces at 0.1 m from the origins of both bodies.
    """
    _, noise = carried_rod
    assert noise.noise.keys() == {"hand"}
    assert noise.reach((HAND, ROD), lever_lengths=(0.1, 0.1)) == 0.0
    assert noise.reach((ROD, BENCH), lever_lengths=(0.1, 0.1)) > 0.0


def test_children_move_with_their_trackers_noise_and_fixed_bodies_rest(carried_rod):
    """In each of three noisy copies the rod keeps its place and rotation in the hand, and the bench its own."""
    assembly, noise = carried_rod
    copies, every_frame = NoisyCopies(noise, copies=3, seed=0), np.ones(4, dtype=bool)
    errors = copies.errors(assembly.motion.times)
    (hand_rotation, hand_position), (rod_rotation, rod_position), (_, bench_position) = (
        copies.poses(assembly.motion, errors, body, every_frame) for body in (HAND, ROD, BENCH)
    )
    recorded = assembly.motion.translations
    assert np.abs(hand_position - np.tile(recorded[:, HAND], (3, 1))).max() > 1e-4, "the hand is moved by noise"
    rod_in_hand = np.tile(recorded[:, ROD] - recorded[:, HAND], (3, 1))
    carried = hand_position + (hand_rotation @ rod_in_hand[..., None])[..., 0]
    assert np.abs(rod_position - carried).max() < 1e-12
    assert np.array_equal(hand_rotation, rod_rotation)
    assert np.array_equal(bench_position, np.tile(recorded[:, BENCH], (3, 1)))


def test_a_child_rotates_about_its_tracker():
    """A tracker at x = 1 m carries a body at x = 1.5 m; its error is 0.1 m up and a quarter turn about Z.

    So the body, 0.5 m beyond the tracker along x, comes to be 0.5 m beside it along y; both turn x to y. ``roots`` and
    ``anchors`` have the tracker of each body, its name and its number: both are tracked by the hand.
    """
    tracker, carried = 0, 1
    unrotated = np.tile(np.eye(3), (1, 2, 1, 1))
    motion = SimpleNamespace(rotations=unrotated, translations=np.array([[[1.0, 0.0, 0.0], [1.5, 0.0, 0.0]]]))
    noise = BodyNoise(roots=("hand", "hand"), anchors=(tracker, tracker), noise={"hand": VIVE})
    copies = NoisyCopies(noise, copies=1, seed=0)
    position_error, rotation_error = [0.0, 0.0, 0.1], [0.0, 0.0, np.pi / 2]
    errors = {"hand": np.array([[[*position_error, *rotation_error]]])}
    the_only_frame = np.array([True])
    for body, expected in ((tracker, [1.0, 0.0, 0.1]), (carried, [1.0, 0.5, 0.1])):
        rotation, translation = copies.poses(motion, errors, body, the_only_frame)
        assert translation[0] == pytest.approx(expected)
        assert rotation[0] @ [1.0, 0.0, 0.0] == pytest.approx([0, 1, 0])
