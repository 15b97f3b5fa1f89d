from __future__ import annotations

import numpy as np
import pytest

from sessions.synthetic.buttons import Buttons

TIMES = np.linspace(0.0, 5.0, 5001)


def test_the_trigger_passes_the_grasp_level_at_the_grasp_and_the_release_level_at_the_release():
    buttons = Buttons()
    buttons.hold("left", 1.0, 3.0)
    value = buttons.trigger("left", TIMES)
    assert TIMES[np.argmax(value > 0.6)] == pytest.approx(1.0, abs=2e-3)
    after = TIMES > 2.0
    assert TIMES[after][np.argmax(value[after] < 0.4)] == pytest.approx(3.0, abs=2e-3)
    assert value.max() == 1.0 and value[0] == value[-1] == 0.0
    assert np.abs(np.diff(value)).max() < 0.02
    assert (buttons.trigger("right", TIMES) == 0.0).all()


def test_two_holds_are_two_presses():
    buttons = Buttons()
    buttons.hold("right", 1.0, 2.0)
    buttons.hold("right", 3.0, 4.0)
    value = buttons.trigger("right", TIMES)
    assert ((value[1:] > 0.6) & (value[:-1] <= 0.6)).sum() == 2


def test_controllers_report_eight_bits_on_the_sessions_stamps():
    buttons = Buttons()
    buttons.hold("right", 0.5, 1.0)
    stamps = 10**18 + np.arange(200) * 11_111_111
    hands = buttons.tracks(stamps)
    assert set(hands) == {"student/left", "student/right"}
    scaled = hands["student/right"].trigger * 255.0
    np.testing.assert_allclose(scaled, np.round(scaled), atol=1e-9)
    assert (hands["student/right"].grip <= hands["student/right"].trigger).all()
