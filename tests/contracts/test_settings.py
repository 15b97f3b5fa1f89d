"""Every setting of every detector is checked when it is given: what is refused gets one sentence, what is not runs."""

from dataclasses import dataclass, fields
from functools import cache
from typing import ClassVar

import numpy as np
import pytest
from support.optional import ROWS
from support.shapes import ball_mesh, box_mesh, unrotated_motion

from cdcore import Body, FrameDetector, create_detector
from cdcore.detectors.detector_table import load_detector
from cdcore.errors import CollisionCoreError, InvalidSettingError
from cdcore.protocol import Detection

NEVER = ("off", "", float("nan"), float("inf"), 1e308, [], 1j, "x" * 10_000)
"""No setting takes these."""
SOMETIMES = ("yes", "12", True, False, 0, -1, 2.5, 10**30, -(10**30), -1e308, float("-inf"), {}, b"off", np.zeros(3),
             object())  # fmt: skip
"""Values that some settings take and most do not; of those taken, all must run."""


@pytest.fixture(params=ROWS)
def name(request):
    """Each row of the table of detectors."""
    return request.param


def settings_of(name):
    """Names of a detector's settings."""
    return [item.name for item in fields(load_detector(name).Settings)]


@cache
def passing_ball():
    """A ball that passes a box: two bodies and their motion of three frames."""
    positions = np.zeros((3, 2, 3))
    positions[:, 0, 0] = 0.6, 0.9, 1.2
    return [Body("ball", ball_mesh(0.4, rings=4, sides=6)), Body("box", box_mesh())], unrotated_motion(positions)


def answer_or_refusal(name, **settings):
    """A detector's answer for a ball that passes a box, or the sentence with which it refuses a setting."""
    bodies, motion = passing_ball()
    try:
        detector = create_detector(name, bodies, **settings)
    except InvalidSettingError as error:
        return str(error)
    except CollisionCoreError:  # an engine that is not installed
        return None
    return detector.detect(motion)


def assert_item_sentence(sentence, setting):
    """Fails unless a sentence begins with the setting and says in a line what to give."""
    assert sentence.startswith(f"{setting}=")
    assert "give " in sentence and "\n" not in sentence and len(sentence) < 300


def test_invalid_setting_is_refused_in_a_sentence(name):
    """NaN, 1e308, an empty text and others of NEVER are refused, unless one is the setting's default.

    Numbers, flags and others of SOMETIMES are refused, or the detector answers with them for a ball that passes a box.
    A refusal is a sentence that names the setting.
    """
    for setting in settings_of(name):
        default = getattr(load_detector(name).Settings(), setting)
        for value in NEVER:
            if value != default:
                assert_item_sentence(answer_or_refusal(name, **{setting: value}), setting)
        for value in SOMETIMES:
            output = answer_or_refusal(name, **{setting: value})
            if isinstance(output, str):
                assert_item_sentence(output, setting)
            else:
                assert output is None or isinstance(output, Detection), "None: the engine is not installed"


def test_settings_refuse_numbers_for_flags_and_flags_for_numbers(name):
    """Every setting of a detector: 1 is refused where the default is true or false, and ``True`` where it is not."""
    settings = load_detector(name).Settings()
    for item in fields(settings):
        is_flag = isinstance(getattr(settings, item.name), bool)
        wrong = 1 if is_flag else True
        assert_item_sentence(answer_or_refusal(name, **{item.name: wrong}), item.name)


@pytest.mark.parametrize(
    ("name", "settings", "valid"),
    [
        ("sphere", {"sphere": "exact"}, "paper, best"), ("discrete", {"rate_hz": 0}, "above 0"),
        ("static", {"epsilon": -1.0}, "metres from 0"),
        ("exact", {"containment": "off"}, "true or false"), ("qaco", {"variant": "quick"}, "memetic, corrected"),
        ("qaco", {"without_equation": 14}, "15, 16"),
        ("qaco", {"ants": 2.5}, "whole number"), ("qaco", {"mutation": 1.5}, "from 0 to 1"),
        ("qaco", {"beta": 1001}, "from 0 to 1000"), ("qaco", {"samples": "many"}, "or None"),
        ("qaco", {"pheromone_least": 11.0}, "up to pheromone_most"), ("hybrid-qaco", {"rest": -0.1}, "from 0 to 1000"),
        ("hybrid-qaco", {"decide": "luck"}, "search, mesh"), ("obb", {"mode": "some"}, "all, first"),
        ("qaco", {"seed": 2**63}, "at most 9223372036854775807"),
        ("obb", {"budget": 0}, "1 or more"), ("collider", {"shape": "blob"}, "hull, box, sphere, capsule, mesh"),
        ("collider", {"pieces": 0}, "1 or more"), ("collider", {"skin_m": -0.001}, "metres from 0"),
        ("continuous", {"tolerance": 0.0}, "metres above 0"), ("continuous", {"effort": -5}, "0 or more"),
        ("image-space", {"resolution": 4097}, "at most 4096"),
    ],
)  # fmt: skip
def test_refused_setting_names_the_valid_values(name, settings, valid):
    """A detector with a wrong setting; the refusal says what may be given in its place, ``valid``."""
    refusal = answer_or_refusal(name, **settings)
    assert isinstance(refusal, str) and valid in refusal


def test_numbers_of_numpy_are_numbers():
    """An integer of NumPy where a whole number is needed, and a float where a real one is."""
    body = Body("a", box_mesh())
    assert create_detector("obb", [body], budget=np.int64(2)).settings.budget == 2
    assert create_detector("static", [body], epsilon=np.float64(0.5)).settings.epsilon == 0.5


@dataclass(frozen=True)
class Plain:
    """Settings of a detector from outside, which says nothing but types."""

    careful: bool = True
    looks: int = 1
    reach: float = 0.5


class Outside(FrameDetector):
    """A user's own detector: reports no contact of any pair."""

    Settings: ClassVar[type] = Plain

    def look(self, _rotations, _translations):
        return [False] * len(self.pairs)


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        pytest.param("careful", "off", id="text for a bool"),
        pytest.param("looks", 1.5, id="fraction for an int"),
        pytest.param("looks", True, id="bool for an int"),
        pytest.param("reach", float("nan"), id="NaN for a float"),
    ],
)
def test_settings_from_outside_are_checked_by_their_types(setting, value):
    """The settings of a user's detector have types and no other rules: bool, int and float."""
    with pytest.raises(InvalidSettingError, match=f"{setting}="):
        create_detector(f"{__name__}:Outside", [Body("a", box_mesh())], **{setting: value})
