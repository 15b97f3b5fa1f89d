"""Hard cases of whole bodies: two of them, their poses, and the verdict that construction or all face pairs give.

Lengths are sums of few powers of two where a hair decides, so that what touches does exactly.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from cdcore import Body, Motion, TriangleMesh, Verdict
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.numerics import FloatArray
from cdcore.poses import place_points
from cdcore.protocol.detection import Covers
from cdcore.tolerances import TWO_MICROMETRES
from replay.studies.stress.families import FIRST_SEED, random_rotations
from replay.studies.stress.solids import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    icosphere_mesh,
    merge_meshes,
    rod_mesh,
    shift_mesh,
)
from sessions.model.constants import HEADSET_HZ

HAIR_BREADTH_M: Final = 2.0**-40
"""Metres, a picometre: far below what a tracker sees, far above the rounding of a metre."""

IMPOSSIBLE_M: Final = (2.0**53, 1e17, 1e30, 1e160, 1e300)
"""Metres from the origin: finite, and no pose of a room; squares of the last two are not finite."""

LIFTS_M: Final = (1e-12, 1e-9, 1e-7, 5e-7, 1e-6, 2e-6, 1e-5)
"""Metres by which a resting glass is lifted or sunk."""


Meshes = tuple[TriangleMesh, TriangleMesh]


@dataclass(frozen=True, eq=False)
class StressScene:
    """Two bodies, a motion, and what is true of it."""

    name: str
    bodies: tuple[Body, Body]
    motion: Motion  # T poses of the two, in ``crossings`` equal parts
    # of instants (T,) uint8 verdicts, one a frame; of intervals (crossings,), whether each part has a contact
    truth: NDArray[np.uint8]
    covers: Covers = "instants"  # whether the frames are asked about, or all of the time between them too


def scene_of_instants(name: str, meshes: Meshes, motion: Motion, truth: ArrayLike | None = None) -> StressScene:
    """A scene whose frames have these verdicts; else all face pairs tell, and nothing may be inside another."""
    bodies = body_pair(*meshes)
    if truth is None:
        truth = [
            Verdict.CONTACT if len(meeting_faces(bodies, motion, k)) else Verdict.CLEAR for k in range(len(motion))
        ]
    return StressScene(name, bodies, motion, np.broadcast_to(np.asarray(truth, dtype=np.uint8), len(motion)))


def scene_of_intervals(name: str, meshes: Meshes, motion: Motion, meets: bool, crossings: int = 1) -> StressScene:
    """A scene of a motion of several equal parts, each of which has a contact somewhere, or none of which has."""
    return StressScene(name, body_pair(*meshes), motion, np.full(crossings, meets, dtype=np.uint8), "intervals")


def body_pair(first: TriangleMesh, second: TriangleMesh) -> tuple[Body, Body]:
    """The meshes as bodies."""
    return Body("first", first), Body("second", second)


def meeting_faces(bodies: tuple[Body, Body], motion: Motion, frame: int) -> NDArray[np.int64]:
    """The face pairs (k, 2) that meet in a frame, from all there are, placed as every detector places them."""
    rotations, moves = motion.rotations[frame], motion.translations[frame]
    placed_triangles = (place_points(body.mesh.triangles, rotations[k], moves[k]) for k, body in enumerate(bodies))
    return meeting_faces_exhaustive(*placed_triangles)


def random_pose_motion(rng: Generator, count: int) -> Motion:
    """Both bodies in the same random pose, ``count`` times; the first time as they stand."""
    rotations, translations = random_rotations(rng, count), rng.normal(size=(count, 3))
    rotations[0], translations[0] = np.eye(3), 0.0
    return Motion(
        np.arange(count) / HEADSET_HZ, np.repeat(translations[:, None], 2, 1), np.repeat(rotations[:, None], 2, 1)
    )


def motion_at(translations: ArrayLike) -> Motion:
    """The first body unturned at places (T, 3), the second at the origin."""
    first = np.asarray(translations, dtype=np.float64)
    translations_of_both = np.stack([first, np.zeros_like(first)], axis=1)
    return Motion(np.arange(len(first)) / HEADSET_HZ, translations_of_both, np.tile(np.eye(3), (len(first), 2, 1, 1)))


def shifted_motion(motion: Motion, offset: ArrayLike) -> Motion:
    """The same somewhere else."""
    return Motion(motion.times, motion.translations + np.asarray(offset), motion.rotations, linked=motion.linked)


def _contact_where(meets: ArrayLike, free: Verdict = Verdict.CLEAR) -> NDArray[np.uint8]:
    return np.where(meets, Verdict.CONTACT, free).astype(np.uint8)


def _inside_out(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def containment(rng: Generator) -> Iterator[StressScene]:
    """27: a body wholly inside another."""
    nested_meshes = {"ball in a box": (ball_mesh(0.1), box_mesh()), "ball in a ball": (ball_mesh(0.2), ball_mesh(1.0))}
    for name, (inner, outer) in nested_meshes.items():
        yield scene_of_instants(name, (inner, outer), random_pose_motion(rng, 6), Verdict.CONTAINED)
        yield scene_of_instants(f"{name}, outer first", (outer, inner), random_pose_motion(rng, 6), Verdict.CONTAINED)


def cavity(rng: Generator) -> Iterator[StressScene]:
    """28: a rod in the cavity of an open beaker, which is outside the glass."""
    rod, beaker = shift_mesh(rod_mesh(), [0.01, 0.005, 0.01]), beaker_mesh()
    yield scene_of_instants("rod first", (rod, beaker), random_pose_motion(rng, 6), Verdict.CLEAR)
    yield scene_of_instants("beaker first", (beaker, rod), random_pose_motion(rng, 6), Verdict.CLEAR)


def odd_meshes(_rng: Generator) -> Iterator[StressScene]:
    """37: meshes with every common fault, beside a sound one; clear, in contact, far away."""
    box = box_mesh()
    stray_vertices = [*box.vertices.tolist(), [50.0, 0, 0]]
    odd_meshes_by_name = {
        "faces without area": TriangleMesh(box.vertices, [*box.faces.tolist(), [0, 0, 1], [3, 3, 3]]),
        "faces listed twice": TriangleMesh(box.vertices, np.concatenate([box.faces, box.faces])),
        "vertices not merged": TriangleMesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3)),
        "a far vertex of no face": TriangleMesh(stray_vertices, box.faces),
        "open": TriangleMesh(box.vertices, box.faces[:-1]),
        "faces turned round": TriangleMesh(box.vertices, box.faces[:, ::-1]),
        "an edge of three faces": TriangleMesh([*stray_vertices[:-1], [-1.0, -1, 0]], [*box.faces.tolist(), [0, 1, 8]]),
        "no area at all": TriangleMesh(np.zeros((3, 3)) + 0.5, [[0, 1, 2], [0, 0, 0]]),
    }
    for name, mesh in odd_meshes_by_name.items():
        yield scene_of_instants(name, (ball_mesh(0.5), mesh), motion_at([[1.1, 0, 0], [0.9, 0.1, 0.2], [3.0, 0, 0]]))


def far_away(_rng: Generator) -> Iterator[StressScene]:
    """38: thousands of kilometres from the origin, by the poses or in the vertices."""
    ball, box = ball_mesh(0.5), box_mesh()
    near_motion = motion_at([[x, 0.1, 0.2] for x in (0.9, 0.99, 1.0, 1 + 1e-9, 1.01)])
    for shift in (1e3, 1e5, 1e7):
        offset = np.array([shift, -shift / 3, shift / 7])
        yield scene_of_instants(f"{shift:g} m in the pose", (ball, box), shifted_motion(near_motion, offset))
        yield scene_of_instants(
            f"{shift:g} m in the vertices", (shift_mesh(ball, offset), shift_mesh(box, offset)), near_motion
        )


def scaled_scenes(_rng: Generator) -> Iterator[StressScene]:
    """39: all lengths times a power of two or of ten."""
    for scale in (2.0**-20, 2.0**-10, 2.0**10, 2.0**20, 1e-6, 1e-3, 1e3, 1e6):
        ball, box = (TriangleMesh(mesh.vertices * scale, mesh.faces) for mesh in (ball_mesh(0.5), box_mesh()))
        motion = motion_at(np.array([[x, 0.1, 0.2] for x in (0.8, 0.9, 1.01, 1.1)]) * scale)
        yield scene_of_instants(f"times {scale:.3g}", (ball, box), motion)


def resting_scenes(rng: Generator) -> Iterator[StressScene]:
    """41: a glass on a table, lifted or sunk by a hair."""
    table = box_mesh((0.3, 0.3, 0.02), (0, 0, -0.01))
    for lift in (0.0, *LIFTS_M, *(-lift for lift in LIFTS_M)):
        yield scene_of_instants(
            f"lifted by {lift:g} m", (shift_mesh(beaker_mesh(), [0, 0, lift]), table), random_pose_motion(rng, 6)
        )


def degenerate(rng: Generator) -> Iterator[StressScene]:
    """42: a mesh on itself, kisses in one vertex, a rod on a wall, blocks on one lattice."""
    beaker, ball, rod = beaker_mesh(sides=10), icosphere_mesh(), rod_mesh(0.25, 4.0, 8)
    blocks = merge_meshes(*(box_mesh(centre=(x, y, 0)) for x in range(3) for y in range(2)))
    scenes = {
        "a mesh on itself": (beaker, beaker),
        "icospheres kissing": (ball, shift_mesh(ball, [0, 0, 2])),
        "a rod on a wall": (rod, box_mesh((1.0, 6.0, 6.0), (0.75, 0, 2.0))),
        "blocks on a lattice": (blocks, shift_mesh(blocks, [1, 1, 1])),
    }
    for name, meshes in scenes.items():
        yield scene_of_instants(name, meshes, random_pose_motion(rng, 6))


CUBE_AND_PLATE: Final = box_mesh((0.005,) * 3), box_mesh((0.2, 0.2, 0.001))

SPEEDS_M_S: Final = (0.4, 0.6, 1.0, 2.0, 4.0)
"""Metres a second of a 5 mm cube through a 1 mm plate."""

PHASE_COUNT: Final = 100
PLATE_REACH_M: Final = 0.003
"""Half the cube and half the plate, metres: the surfaces meet while the centres are no further apart."""


def crossing_motion(speed: float, phases: int = PHASE_COUNT, sideways_offset: ArrayLike = 0.0) -> Motion:
    """A cube through a plate at 90 Hz, ``phases`` times one after another, each a share of a step later.

    ``speed``: metres a second, downward.
    ``phases``: how many; the k-th is (k + 1/2) / phases of a step late.
    ``sideways_offset``: metres from the middle of the plate, one number or (phases,).
    """
    step_length = speed / HEADSET_HZ
    frames_before = int(np.ceil(0.012 / step_length)) + 1
    frame_count = 2 * frames_before + 2
    phase = (np.arange(phases) + 0.5) / phases
    translations = np.zeros((phases, frame_count, 2, 3))
    translations[:, :, 0, 2] = (
        PLATE_REACH_M + (phase[:, None] - 1 - np.arange(-frames_before, frame_count - frames_before)) * step_length
    )
    translations[:, :, 0, 0] = np.broadcast_to(sideways_offset, phases)[:, None]
    is_linked = np.ones((phases, frame_count, 2), dtype=bool)
    is_linked[:, 0] = False
    total_frames = phases * frame_count
    rotations = np.broadcast_to(np.eye(3), (total_frames, 2, 3, 3))
    return Motion(
        np.arange(total_frames) / HEADSET_HZ,
        translations.reshape(total_frames, 2, 3),
        rotations,
        linked=is_linked.reshape(total_frames, 2),
    )


def thin_wall(_rng: Generator) -> Iterator[StressScene]:
    """29: every crossing has a contact, and a pass beside the plate by 3 um to 1 mm has none."""
    for speed in SPEEDS_M_S:
        yield scene_of_intervals(f"{speed:g} m/s", CUBE_AND_PLATE, crossing_motion(speed), True, PHASE_COUNT)
        passing_motion = crossing_motion(speed, sideways_offset=0.1 + 0.0025 + np.geomspace(3e-6, 1e-3, PHASE_COUNT))
        yield scene_of_intervals(f"{speed:g} m/s beside", CUBE_AND_PLATE, passing_motion, False, PHASE_COUNT)


def turning_motion(degrees: float) -> Motion:
    """The first body turns about z from minus to plus half the angle, by the shortest arc; the second stands."""
    half = np.radians(degrees) / 2
    spin_rotations = np.zeros((2, 2, 3, 3)) + np.eye(3)
    for frame, angle in enumerate((-half, half)):
        spin_rotations[frame, 0, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return Motion([0, 1 / HEADSET_HZ], np.zeros((2, 2, 3)), spin_rotations)


def rotation_only(_rng: Generator) -> Iterator[StressScene]:
    """30: of 181 degrees the shortest arc is 179 the other way."""
    rod = box_mesh((0.1, 0.004, 0.004), (0.06, 0, 0))
    for degrees in (90.0, 179.0, 181.0):
        for side in (1, -1):
            post = box_mesh((0.01, 0.01, 0.1), (0.08 * side, 0, 0))
            name = f"{degrees:g} degrees, post {'before' if side > 0 else 'behind'}"
            yield scene_of_intervals(name, (rod, post), turning_motion(degrees), (side > 0) == (degrees < 180))


def end_scenes(_rng: Generator) -> Iterator[StressScene]:
    """31: contact only at the first instant, only at the last, and no motion at all."""
    for name, start, end in (
        ("at the start only", 1.0, 1.5),
        ("at the end only", 1.5, 1.0),
        ("standing in contact", 0.9, 0.9),
        ("standing apart", 1.1, 1.1),
    ):
        motion = motion_at([[start, 0, 0], [end, 0, 0]])
        yield scene_of_intervals(name, (box_mesh(), box_mesh()), motion, name != "standing apart")


def grazing_scenes(_rng: Generator) -> Iterator[StressScene]:
    """32: two tips that pass each other at one instant, touching or by a hair."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    tip = TriangleMesh(corners, [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)])
    for gap in (0.0, TWO_MICROMETRES / 2, -TWO_MICROMETRES / 2, 2 * TWO_MICROMETRES, -2 * TWO_MICROMETRES):
        yield scene_of_intervals(
            f"gap {gap:g} m", (tip, tip), motion_at([[-0.5, 0, 2 + gap], [0.5, 0, 2 + gap]]), gap <= 0
        )


