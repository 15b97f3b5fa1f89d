from sessions import Finding, Severity
from sessions.doctor.finding import Span, in_order


def test_the_worst_comes_first_and_then_the_earliest():
    late = Span(9, 9, 0).finding("torn", "late")
    early = Span(1, 1, 0).finding("torn", "early")
    note = Finding("torn", "note", own_severity=Severity.NOTE)
    assert in_order([note, late, early]) == [early, late, note]
