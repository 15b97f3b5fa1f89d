"""Makes bodies, one motion and pairs, which the collision core takes, from a recorded session.

What is done to the poses, in order: frames whose stamp does not increase are left out and counted; every body gets a
pose in every frame by the rules of ``replay.prepare.interpolation``; parents, offsets and fixed bodies are put
together; rotations are renormalised in float64. The session itself stays as it was recorded.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Motion, TriangleMesh
from cdcore.errors import InvalidMeshError
from replay.base.constants import BLOCK_FRAMES
from replay.base.shown import shown
from replay.errors import AssemblyError
from replay.prepare.assembly import Assembly, PoseOrigin
from replay.prepare.convex_pieces import solids_of
from replay.prepare.flags import chain_of
from replay.prepare.interpolation import filled
from replay.prepare.kinematics import Kinematics, PlacedFrames
from replay.prepare.pair_choice import chosen_pairs, held_pairs, rest_frames
from replay.prepare.session_scan import SessionScan, in_order, scan
from sessions import Session
from sessions.doctor.timing import gap_rows
from sessions.importers.pose_table import LARGEST_SECONDS
from sessions.model.event import LiveContact
from sessions.model.scene import absent_bodies

RESIDUAL_FACT: Final = "contacts_clock_residual_s"
"""Fact of a session whose reported contacts came from another clock."""

GIVE_MESHES: Final = "import it again with --mesh BODY=FILE, or name meshes in a scene (replay scene new)"

Pairs = Sequence[tuple[str, str]]


@dataclass(frozen=True, eq=False)
class AssemblyLayout:
    """The parts of an assembly that do not grow with time: made once, shared by every block.

    Parameters
    ----------
    scan : the first pass over the frames.
    bodies : N bodies, tracked ones first, then fixed ones.
    pairs : (P, 2) int64 body numbers; ``held`` (P,) bool.
    breaks : per body, stamps (k, 2) between which its path is unknown; each column ascends.
    proxies, left_out, notes, live_contacts, live_residual : as in ``Assembly``.
    """

    scan: SessionScan
    bodies: tuple[Body, ...]
    pairs: NDArray[np.int64]
    held: NDArray[np.bool_]
    breaks: tuple[NDArray[np.int64], ...]
    proxies: tuple[str, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    live_contacts: Sequence[LiveContact] = ()
    live_residual: float = 0.0

    def assembly(self, frames: PlacedFrames) -> Assembly:
        """An assembly of placed frames."""
        times = (frames.stamp_ns - self.scan.first_ns) / 1e9
        valid = frames.origin != PoseOrigin.NONE
        linked = valid & np.roll(valid, 1, axis=0)
        linked[:1] = False
        for column, breaks in enumerate(self.breaks):
            # a frame lies in a break that begins before it and does not end before it
            begun, ended = (np.searchsorted(edge, frames.stamp_ns) for edge in breaks.T)
            linked[:, column] &= begun == ended
        if len(self.pairs):
            names = [body.name for body in self.bodies]
            motion = Motion(times, frames.translation, frames.rotation, valid, linked=linked, names=names, copy=False)
        else:
            # The survey has checked every sample, and no detector will use these poses: the compiler stays unloaded.
            motion = Motion.of_rigid(times, frames.translation, frames.rotation, valid, linked)
        shared = {item.name: getattr(self, item.name) for item in fields(Assembly) if hasattr(self, item.name)}
        return Assembly(motion=motion, stamp_ns=frames.stamp_ns, origin=frames.origin, **shared)


def lay_out(
    session: Session, *, pairs: Pairs | None = None, looking: bool = True, seen: SessionScan | None = None
) -> AssemblyLayout:
    """Choose the bodies and pairs of a session.

    Parameters
    ----------
    pairs : as ``assemble``.
    looking : whether a detector will run; without one, a session may have no pair.
    seen : the pass over its frames; ``None``: it is made here.

    Raises ``AssemblyError``: no frame, no body with a mesh, no pair, or a scene that contradicts itself;
    ``InvalidPoseError``: a sample that claims to be a pose and is none; names frame, time and body;
    ``InvalidMeshError``: a mesh that cannot be one; names the body.
    """
    seen = scan(session) if seen is None else seen
    if not len(seen.stamp_ns):
        raise AssemblyError("the session has no frames; record some, or look at the file with `replay info`")
    fixed = [body.id for body in session.scene.bodies if body.fixed is not None and body.id not in session.names]
    bodies = tuple(_body(session, name) for name in [*session.names, *fixed] if name in session.meshes)
    names = [body.name for body in bodies]
    if not bodies:
        tracked = shown(", ".join(session.names))
        raise AssemblyError(f"no body has a mesh; there are tracks of: {tracked}; {GIVE_MESHES}")
    Kinematics(session.scene, session.names, names)
    moves = dict(zip(session.names, seen.moves.tolist(), strict=True))
    rows = chosen_pairs(session.scene, names, moves, pairs)
    if not len(rows) and looking:
        raise AssemblyError(f"no pair to look at: {_why_no_pair(session, names, moves, pairs)}")
    return AssemblyLayout(
        scan=seen, bodies=bodies, pairs=rows, held=held_pairs(session.scene, names, rows),
        breaks=tuple(_breaks(seen, chain_of(name, session.scene)) for name in names),
        proxies=tuple(name for name in names if (known := session.scene.body(name)) is not None and known.proxy),
        left_out=tuple(name for name in session.names if name not in session.meshes),
        notes=(*seen.notes(), *_absent(session)), live_contacts=session.live_contacts, live_residual=_residual(session),
    )  # fmt: skip


def _why_no_pair(session: Session, names: list[str], moves: dict[str, bool], asked: Pairs | None) -> str:
    bare = [name for name in session.names if name not in session.meshes]
    without = f"{bare[0]} has no mesh" if len(bare) == 1 else f"{len(bare)} bodies have no mesh"
    if len(names) == 1:
        only = names[0]
        return f"{without}, only {only} has one; {GIVE_MESHES}" if bare else f"{only} is the only body"
    why = f"none of {', '.join(names)} moves against another"
    if asked is not None or len(set(rest_frames(session.scene, names, moves).values())) > 1:
        why = "the scene, or what was asked for, leaves no pair of bodies with a mesh"
    return f"{why}{'; ' + without if bare else ''}; name pairs in the scene"


def assemble(
    session: Session, *, pairs: Pairs | None = None, start: float | None = None, end: float | None = None,
    layout: AssemblyLayout | None = None,
) -> Assembly:  # fmt: skip
    """A whole session, or the frames from ``start`` to ``end`` seconds after its first, ready for detection.

    Parameters
    ----------
    pairs : pairs of body names; ``None``: the scene's, else all with relative motion.
    start, end : seconds after the first frame, both included; ``None``: the session's own.
    layout : from ``lay_out`` of this session, which is then not read again; ``pairs`` is ignored.

    Raises ``AssemblyError``, ``InvalidPoseError``, ``InvalidMeshError``: as ``lay_out``; also when no frame lies
    between ``start`` and ``end``.

    Examples
    --------
    >>> mesh = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> still, moving = [[0, 0, 0]] * 2, [[0, 0, 2], [0, 0, 1]]
    >>> turn = [[0, 0, 0, 1]] * 2
    >>> session = Session.from_arrays([0, 11], {"a": (still, turn), "b": (moving, turn)}, {"a": mesh, "b": mesh})
    >>> assemble(session).pair_name(0)
    'a-b'
    """
    layout = layout or lay_out(session, pairs=pairs)
    low, high = _window(layout.scan, start, end)
    count = int(((layout.scan.stamp_ns >= low) & (layout.scan.stamp_ns <= high)).sum())
    return layout.assembly(PlacedFrames.filled(count, _placed_blocks(session, layout, low, high)))


def _placed_blocks(session: Session, layout: AssemblyLayout, low: int, high: int) -> Iterator[PlacedFrames]:
    """The frames between two stamps, both included."""
    kinematics = Kinematics(session.scene, session.names, [body.name for body in layout.bodies])
    for frames in filled(in_order(session.blocks(BLOCK_FRAMES))):
        first, stop = np.searchsorted(frames.stamp_ns, low), np.searchsorted(frames.stamp_ns, high, side="right")
        if stop > first:
            yield kinematics.place(frames).part(int(first), int(stop))
        if len(frames) and frames.stamp_ns[-1] > high:
            return


def window_ns(first: int, last: int, start: float | None, end: float | None) -> tuple[int, int]:
    """First and last stamp asked for, of a recording from the stamps ``first`` to ``last``."""
    for seconds in (start, end):
        if seconds is not None and not abs(seconds) <= LARGEST_SECONDS:
            raise AssemblyError(f"{seconds:g} s is no time of a recording; give seconds from its first frame")
    low = first if start is None else first + round(start * 1e9)
    high = last if end is None else first + round(end * 1e9)
    return low, high


def _window(seen: SessionScan, start: float | None, end: float | None) -> tuple[int, int]:
    """First and last stamp asked for."""
    low, high = window_ns(seen.first_ns, int(seen.stamp_ns[-1]), start, end)
    if not ((seen.stamp_ns >= low) & (seen.stamp_ns <= high)).any():
        asked = f"between {0.0 if start is None else start:g} and {seen.duration if end is None else end:g} s"
        raise AssemblyError(f"no frame lies {asked}; the session runs from 0 to {seen.duration:.3f} s")
    return low, high


def _breaks(seen: SessionScan, chain: Sequence[str]) -> NDArray[np.int64]:
    """Stamps (k, 2) between which a body, or one of those that carry it, has no known path: gaps and teleports."""
    gaps = seen.stamp_ns[gap_rows(seen.stamp_ns)[:, None] + [0, 1]]
    return np.sort(np.concatenate([gaps, *(seen.jumps[one] for one in chain if one in seen.jumps)]), axis=0)


def _body(session: Session, name: str) -> Body:
    mesh = session.meshes[name]
    try:
        parts = [TriangleMesh(one.vertices, one.faces) for one in session.colliders.get(name, ())]
        return Body(name, TriangleMesh(mesh.vertices, mesh.faces), solids_of(parts) if parts else None)
    except InvalidMeshError as error:
        raise InvalidMeshError(f"mesh of body {name!r}: {error}") from error


def _residual(session: Session) -> float:
    """Seconds by which the clock of reported contacts may be off, as their import measured it."""
    try:
        return max(0.0, float(session.facts.get(RESIDUAL_FACT, "0")))
    except ValueError:
        return 0.0


def _absent(session: Session) -> list[str]:
    """A note on every declared body that has neither a track nor a fixed pose."""
    there = {*session.names, *(body.id for body in session.scene.bodies if body.fixed is not None)}
    declared = [body.id for body in session.scene.bodies if body.id not in there]
    missing = dict.fromkeys([*declared, *absent_bodies(session.scene, [*there])])
    return [f"body {name!r} is declared in the scene but was not recorded" for name in missing]