def reversed_and_split(rng: Generator) -> Iterator[StressScene]:
    """33: a crossing, the same backwards, and the same with a frame at a half, a quarter or a third of it."""
    meshes = ball_mesh(0.01), box_mesh((0.3, 0.3, 0.002))
    for number in range(3):
        start, end = np.array([*rng.uniform(-0.02, 0.02, 2), 0.05]), np.array([*rng.uniform(-0.02, 0.02, 2), -0.05])
        for sideways_offset, meets in ((0.0, True), (0.5, False)):
            shift = np.array([sideways_offset, 0, 0])
            paths: dict[str, FloatArray] = {"forth": np.array([start, end]), "back": np.array([end, start])}
            paths |= {
                f"split at {s:.3g}": np.array([start, start + s * (end - start), end]) for s in (0.5, 0.25, 1 / 3)
            }
            for direction, points in paths.items():
                name = f"path {number} {'through' if meets else 'beside'} {direction}"
                yield scene_of_intervals(name, meshes, motion_at(points + shift), meets)


def glancing_spins(_rng: Generator) -> Iterator[StressScene]:
    """44: a rod turns by up to 179 degrees in a frame; the corner of its tip passes a wall by a hair, or not."""
    tip_distance, thickness = 0.11, 0.004
    rod, reach = (
        box_mesh((0.1, thickness, thickness), (tip_distance - 0.05, 0, 0)),
        float(np.hypot(tip_distance, thickness / 2)),
    )
    for degrees, gap in product((60.0, 120.0, 170.0, 179.0), (TWO_MICROMETRES / 2, 2 * TWO_MICROMETRES, 1e-4, 2e-3)):
        for side, travel in product((1, -1), (0.0, 0.02)):
            wall = box_mesh((0.01, 0.1, 0.2), (reach + side * gap + 0.005, 0, 0))
            translations = np.zeros((2, 2, 3))
            translations[:, 0, 2] = -travel, travel
            name = f"{degrees:g} degrees, gap {side * gap:g} m, {travel:g} m along"
            yield scene_of_intervals(name, (rod, wall), shifted_motion(turning_motion(degrees), translations), side < 0)


