from dataclasses import replace

import numpy as np
import pytest

from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series

TIMES = np.arange(3.0)
LIQUID = Liquid(TIMES, np.ones(3), 0.1, 0.2, np.zeros((3, 4), dtype=np.uint8))
WHOLE = EffectOutput(
    (EffectEvent(1.0, "spill", ("cup",), 2.0, {"volume_ml": np.float64(3.0)}, point=(0.0, 1.0, 2.0)),),
    {"cup/volume": Series(TIMES, TIMES * 2, "mL")},
    {"cup": (LaneSpan(0.0, 1.0, "pours"),)},
    np.array([True, False, True]),
    {"cup": LIQUID},
)


def test_equal_outputs_have_equal_digests_whatever_they_tell_other_effects():
    assert WHOLE.digest == replace(WHOLE, data=object()).digest


@pytest.mark.parametrize(
    "changed",
    [
        {"events": ()},
        {"events": (replace(WHOLE.events[0], values={"volume_ml": 3.0000001}),)},
        {"series": {"cup/volume": Series(TIMES, np.nextafter(TIMES * 2, 9), "mL")}},
        {"series": {"cup/volume": Series(TIMES, TIMES * 2, "L")}},
        {"lanes": {}},
        {"ran": None},
        {"liquids": {"cup": replace(LIQUID, floor=0.11)}},
    ],
)
def test_any_difference_shows_in_the_digest(changed):
    assert replace(WHOLE, **changed).digest != WHOLE.digest
