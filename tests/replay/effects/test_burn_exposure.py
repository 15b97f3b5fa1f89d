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
    """Effects of a run in which a hand is on a pot of 2 J/K from 0.2 s on for so many frames of 10 ms.

    A burn is declared for 0.5 s above 65 degC; ``more``: other effects.
    """
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
    """A hand touches a pot from 0.2 s on for so many frames of 10 ms; a burn takes 0.5 s at more than 65 degC.

    ``names``: events; both are of the whole touch, a burn is an error, and the effect runs only while it lasts.
    """
    effect = effects_of_touch(frames, surface_c=surface_c)["burn-exposure"]
    assert [event.name for event in effect.events] == names and effect.output.lanes["hand-pot"][0].word == names[-1]
    last, touch_s = effect.events[-1], frames / 100
    assert last.time == pytest.approx(0.2) and last.values["seconds"] == pytest.approx(touch_s)
    assert last.message.endswith(f" for {touch_s:.2f} s")
    assert (last.level == "error") == (last.name == "burn") and effect.frames_run == frames


@pytest.mark.parametrize(
    ("base", "kelvin_per_s"),
    [([0.0, -1.0, 0.0], 160.0 / 2.0), ([50.0, -1.0, 0.0], 0.0)],
    ids=["flame below the pot", "flame 50 m beside it"],
)
def test_a_burn_follows_the_temperature_through_the_contact(base, kelvin_per_s):
    """A flame gives 160 W to a pot of 2 J/K from the first frame on, without loss, or none; the room has 20 degC.

    A hand touches the pot in frames 20 to 79 of 10 ms, and feels the pot's temperature in each.
    """
    flame = SceneEffect("heat", {**FLAME.settings, "base": base})
    effects = effects_of_touch(60, flame)
    felt = effects["burn-exposure"].series["pot/touched at 20"]
    assert felt.values == pytest.approx(20.0 + kelvin_per_s * np.arange(20, 80) / 100)


def test_an_unheated_vessel_is_as_warm_as_the_room():
    """A cup is touched in frames 1 to 3; the effect heat has no temperature of it, but that of the room, 19 degC."""
    heat = EffectOutput()
    inputs = SimpleNamespace(times=np.arange(5.0), output=lambda _: heat, tables={"heat": [{"ambient_c": 19.0}]})
    touch = SimpleNamespace(first=1, stop=4)
    felt = surface_temperature(inputs, {"surface_c": None}, "cup", touch)
    assert felt.tolist() == [19.0] * 3
