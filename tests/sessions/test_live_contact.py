from sessions.live_contact import PHASES, LiveContact


def test_a_contact_is_a_value_and_may_have_no_point():
    assert LiveContact(1, "a", "b", "enter") == LiveContact(1, "a", "b", "enter", None)
    assert LiveContact(1, "a", "b", "enter") != LiveContact(1, "b", "a", "enter")
    assert PHASES == ("enter", "stay", "exit")
