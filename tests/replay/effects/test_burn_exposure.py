from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.effects.burn_exposure import SPEC, surface
from replay.effects.declaring import declare
from replay.effects.output import EffectOutput, Series
from replay.pipeline.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect


def scene(**more):
    settings = {"between": ["hand", "pot"], "threshold_c": 65.0, "seconds": 0.5, **more}
    return Scene(bodies=(SceneBody("hand"), SceneBody("pot")), effects=(SceneEffect("burn-exposure", settings),))


def run(frames, **more):
    places = [3.0] * 20 + [0.9] * frames + [3.0] * 20
    return compute(cubes({"hand": places, "pot": [0.0] * len(places)}, scene=scene(**more)), detectors=()).effects


def test_a_hand_on_a_hot_part_for_long_enough_is_a_burn():
    effect = run(60, surface_c=70.0)["burn-exposure"]
    exposed, burn = effect.events
    assert (exposed.name, burn.name, burn.level) == ("exposed", "burn", "error")
    assert burn.values["seconds"] == pytest.approx(0.6) and burn.time == pytest.approx(0.2)
    assert effect.frames_run == 60 and effect.output.lanes["hand-pot"][0].word == "burn"


@pytest.mark.parametrize(("frames", "surface_c"), [(60, 65.0), (49, 70.0)], ids=["not hot enough", "not long enough"])
def test_at_the_threshold_or_for_a_shorter_time_it_is_an_exposure(frames, surface_c):
    assert [event.name for event in run(frames, surface_c=surface_c)["burn-exposure"].events] == ["exposed"]


def test_the_temperature_of_the_effect_heat_is_followed_through_the_contact():
    declared = declare(scene().effects[0], 1, SPEC.fields, scene(), "lab.toml")
    heat = EffectOutput(series={"pot/temperature": Series(np.array([0.0, 10.0]), np.array([20.0, 120.0]), "degC")})
    room = {"ambient_c": 21.0}
    inputs = SimpleNamespace(
        times=np.arange(0.0, 5.0), output=lambda kind: {"heat": heat}[kind], tables={"heat": [room]}
    )
    assert surface(inputs, declared, "pot", SimpleNamespace(first=2, stop=4)).tolist() == [40.0, 50.0]
    # A glass nothing has been mixed in yet is as warm as the room: what a student leaves out ends no run.
    assert surface(inputs, declared, "cup", SimpleNamespace(first=2, stop=4)).tolist() == [21.0, 21.0]
