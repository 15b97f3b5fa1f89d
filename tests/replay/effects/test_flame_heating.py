import numpy as np
import pytest
from support.liquid_worlds import still, world

from replay.errors import EffectError
from replay.pipeline.engine import compute
from sessions.model.scene import SceneBody

FLAME = {
    "of": "flame", "source": "lamp", "heats": "dish", "within": 0.02, "base": [0.0, 0.1, 0.0], "power_w": 160.0,
    "loss_w_per_k": 0.4, "ambient_c": 20.0,
}  # fmt: skip


def run(xs, height=0.2, capacity=60.0, **more):
    places = np.zeros((len(xs), 3))
    places[:, 0], places[:, 1] = xs, height
    poses = {"lamp": still(len(xs)), "dish": (places, still(len(xs))[1])}
    dish = SceneBody("dish", extra={"properties": {"heat_capacity_j_per_k": capacity}})
    session = world(poses, (SceneBody("lamp"), dish), ("heat", {**FLAME, **more}), step_ns=100_000_000)
    return compute(session).effects["heat"]


XS = [1.0] * 5 + [0.01] * 100 + [1.0] * 100


def test_over_the_flame_it_warms_and_beside_it_it_cools():
    run_ = run(XS)
    (event,) = run_.events
    peak = 20.0 + 400.0 * -np.expm1(-10.0 * 0.4 / 60.0)
    assert event.name == "heated" and (event.time, event.end) == pytest.approx((0.5, 10.5))
    assert event.values["to_c"] == pytest.approx(peak, rel=1e-9)
    told = run_.series["dish/temperature"]
    assert told.values.max() == pytest.approx(peak, rel=1e-9) and told.values[0] == 20.0
    after = 20.0 + (peak - 20.0) * np.exp(-(told.times[-1] - 10.5) * 0.4 / 60.0)
    assert told.values[-1] == pytest.approx(after, rel=1e-9) and run_.frames_run == 200


@pytest.mark.parametrize("where", [{"xs": [0.021] * 20}, {"xs": [0.0] * 20, "height": 0.1}, {"xs": [1.0, 0.0, 1.0]}])
def test_beside_below_or_for_one_frame_it_is_not_heated(where):
    run_ = run(**where)
    assert run_.events == () and run_.frames_run == 0 and set(run_.series["dish/temperature"].values) == {20.0}


def test_reaching_the_boiling_point_is_an_event_and_short_of_it_none():
    assert [event.name for event in run(XS, boils_c=40.0).events] == ["heated", "boil"]
    assert [event.name for event in run(XS, boils_c=80.0).events] == ["heated"]


@pytest.mark.parametrize("capacity", [0.0, -1.0, None, "small"])
def test_a_heat_capacity_that_cannot_be_is_named(capacity):
    with pytest.raises(EffectError, match="'dish' has heat_capacity_j_per_k"):
        run(XS, capacity=capacity)
