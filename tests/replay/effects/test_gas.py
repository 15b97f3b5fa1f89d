import math

import numpy as np
import pytest
from support.liquid_worlds import glass, still, tilted, world

from replay.effects.models.gas_laws import gas_ml_per_mol
from replay.pipeline.engine import compute
from sessions.model.scene import SceneBody

ZINC = {"formula": "Zn", "mass_g": 0.5}
GAS = {
    "gas": "H2", "from": "b", "tube": "tube", "outlet": [0.0, 0.5, 0.0], "jar": "jar", "temperature_c": 20.0,
    "pressure_pa": 101325.0,
}  # fmt: skip
COUNT = 200


def overturned(heights):
    """Poses of a jar over the tube, mouth down, its mouth at these heights."""
    places = np.zeros((len(heights), 3))
    places[:, 1] = np.asarray(heights) + 0.06
    return places, np.tile((1.0, 0.0, 0.0, 0.0), (len(heights), 1))


def run(heights=None, rate=2.0, zinc=ZINC, degrees=None, **more):
    """Acid is poured on zinc at 0.11 s, after a jump; the tube's outlet is 0.5 m above the flask's floor."""
    heights = [0.45] * COUNT if heights is None else heights
    flask = glass("b", cavity={"radius": 0.05})
    flask.extra["properties"]["solid"] = zinc
    bodies = (glass("a", 60.0, solute="HCl", molar=5.0), flask, SceneBody("tube"), glass("jar"))
    degrees = [*([0.0] * 10), *([80.0] * (COUNT - 10))] if degrees is None else degrees
    poses = {"a": tilted(degrees), "b": still(COUNT), "tube": still(COUNT), "jar": overturned(heights)}
    effects = (
        ("pour", {"from": ["a"], "into": ["b"]}), ("mixing", {"in": ["b"]}),
        ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", **({"rate_per_s": rate} if rate else {})}),
        ("gas", {**GAS, **more}),
    )  # fmt: skip
    return compute(world(poses, bodies, *effects)).effects["gas"]


def test_under_the_jar_all_of_it_is_collected_up_to_what_the_jar_holds():
    run_ = run()
    (event,) = run_.events
    moles = 0.5 / 65.38 * -math.expm1(-2.0 * 1.88)
    assert event.values["volume_ml"] == pytest.approx(math.pi * 0.02**2 * 0.06 * 1e6)
    assert run_.series["jar/H2 collected"].values[-1] == pytest.approx(math.pi * 0.02**2 * 0.06 * 1e6)
    whole = run_.series["jar/H2 collected"].values[-1] + run_.series["jar/H2 leaked"].values[-1]
    assert whole == pytest.approx(moles * gas_ml_per_mol(20.0, 101325.0), rel=1e-9)


def test_only_while_the_outlet_is_inside_is_anything_collected():
    heights = [0.6] * 50 + [0.48] * 50 + [0.6] * 100
    little = {**ZINC, "mass_g": 0.05}
    run_ = run(heights, zinc=little)
    (event,) = run_.events
    moles = 0.05 / 65.38 * (math.exp(-2.0 * 0.38) - math.exp(-2.0 * 0.88))
    assert event.values["moles"] == pytest.approx(moles, rel=1e-9) and event.end == pytest.approx(1.0)
    assert event.values["leaked_before_mol"] == pytest.approx(0.05 / 65.38 * -math.expm1(-2.0 * 0.38), rel=1e-6)
    assert [span.word for span in run_.output.lanes["jar"]] == ["leaks", "collected", "leaks"]
