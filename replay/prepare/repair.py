"""Before a run: the faults of the session, and what the policy does about them; the recording is not changed.

Some samples are replaced, dropped or held; every other sample keeps its bits.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from replay.base.constants import BLOCK_FRAMES
from replay.errors import RefusedError
from replay.prepare.flags import FlagSpan
from replay.prepare.interpolation import slerp
from replay.prepare.policy import DROP, HOLD, INTERPOLATE, REFUSE, Policy
from replay.prepare.session_scan import NO_ROTATION, SessionScan, scan_of
from sessions import Finding, Frames, Session, Status
from sessions.doctor.finding import in_order
from sessions.doctor.pose_pass import PosePass, look_through
from sessions.doctor.pose_spans import PoseSpan, pose_spans
from sessions.doctor.runs import runs
from sessions.doctor.session_findings import examine_session
from sessions.doctor.timing import gap_rows
from sessions.doctor.track_watch import Mark

NAMED_BY_SURVEY: Final = frozenset({"not-finite", "zero-quaternion", "non-unit-quaternion"})
"""Kinds that the assembly refuses by frame, body and value when nothing replaces them."""

DAMAGE: Final = NAMED_BY_SURVEY | {"identity-while-lost", "out-of-space"}
"""Kinds whose samples claimed to be poses: dropping them loses data that a reader would expect."""

RANKS: Final = {INTERPOLATE: 1, HOLD: 2, DROP: 3}
"""Where two faults share a sample the stricter action holds."""

Blocks = Callable[[int], Iterator[Frames]]


@dataclass(frozen=True, eq=False)
class Replacement:
    """Samples of one body that are not used as recorded.

    Parameters
    ----------
    rows : (k,) frame numbers in the file, ascending.
    status : (k,) uint8, values of ``Status``.
    position (k, 3), quaternion (k, 4) : the replacement; NaN where there is none.
    """

    rows: NDArray[np.int64]
    status: NDArray[np.uint8]
    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]

    def count(self, first: int, last: int, status: Status) -> int:
        """Samples between two frames that became this."""
        low, high = np.searchsorted(self.rows, [first, last + 1])
        return int((self.status[low:high] == status).sum())


@dataclass(frozen=True, eq=False)
class RepairedFrames:
    """The frames of another source with the samples of some columns replaced."""

    original: Blocks
    names: tuple[str, ...]
    replaced: Mapping[int, Replacement]

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames, block by block."""
        first = 0
        for block in self.original(frames):
            yield self._repaired(block, first)
            first += len(block)

    def _repaired(self, block: Frames, first: int) -> Frames:
        parts = {
            column: np.searchsorted(one.rows, [first, first + len(block)]).tolist()
            for column, one in self.replaced.items()
        }
        if not any(high > low for low, high in parts.values()):
            return block
        position, quaternion = block.position.copy(), block.quaternion_xyzw.copy()
        status = block.status.copy()
        for column, (low, high) in parts.items():
            one = self.replaced[column]
            rows, new = one.rows[low:high] - first, one.status[low:high]
            status[rows, column] = new
            there = new != Status.LOST
            position[rows[there], column] = one.position[low:high][there]
            quaternion[rows[there], column] = one.quaternion[low:high][there]
        return replace(block, position=position, quaternion_xyzw=quaternion, status=status)


def replacements(looked: PosePass, spans: Sequence[PoseSpan], policy: Policy, blocks: Blocks) -> dict[int, Replacement]:
    """What the policy makes of the samples in these spans, by column; columns where nothing changes are not there."""
    plans = {}
    for column in sorted({span.column for span in spans}):
        plan = _plan(looked, [span for span in spans if span.column == column], column, policy)
        if plan is not None:
            plans[column] = plan
    poses = _poses(plans, blocks)
    return {column: plan.filled(looked.stamp_ns, poses[column]) for column, plan in plans.items()}


