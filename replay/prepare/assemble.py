"""Makes bodies, one motion and pairs, which the collision core takes, from a recorded session.

What is done to the poses, in order: frames whose stamp does not increase are left out and counted; every body gets a
pose in every frame by the rules of ``replay.prepare.interpolation``; parents, offsets and fixed bodies are put
together; rotations are renormalised in float64. The session itself stays as it was recorded.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore import Body, Motion, TriangleMesh
from cdcore.errors import InvalidMeshError
from cdcore.mesh import once_a_mesh
from cdcore.numerics import IntArray
from replay import words
from replay.cutting.convex_solids import solids_of
from replay.errors import AssemblyError
from replay.prepare.assembly import Assembly, PoseOrigin
from replay.prepare.flags import chain_of
from replay.prepare.interpolation import fill_frames
from replay.prepare.kinematics import Kinematics, Placed
from replay.prepare.pair_choice import chosen_pairs, grasped_pairs, rest_frames
from replay.prepare.session_scan import SessionScan, in_order, scan_session
from replay.words import plural, safe_text
from sessions import MeshData, Session
from sessions.doctor.timing import gap_rows
from sessions.importers.ledger import LARGEST_SECONDS
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.scene import absent_bodies

RESIDUAL_FACT: Final = "contacts_clock_residual_s"
"""Fact of a session whose reported contacts came from another clock."""

MOST_UNKNOWN_NAMES: Final = 5
"""Names in an engine's reports that a note lists."""
MESHES_HINT: Final = "import it again with --mesh BODY=FILE, or name meshes in a scene (replay scene new)"

Pairs = Sequence[tuple[str, str]]


def assemble(
    session: Session,
    *,
    pairs: Pairs | None = None,
    start: float | None = None,
    end: float | None = None,
    detecting: bool = True,
    session_scan: SessionScan | None = None,
) -> Assembly:
    """A whole session, or the frames from ``start`` to ``end`` seconds after its first, ready for detection.

    Parameters
    ----------
    pairs : pairs of body names; ``None``: the scene's, else all with relative motion.
    start, end : seconds after the first frame, both included; ``None``: the session's own.
    detecting : whether a detector will run; without one, a session may have no pair.
    session_scan : the pass over its frames; ``None``: it is made here.

    Raises ``AssemblyError``: no frame, none between ``start`` and ``end``, no body with a mesh, no pair, or a scene
    that contradicts itself; ``InvalidPoseError``: a sample that claims to be a pose and is none; names frame, time and
    body; ``InvalidMeshError``: a mesh that cannot be one; names the body.

    Examples
    --------
    >>> mesh = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> still, moving = [[0, 0, 0]] * 2, [[0, 0, 2], [0, 0, 1]]
    >>> turn = [[0, 0, 0, 1]] * 2
    >>> session = Session.from_arrays([0, 11], {"a": (still, turn), "b": (moving, turn)}, {"a": mesh, "b": mesh})
    >>> assemble(session).pair_name(0)
    'a-b'
    """
    session_scan = scan_session(session) if session_scan is None else session_scan
    if not len(session_scan.stamp_ns):
        raise AssemblyError("the session has no frames; record some, or check the file with `replay info`")
    scene = session.scene
    fixed_names = [body.id for body in scene.bodies if body.fixed is not None and body.id not in session.names]
    bodies = tuple(body_of(session, name) for name in [*session.names, *fixed_names] if name in session.meshes)
    body_names = [body.name for body in bodies]
    if not bodies:
        tracked_names = safe_text(", ".join(session.names))
        raise AssemblyError(f"no body has a mesh; there are tracks of: {tracked_names}; {MESHES_HINT}")
    kinematics = Kinematics(scene, session.names, body_names)
    moves_by_name = dict(zip(session.names, session_scan.moves.tolist(), strict=True))
    pair_rows = chosen_pairs(scene, body_names, moves_by_name, pairs)
    if not len(pair_rows) and detecting:
        without_pose = [
            name for name, has_any_pose in zip(session.names, session_scan.has_pose, strict=True) if not has_any_pose
        ]
        missing_pose_reason = _without_pose([name for name in without_pose if name in body_names])
        raise AssemblyError(
            f"no pair to replay: {missing_pose_reason or _why_no_pair(session, body_names, moves_by_name, pairs)}"
        )
    stamps = _window_stamps(session_scan, start, end)
    placed_frames = _place_frames(session, kinematics, stamps, len(bodies))
    declared_bodies = [scene.body(name) for name in body_names]
    return Assembly(
        bodies=bodies,
        motion=_motion(stamps, placed_frames, session_scan, session, body_names, detecting=len(pair_rows) > 0),
        pairs=pair_rows,
        grasped=grasped_pairs(scene, body_names, pair_rows),
        stamp_ns=stamps,
        origin=placed_frames.origin,
        proxies=tuple(body.id for body in declared_bodies if body is not None and body.proxy),
        left_out=tuple(name for name in session.names if name not in session.meshes),
        notes=(
            *session_scan.notes(),
            *_absent_body_notes(session),
            *_fixed_and_tracked(session),
            *unknown_in_reports(session),
        ),
        live_contacts=session.live_contacts,
        live_residual=_residual(session),
        group_of=scene.group_of,
    )


