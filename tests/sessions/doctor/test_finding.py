"""Findings about a stretch of a recording: their seconds, their order, and how JSON holds them."""

import numpy as np

from sessions.doctor.finding import Finding, Severity, Span, in_order

STAMPS = np.array([5_000_000_000, 5_500_000_000, 7_000_000_000])


def test_finding_has_seconds_after_the_first_frame():
    """A finding from the second frame, half a second after the first, to the third, 2 s after it, has these times."""
    finding = Span.of(STAMPS, 1, 2).finding("frozen", "it repeats", "cup", count=3)
    assert (finding.start, finding.end, finding.start_ns, finding.end_ns) == (0.5, 2.0, STAMPS[1], STAMPS[2])


def test_json_of_a_finding_names_a_body_or_none():
    """A finding about a cup, and one about the whole recording, whose body "" is null in JSON."""
    assert [Finding("frozen", "it repeats", body).as_json()["body"] for body in ("cup", "")] == ["cup", None]


def test_findings_are_in_order_of_severity_body_and_start():
    """An error comes first, then bodies by name, then the earlier start; without a start it is the whole recording."""
    span = Span.of(STAMPS, 1, 2)
    late = Span.of(STAMPS, 2, 2).finding("frozen", "late", "cup", severity=Severity.WARNING)
    early = span.finding("frozen", "early", "cup", severity=Severity.WARNING)
    whole = Finding("frozen", "whole", "cup", own_severity=Severity.WARNING)
    error = span.finding("frozen", "error", "rod", severity=Severity.ERROR)
    assert [row.message for row in in_order([late, early, whole, error])] == ["error", "whole", "early", "late"]