@dataclass(frozen=True, eq=False)
class _Plan:
    """Rows of one column to replace, each with its rank, its limit, and the good samples around it (-1: none)."""

    column: int
    rows: NDArray[np.int64]
    rank: NDArray[np.uint8]
    limit_ns: NDArray[np.int64]
    before: NDArray[np.int64]
    after: NDArray[np.int64]

    @property
    def wanted(self) -> NDArray[np.int64]:
        """Rows that something is held at or led to, ascending."""
        stand_in = self.rank < RANKS[DROP]
        rows = np.concatenate([self.before[stand_in], self.after[stand_in & (self.rank == RANKS[INTERPOLATE])]])
        return np.unique(rows[rows >= 0])

    def filled(self, stamps: NDArray[np.int64], poses: NDArray[np.float64]) -> Replacement:
        """The replacement; ``poses`` (w, 7) are those of the rows wanted."""
        status = np.full(len(self.rows), Status.LOST, dtype=np.uint8)
        pose = np.full((len(self.rows), 7), np.nan)
        now, since = stamps[self.rows], stamps[self.rows] - stamps[self.before]
        held = (self.rank == RANKS[HOLD]) & (self.before >= 0) & (since >= 0) & (since <= self.limit_ns)
        pose[held] = poses[np.searchsorted(self.wanted, self.before[held])]
        status[held] = Status.HELD
        width = stamps[self.after] - stamps[self.before]
        inside = (since > 0) & (now < stamps[self.after]) & (width <= self.limit_ns)
        between = (self.rank == RANKS[INTERPOLATE]) & (self.before >= 0) & (self.after >= 0) & inside
        start, end = (poses[np.searchsorted(self.wanted, rows[between])] for rows in (self.before, self.after))
        share = since[between] / width[between]
        pose[between, :3] = start[:, :3] + (end[:, :3] - start[:, :3]) * share[:, None]
        pose[between, 3:] = slerp(start[:, 3:], end[:, 3:], share)
        status[between] = Status.INTERPOLATED
        return Replacement(self.rows, status, pose[:, :3], pose[:, 3:])


def _plan(looked: PosePass, spans: Sequence[PoseSpan], column: int, policy: Policy) -> _Plan | None:
    there = np.flatnonzero(looked.has(Mark.PRESENT, column))
    rank, limit = np.zeros(len(there), dtype=np.uint8), np.zeros(len(there), dtype=np.int64)
    for span in spans:
        rule = policy.rule(span.code)
        low, high = np.searchsorted(there, [span.first, span.last + 1])
        stricter = rank[low:high] < RANKS.get(rule.action, 0)
        rank[low:high][stricter] = RANKS.get(rule.action, 0)
        limit[low:high][stricter] = round(rule.limit * 1e9)
    if (looked.has(Mark.LOST, column)[there] | (rank == 0)).all() and not (rank % RANKS[DROP]).any():
        return None
    before, after = np.full(len(there), -1), np.full(len(there), -1)
    for first, last in runs(rank > 0).tolist():
        before[first : last + 1] = there[first - 1] if first else -1
        after[first : last + 1] = there[last + 1] if last + 1 < len(there) else -1
    chosen = rank > 0
    return _Plan(column, there[chosen], rank[chosen], limit[chosen], before[chosen], after[chosen])


def _poses(plans: Mapping[int, _Plan], blocks: Blocks) -> dict[int, NDArray[np.float64]]:
    """Column -> poses (w, 7) of the rows that its plan wants."""
    wanted = {column: plan.wanted for column, plan in plans.items()}
    poses = {column: np.empty((len(rows), 7)) for column, rows in wanted.items()}
    if not any(map(len, poses.values())):
        return poses
    first = 0
    for block in blocks(BLOCK_FRAMES):
        for column, rows in wanted.items():
            low, high = np.searchsorted(rows, [first, first + len(block)])
            there = rows[low:high] - first
            poses[column][low:high] = np.hstack([block.position[there, column], block.quaternion_xyzw[there, column]])
        first += len(block)
    return poses


@dataclass(frozen=True)
class Repair:
    """The session that a run uses, and why.

    Parameters
    ----------
    session : the session with the policy applied; the very same where nothing was to be done.
    policy : the rules.
    findings : everything the doctor says of it, the worst first.
    spans : what was in doubt, and what was done about it.
    digest, pose_digest : of the recording, before any repair, as ``PosePass`` has them.
    scan : the pass over ``session``; ``None`` where it is not as recorded, or holds what is no pose.
    """

    session: Session
    policy: Policy
    findings: tuple[Finding, ...]
    spans: tuple[FlagSpan, ...]
    digest: str
    pose_digest: str
    scan: SessionScan | None = None

    def as_json(self) -> dict[str, Any]:
        """What the summary of a run says of it."""
        return {
            "policy": self.policy.as_json(),
            "findings": [finding.as_json() for finding in self.findings],
            "flagged": [vars(span) for span in self.spans],
        }


