"""The section of the report that says whether the recording can be trusted, and what was done where it cannot."""

from __future__ import annotations

from collections import Counter

from replay.report.markup import Markup, element, joined, table
from replay.run_result import RunResult
from sessions import Finding, Severity

MOST_ROWS = 200
"""Findings listed; ``summary.json`` holds them all."""


def finding_tables(result: RunResult) -> Markup:
    """What the doctor found, worst first, and what the policy made of it; one sentence where nothing was wrong."""
    if result.treatment is None:
        return element("p", "The recording was not examined.")
    findings = result.treatment.findings
    parts: list[object] = [element("p", trust(findings))]
    if findings:
        shown = findings[:MOST_ROWS]
        codes = [finding.code for finding in shown]
        # What a code means is said once: with nine losses of tracking it would be most of the page.
        rows = [_row(finding, explained=codes.index(finding.code) < k) for k, finding in enumerate(shown)]
        parts.append(table("Findings", ("severity", "code", "body", "what", "seconds", "count"), rows, words=4))
    if result.treatment.spans:
        parts.append(_treated(result))
    if any(result.summary["flagged_verdicts"].values()):
        parts.append(_verdicts(result))
    return joined(parts)


def trust(findings: tuple[Finding, ...]) -> str:
    """One sentence: how far the recording can be trusted."""
    count = Counter(finding.severity for finding in findings)
    if not count[Severity.ERROR] and not count[Severity.WARNING]:
        return "Nothing was found that makes an answer less sure than it looks."
    words = [
        f"{count[severity]} {severity.name.lower()}{'s' * (count[severity] > 1)}"
        for severity in (Severity.ERROR, Severity.WARNING)
        if count[severity]
    ]
    return f"{' and '.join(words)}: verdicts on these spans carry a flag."


def _row(finding: Finding, *, explained: bool) -> tuple[object, ...]:
    meaning = "" if explained else element("small", f"{finding.meaning}; {finding.fix}")
    what = joined([finding.message, meaning])
    return (
        finding.severity.name.lower(),
        finding.code,
        finding.body,
        what,
        _when(finding.start, finding.end),
        finding.count,
    )


def _when(start: float | None, end: float | None) -> str:
    if start is None or end is None:
        return ""
    return f"{start:.3f}" if start == end else f"{start:.3f} to {end:.3f}"


def _treated(result: RunResult) -> Markup:
    """A row per kind and body: the action, and what became of the samples."""
    assert result.treatment is not None
    sums: dict[tuple[str, str, str], Counter[str]] = {}
    for span in result.treatment.spans:
        count = sums.setdefault((span.kind, span.body or "all", span.action), Counter())
        for name in ("samples", "dropped", "held", "interpolated"):
            count[name] += getattr(span, name)
        count["spans"] += 1
    head = ("kind", "body", "policy", "spans", "samples", "dropped", "held", "interpolated")
    rows = [(*key, *(count[name] for name in head[3:])) for key, count in sums.items()]
    return table("What was done about poses in doubt", head, rows, words=3)


def _verdicts(result: RunResult) -> Markup:
    rows = [
        (label, ", ".join(f"{count:,} {verdict}" for verdict, count in told.items()))
        for label, told in result.summary["flagged_verdicts"].items()
        if told
    ]
    return table("Verdicts that rest on a pose in doubt (pair-frames)", ("detector", "verdicts"), rows, words=2)