def _without_pose(names: Sequence[str]) -> str:
    """Why bodies of which every sample is lost are in no pair; ``""``: there are none."""
    if not names:
        return ""
    verb = "has" if len(names) == 1 else "have"
    return f"{', '.join(names)} {verb} no pose that is not lost; `replay doctor` says where; correct the export"


def _why_no_pair(session: Session, names: list[str], moves: dict[str, bool], requested: Pairs | None) -> str:
    names_without_mesh = [name for name in session.names if name not in session.meshes]
    mesh_clause = (
        f"{names_without_mesh[0]} has no mesh"
        if len(names_without_mesh) == 1
        else f"{len(names_without_mesh)} bodies have no mesh"
    )
    if len(names) == 1:
        only_name = names[0]
        return (
            f"{mesh_clause}, only {only_name} has one; {MESHES_HINT}"
            if names_without_mesh
            else f"{only_name} is the only body"
        )
    reason = f"{', '.join(names)} do not move against each other"
    if requested is not None or len(set(rest_frames(session.scene, names, moves).values())) > 1:
        reason = "the scene, or the request, leaves no pair of bodies with a mesh"
    return f"{reason}{'; ' + mesh_clause if names_without_mesh else ''}; name pairs in the scene"


def _place_frames(session: Session, kinematics: Kinematics, stamps: IntArray, bodies: int) -> Placed:
    """The frames of these stamps, written block by block into arrays of their size."""
    all_frames, placed_count = Placed.empty(len(stamps), bodies), 0
    for frames in fill_frames(in_order(session.blocks(BLOCK_FRAMES))):
        first, last = np.searchsorted(frames.stamp_ns, stamps[0]), np.searchsorted(frames.stamp_ns, stamps[-1], "right")
        frames = frames.segment(int(first), int(last))
        placed_slice = slice(placed_count, placed_count + len(frames))
        kinematics.place(
            frames,
            Placed(
                all_frames.translation[placed_slice], all_frames.rotation[placed_slice], all_frames.origin[placed_slice]
            ),
        )
        placed_count = placed_slice.stop
        if placed_count == len(stamps):
            break
    return all_frames


def _motion(
    stamps: IntArray, placed_frames: Placed, scan: SessionScan, session: Session, names: list[str], *, detecting: bool
) -> Motion:
    times = (stamps - scan.first_ns) / 1e9
    has_pose = placed_frames.origin != PoseOrigin.NONE
    has_pose_before = has_pose & np.roll(has_pose, 1, axis=0)
    has_pose_before[:1] = False
    for column, name in enumerate(names):
        # A frame lies in a break that begins before it and does not end before it.
        breaks = _path_breaks(scan, chain_of(name, session.scene))
        intervals_begun, intervals_ended = (np.searchsorted(edge, stamps) for edge in breaks.T)
        has_pose_before[:, column] &= intervals_begun == intervals_ended
    if detecting:
        return Motion(
            times,
            placed_frames.translation,
            placed_frames.rotation,
            has_pose,
            linked=has_pose_before,
            names=names,
            copy=False,
        )
    # The scan has checked every sample, and no detector will use these poses: the compiler stays unloaded.
    return Motion.of_rigid(times, placed_frames.translation, placed_frames.rotation, has_pose, has_pose_before)


