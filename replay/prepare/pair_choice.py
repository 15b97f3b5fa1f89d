"""The pairs that a run examines: those asked for, those the scene declares, else all that move against each other."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from replay.errors import AssemblyError
from sessions.model.scene import Scene, SceneBody, candidate_pairs, selected_bodies

WORLD_NAME = ""
"""The frame that bodies at rest belong to; no body has an empty name."""


def rest_frames(scene: Scene, names: Sequence[str], moves: Mapping[str, bool]) -> dict[str, str]:
    """For each body the body (or the world) that it never moves against.

    A body whose recorded pose never changes rests in its parent, or in the world; a body that moves rests in itself.
    Two bodies have relative motion exactly when their rest frames differ: the rule needs one flag per body, however
    long the session is.
    """

    def rest(name: str) -> str:
        while name and not moves.get(name, False):
            declared_body = scene.body(name)
            name = declared_body.parent if declared_body is not None else WORLD_NAME
        return name

    return {name: rest(name) for name in names}


def chosen_pairs(
    scene: Scene, names: Sequence[str], moves: Mapping[str, bool], requested: Sequence[tuple[str, str]] | None
) -> NDArray[np.int64]:
    """The pairs to examine, (P, 2) body numbers, first below second, in order.

    ``requested`` names bodies, groups, ``tag:WORD`` or patterns; members of one group make no pair.

    Raises ``AssemblyError``: a pair names a body that is not there, or one body twice.
    """
    number_of_name = {name: index for index, name in enumerate(names)}
    if requested is None:
        candidates = candidate_pairs(scene, names)
    else:
        candidates = [
            pair for pair_selectors in requested for pair in _pairs_of_selectors(scene, names, pair_selectors)
        ]
    if requested is None and scene.pairs is None:
        rest_frame_of_body = rest_frames(scene, names, moves)
        candidates = [(a, b) for a, b in candidates if rest_frame_of_body[a] != rest_frame_of_body[b]]
    numbered_pairs = {_numbers(pair, number_of_name) for pair in candidates}
    return np.array(sorted(numbered_pairs), dtype=np.int64).reshape(-1, 2)


def grasped_pairs(scene: Scene, names: Sequence[str], pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mask of pairs of a body and its parent, or of a hand and a thing of its group, (P,) bool.

    A group with a hand in it says that the hand holds the rest throughout: contact there is the rule, not news.
    """
    scene_body_of_name = {body.id: body for body in scene.bodies}
    bodies_of_pairs = [[scene_body_of_name.get(names[k], SceneBody(names[k])) for k in pair] for pair in pairs.tolist()]
    is_grasped = [
        a.parent == b.id or b.parent == a.id or (a.group == b.group != "" and ("hand" in a.tags) != ("hand" in b.tags))
        for a, b in bodies_of_pairs
    ]
    return np.array(is_grasped, dtype=np.bool_)


def _pairs_of_selectors(scene: Scene, names: Sequence[str], selectors: Sequence[str]) -> list[tuple[str, str]]:
    """The pairs of bodies that a pair of selectors stands for."""
    if len(selectors) != 2 or selectors[0] == selectors[1]:
        raise AssemblyError(f"{tuple(selectors)!r} is no pair; name two different bodies")
    selected_names = [selected_bodies(scene, names, end) for end in selectors]
    for end, bodies in zip(selectors, selected_names, strict=True):
        if not bodies:
            known_names = ", ".join([*(group.name for group in scene.groups), *names])
            raise AssemblyError(
                f"pair {selectors[0]}-{selectors[1]} names {end!r}, which has no mesh or no pose; there are: "
                f"{known_names}"
            )
    if selected_names == [[selectors[0]], [selectors[1]]]:
        return [(selectors[0], selectors[1])]
    united = scene.group_of
    return [(a, b) for a in selected_names[0] for b in selected_names[1] if a != b and not _in_one_group(united, a, b)]


def _in_one_group(group_of: Mapping[str, str], a: str, b: str) -> bool:
    """Whether two bodies are members of one group."""
    return a in group_of and group_of[a] == group_of.get(b)


def _numbers(pair: Sequence[str], number: Mapping[str, int]) -> tuple[int, int]:
    i, j = number[pair[0]], number[pair[1]]
    return (i, j) if i < j else (j, i)