def repair_session(session: Session, policy: Policy, needed: Collection[str] | None = None) -> Repair:
    """Examine a session and apply the policy to it; ``needed`` is as for ``examine_session``.

    Raises ``RefusedError``: the session has a fault that the policy refuses. Invalid samples are left to the session
    scan, which names them.
    """
    looked = look_through(session.blocks(BLOCK_FRAMES), session.scene.space_radius)
    findings = tuple(in_order([*_in_recording(session, examine_session(session, looked, needed))]))
    for finding in findings:
        if policy.rule(finding.code).action == REFUSE and finding.code not in NAMED_BY_SURVEY:
            raise RefusedError(_refusal(session, finding))
    spans = pose_spans(looked)
    replaced = replacements(looked, spans, policy, session.blocks)
    repaired = session
    if replaced:
        repaired = replace(session, source=RepairedFrames(session.blocks, session.names, replaced))
    first_ns = int(looked.stamp_ns[0]) if len(looked.stamp_ns) else 0
    zero = first_ns if session.part is None else session.part.first_ns
    flagged = [_flagged(looked, span, policy, replaced.get(span.column), zero) for span in spans]
    # The frame after a gap is flagged: the path into it is not known.
    gaps = [_span(looked, "gap", ("", row, row, 1), policy, zero) for row in (gap_rows(looked.stamp_ns) + 1).tolist()]
    as_recorded = not replaced and bool((np.diff(looked.stamp_ns) > 0).all()) and not looked.has(NO_ROTATION).any()
    seen = scan_of(looked, session.part) if as_recorded else None
    return Repair(repaired, policy, findings, (*flagged, *gaps), looked.digest, looked.pose_digest, seen)


def _in_recording(session: Session, findings: Iterable[Finding]) -> Iterator[Finding]:
    """Findings in a part of a recording, in seconds of the whole; nothing is said of what lies outside."""
    if session.part is None:
        yield from findings
        return
    first = session.part.first_ns
    for finding in findings:
        if finding.start_ns is not None and finding.end_ns is not None:
            finding = replace(finding, start=(finding.start_ns - first) / 1e9, end=(finding.end_ns - first) / 1e9)
        if finding.code != "stream-apart":
            yield finding


def _flagged(looked: PosePass, span: PoseSpan, policy: Policy, replaced: Replacement | None, zero: int) -> FlagSpan:
    dropped = span.count if span.code == "tracking-lost" else 0
    held = interpolated = 0
    if replaced is not None:
        dropped, held, interpolated = (
            replaced.count(span.first, span.last, status) for status in (Status.LOST, Status.HELD, Status.INTERPOLATED)
        )
    where = looked.names[span.column], span.first, span.last, span.count
    return _span(looked, span.code, where, policy, zero, dropped, held, interpolated)


def _span(
    looked: PosePass, kind: str, where: tuple[str, int, int, int], policy: Policy, zero: int, *became: int
) -> FlagSpan:
    """A fault of a body from a first to a last frame with so many samples.

    ``zero`` is the stamp of second 0; ``became``: samples that were dropped, held, interpolated.
    """
    body, first, last, samples = where
    start, end = (int(looked.stamp_ns[row]) for row in (first, last))
    seconds = (start - zero) / 1e9, (end - zero) / 1e9
    return FlagSpan(kind, body, start, end, seconds[0], seconds[1], samples, str(policy.rule(kind)), *became)


def _refusal(session: Session, finding: Finding) -> str:
    who = f" of {finding.body}" if finding.body else ""
    when = "" if finding.start is None else f" at {finding.start:.3f} s"
    return (
        f"{session.origin or 'the session'}: {finding.code}{who}{when}: {finding.message}; the policy refuses it, "
        f"repair the recording or choose --policy {finding.code}=... otherwise"
    )
