"""A first scene of a recording, to edit: its bodies, the pairs that come near, and what is held."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import networkx as nx
import numpy as np
from scipy.spatial.transform import Rotation

from cdcore import Motion, create_detector
from cdcore.numerics import BoolArray
from cdcore.protocol import Verdict, counts_as_contact
from replay import words
from replay.prepare.assemble import assemble
from replay.prepare.assembly import Assembly
from replay.prepare.holding_poses import load_beginning
from replay.prepare.policy import parse_policy
from replay.prepare.repair import repair_session
from sessions import Session
from sessions.mesh_data import MeshData
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.scene import SceneBody
from sessions.scene_files.scene_toml import scene_to_toml, value_text

NEAR_GAP_M: Final = 0.05  # A pair whose boxes never come as near as this cannot have touched between two frames either
RIGID_M, RIGID_RAD = 0.005, np.radians(3.0)  # Throughout: what is mounted or held without a slip
LEAST_MOTION_M: Final = 0.05
SAMPLE_STEP_S: Final = 0.2

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Draft:
    """Scene facts derived from a recording.

    Parameters
    ----------
    near_pairs : pairs that move against each other and come within ``NEAR_GAP_M``, boxes along their own axes.
    held : sets of bodies that move and never move against each other.
    examined_text : the part that was looked at, in words; ``""``: all of it.
    """

    near_pairs: tuple[Pair, ...] = ()
    held: tuple[tuple[str, ...], ...] = ()
    examined_text: str = ""


def draft_scene(session: Session) -> Draft:
    """Look through a recording once, of one that is too long to be held through its beginning; errors as of a run."""
    undeclared_session = replace(session, scene=replace(session.scene, pairs=None, ignore=(), effects=None, text=""))
    if not session.meshes:
        return Draft()
    beginning = load_beginning(undeclared_session)
    repair = repair_session(beginning, parse_policy(None))
    assembly = assemble(repair.session, detecting=False, session_scan=repair.scan)
    if not len(assembly.pairs):
        return Draft()
    near_pairs = assembly.pairs[_pairs_that_come_near(assembly)].tolist()
    times = assembly.motion.times
    samples = assembly.motion.take(np.flatnonzero(np.diff(np.floor(times / SAMPLE_STEP_S), prepend=-1.0)))
    rigid_pairs = [pair for pair in near_pairs if _is_rigid_pair(samples, *pair)]
    groups = [*nx.connected_components(nx.Graph(rigid_pairs))]
    free_pairs = [pair for pair in near_pairs if not any({*pair} <= group for group in groups)]
    names = assembly.names
    grasped_groups = tuple(tuple(sorted(names[body] for body in group)) for group in groups)
    examined_text = (
        ""
        if beginning.segment is None
        else f"its first {words.decimal(repair.scan.duration / 3600, 1)} h, which fit into memory"
    )
    return Draft(tuple((names[i], names[j]) for i, j in free_pairs), grasped_groups, examined_text)


def _pairs_that_come_near(assembly: Assembly) -> BoolArray:
    """(P,) which pairs come near."""
    boxes = create_detector("collider", assembly.bodies, pairs=assembly.pairs, shape="box", skin_m=NEAR_GAP_M / 2)
    comes_near = np.zeros(len(assembly.pairs), dtype=np.bool_)
    for detection in boxes.stream(assembly.motion.blocks(BLOCK_FRAMES)):
        comes_near |= (counts_as_contact(detection.verdict) | (detection.verdict == Verdict.UNRESOLVED)).any(axis=0)
    return comes_near


def _is_rigid_pair(samples: Motion, i: int, j: int) -> bool:
    """Whether two bodies move and never move against each other."""
    both_valid = samples.valid[:, i] & samples.valid[:, j]
    if not both_valid.any():
        return False
    translations, rotation = samples.translations[both_valid], samples.rotations[both_valid]
    inverse_rotation = Rotation.from_matrix(rotation[:, i]).inv()
    translation, relative_rotation = (
        inverse_rotation.apply(translations[:, j] - translations[:, i]),
        inverse_rotation * Rotation.from_matrix(rotation[:, j]),
    )
    is_still = (
        np.ptp(translation, axis=0).max() <= RIGID_M
        and (relative_rotation[0].inv() * relative_rotation).magnitude().max() <= RIGID_RAD
    )
    return bool(is_still and np.ptp(translations[:, i], axis=0).max() > LEAST_MOTION_M)


def draft_text(session: Session, draft: Draft, files: Mapping[str, tuple[str, str, float]], heading: str) -> str:
    """The scene as TOML below remarks; ``files``: body -> its mesh file, node of it, and scale.

    What the session's scene says is kept. Its pairs are kept where it names some; else those of the draft are written,
    as remarks where the scene has effects, which ask for their own.
    """
    own = session.scene
    groups = {name: f"held-{k}" for k, group in enumerate(draft.held, start=1) for name in group}
    remarks = [heading, *([f"Looked at: {draft.examined_text}."] if draft.examined_text else [])]
    bodies = []
    for name in dict.fromkeys([*session.names, *(body.id for body in own.bodies)]):
        mesh, node, scale = files.get(name, ("", "", 1.0))
        body = own.body(name) or SceneBody(name)
        bodies.append(replace(body, mesh=mesh, node=node, scale=scale, group=body.group or groups.get(name, "")))
        remarks.append(f"{value_text(name)}: {_mesh_remark(session, name)}")
    if groups:
        remarks.append("Bodies of one group are never paired: these moved together throughout.")
    pairs = own.pairs
    if own.pairs is None and draft.near_pairs:
        distance_clause = f"came within {100 * NEAR_GAP_M:g} cm"
        if own.effects is None:
            pairs = draft.near_pairs
            remarks.append(f"The pairs {distance_clause}; without any, all pairs that move are tested.")
        else:
            remarks += [f"{value_text(pair)} {distance_clause}" for pair in draft.near_pairs]
    scene = replace(own, name=own.name or "first", bodies=tuple(bodies), pairs=pairs, text="")
    return "".join(f"# {remark}\n" for remark in remarks) + scene_to_toml(scene)


def _mesh_remark(session: Session, name: str) -> str:
    mesh: MeshData | None = session.meshes.get(name)
    if mesh is None:
        return "it has no mesh: give it mesh = FILE, shape or instrument, or contacts of it cannot be found"
    size_text = " x ".join(words.decimal(100 * edge, 1) for edge in mesh.bounds[1] - mesh.bounds[0])
    return f"{'tracked' if name in session.names else 'fixed'}; {len(mesh.faces):,} faces, {size_text} cm"