def flush_scenes(_rng: Generator) -> Iterator[StressScene]:
    """45: a block that slides along a table and past its end, or stands on it, or in a slot of its own width."""
    table, block = box_mesh((2.0, 2.0, 0.25), (0, 0, -0.125)), box_mesh((0.25,) * 3)
    offsets = np.concatenate([np.zeros(8), np.arange(-16, 25) / 16])
    for lift in (0.0, HAIR_BREADTH_M, -HAIR_BREADTH_M, 2.0**-20, -(2.0**-20)):
        meets = _contact_where((lift <= 0) & (np.abs(offsets) <= 1.125))
        positions_along = np.outer(offsets, [1.0, 0, 0])
        lifted_positions = positions_along.copy()
        lifted_positions[:, 2] += 0.125 + lift
        yield scene_of_instants(f"lifted by {lift:g} m", (block, table), motion_at(lifted_positions), meets)
        slot = merge_meshes(*(box_mesh((2.0, 0.25, 1.0), (0, side * (0.25 + lift), 0)) for side in (1, -1)))
        yield scene_of_instants(f"a slot wider by {2 * lift:g} m", (block, slot), motion_at(positions_along), meets)


def nested_shells(_rng: Generator) -> Iterator[StressScene]:
    """46: a box or a shell in a solid or in the cavity of a shell: free, touching by face, edge or corner, or out."""
    box, solid = box_mesh(), box_mesh((2.0,) * 3)
    inner, outer = (
        merge_meshes(box, _inside_out(box_mesh((0.5,) * 3))),
        merge_meshes(box_mesh((3.0,) * 3), _inside_out(solid)),
    )
    axes = np.array([[1, 0, 0], [1, 1, 0], [1, -1, 1], [0, 0, -1]])
    distances = np.array([0.0, 0.25, 0.5 - HAIR_BREADTH_M, 0.5, 0.5 + HAIR_BREADTH_M, 0.5 + 2.0**-10])
    positions = (distances[:, None, None] * axes).reshape(-1, 3)
    meets = np.repeat(distances >= 0.5, len(axes))
    for inner_item, outer_item in product(
        {"box": box, "shell": inner}.items(), {"solid": solid, "shell": outer}.items()
    ):
        free = Verdict.CONTAINED if outer_item[0] == "solid" else Verdict.CLEAR
        name, truth = f"{inner_item[0]} in a {outer_item[0]}", _contact_where(meets, free)
        yield scene_of_instants(name, (inner_item[1], outer_item[1]), motion_at(positions), truth)
        yield scene_of_instants(f"{name}, outer first", (outer_item[1], inner_item[1]), motion_at(-positions), truth)


