import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from hypothesis import given
from hypothesis import strategies as st

from sessions.errors import SessionFileError
from sessions.mcap import annotations as a
from sessions.mcap.schemas import message_class
from sessions.model.event import Interval

text, times = st.text('a"\\\n\0ä\u202e杯🙂', max_size=5), st.integers(0, 2**62)


@given(st.lists(st.tuples(times, times, text, text, st.dictionaries(text, text, max_size=2)), max_size=4))
def test_any_intervals_come_back_in_order(given_spans):
    """Up to four random intervals, as messages and back; text may hold quotes, zeros and signs beyond Latin."""
    spans = tuple(Interval(min(s, e), max(s, e), kind, name, data) for s, e, kind, name, data in given_spans)
    payloads = [a.interval_message(span)[2] for span in spans]
    assert a.read_intervals(payloads, 0) == spans


def test_open_interval_is_closed_by_its_successor_only():
    """Messages say: pour begins, stir begins, pour ends at 9 ns, pour begins again; the session ends at 20 ns.

    What was not ended lasts until then, and is marked as unclosed.
    """
    pour = Interval(start_ns=5, end_ns=9, kind="task", name="pour")
    stir = Interval(start_ns=5, end_ns=7, kind="task", name="stir")
    messages = [(pour, False), (stir, False), (pour, True), (pour, False)]
    payloads = []
    for interval, is_closed in messages:
        _topic, _stamp, payload = a.interval_message(interval, closed=is_closed)
        payloads.append(payload)
    assert a.read_intervals(payloads, 20) == (
        pour,
        Interval(start_ns=5, end_ns=20, kind="task", name="stir", data={"unclosed": "true"}),
        Interval(start_ns=5, end_ns=20, kind="task", name="pour", data={"unclosed": "true"}),
    )


def test_samples_stamped_before_zero_are_refused():
    """A stream of numbers and a hand have samples before 0, so that the time between two may exceed 64 bits of ns."""
    scalar = message_class("ScalarSamples")(sample_ns=[-(2**62), 0, 2**63 - 1], value=[1, 2, 3])
    hand = message_class("Hand")()
    hand.timestamp.seconds = -1
    for prefix, message in (("/scalars/", scalar), ("/hands/", hand)):
        with pytest.raises(SessionFileError, match="a sample is stamped before 0"):
            a.read_stream(prefix, [message.SerializeToString()])


@pytest.mark.parametrize(("phase", "point"), [(0, []), (4, []), (1, [1.0, 2.0]), (0, [1.0, 2.0])])
def test_live_contact_of_unknown_phase_or_partial_point_is_refused(phase, point):
    """A contact in a file has a phase from 1 to 3, and a point of no number or of three."""
    payload = message_class("Contact")(body_a="a", body_b="b", phase=phase, point=point).SerializeToString()
    with pytest.raises(SessionFileError, match="no known phase or a point that is not three numbers"):
        a.read_contact(payload)


def test_interval_without_an_end_does_not_end_before_its_start():
    """An interval lasts to the last frame, at 20 ns, if no message ends it; begun at 50 ns, it ends as it begins."""
    payloads = []
    for start_ns in (10, 50):
        interval = Interval(start_ns, end_ns=60, kind="task", name="pour")
        _topic, _stamp, payload = a.interval_message(interval, closed=False)  # the end of 60 ns is not written
        payloads.append(payload)
    intervals = a.read_intervals(payloads, last_ns=20)
    assert [(interval.start_ns, interval.end_ns) for interval in intervals] == [(10, 20), (50, 50)]


def test_level_that_no_event_has_counts_as_info():
    """Levels of a log go from 1, debug, to 5, fatal; other programs leave it at 0 or write a greater number."""
    logs = [Log(message="drop", file="drop", level=level).SerializeToString() for level in range(7)]
    levels = [a.read_event(log, publish_ns=0).level for log in logs]
    assert levels == ["info", "debug", "info", "warning", "error", "fatal", "info"]
