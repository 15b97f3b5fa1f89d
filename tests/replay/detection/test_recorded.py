from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import STEP_NS, cubes

from cdcore import join
from replay.detection.detector_spec import DetectorSpec, parse_detector, parse_detectors
from replay.detection.recorded import recorded_detector, reported_spans
from replay.errors import AuditError, DetectorSpecError
from replay.pipeline.engine import compute
from replay.prepare.assemble import RESIDUAL_FACT, assemble
from sessions.model.live_contact import LiveContact

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def reported(*reports, facts=None):
    """A session in which the engine reported (frame, phase) of the cubes; frames may be fractions."""
    session = cubes(PLACES, facts=facts or {})
    contacts = tuple(LiveContact(round(frame * STEP_NS), "b", "a", phase) for frame, phase in reports)
    return replace(session, live_contacts=contacts)


def column(session, **settings):
    found = compute(session, detectors=[("recorded", settings)], oracle="exact")
    (label,) = found.comparisons
    return found, found.detections[label].verdict[:, 0].tolist()


def test_a_report_is_contact_from_begin_to_end_both_included():
    _, verdict = column(reported((4, "enter"), (4, "exit"), (7.5, "enter"), (9.2, "exit")))
    assert verdict == [0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0]


def test_a_contact_between_two_frames_is_told_at_the_next():
    _, verdict = column(reported((3.2, "enter"), (3.6, "exit"), (11.5, "enter"), (11.6, "exit")))
    assert verdict == [0, 0, 0, 0, 1] + [0] * 7


def test_it_is_audited_like_any_row():
    result, _ = column(reported((4, "enter"), (4, "exit"), (9, "enter"), (10, "exit")))
    figures = result.summary["audit"]["recorded"]
    assert (figures["missed"]["count"], figures["missed"]["of"], figures["invented"]["count"]) == (1, 4, 0)
    assert figures["episodes"]["matched"] == 2
    assert result.matches["recorded"].matched[1].onset_error == pytest.approx(0.01)
    assert [miss.cause for miss in result.misses["recorded"]] == ["unexplained"]


def test_what_the_clock_leaves_open_is_the_cause_of_misses_within_it():
    late = reported((4, "enter"), (4, "exit"), (9, "enter"), (10, "exit"), facts={RESIDUAL_FACT: "0.011"})
    assert [miss.cause for miss in column(late)[0].misses["recorded"]] == ["clock"]
    blind = reported((4, "enter"), (4, "exit"), facts={RESIDUAL_FACT: "0.011"})
    assert [miss.cause for miss in column(blind)[0].misses["recorded"]] == ["unexplained"]


def test_a_known_engine_explains_its_misses_as_its_collider_would():
    session = reported((8, "enter"), (10, "exit"))
    result, _ = column(session, rate_hz=25.0)
    assert {miss.cause for miss in result.misses["recorded-25.0"]} <= {"between looks", "unexplained"}


@pytest.mark.parametrize("block", [1, 3, 5])
def test_blocks_give_the_answer_of_the_whole(block):
    session = reported((3.2, "enter"), (3.6, "exit"), (4.1, "enter"), (4.2, "exit"), (7.5, "enter"))
    assembly = assemble(session)
    make = lambda: recorded_detector(assembly.bodies, assembly.pairs, session.live_contacts, 0, 0.0, {})  # noqa: E731
    whole = make().detect(assembly.motion)
    parts = join(make().stream(assembly.motion.blocks(block)))
    assert np.array_equal(parts.verdict, whole.verdict)
    assert whole.verdict[:, 0].tolist() == [0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 1, 1]


def test_a_part_of_a_session_keeps_the_sessions_clock():
    session = reported((8, "enter"), (10, "exit"))
    result = compute(session, detectors="recorded", oracle="exact", start=0.05)
    assert [(e.start, e.end) for e in result.episodes["recorded"]] == [(pytest.approx(0.08), pytest.approx(0.1))]


def test_reports_of_other_bodies_are_counted_and_a_session_without_any_is_refused():
    session = reported((4, "enter"), (4, "exit"))
    extra = LiveContact(0, "a", "Floor", "enter")
    found = compute(replace(session, live_contacts=(*session.live_contacts, extra)), detectors="recorded")
    assert found.detections["recorded"].work == {"reported": 1, "of_other_pairs": 1}
    with pytest.raises(AuditError, match="replay import contacts"):
        compute(cubes(PLACES), detectors="recorded")
    with pytest.raises(AuditError, match="no setting 'nonsense'"):
        compute(session, detectors="recorded[nonsense=1]")


def spans(*reports):
    return reported_spans(LiveContact(time, a, b, phase) for time, a, b, phase in reports)


def test_a_span_goes_from_a_begin_to_the_next_end_whoever_is_named_first():
    found = spans((5, "b", "a", "exit"), (1, "a", "b", "enter"), (9, "a", "b", "enter"), (12, "b", "a", "exit"))
    assert found == {("a", "b"): [(1, 5), (9, 12)]}