def impossible_pose_scenes(_rng: Generator) -> Iterator[StressScene]:
    """47: poses that are finite and impossible, among sound ones, whose answers they must not change."""
    boxes = box_mesh(), box_mesh()
    sound_positions, sound_verdicts = (
        np.array([[0.75, 0, 0], [1.5, 0, 0], [0.75, 0.25, 0]]),
        _contact_where([True, False, True]),
    )
    for value, axis, sign in product(IMPOSSIBLE_M, range(3), (1, -1)):
        lost_position = np.zeros((1, 3))
        lost_position[0, axis] = sign * value
        translations = np.concatenate(
            [sound_positions, lost_position, sound_positions, -lost_position, lost_position, sound_positions]
        )
        meets = _contact_where(np.abs(translations).max(axis=1) <= 1.0)
        yield scene_of_instants(f"{sign * value:g} m along {'xyz'[axis]}", boxes, motion_at(translations), meets)
    tiny_translations = [[0.75, 5e-324, -5e-324], [1.5, 5e-324, -0.0], [1.0, 0.0, -0.0]]
    yield scene_of_instants("the smallest numbers", boxes, motion_at(tiny_translations), sound_verdicts)
    motion = motion_at(sound_positions)
    stretched_motion = Motion(motion.times, motion.translations, motion.rotations * (1 + 4e-4))
    yield scene_of_instants("rotations to repair", boxes, stretched_motion, sound_verdicts)


