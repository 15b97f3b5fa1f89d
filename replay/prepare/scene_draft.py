"""A first scene of a recording, to edit: its bodies, the pairs that come near, and what is held."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import networkx as nx
import numpy as np

from cdcore import Motion, create_detector
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import Verdict, counts_as_contact
from replay.base.constants import BLOCK_FRAMES
from replay.prepare.assemble import AssemblyLayout, assemble, lay_out
from replay.prepare.holding_poses import begun
from replay.prepare.policy import parse_policy
from replay.prepare.repair import repair_session
from sessions import Session
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene, SceneBody
from sessions.scene_files.scene_toml import body_keys, table_lines, value_text

NEAR_M: Final = 0.05  # A pair whose boxes never come as near as this cannot have touched between two frames either
RIGID_M, RIGID_DEG = 0.005, 3.0  # Throughout: what is mounted or held without a slip
MOVES_M: Final = 0.05
SAMPLE_S: Final = 0.2

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Draft:
    """What a recording tells about its scene.

    Parameters
    ----------
    near : pairs that move against each other and come within ``NEAR_M``, boxes along their own axes.
    held : sets of bodies that move and never move against each other.
    seen : the part that was looked at, in words; ``""``: all of it.
    """

    near: tuple[Pair, ...] = ()
    held: tuple[tuple[str, ...], ...] = ()
    seen: str = ""


def drafted(session: Session) -> Draft:
    """Look through a recording once, of one that is too long to be held through its beginning; errors as of a run."""
    bare = replace(session, scene=replace(session.scene, pairs=None, ignore=(), effects=None, text=""))
    if not session.meshes:
        return Draft()
    beginning = begun(bare)
    session = repair_session(beginning, parse_policy(None)).session
    layout = lay_out(session, looking=False)
    if not len(layout.pairs):
        return Draft()
    near, samples = _near(session, layout)
    names = [body.name for body in layout.bodies]
    pairs = [(names[i], names[j]) for i, j in layout.pairs[near].tolist()]
    rigid = [pair for pair, fixed in zip(pairs, _rigid(samples, layout, near), strict=True) if fixed]
    held = tuple(tuple(sorted(group)) for group in nx.connected_components(nx.Graph(rigid)))
    loose = tuple(pair for pair in pairs if not any({*pair} <= {*group} for group in held))
    seen = "" if beginning.part is None else f"its first {layout.scan.duration / 3600:.1f} h, which fit into memory"
    return Draft(loose, held, seen)


def _near(session: Session, layout: AssemblyLayout) -> tuple[BoolArray, Motion]:
    """(P,) which pairs come near, and the motion at a sample every ``SAMPLE_S``."""
    boxes = create_detector("collider", layout.bodies, pairs=layout.pairs, shape="box", skin_m=NEAR_M / 2)
    motion = assemble(session, layout=layout).motion
    near = np.zeros(len(layout.pairs), dtype=np.bool_)
    for found in boxes.stream(motion.blocks(BLOCK_FRAMES)):
        near |= (counts_as_contact(found.verdict) | (found.verdict == Verdict.UNRESOLVED)).any(axis=0)
    return near, motion.take(np.flatnonzero(np.diff(np.floor(motion.times / SAMPLE_S), prepend=-1.0)))


def _turned(first: FloatArray, second: FloatArray) -> FloatArray:
    """Degrees between rotations (..., 3, 3)."""
    trace = np.einsum("...ij,...ij->...", first, second)
    return np.degrees(np.arccos(np.clip((trace - 1) / 2, -1.0, 1.0)))


def _rigid(samples: Motion, layout: AssemblyLayout, near: BoolArray) -> list[bool]:
    """Which near pairs move and never move against each other."""
    found = []
    for i, j in layout.pairs[near].tolist():
        seen = samples.valid[:, i] & samples.valid[:, j]
        if not seen.any():
            found.append(False)
            continue
        at, turn = samples.translations[seen], samples.rotations[seen]
        place = np.einsum("tji,tj->ti", turn[:, i], at[:, j] - at[:, i])
        angle = np.einsum("tji,tjk->tik", turn[:, i], turn[:, j])
        still = np.ptp(place, axis=0).max() <= RIGID_M and _turned(angle, angle[:1]).max() <= RIGID_DEG
        found.append(bool(still and np.ptp(at[:, i], axis=0).max() > MOVES_M))
    return found


def draft_text(session: Session, draft: Draft, files: Mapping[str, tuple[str, str, float]], heading: str) -> str:
    """The scene as TOML with remarks; ``files``: body -> its mesh file, node of it, and scale.

    What the session's scene says of bodies and effects is kept. Its pairs are kept where it names some; else those of
    the draft are written, as remarks where the scene has effects, which ask for their own.
    """
    own = session.scene
    there = dict.fromkeys([*session.names, *(body.id for body in own.bodies if body.id not in session.names)])
    lines = [
        f"# {heading}",
        *([f"# Looked at: {draft.seen}."] if draft.seen else []),
        "[scene]",
        f"name = {value_text(own.name or 'first')}",
    ]
    groups = {name: f"held-{k}" for k, group in enumerate(draft.held, start=1) for name in group}
    for name in there:
        mesh, node, scale = files.get(name, ("", "", 1.0))
        body = own.body(name) or SceneBody(name)
        body = replace(body, mesh=mesh, node=node, scale=scale, group=body.group or groups.get(name, ""))
        lines += [*table_lines("body", body_keys(body)), f"# {_about(session, name)}"]
    lines += ["", "# Bodies of one group are never paired: these moved together throughout."] * bool(groups)
    lines += [*_pairs(own, draft), *(line for one in own.ignore for line in table_lines("ignore", {"between": one}))]
    for effect in own.effects or ():
        lines += table_lines("effect", {"kind": effect.kind, **effect.settings})
    return "\n".join((["effect = []"] if own.effects == () else []) + lines) + "\n"


def _about(session: Session, name: str) -> str:
    mesh: MeshData | None = session.meshes.get(name)
    if mesh is None:
        return "it has no mesh: give it mesh = FILE, shape or instrument, or contacts of it cannot be found"
    size = " x ".join(f"{100 * edge:.1f}" for edge in mesh.bounds[1] - mesh.bounds[0])
    return f"{'tracked' if name in session.names else 'fixed'}; {len(mesh.faces):,} faces, {size} cm"


def _pairs(own: Scene, draft: Draft) -> Iterator[str]:
    if own.pairs is not None:
        yield from (line for one in own.pairs for line in table_lines("pair", {"between": one}))
        return
    mark = "" if own.effects is None else "# "
    if draft.near:
        yield from ("", f"# Pairs that came within {100 * NEAR_M:g} cm; without any, all that move are looked at.")
    for pair in draft.near:
        yield from (f"{mark}{line}" if line else "" for line in table_lines("pair", {"between": pair}))
