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
        (["vive"], VIVE),
        (["0.3 mm, 0.05 deg, 0.1 s"], TrackerNoise(position_rms_m=3e-4, rotation_rms_deg=0.05, correlation_s=0.1)),
        (["0.5m,0deg"], TrackerNoise(position_rms_m=0.5, rotation_rms_deg=0.0)),
        (["50 ms, 1 cm"], TrackerNoise(position_rms_m=0.01, correlation_s=0.05)),
    ],
)
def test_noise_size_has_units_and_defaults_to_vive(text, size):
    """Units of length, angle and time in any order, each at most once; what is not stated is that of TrackerNoise."""
    assert parse_noise(text).usual == size
    assert parse_noise([f"cup={text[0]}"]).noise_of_body == {"cup": size}


@pytest.mark.parametrize(
    "text",
    ["3 miles", "much", "1 mm, 2 mm", "1001 m", "361 deg", "0 s"],
)
def test_noise_without_a_known_unit_or_possible_size_is_refused(text):
    """A tracker errs by at most 1 km and one turn, and noise that is one with itself for 0 s cannot be drawn."""
    with pytest.raises(NoiseError, match="is no noise; write vive or"):
        parse_noise([text])


def noise_of_cup(size, copies=400, seed=1):
    """Noise of this size for copies of one body's poses."""
    return NoisyCopies(BodyNoise(("cup",), (0,), {"cup": size}), copies, seed)


def test_noisy_copies_have_the_requested_size_and_correlation():
    """400 copies: root mean squares to 10 %, and correlations that fall by e in 0.05 s."""
    size = TrackerNoise(position_rms_m=0.002, rotation_rms_deg=0.3, correlation_s=0.05)
    error = noise_of_cup(size).errors(np.array([0.0, 0.01, 0.06, 2.0]))["cup"].swapaxes(0, 1)
    moved, rotated = np.split(error, 2, axis=2)
    assert np.sqrt((moved**2).sum(axis=2).mean(axis=0)) == pytest.approx(0.002, rel=0.1)
    assert np.degrees(np.sqrt((rotated**2).sum(axis=2).mean(axis=0))) == pytest.approx(0.3, rel=0.1)
    for later, separate in ((1, 0.01), (2, 0.06), (3, 2.0)):
        product = (moved[:, 0] * moved[:, later]).sum(axis=1).mean() / 0.002**2
        assert product == pytest.approx(np.exp(-separate / 0.05), abs=0.1)


def test_noisy_copy_is_independent_of_blocks_and_bodies():
    """50 instants whole, in four pieces, and beside another body."""
    times = np.sort(np.random.default_rng(0).uniform(0, 3, 50))
    whole = noise_of_cup(VIVE, copies=5).errors(times)["cup"]
    pieces = noise_of_cup(VIVE, copies=5)
    blocks = [pieces.errors(piece)["cup"] for piece in np.split(times, [1, 7, 30])]
    other = NoisyCopies(BodyNoise(("jug", "cup"), (0, 1), {"jug": VIVE, "cup": VIVE}), copies=5, seed=1).errors(times)[
        "cup"
    ]
    assert whole.tobytes() == np.concatenate(blocks).tobytes() == other.tobytes()
    assert noise_of_cup(VIVE, copies=5, seed=2).errors(times)["cup"].tobytes() != whole.tobytes()


def test_children_move_with_their_trackers_noise_and_fixed_bodies_rest():
    """In each of three copies the rod keeps its place in the hand, and the bench its own.

    So noise brings hand and rod no nearer to each other (reach 0), rod and bench it does.
    """
    poses = {name: along_x([at, at + 0.1, at, at]) for name, at in (("hand", 1.0), ("rod", 0.5))}
    bodies = (
        SceneBody("hand"),
        SceneBody("rod", parent="hand"),
        SceneBody("bench", fixed=Pose((0, 0, 0), (0, 0, 0, 1))),
    )
    meshes = {name: cube(edge=0.1) for name in ("hand", "rod", "bench")}
    session = Session.from_arrays(np.arange(4) * 10_000_000, poses, meshes, Scene(bodies=bodies))
    assembly = assemble(session)
    noise = noise_of(parse_noise(["1 mm, 1 deg"]), assembly, session.scene)
    assert set(noise.noise) == {"hand"} and noise.reach((0, 1), (0.1, 0.1)) == 0.0 < noise.reach((1, 2), (0.1, 0.1))
    drawn, every = NoisyCopies(noise, copies=3, seed=0), np.ones(4, dtype=bool)
    errors = drawn.errors(assembly.motion.times)
    (rotation, position), (rotation_rod, position_rod), (_, bench) = (
        drawn.poses(assembly.motion, errors, assembly.names.index(name), every) for name in ("hand", "rod", "bench")
    )
    before = assembly.motion.translations[:, 1] - assembly.motion.translations[:, 0]
    carried = position_rod - position - (rotation @ np.tile(before, (3, 1))[..., None])[..., 0]
    assert np.abs(carried).max() < 1e-12 and np.array_equal(rotation, rotation_rod)
    assert np.array_equal(bench, np.tile(assembly.motion.translations[:, 2], (3, 1)))


def test_a_child_rotates_about_its_tracker():
    """A quarter turn about Z of the tracker at 1 m on X takes what is 0.5 m beyond to 0.5 m beside."""
    rest = np.tile(np.eye(3), (1, 2, 1, 1))
    motion = SimpleNamespace(rotations=rest, translations=np.array([[[1.0, 0.0, 0.0], [1.5, 0.0, 0.0]]]))
    copies = NoisyCopies(BodyNoise(("hand", "hand"), (0, 0), {"hand": VIVE}), copies=1, seed=0)
    errors = {"hand": np.array([[[0.0, 0.0, 0.1, 0.0, 0.0, np.pi / 2]]])}
    rows = np.array([True])
    for body, position in ((0, [1.0, 0.0, 0.1]), (1, [1.0, 0.5, 0.1])):
        rotation, translation = copies.poses(motion, errors, body, rows)
        assert translation[0] == pytest.approx(position) and rotation[0] @ [1.0, 0.0, 0.0] == pytest.approx([0, 1, 0])
