"""Findings in the picture: a lane per body with what is in doubt and when, and the list of everything in words."""

from __future__ import annotations

from typing import Final

import numpy as np

from replay.outputs.palette import DOUBTS, Looks
from replay.outputs.rerun_log.columns import RecordingWriter, entity
from replay.outputs.rerun_log.lanes import log_lane
from replay.outputs.run_tables import finding_table
from replay.outputs.tables import markdown
from replay.outputs.words import NOTHING_SUSPICIOUS
from replay.pipeline.run_result import RunResult
from replay.prepare.flags import FLAG_KINDS, FlagSpan
from sessions.doctor.finding import CODES

ROOT: Final = "findings"
LIST: Final = "findings/list"
ALL_BODIES: Final = "time"
MOST_FINDINGS: Final = 200

KIND_LOOKS: Final[Looks] = dict(enumerate(zip(FLAG_KINDS, DOUBTS, strict=True), start=1))
"""State of a lane -> its word and colour. None is the red of a missed contact or the yellow of an invented one."""


def finding_lanes(result: RunResult) -> tuple[str, ...] | None:
    """Paths of the lanes: one per body in doubt, by name, and one for the clock; ``None`` without an examination."""
    if result.treatment is None:
        return None
    names = sorted({span.body or ALL_BODIES for span in result.treatment.spans})
    return tuple(entity(ROOT, "lanes", name) for name in names)


def log_findings(writer: RecordingWriter, result: RunResult) -> None:
    """Send a lane per body in doubt and the list; where two kinds meet, the lane says the first of `FLAG_KINDS`."""
    if result.treatment is None:
        return
    grouped: dict[str, list[FlagSpan]] = {}
    for span in result.treatment.spans:
        grouped.setdefault(span.body or ALL_BODIES, []).append(span)
    stamps = result.assembly.stamp_ns
    for name, spans in grouped.items():
        state = np.zeros(len(stamps), dtype=np.uint8)
        for span in sorted(spans, key=lambda one: -FLAG_KINDS.index(one.kind)):
            first, last = np.searchsorted(stamps, [span.start_ns, span.end_ns + 1])
            state[first:last] = FLAG_KINDS.index(span.kind) + 1
        log_lane(writer, entity(ROOT, "lanes", name), state, KIND_LOOKS)
    writer.markdown(LIST, finding_list(result))


def finding_list(result: RunResult) -> str:
    """Markdown: what was found, the worst first, each code explained once."""
    findings = () if result.treatment is None else result.treatment.findings
    if not findings:
        return f"{NOTHING_SUSPICIOUS}."
    shown = findings[:MOST_FINDINGS]
    said = {one.code for one in shown}
    notes = "\n".join(f"- **{code}**: {spec.meaning}; {spec.fix}" for code, spec in CODES.items() if code in said)
    made = finding_table(shown).only("severity", "code", "body", "seconds", "what")
    return markdown(made.titled("", notes))
