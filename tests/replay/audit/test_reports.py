from replay.audit.reports import reported_spans
from sessions.live_contact import LiveContact


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
