"""Before a run: what is wrong with the session, and what the policy makes of it; the recording stays as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from replay.base.constants import BLOCK_FRAMES
from replay.errors import RefusedError
from replay.flags import FlagSpan
from replay.policy import REFUSE, Policy
from replay.treated_frames import Replacement, TreatedFrames, replacements
from sessions import Finding, Session, Status
from sessions.doctor.finding import in_order
from sessions.doctor.pose_pass import Looked, look_through
from sessions.doctor.pose_spans import PoseSpan, pose_spans
from sessions.doctor.session_findings import examine_session
from sessions.doctor.timing import gap_rows

DAMAGE: Final = frozenset({"not-finite", "zero-quaternion", "non-unit-quaternion", "identity-while-lost"})
"""Kinds whose samples claimed to be poses: dropping them loses data that a reader would expect."""

NAMED_BY_SURVEY: Final = frozenset({"not-finite", "zero-quaternion", "non-unit-quaternion"})
"""Kinds that the assembly refuses by frame, body and value when nothing stands in for them."""


@dataclass(frozen=True)
class Treatment:
    """What a run goes on with.

    Parameters
    ----------
    session : the session with the policy applied; the very same where nothing was to be done.
    policy : the rules.
    findings : everything the doctor says of it, the worst first.
    spans : what was in doubt, and what was done about it.
    """

    session: Session
    policy: Policy
    findings: tuple[Finding, ...]
    spans: tuple[FlagSpan, ...]

    def as_json(self) -> dict[str, Any]:
        """What the summary of a run says of it."""
        return {
            "policy": self.policy.as_json(),
            "findings": [finding.as_json() for finding in self.findings],
            "flagged": [vars(span) for span in self.spans],
        }


def treat(session: Session, policy: Policy) -> Treatment:
    """Examine a session and apply the policy to it.

    Raises
    ------
    RefusedError
        Something was found that the policy refuses; samples that are no poses are left to ``survey``, which names them.
    """
    looked = look_through(session.blocks(BLOCK_FRAMES))
    findings = tuple(in_order([*examine_session(session, looked)]))
    for finding in findings:
        if policy.rule(finding.code).action == REFUSE and finding.code not in NAMED_BY_SURVEY:
            raise RefusedError(_refusal(session, finding))
    spans = pose_spans(looked)
    replaced = replacements(looked, spans, policy, session.blocks)
    treated = session
    if replaced:
        treated = replace(session, source=TreatedFrames(session.blocks, session.names, replaced))
    flagged = [_flagged(looked, span, policy, replaced.get(span.column)) for span in spans]
    return Treatment(treated, policy, findings, (*flagged, *_gaps(looked, policy)))


def _flagged(looked: Looked, span: PoseSpan, policy: Policy, replaced: Replacement | None) -> FlagSpan:
    dropped = span.count if span.code == "tracking-lost" else 0
    held = interpolated = 0
    if replaced is not None:
        dropped, held, interpolated = (
            replaced.count(span.first, span.last, status) for status in (Status.LOST, Status.HELD, Status.INTERPOLATED)
        )
    start, end = _seconds(looked, span.first), _seconds(looked, span.last)
    return FlagSpan(
        span.code, looked.names[span.column], int(looked.stamp_ns[span.first]), int(looked.stamp_ns[span.last]),
        start, end, span.count, str(policy.rule(span.code)), dropped, held, interpolated,
    )  # fmt: skip


def _gaps(looked: Looked, policy: Policy) -> Sequence[FlagSpan]:
    """The frame after each gap: what its path says of the time before is not known."""
    action = str(policy.rule("gap"))
    return [
        FlagSpan(
            "gap", "", int(looked.stamp_ns[row]), int(looked.stamp_ns[row]), _seconds(looked, row),
            _seconds(looked, row), 1, action,
        )
        for row in (gap_rows(looked.stamp_ns) + 1).tolist()
    ]  # fmt: skip


def _seconds(looked: Looked, row: int) -> float:
    return float(np.int64(looked.stamp_ns[row]) - np.int64(looked.stamp_ns[0])) / 1e9


def _refusal(session: Session, finding: Finding) -> str:
    who = f" of {finding.body}" if finding.body else ""
    when = "" if finding.start is None else f" at {finding.start:.3f} s"
    return (
        f"{session.origin or 'the session'}: {finding.code}{who}{when}: {finding.message}; the policy refuses it, "
        f"repair the recording or choose --policy {finding.code}=... otherwise"
    )
