"""Whether the alternatives of an assumption change the contacts of a recording, without kernels.

An import in a pipe asks this before it tries every alternative in full: starting the kernels takes longer than a short
import. Bodies that never come within reach have no contact under any alternative; one frame with a contact under one
alternative and without one under another decides too. What neither decides is looked up in all frames by FCL.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.advice.pair_states import CLEAR_GAP_M, PairState, PairStates, QueryBudget, QueryLimitError, can_be_tested
from replay.advice.sampled_poses import USABLE_STATUSES, SampledPoses, is_plain, sampled_poses
from replay.errors import ReplayError
from replay.prepare.pair_choice import chosen_pairs
from sessions import MeshData, Session
from sessions.errors import SessionError
from sessions.model.assumption import Assumption, Subject
from sessions.scene_files.answers import with_answer
from sessions.scene_files.pose_axes import follows_its_poses

MOST_FRAMES: Final = 12_000
"""Frames whose distances are looked up; of more, evenly chosen ones, as many as are replayed."""

TESTS_OF_A_PAIR: Final = 16
"""Frames of a pair that are looked up before all are; twice as many where boxes are disjoint under an alternative."""

FEW_FRAMES: Final = 6_000
"""Frames within reach, of all pairs, up to which all are looked up at once."""

CLEARLY_BETTER_M: Final = 0.005
"""Metres by which the bounds of colliders fit their meshes better in other axes before these are asked for."""

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _Scene:
    """A recording under one alternative in k chosen frames."""

    meshes: Mapping[str, MeshData]
    poses: SampledPoses


class _PairScene:
    """A pair under one alternative in the k frames within reach: poses of the second body in the axes of the first."""

    def __init__(self, meshes: tuple[MeshData, MeshData], rotations: Array, translations: Array) -> None:
        self._rotations = rotations
        self._translations = translations
        self._states = PairStates(*meshes)
        self.depths = box_depths(meshes, rotations, translations)
        """Metres (k,) by which the boxes of both overlap along the axes of both; below 0 they are disjoint."""

    def states(self, rows: Rows, budget: QueryBudget) -> NDArray[np.int8]:
        """Returns the ``PairState`` of some frames, (n,); FCL is asked where boxes are not disjoint.

        Raises ``QueryLimitError``.
        """
        states = np.full(len(rows), PairState.SEPARATED, dtype=np.int8)
        near_rows = np.flatnonzero(self.depths[rows] >= -CLEAR_GAP_M)
        chosen = rows[near_rows]
        states[near_rows] = self._states.states(self._rotations[chosen], self._translations[chosen], budget)
        return states


Alternatives = Sequence[_PairScene]
"""A pair under each alternative of an assumption."""


def alternatives_differ(session: Session, assumption: Assumption) -> bool | None:
    """Returns whether the alternatives of an assumption change contacts; ``None``: only a replay decides it.

    Colliders have no contacts of their own here; theirs differ where others than those assumed fit their meshes better.
    """
    if assumption.subject is Subject.COLLIDER_AXES:
        return best_fitting_axes(session, assumption) != assumption.value
    if assumption.subject is Subject.POSE_AXES and _all_follow(session, assumption):
        return False
    chosen_rows = evenly(len(session.frames), MOST_FRAMES)
    values = dict.fromkeys((assumption.value, *assumption.alternatives))
    try:
        scenes = _scenes(session, assumption, values, chosen_rows)
    except (SessionError, ReplayError):
        return None
    if not all(can_be_tested(mesh) for scene in scenes for mesh in scene.meshes.values()):
        return None
    poses = scenes[0].poses
    near_pairs = list[Alternatives]()
    for pair in _pairs(session, [name for name in poses.names if name in session.meshes]):
        columns = poses.names.index(pair[0]), poses.names.index(pair[1])
        posed_rows = np.flatnonzero(poses.is_usable[:, columns[0]] & poses.is_usable[:, columns[1]])
        near_pairs.append(_pair_scenes(scenes, pair, columns, posed_rows))
    return _states_differ(near_pairs)


def _all_follow(session: Session, row: Assumption) -> bool:
    """Whether all meshes turn with the poses under every alternative."""
    alternatives = (value for value in row.alternatives if value != row.value)
    return all(follows_its_poses(session, with_answer(session, row, value)) for value in alternatives)


def _scenes(session: Session, assumption: Assumption, assumption_values: Iterable[str], rows: Rows) -> list[_Scene]:
    """The recording under each value; those that differ in their meshes alone share their poses."""
    poses = sampled_poses(session, rows)
    scenes = []
    for value in assumption_values:
        changed_session = session if value == assumption.value else with_answer(session, assumption, value)
        is_unmoved = changed_session.source is session.source and (
            is_plain(session) or changed_session.scene == session.scene
        )
        scenes.append(_Scene(changed_session.meshes, poses if is_unmoved else sampled_poses(changed_session, rows)))
    return scenes


def _pairs(session: Session, names: Sequence[str]) -> list[tuple[str, str]]:
    """The pairs of names that a replay examines."""
    frames = session.frames
    moves_by_name = {}
    for column, name in enumerate(frames.names):
        is_usable = np.isin(frames.status[:, column], USABLE_STATUSES)
        poses = np.hstack([frames.position[is_usable, column], frames.quaternion_xyzw[is_usable, column]])
        moves_by_name[name] = bool((poses != poses[:1]).any())
    return [(names[i], names[j]) for i, j in chosen_pairs(session.scene, names, moves_by_name, requested=None).tolist()]


def _pair_scenes(scenes: Sequence[_Scene], pair: tuple[str, str], columns: tuple[int, int], rows: Rows) -> Alternatives:
    """A pair under each alternative, in those of some frames in which it is within reach under any."""
    rows_within_reach = rows[_is_within_reach(scenes, pair, columns, rows)]
    poses = dict[int, tuple[Array, Array]]()
    alternatives = []
    for scene in scenes:
        key = id(scene.poses)
        if key not in poses:
            poses[key] = _relative_poses(scene.poses, columns, rows_within_reach)
        alternatives.append(_PairScene((scene.meshes[pair[0]], scene.meshes[pair[1]]), *poses[key]))
    return alternatives


def _is_within_reach(
    scenes: Sequence[_Scene], pair: tuple[str, str], columns: tuple[int, int], rows: Rows
) -> NDArray[np.bool_]:
    """Whether spheres about the origins of two bodies overlap under any alternative, for each row."""
    is_within = np.zeros(len(rows), dtype=np.bool_)
    reach_of_pair = max(
        sum(float(np.linalg.norm(scene.meshes[name].vertices, axis=1).max()) for name in pair) for scene in scenes
    )
    for poses in {id(scene.poses): scene.poses for scene in scenes}.values():
        origin_difference = poses.positions[rows, columns[0]] - poses.positions[rows, columns[1]]
        is_within |= (origin_difference * origin_difference).sum(axis=1) <= reach_of_pair**2
    return is_within


def _relative_poses(poses: SampledPoses, columns: tuple[int, int], rows: Rows) -> tuple[Array, Array]:
    """Rotations (k, 3, 3) and translations (k, 3) of the second body in the axes of the first."""
    first, second = (poses.rotations(column, rows) for column in columns)
    origin_difference = poses.positions[rows, columns[1]] - poses.positions[rows, columns[0]]
    inverse_rotations = first.transpose(0, 2, 1)
    return inverse_rotations @ second, (inverse_rotations @ origin_difference[:, :, None])[:, :, 0]


def box_depths(meshes: tuple[MeshData, MeshData], rotations: Array, translations: Array) -> Array:
    """Returns the metres (k,) by which the boxes of two bodies overlap along the axes of both.

    ``rotations`` (k, 3, 3), ``translations`` (k, 3): poses of the second body in the axes of the first.
    """
    bounds = [mesh.bounds for mesh in meshes]
    half = [0.5 * (box[1] - box[0]) for box in bounds]
    box_middles = [box.mean(axis=0) for box in bounds]
    middle_difference = rotations @ box_middles[1] + translations - box_middles[0]
    absolute_rotations = np.abs(rotations)
    along_first = half[0] + absolute_rotations @ half[1] - np.abs(middle_difference)
    along_second = half[1] + half[0] @ absolute_rotations - np.abs((middle_difference[:, None] @ rotations)[:, 0])
    depths: Array = np.minimum(along_first, along_second).min(axis=1)
    return depths


def evenly(number_count: int, most_numbers: int) -> Rows:
    """Returns at most so many of the numbers below a count, evenly chosen."""
    if not number_count:
        return np.zeros(0, dtype=np.intp)
    return np.linspace(0, number_count - 1, min(number_count, most_numbers)).round().astype(np.intp)


def _states_differ(near_pairs: Sequence[Alternatives]) -> bool | None:
    """Whether a pair is in contact under one alternative and apart under another, in all frames within reach.

    ``None``: a state is unknown, or looking them all up would take longer than a replay.
    """
    budget = QueryBudget()
    frame_count = sum(len(alternatives[0].depths) for alternatives in near_pairs)
    if frame_count > FEW_FRAMES and _samples_differ(near_pairs, budget):
        return True
    is_known = True
    try:
        for alternatives in near_pairs:
            rows = np.arange(len(alternatives[0].depths))
            states = [pair_scene.states(rows, budget) for pair_scene in alternatives]
            if _contradict(states):
                return True
            is_known &= all((state != PairState.UNKNOWN).all() for state in states)
    except QueryLimitError:
        return None
    return False if is_known else None


def _samples_differ(near_pairs: Sequence[Alternatives], budget: QueryBudget) -> bool:
    """Whether in one of a few frames a pair is in contact under one alternative and apart under another."""
    try:
        for pair_scenes in near_pairs:
            rows = _telling_rows(pair_scenes)
            if len(rows) and _contradict([pair_scene.states(rows, budget) for pair_scene in pair_scenes]):
                return True
    except QueryLimitError:
        return False
    return False


def _telling_rows(alternatives: Alternatives) -> Rows:
    """Frames in which alternatives likely differ: boxes are disjoint under one and deep under another, or just deep."""
    depths = np.stack([pair_scene.depths for pair_scene in alternatives])
    deepest, is_separated = depths.max(axis=0, initial=-np.inf), depths.min(axis=0, initial=np.inf) < 0.0
    chosen_rows = set[int]()
    for mask in (is_separated, ~is_separated):
        overlapping = np.flatnonzero(mask & (deepest > 0.0))
        if len(overlapping):
            chosen_rows.add(int(overlapping[deepest[overlapping].argmax()]))
            chosen_rows.update(overlapping[evenly(len(overlapping), TESTS_OF_A_PAIR)].tolist())
    return np.array(sorted(chosen_rows), dtype=np.intp)


def _contradict(states: Sequence[NDArray[np.int8]]) -> bool:
    """Whether a frame is in contact under one alternative and apart under another."""
    is_apart = np.any([state == PairState.SEPARATED for state in states], axis=0)
    is_contact = np.any([state == PairState.CONTACT for state in states], axis=0)
    return bool((is_apart & is_contact).any())


def best_fitting_axes(session: Session, row: Assumption) -> str:
    """Returns the axes of colliders whose bounds are clearly nearer to those of their meshes, else those assumed."""
    values = tuple(dict.fromkeys((row.value, *row.alternatives)))
    misfit_of_axes = {
        value: collider_misfit(session if value == row.value else with_answer(session, row, value), row.bodies)
        for value in values
    }
    best_axes = min(values, key=lambda value: misfit_of_axes[value])
    return best_axes if misfit_of_axes[row.value] - misfit_of_axes[best_axes] > CLEARLY_BETTER_M else row.value


def collider_misfit(session: Session, names: Sequence[str]) -> float:
    """Returns the metres by which the bounds of colliders and of their meshes differ at most; 0 without a mesh."""
    largest_misfit = 0.0
    for name in names:
        solids: Sequence[MeshData] = session.colliders.get(name, ())
        if name in session.meshes and solids:
            bounds = np.stack([solid.bounds for solid in solids])
            swept_box = np.stack([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)])
            largest_misfit = max(largest_misfit, float(np.abs(swept_box - session.meshes[name].bounds).max()))
    return largest_misfit
