from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.effects.burn_exposure import surface_temperature
from replay.effects.output import EffectOutput
from replay.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect

FLAME = SceneEffect("heat", {
    "of": "flame", "source": "lamp", "heats": "pot", "within": 9.0, "base": [0.0, -1.0, 0.0], "height": 5.0,
    "power_w": 160.0, "loss_w_per_k": 0.0, "ambient_c": 20.0,
})  # fmt: skip


def effects_of_touch(frames, *more, **limits):
    """A hand is on a pot from 0.2 s on for so many frames of 10 ms."""
    burn = SceneEffect("burn-exposure", {"between": ["hand", "pot"], "threshold_c": 65.0, "seconds": 0.5, **limits})
    heated = {"properties": {"heat_capacity_j_per_k": 2.0}}
    scene = Scene(bodies=(SceneBody("hand"), SceneBody("lamp"), SceneBody("pot", extra=heated)), effects=(burn, *more))
    points = [3.0] * 20 + [0.9] * frames + [3.0] * 20
    still = [0.0] * len(points)
    return compute(unit_cubes_on_x({"hand": points, "pot": still, "lamp": still}, scene=scene), detectors=()).effects


@pytest.mark.parametrize(
    ("frames", "surface_c", "names"),
    [(60, 70.0, ["exposed", "burn"]), (60, 65.0, ["exposed"]), (49, 70.0, ["exposed"])],
    ids=["burn", "not hot enough", "not long enough"],
)
def test_a_long_touch_of_hot_glass_is_a_burn(frames, surface_c, names):
    """A burn takes 0.5 s (50 frames) at more than 65 degC."""
    effect = effects_of_touch(frames, surface_c=surface_c)["burn-exposure"]
    assert [event.name for event in effect.events] == names and effect.output.lanes["hand-pot"][0].word == names[-1]
    last = effect.events[-1]
    assert last.time == pytest.approx(0.2) and last.values["seconds"] == pytest.approx(frames / 100)
    assert last.message.endswith(f" for {frames / 100:.2f} s")
    assert (last.level == "error") == (len(names) == 2) and effect.frames_run == frames


@pytest.mark.parametrize("within", [9.0, 1e-9])
def test_a_burn_follows_the_temperature_through_the_contact(within):
    """160 W into 2 J/K without loss: 80 K a second from the first frame on, or the room's 20 degrees."""
    flame = SceneEffect("heat", {**FLAME.settings, "within": within})
    touched_frames = 60  # from frame 20 to 79, at 100 Hz
    effects = effects_of_touch(touched_frames, flame)
    felt = effects["burn-exposure"].series["pot/touched at 20"]
    rate = 80.0 if effects["heat"].events else 0.0
    assert felt.values == pytest.approx(20.0 + rate * np.arange(20, 20 + touched_frames) / 100)


def test_an_unheated_vessel_is_as_warm_as_the_room():
    times, heat = np.arange(5.0), EffectOutput()
    inputs = SimpleNamespace(times=times, output=lambda _: heat, tables={"heat": [{"ambient_c": 19.0}]})
    felt = surface_temperature(inputs, {"surface_c": None}, "cup", SimpleNamespace(first=1, stop=4))
    assert felt.tolist() == [19.0] * 3