def window_ns(first_stamp: int, last_stamp: int, start: float | None, end: float | None) -> tuple[int, int]:
    """First and last stamp asked for, of a recording from the stamps ``first_stamp`` to ``last_stamp``."""
    for seconds in (start, end):
        if seconds is not None and not abs(seconds) <= LARGEST_SECONDS:
            raise AssemblyError(f"{seconds:g} s is no time of a recording; give seconds from its first frame")
    lower = first_stamp if start is None else first_stamp + round(start * 1e9)
    upper = last_stamp if end is None else first_stamp + round(end * 1e9)
    return lower, upper


def _window_stamps(scan: SessionScan, start: float | None, end: float | None) -> IntArray:
    """The stamps asked for."""
    lower, upper = window_ns(scan.first_ns, int(scan.stamp_ns[-1]), start, end)
    stamps = scan.stamp_ns[(scan.stamp_ns >= lower) & (scan.stamp_ns <= upper)]
    if not len(stamps):
        interval_text = f"between {start or 0.0:g} and {scan.duration if end is None else end:g} s"
        raise AssemblyError(f"no frame lies {interval_text}; the session runs from 0 to {words.moment(scan.duration)}")
    return stamps


def _path_breaks(scan: SessionScan, chain: Sequence[str]) -> IntArray:
    """Stamps (k, 2) between which a body, or one of those that carry it, has no known path: gaps and teleports."""
    gaps = scan.stamp_ns[gap_rows(scan.stamp_ns)[:, None] + [0, 1]]
    return np.sort(np.concatenate([gaps, *(scan.jumps[body] for body in chain if body in scan.jumps)]), axis=0)


def body_of(session: Session, name: str) -> Body:
    """Returns a body with its mesh and its colliders; InvalidMeshError names it."""
    mesh = session.meshes[name]
    try:
        solids = [_solid(collider) for collider in session.colliders.get(name, ())]
        return Body(name, _solid(mesh), solids_of(solids) if solids else None)
    except InvalidMeshError as error:
        raise InvalidMeshError(f"mesh of body {name!r}: {error}") from error


@once_a_mesh
def _solid(mesh: MeshData) -> TriangleMesh:
    """Collision mesh with its trees, shared by all runs of a session."""
    return TriangleMesh(mesh.vertices, mesh.faces)


def _residual(session: Session) -> float:
    """Seconds by which the clock of reported contacts may be off, as their import measured it."""
    try:
        return max(0.0, float(session.facts.get(RESIDUAL_FACT, "0")))
    except ValueError:
        return 0.0


def _absent_body_notes(session: Session) -> list[str]:
    """A note on every declared body that has neither a track nor a fixed pose."""
    present_names = {*session.names, *(body.id for body in session.scene.bodies if body.fixed is not None)}
    declared_absent = [body.id for body in session.scene.bodies if body.id not in present_names]
    missing_names = dict.fromkeys([*declared_absent, *absent_bodies(session.scene, [*present_names])])
    return [f"body {name!r} is declared in the scene but was not recorded" for name in missing_names]


def _fixed_and_tracked(session: Session) -> list[str]:
    """A note on every body whose fixed pose is not used, for it has poses of its own."""
    bodies = (body.id for body in session.scene.bodies if body.fixed is not None and body.id in session.names)
    return [f"the fixed pose of body {name!r} is not used: the recording has poses of it" for name in bodies]


def unknown_in_reports(session: Session) -> list[str]:
    """A sentence on names in the engine's reports that are no body of the session, if there are any."""
    present_names = {*session.names, *(body.id for body in session.scene.bodies)}
    pairs = [{contact.body_a, contact.body_b} for contact in session.live_contacts]
    unknown = sorted({name for pair in pairs for name in pair} - present_names)
    if not unknown:
        return []
    reports_text = plural(sum(bool(pair - present_names) for pair in pairs), "report")
    more_text = f" and {len(unknown) - MOST_UNKNOWN_NAMES} more" if len(unknown) > MOST_UNKNOWN_NAMES else ""
    named_text = ", ".join(map(repr, unknown[:MOST_UNKNOWN_NAMES]))
    return [f"compared with nothing, for no body is called {named_text}{more_text}: {reports_text} of the engine"]
