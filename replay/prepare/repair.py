"""Before a run: the faults of the session, and what the policy does about them; the recording is not changed."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from replay.base.constants import BLOCK_FRAMES
from replay.errors import RefusedError
from replay.prepare.flags import FlagSpan
from replay.prepare.policy import REFUSE, Policy
from replay.prepare.repaired_frames import RepairedFrames, Replacement, replacements
from sessions import Finding, Session, Status
from sessions.doctor.finding import in_order
from sessions.doctor.pose_pass import PosePass, look_through
from sessions.doctor.pose_spans import Jumps, PoseSpan, pose_spans, teleports
from sessions.doctor.session_findings import examine_session
from sessions.doctor.timing import gap_rows

NAMED_BY_SURVEY: Final = frozenset({"not-finite", "zero-quaternion", "non-unit-quaternion"})
"""Kinds that the assembly refuses by frame, body and value when nothing replaces them."""

DAMAGE: Final = NAMED_BY_SURVEY | {"identity-while-lost", "out-of-space"}
"""Kinds whose samples claimed to be poses: dropping them loses data that a reader would expect."""


@dataclass(frozen=True)
class Repair:
    """The session that a run uses, and why.

    Parameters
    ----------
    session : the session with the policy applied; the very same where nothing was to be done.
    policy : the rules.
    findings : everything the doctor says of it, the worst first.
    spans : what was in doubt, and what was done about it.
    digest : of the recording, before any repair.
    jumps : teleports of ``session``; ``None`` where it is not as recorded and they are to be sought in it.
    """

    session: Session
    policy: Policy
    findings: tuple[Finding, ...]
    spans: tuple[FlagSpan, ...]
    digest: str
    jumps: Jumps | None = None

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
    findings = tuple(in_order([*examine_session(session, looked, needed)]))
    for finding in findings:
        if policy.rule(finding.code).action == REFUSE and finding.code not in NAMED_BY_SURVEY:
            raise RefusedError(_refusal(session, finding))
    spans = pose_spans(looked)
    replaced = replacements(looked, spans, policy, session.blocks)
    repaired = session
    if replaced:
        repaired = replace(session, source=RepairedFrames(session.blocks, session.names, replaced))
    flagged = [_flagged(looked, span, policy, replaced.get(span.column)) for span in spans]
    # The frame after a gap is flagged: the path into it is not known.
    gaps = [_span(looked, "gap", "", row, row, 1, policy) for row in (gap_rows(looked.stamp_ns) + 1).tolist()]
    as_recorded = not replaced and bool((np.diff(looked.stamp_ns) > 0).all())
    jumps = teleports(looked, spans) if as_recorded else None
    return Repair(repaired, policy, findings, (*flagged, *gaps), looked.digest, jumps)


def _flagged(looked: PosePass, span: PoseSpan, policy: Policy, replaced: Replacement | None) -> FlagSpan:
    dropped = span.count if span.code == "tracking-lost" else 0
    held = interpolated = 0
    if replaced is not None:
        dropped, held, interpolated = (
            replaced.count(span.first, span.last, status) for status in (Status.LOST, Status.HELD, Status.INTERPOLATED)
        )
    where = looked.names[span.column], span.first, span.last, span.count
    return _span(looked, span.code, *where, policy, dropped, held, interpolated)


def _span(
    looked: PosePass, kind: str, body: str, first: int, last: int, samples: int, policy: Policy, *became: int
) -> FlagSpan:
    """Frames ``first`` to ``last`` of a body; ``became``: samples that were dropped, held, interpolated."""
    zero, start, end = (int(looked.stamp_ns[row]) for row in (0, first, last))
    seconds = (start - zero) / 1e9, (end - zero) / 1e9
    return FlagSpan(kind, body, start, end, seconds[0], seconds[1], samples, str(policy.rule(kind)), *became)


def _refusal(session: Session, finding: Finding) -> str:
    who = f" of {finding.body}" if finding.body else ""
    when = "" if finding.start is None else f" at {finding.start:.3f} s"
    return (
        f"{session.origin or 'the session'}: {finding.code}{who}{when}: {finding.message}; the policy refuses it, "
        f"repair the recording or choose --policy {finding.code}=... otherwise"
    )
