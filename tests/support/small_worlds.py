"""Worlds of two or three cubes, small enough to work out every contact by hand."""

from functools import partial

import numpy as np

from cdcore import Detection, Verdict
from sessions import Frames, MeshData, Scene, Session
from sessions.geometry.rings import sewn
from sessions.geometry.rotations import quaternion_about
from sessions.geometry.solids import box, pointed_ball
from sessions.model.scene import SceneBody
from sessions.synthetic import analytic
from sessions.synthetic.analytic import BALL, AnalyticCase, on_axis, within
from sessions.synthetic.motion_profiles import Polyline, Swing, joined_intervals
from sessions.synthetic.paths import Standing
from sessions.synthetic.truth import ordered_pair

STEP_NS = 10_000_000
"""One frame every 10 ms."""

STEP_S = 0.01
"""The same in seconds."""

STILL = (0.0, 0.0, 0.0, 1.0)

MEET_IN_4_AND_8_TO_10 = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
"""Where two unit cubes are on X: below 1 m they are in contact, in frame 4 alone and in frames 8 to 10."""


def cube(edge: float = 1.0) -> MeshData:
    """A closed cube about the origin, 12 faces."""
    half = edge / 2
    corners = [[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return MeshData(corners, faces)


def along_x(points, quaternion=STILL):
    """Positions (T, 3) on the X axis and one quaternion for all."""
    positions = np.zeros((len(points), 3))
    positions[:, 0] = points
    return positions, np.tile(quaternion, (len(points), 1))


def unit_cubes_on_x(positions, *, step_ns=STEP_NS, first_ns=0, scene=None, **more) -> Session:
    """A session of unit cubes: name -> its X in each frame; two of them are in contact from a distance of 1 m down."""
    count = len(next(iter(positions.values())))
    poses = {name: along_x(where) for name, where in positions.items()}
    stamps = first_ns + np.arange(count) * step_ns
    return Session.from_arrays(stamps, poses, {name: cube() for name in positions}, scene, **more)


def swinging_cubes(frames, start=0) -> Session:
    """A cube of 2 cm that swings through another at up to 1.9 m/s, once in two seconds at 90 Hz; 12 faces each."""
    since = np.arange(frames) * 11_111_111
    poses = {"a": along_x(np.zeros(frames)), "b": along_x(0.6 * np.sin(np.pi * (since / 1e9 + 0.31)))}
    return Session.from_arrays(start + since, poses, dict.fromkeys("ab", cube(0.02)))


def jumping(positions=(7, 3, -3, -6, -5, -0.9, -0.8, -3)) -> Session:
    """A cube of 2 cm and one on its X axis, ``positions`` in edges: it flies through it between the frames 1 and 2.

    Slow enough, at 12 m/s among steps of 8 and 6, to be believed: from rest it would be taken for lost tracking.
    """
    poses = {"a": along_x([0.0] * len(positions)), "b": along_x(0.02 * np.array(positions))}
    return Session.from_arrays(np.arange(len(positions)) * STEP_NS, poses, {"a": cube(0.02), "b": cube(0.02)})


def grazing(away, depth, turned=1.5) -> Session:
    """A cube of 2 cm that turns about Z by ``turned`` between frames 1 and 2, its edge by ``depth`` into another."""
    angles = np.array([0.0, 0.0, turned, turned])
    still, spin = np.tile(STILL, (4, 1)), np.stack([0 * angles, 0 * angles, np.sin(angles / 2), np.cos(angles / 2)], 1)
    poses = {"a": (along_x([away] * 4)[0], spin), "b": (along_x([away + 0.01 + 0.01 * 2**0.5 - depth] * 4)[0], still)}
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b")), space_radius=2 * away + 1000)
    return Session.from_arrays(np.arange(4) * STEP_NS, poses, {name: cube(0.02) for name in poses}, scene)


def session_of_frames(stamps, status, position=None, quaternion=None, names=None) -> Session:
    """A session of frames exactly as given: status (T, N), positions (T, N, 3)."""
    stamps, status = np.asarray(stamps, dtype=np.int64), np.asarray(status, dtype=np.uint8)
    frames, bodies = status.shape
    if position is None:
        position = np.zeros((frames, bodies, 3))
        position[:, :, 0] = np.arange(frames)[:, None] + 10 * np.arange(bodies)
    if quaternion is None:
        quaternion = np.tile(STILL, (frames, bodies, 1))
    position, quaternion = np.array(position, dtype=np.float64), np.array(quaternion, dtype=np.float64)
    sample = np.where(status == 0, 0, stamps[:, None])
    position[status == 0], quaternion[status == 0] = np.nan, np.nan
    names = tuple(names or "abcdefgh"[:bodies])
    source = Frames(names, stamps, stamps.copy(), sample, position, quaternion, status)
    return Session(source, {name: cube() for name in names})


def verdicts(rows, *, name="fake", covers="instants", step=0.01, **more) -> Detection:
    """A detection that says exactly this: rows (T, P) of verdicts, or strings with a letter per pair.

    ``.`` CLEAR, ``C`` CONTACT, ``I`` CONTAINED, ``?`` CANDIDATE, ``n`` NOT_FOUND, ``u`` UNRESOLVED, ``-`` NO_POSE,
    ``x`` INVALID.
    """
    codes = {".": Verdict.CLEAR, "C": Verdict.CONTACT, "I": Verdict.CONTAINED, "?": Verdict.CANDIDATE}
    codes |= {"n": Verdict.NOT_FOUND, "u": Verdict.UNRESOLVED, "-": Verdict.NO_POSE, "x": Verdict.INVALID}
    table = np.array([[codes[letter] for letter in row] for row in rows], dtype=np.uint8)
    pairs = np.array([(0, k + 1) for k in range(table.shape[1])], dtype=np.int64)
    bodies = tuple("abcdefgh"[: table.shape[1] + 1])
    return Detection(name, bodies, pairs, np.arange(len(table)) * step, table, covers, **more)


def verdict_column(codes, **more) -> Detection:
    """A detection of one pair, a letter per frame."""
    return verdicts(list(codes), **more)


def prism(sides, radius, length):
    """A regular prism along Y about the origin; of its ``sides``, an even number, one corner lies on +X, one on -X."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    outline = radius * np.column_stack([np.cos(angle), np.zeros(sides), np.sin(angle)])
    outline[[0, sides // 2]] = [radius, 0.0, 0.0], [-radius, 0.0, 0.0]
    half = np.array([0.0, length / 2.0, 0.0])
    return sewn([-half[None], outline - half, outline + half, half[None]])


SMALL_BALL = 1.0 / 64.0


def spinning_rod(rng, seconds):
    """A rod turns on the spot to and fro past a post: nothing moves but the rotation."""
    half_width, post, distance, sides = 1.0 / 256.0, 1.0 / 256.0, 0.125, 16
    profile = Swing(0.0, 1.4, float(rng.uniform(0.8, 1.2)), float(rng.uniform(0.0, 0.3)))

    def path(times):
        return np.zeros((*times.shape, 3)), quaternion_about((0.0, 1.0, 0.0), profile(times))

    def contact(level):
        reach = half_width + post + level
        angle = float(np.arcsin(reach / distance))
        return profile.between(-angle, angle, seconds) if reach >= 0.0 else []

    return AnalyticCase(
        {"rod": box((0.3, 2.0 * half_width, 2.0 * half_width)), "post": prism(sides, post, 0.1)},
        {"rod": path, "post": Standing((distance, 0.0, 0.0))},
        {ordered_pair("post", "rod"): contact},
        tessellation=post * (1.0 - np.cos(np.pi / sides)),
        lever=0.15,
    )


def grazing_ball(rng, seconds):
    """A ball grazes a plate with clearances 0, 1, -1, 4 and -4 micrometres, at whole seconds."""
    plate, clearances = 1.0 / 64.0, (0.0, 1e-6, -1e-6, 4e-6, -4e-6)
    count = max(1, int(seconds))
    heights = np.full(2 * count + 1, BALL + 0.04)
    heights[1::2] = [BALL + clearances[int(k) % 5] for k in rng.permutation(count)]
    profile = Polyline(tuple(0.5 + 0.5 * np.arange(len(heights))), tuple(heights))
    return AnalyticCase(
        {"ball": pointed_ball(BALL), "plate": box((0.5, plate, 0.5))},
        {"ball": on_axis(1, profile), "plate": Standing((0.0, -plate / 2.0, 0.0))},
        {ordered_pair("ball", "plate"): lambda level: profile.between(-BALL, BALL + level, seconds)},
    )


def ball_in_box(rng, seconds):
    """A ball inside a closed box comes out through one wall or the other: contained, contact, clear."""
    half, pair = 1.0 / 16.0, ordered_pair("ball", "box")
    profile = Swing(0.0, half + SMALL_BALL + 0.02, float(rng.uniform(2.5, 3.5)), float(rng.uniform(0.0, 1.0)))

    def contact(level):
        lower, upper = half - SMALL_BALL - level, half + SMALL_BALL + level
        return joined_intervals(
            [*profile.between(lower, upper, seconds), *profile.between(-upper, -lower, seconds)], seconds
        )

    return AnalyticCase(
        {"ball": pointed_ball(SMALL_BALL), "box": box((2.0 * half, 2.0 * half, 2.0 * half))},
        {"ball": on_axis(0, profile), "box": Standing((0.0, 0.0, 0.0))},
        {pair: contact},
        {pair: within(profile, half - SMALL_BALL, seconds)},
    )


ANALYTIC = analytic.ANALYTIC | {
    make.__name__.replace("_", "-"): make for make in (spinning_rod, grazing_ball, ball_in_box)
}
make_analytic = partial(analytic.make_analytic, cases=ANALYTIC)