def test_a_second_begin_or_end_changes_nothing():
    found = spans((1, "a", "b", "enter"), (2, "a", "b", "enter"), (3, "a", "b", "stay"), (5, "a", "b", "exit"),
                  (6, "a", "b", "exit"))  # fmt: skip
    assert found == {("a", "b"): [(1, 5)]}


def test_what_was_there_before_or_never_ended_is_open():
    assert spans((4, "a", "b", "exit")) == {("a", "b"): [(None, 4)]}
    assert spans((4, "a", "b", "stay"), (6, "a", "b", "exit")) == {("a", "b"): [(None, 6)]}
    assert spans((4, "a", "b", "enter")) == {("a", "b"): [(4, None)]}


def test_pairs_are_kept_apart():
    assert set(spans((1, "a", "b", "enter"), (1, "c", "a", "enter"))) == {("a", "b"), ("a", "c")}


@pytest.mark.parametrize(
    ("text", "label", "name", "settings"),
    [
        ("hybrid", "hybrid", "hybrid", {}),
        (" hybrid ", "hybrid", "hybrid", {}),
        ("discrete[rate_hz=22.5]", "discrete-22.5", "discrete", {"rate_hz": 22.5}),
        ("slow=discrete[rate_hz=22.5]", "slow", "discrete", {"rate_hz": 22.5}),
        ("22.5Hz=discrete[rate_hz=22.5]", "22.5Hz", "discrete", {"rate_hz": 22.5}),
        ("x=hybrid", "x", "hybrid", {}),
        ("hybrid[]", "hybrid", "hybrid", {}),
        (
            "q=hybrid-qaco[ants=20, stop_first=true,sphere=best,budget=none]", "q", "hybrid-qaco",
            {"ants": 20, "stop_first": True, "sphere": "best", "budget": None},
        ),
        ("my.package:Class", "Class", "my.package:Class", {}),
    ],
)  # fmt: skip
def test_text_says_label_name_and_settings(text, label, name, settings):
    spec = parse_detector(text)
    assert (spec.label, spec.name, spec.settings) == (label, name, settings)
    assert [type(value) for value in spec.settings.values()] == [type(value) for value in settings.values()]


@pytest.mark.parametrize(
    "text",
    ["", "  ", "a[b", "a]b", "a[b]c", "a[=3]", "a[x]", "a[x=]", "a=b=c", "a[x=[1]]", "-x=hybrid", "ä=hybrid", "a/b=c"],
)
def test_text_of_another_form_is_refused(text):
    with pytest.raises(DetectorSpecError):
        parse_detector(text)


@pytest.mark.parametrize("given", [3, None, ("hybrid",), ("hybrid", 3), (3, {})])
def test_values_that_name_no_detector_are_refused(given):
    with pytest.raises(DetectorSpecError, match="names no detector"):
        parse_detector(given)


def test_every_python_form_says_the_same():
    want = (DetectorSpec("slow", "discrete", {"rate_hz": 22.5}), DetectorSpec("hybrid", "hybrid"))
    slow = ("discrete", {"rate_hz": 22.5})
    assert parse_detectors("slow=discrete[rate_hz=22.5],hybrid") == want
    assert parse_detectors(["slow=discrete[rate_hz=22.5]", "hybrid"]) == want
    assert parse_detectors(("slow=discrete[rate_hz=22.5]", "hybrid")) == want
    assert parse_detectors({"slow": slow, "hybrid": "hybrid"}) == want
    assert parse_detectors({"slow": "discrete[rate_hz=22.5]", "hybrid": "other=hybrid"}) == want
    assert parse_detectors([want[0], "hybrid"]) == want
    assert parse_detectors(slow) == (DetectorSpec("discrete-22.5", "discrete", {"rate_hz": 22.5}),)
    assert parse_detectors(want[1]) == want[1:]


def test_commas_within_brackets_separate_settings_not_detectors():
    specs = parse_detectors("a=x[p=1,q=2],b=y[r=3],z")
    assert [str(spec) for spec in specs] == ["a=x[p=1,q=2]", "b=y[r=3]", "z=z"]


def test_nothing_is_no_detector():
    assert parse_detectors(()) == () and parse_detectors("") == ()


def test_two_detectors_of_one_label_are_refused():
    with pytest.raises(DetectorSpecError, match="two detectors are called 'hybrid'"):
        parse_detectors("hybrid,hybrid[containment=false],hybrid")


values = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False, allow_infinity=False))


@given(
    st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,9}", fullmatch=True), st.dictionaries(st.sampled_from("pqr"), values)
)
def test_a_spec_written_out_reads_back(label, settings):
    spec = DetectorSpec(label, "discrete", settings)
    assert parse_detector(str(spec)) == spec


@given(st.dictionaries(st.sampled_from("pqr"), st.one_of(values, st.text(max_size=5))))
def test_a_label_made_up_for_settings_is_always_one_that_entity_paths_take(settings):
    label = parse_detector(("discrete", settings)).label
    assert DetectorSpec(label, "x").label == label
