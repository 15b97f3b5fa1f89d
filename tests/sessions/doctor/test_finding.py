import json

from sessions import Finding, Severity
from sessions.doctor.finding import CODES, Span, in_order


def test_severities_are_ordered_so_that_a_gate_can_ask_for_this_or_worse():
    assert Severity.NOTE < Severity.WARNING < Severity.ERROR


def test_a_finding_says_what_it_means_and_what_to_do_in_json_too():
    one = Span(1_500_000_000, 2_000_000_000, 1_000_000_000).finding("gap", Severity.WARNING, "nothing", "cup", 3)
    held = json.loads(json.dumps(one.as_json(), allow_nan=False))
    assert (held["start"], held["end"], held["start_ns"], held["count"]) == (0.5, 1.0, 1_500_000_000, 3)
    assert (held["severity"], held["body"]) == ("warning", "cup")
    assert held["meaning"] == CODES["gap"].meaning and held["fix"] == CODES["gap"].fix


def test_a_finding_about_no_span_says_so():
    assert Finding("proxy", Severity.NOTE, "a stand-in", "cup").as_json()["start"] is None


def test_the_worst_comes_first_and_then_the_earliest():
    late = Span(9, 9, 0).finding("gap", Severity.ERROR, "late")
    early = Span(1, 1, 0).finding("gap", Severity.ERROR, "early")
    note = Finding("torn", Severity.NOTE, "note")
    assert in_order([note, late, early]) == [early, late, note]


def test_every_code_says_what_it_means_and_what_to_do():
    for code, spec in CODES.items():
        assert spec.meaning and spec.fix and not spec.fix.endswith("."), code
        assert spec.group in {"structure", "time", "pose", "scale", "mesh", "stream", "scene"}