def far_crossings(_rng: Generator) -> Iterator[StressScene]:
    """48: a cube through a thin plate, and beside it, a kilometre to eight thousand from the origin."""
    for offset_m, sideways_offset in product((2.0**10, 2.0**17, 2.0**23), (0.0, 0.1 + 0.0025 + 1e-3)):
        far_motion = shifted_motion(crossing_motion(1.0, 10, sideways_offset), [offset_m, -offset_m, offset_m])
        yield scene_of_intervals(
            f"{offset_m:g} m away{', beside' if sideways_offset else ''}",
            CUBE_AND_PLATE,
            far_motion,
            not sideways_offset,
            10,
        )


Maker = Callable[[Generator], Iterator[StressScene]]

SCENE_CASES: Final[dict[int, tuple[str, Maker]]] = {
    27: ("containment", containment),
    28: ("cavity", cavity),
    29: ("thin-wall phases", thin_wall),
    30: ("rotation only", rotation_only),
    31: ("start, end, no motion", end_scenes),
    32: ("grazing", grazing_scenes),
    33: ("time reversal and splitting", reversed_and_split),
    37: ("malformed meshes", odd_meshes),
    38: ("far from the origin", far_away),
    39: ("unit errors", scaled_scenes),
    41: ("resting contact", resting_scenes),
    42: ("mesh degeneracies", degenerate),
    44: ("glancing spins", glancing_spins),
    45: ("flush over a span", flush_scenes),
    46: ("nested shells", nested_shells),
    47: ("poses gone wrong", impossible_pose_scenes),
    48: ("crossings far away", far_crossings),
}
"""Number of a case -> its name, and what makes its scenes: 29 to 33, 44 and 48 ask about the time between frames."""


def scenes_of(number: int, seed: int = FIRST_SEED) -> list[StressScene]:
    """The scenes of a case; none of one that has no bodies of its own."""
    return [*SCENE_CASES[number][1](np.random.default_rng((seed, number)))] if number in SCENE_CASES else []
