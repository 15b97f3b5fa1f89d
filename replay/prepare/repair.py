"""Before a run: the faults of the session, and what the policy does about them; the recording is not changed.

Some samples are replaced, dropped or held; every other sample keeps its bits.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from replay import words
from replay.errors import RefusedError
from replay.prepare.corrupt_poses import CORRUPT_POSE_MARKS
from replay.prepare.flags import FlagSpan
from replay.prepare.interpolation import interpolate_poses, present_neighbours
from replay.prepare.policy import DROP, HOLD, INTERPOLATE, REFUSE, Policy
from replay.prepare.session_scan import SessionScan, scan_of, scan_session
from sessions import Finding, Frames, Session, Status
from sessions.doctor.finding import in_order
from sessions.doctor.pose_pass import PosePass, run_pose_pass
from sessions.doctor.pose_spans import PoseSpan, pose_spans
from sessions.doctor.session_findings import examine_session
from sessions.doctor.timing import gap_rows
from sessions.doctor.track_watch import Mark
from sessions.model.constants import BLOCK_FRAMES

UNUSABLE_POSE_CODES: Final = frozenset({"not-finite", "zero-quaternion", "non-unit-quaternion"})
"""Kinds that the assembly refuses by frame, body and value when nothing replaces them."""

DAMAGE_CODES: Final = UNUSABLE_POSE_CODES | {"identity-while-lost", "out-of-space"}
"""Kinds whose samples claimed to be poses: dropping them loses data that a reader would expect."""

ACTION_RANKS: Final = {INTERPOLATE: 1, HOLD: 2, DROP: 3}
"""Where two faults share a sample the stricter action holds."""

ALL_BODIES: Final = -1
"""The column of a gap, which is of no body alone."""

BlockReader = Callable[[int], Iterator[Frames]]


@dataclass(frozen=True, eq=False)
class Replacement:
    """Samples of one body that are not used as recorded.

    Parameters
    ----------
    rows : (k,) frame numbers in the file, ascending.
    status : (k,) uint8, values of ``Status``.
    poses : (k, 7) place and quaternion that replace them; NaN where there is none.
    """

    rows: NDArray[np.int64]
    status: NDArray[np.uint8]
    poses: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RepairedFrames:
    """The frames of another source with the samples of some columns replaced."""

    original: BlockReader
    names: tuple[str, ...]
    replaced: Mapping[int, Replacement]

    def blocks(self, frames: int) -> Iterator[Frames]:
        """All frames, block by block."""
        first = 0
        for block in self.original(frames):
            position, quaternion = block.position.copy(), block.quaternion_xyzw.copy()
            status = block.status.copy()
            for column, replacement in self.replaced.items():
                row_slice = slice(*np.searchsorted(replacement.rows, [first, first + len(block)]))
                rows, poses = replacement.rows[row_slice] - first, replacement.poses[row_slice]
                status[rows, column] = replacement.status[row_slice]
                has_pose = replacement.status[row_slice] != Status.LOST
                position[rows[has_pose], column] = poses[has_pose, :3]
                quaternion[rows[has_pose], column] = poses[has_pose, 3:]
            yield replace(block, position=position, quaternion_xyzw=quaternion, status=status)
            first += len(block)


def _replacement(
    pose_pass: PosePass, spans: Sequence[PoseSpan], policy: Policy, blocks: BlockReader
) -> Replacement | None:
    """Replacement of the samples of one body in its spans under the policy; ``None``: nothing changes."""
    column, stamps = spans[0].column, pose_pass.stamp_ns
    present_rows = np.flatnonzero(pose_pass.has(Mark.PRESENT, column))
    action_ranks, limits_ns = np.zeros(len(present_rows), dtype=np.uint8), np.zeros(len(present_rows), dtype=np.int64)
    ranked_rules = [
        (ACTION_RANKS.get(policy.rule(span.code).action, 0), policy.rule(span.code), span) for span in reversed(spans)
    ]
    # The strictest is written last, and of equals the first.
    for strictness, rule, span in sorted(ranked_rules, key=lambda entry: entry[0]):
        samples = slice(*np.searchsorted(present_rows, [span.first, span.last + 1]))
        action_ranks[samples], limits_ns[samples] = strictness, round(rule.limit * 1e9)
    # The good samples around each bad one, by their place among those present.
    is_good, no_row = action_ranks == 0, len(present_rows)
    good_before, good_after = (indices[~is_good] for indices in present_neighbours(is_good))
    rows, action_ranks, limits_ns = present_rows[~is_good], action_ranks[~is_good], limits_ns[~is_good]
    start, end = present_rows[good_before], present_rows[np.minimum(good_after, no_row - 1)]
    since_good, gap_width = stamps[rows] - stamps[start], stamps[end] - stamps[start]
    is_repeated = (
        (action_ranks == ACTION_RANKS[HOLD]) & (good_before >= 0) & (since_good >= 0) & (since_good <= limits_ns)
    )
    is_inside_gap = (good_before >= 0) & (good_after < no_row) & (since_good > 0) & (since_good < gap_width)
    is_interpolated = (action_ranks == ACTION_RANKS[INTERPOLATE]) & is_inside_gap & (gap_width <= limits_ns)
    status = np.full(len(rows), Status.LOST, dtype=np.uint8)
    status[is_repeated], status[is_interpolated] = Status.HELD, Status.INTERPOLATED
    replaced_poses = np.full((len(rows), 7), np.nan)
    if is_repeated.any() or is_interpolated.any():
        pose_blocks = [
            np.hstack([block.position[:, column], block.quaternion_xyzw[:, column]]) for block in blocks(BLOCK_FRAMES)
        ]
        poses = np.concatenate(pose_blocks)
        fractions = since_good[is_interpolated] / gap_width[is_interpolated]
        replaced_poses[is_repeated] = poses[start[is_repeated]]
        replaced_poses[is_interpolated] = interpolate_poses(
            poses[start[is_interpolated]], poses[end[is_interpolated]], fractions
        )
    elif pose_pass.has(Mark.LOST, column)[rows].all():
        return None
    return Replacement(rows, status, replaced_poses)


@dataclass(frozen=True)
class Repair:
    """The session that a run uses, and why.

    Parameters
    ----------
    session : the session with the policy applied; the very same where nothing was to be done.
    policy : the rules.
    findings : everything the doctor says of it, the worst first.
    spans : what was in doubt, and what was done about it.
    digest : of the recording, before any repair, as ``PosePass`` has it.
    scan : the pass over ``session``.
    """

    session: Session
    policy: Policy
    findings: tuple[Finding, ...]
    spans: tuple[FlagSpan, ...]
    digest: str
    scan: SessionScan

    def as_json(self) -> dict[str, Any]:
        """Plain data for the summary of a run."""
        return {
            "policy": self.policy.as_json(),
            "findings": [finding.as_json() for finding in self.findings],
            "flagged": [vars(span) for span in self.spans],
        }


def repair_session(session: Session, policy: Policy, needed_codes: Collection[str] | None = None) -> Repair:
    """Examine a session and apply the policy to it; ``needed_codes`` is as for ``examine_session``.

    Raises ``RefusedError``: the session has a fault that the policy refuses; ``InvalidPoseError``: as ``scan``.
    """
    poses = run_pose_pass(session.blocks(BLOCK_FRAMES), session.scene.space_radius)
    findings = tuple(in_order([*_findings_in_recording(session, examine_session(session, poses, needed_codes))]))
    for finding in findings:
        if policy.rule(finding.code).action == REFUSE and finding.code not in UNUSABLE_POSE_CODES:
            raise RefusedError(_refusal_sentence(session, finding))
    spans = pose_spans(poses)
    of_column: dict[int, list[PoseSpan]] = {}
    for span in spans:
        of_column.setdefault(span.column, []).append(span)
    replacements = {
        column: _replacement(poses, body_spans, policy, session.blocks) for column, body_spans in of_column.items()
    }
    changed_columns = {column: replacement for column, replacement in replacements.items() if replacement is not None}
    repaired_session = session
    if changed_columns:
        repaired_session = replace(session, source=RepairedFrames(session.blocks, session.names, changed_columns))
    first_ns = int(poses.stamp_ns[0]) if len(poses.stamp_ns) else 0
    first_ns_of_recording = first_ns if session.segment is None else session.segment.first_ns
    # The frame after a gap is flagged: the path into it is not known.
    gaps = [PoseSpan("gap", ALL_BODIES, row, row, 1) for row in (gap_rows(poses.stamp_ns) + 1).tolist()]
    flag_spans = tuple(
        _flag_span(poses, span, policy, changed_columns.get(span.column), first_ns_of_recording)
        for span in (*spans, *gaps)
    )
    as_recorded = (
        not changed_columns and bool((np.diff(poses.stamp_ns) > 0).all()) and not poses.has(CORRUPT_POSE_MARKS).any()
    )
    session_scan = scan_of(poses, session.segment) if as_recorded else scan_session(repaired_session)
    return Repair(repaired_session, policy, findings, flag_spans, poses.digest, session_scan)


def _findings_in_recording(session: Session, findings: Iterable[Finding]) -> Iterator[Finding]:
    """Findings in a part of a recording, in seconds of the whole; nothing is said of what lies outside."""
    if session.segment is None:
        yield from findings
        return
    first = session.segment.first_ns
    for finding in findings:
        if finding.start_ns is not None and finding.end_ns is not None:
            finding = replace(finding, start=(finding.start_ns - first) / 1e9, end=(finding.end_ns - first) / 1e9)
        if finding.code != "stream-apart":
            yield finding


def _flag_span(
    poses: PosePass, span: PoseSpan, policy: Policy, replacement: Replacement | None, first_ns: int
) -> FlagSpan:
    """A fault and what became of its samples; ``first_ns`` is the stamp of second 0."""
    status_counts = Counter({int(Status.LOST): span.count} if span.code == "tracking-lost" else {})
    if replacement is not None:
        first_row, last_row = np.searchsorted(replacement.rows, [span.first, span.last + 1])
        status_counts = Counter(replacement.status[first_row:last_row].tolist())
    start, end = (int(poses.stamp_ns[row]) for row in (span.first, span.last))
    return FlagSpan(
        kind=span.code,
        body="" if span.column == ALL_BODIES else poses.names[span.column],
        start_ns=start,
        end_ns=end,
        start=(start - first_ns) / 1e9,
        end=(end - first_ns) / 1e9,
        samples=span.count,
        action=str(policy.rule(span.code)),
        dropped=status_counts[Status.LOST],
        held=status_counts[Status.HELD],
        interpolated=status_counts[Status.INTERPOLATED],
    )


def _refusal_sentence(session: Session, finding: Finding) -> str:
    body_clause = f" of {finding.body}" if finding.body else ""
    time_clause = "" if finding.start is None else f" at {words.moment(finding.start)}"
    return (
        f"{session.origin or 'the session'}: {finding.code}{body_clause}{time_clause}: {finding.message}; the "
        f"policy refuses it, "
        f"repair the recording or choose --policy {finding.code}=... otherwise"
    )
