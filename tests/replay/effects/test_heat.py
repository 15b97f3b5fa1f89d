import numpy as np
import pytest
from support.liquid_worlds import effects_of_tilt_degrees, glass, poses_at_rest, session_with_effects

from replay.effects.chemistry.solution_water import water_molar
from replay.effects.output import COLOURS, Findings, Series
from replay.effects.temperatures import note_temperature
from replay.engine import compute
from sessions.model.scene import SceneBody

DILUTION = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_capacity_j_per_ml_k": 4.0}
FLAME = {
    "of": "flame", "source": "lamp", "heats": "dish", "within": 0.02, "base": [0.0, 0.1, 0.0], "power_w": 160.0,
    "loss_w_per_k": 0.4, "ambient_c": 20.0,
}  # fmt: skip


def heat_of_flame(xs, height=0.2, **more):
    """The effect on a dish at these x, 0.1 s each; the flame reaches 2 cm around x = 0, from 0.10 to 0.35 m up."""
    points = np.zeros((len(xs), 3))
    points[:, 0], points[:, 1] = xs, height
    poses = {"lamp": poses_at_rest(len(xs)), "dish": (points, poses_at_rest(len(xs))[1])}
    dish = SceneBody("dish", extra={"properties": {"heat_capacity_j_per_k": 60.0}})
    session = session_with_effects(poses, (SceneBody("lamp"), dish), ("heat", {**FLAME, **more}), step_ns=100_000_000)
    return compute(session).effects["heat"]


X_OVER_FLAME_FOR_10_S = [1.0] * 5 + [0.01] * 100 + [1.0] * 100


def test_dish_warms_over_the_flame_and_cools_beside():
    """Newton's law with 0.4 W/K and 60 J/K: towards 420 degC over the flame (0.5 to 10.5 s), 20 degC beside.

    420 degC: 160 W / 0.4 W/K above the room. Temperatures have a row at the start and from the frame before it heats.
    """
    effect = heat_of_flame(X_OVER_FLAME_FOR_10_S)
    (event,) = effect.events
    peak = 20.0 + 400.0 * -np.expm1(-10.0 * 0.4 / 60.0)
    assert event.name == "heated" and (event.time, event.end) == pytest.approx((0.5, 10.5))
    assert event.values == {"to_c": pytest.approx(peak, rel=1e-9), "seconds": pytest.approx(10.0)}
    assert event.text.endswith(" in 10.0 s")
    celsius = effect.series["dish/temperature"]
    assert celsius.values.max() == pytest.approx(peak, rel=1e-9) and celsius.values[0] == 20.0
    assert celsius.times[:3].tolist() == pytest.approx([0.0, 0.4, 0.5])
    after = 20.0 + (peak - 20.0) * np.exp(-(celsius.times[-1] - 10.5) * 0.4 / 60.0)
    assert celsius.values[-1] == pytest.approx(after, rel=1e-9) and effect.frames_run == 200


@pytest.mark.parametrize(
    "where",
    [
        {"xs": [0.021] * 20},
        {"xs": [0.0] * 20, "height": 0.1},
        {"xs": [1.0, 0.0, 1.0]},
        {"xs": [0.0] * 20, "height": 0.36},
    ],
    ids=["1 mm beside its 2 cm", "level with its base", "over it for one frame", "1 cm above its 25 cm"],
)
def test_dish_beside_below_or_above_the_flame_stays_cold(where):
    """``xs``: metres beside the flame, frame by frame."""
    effect = heat_of_flame(**where)
    assert (
        effect.events == ()
        and effect.frames_run == 0
        and set(effect.series["dish/temperature"].values) == {FLAME["ambient_c"]}
    )


def over_flame(contents, *tables, xs=X_OVER_FLAME_FOR_10_S, **more):
    """The effects of a dish of 20 mL that is over a flame from 0.5 to 10.5 s, or where else ``xs`` is near 0."""
    points = np.zeros((len(xs), 3))
    points[:, 0], points[:, 1] = xs, 0.2
    poses = {"lamp": poses_at_rest(len(xs)), "dish": (points, poses_at_rest(len(xs))[1])}
    bodies = (SceneBody("lamp"), glass("dish", volume_ml=20.0, properties=contents))
    return compute(
        session_with_effects(poses, bodies, ("heat", {**FLAME, **more}), *tables, step_ns=100_000_000)
    ).effects


FOLLOW = ("mixing", {"in": ["dish"]})


@pytest.mark.parametrize("power_w", [160.0, 2000.0])
def test_followed_water_adds_to_the_heat_capacity(power_w):
    """20 mL warm like 4.18 J/(mL K) that are added to the dish's 60 J/K by hand; 2 kW make it boil, 160 W do not."""
    followed = over_flame({"heat_capacity_j_per_k": 60.0}, FOLLOW, power_w=power_w)["heat"]
    by_hand = over_flame({"heat_capacity_j_per_k": 60.0 + 20.0 * 4.18}, power_w=power_w, boils_c=100.0)["heat"]
    expected = by_hand.series["dish/temperature"]
    counted = followed.series["dish/temperature"]
    celsius = np.interp(expected.times, counted.times, counted.values)
    assert celsius == pytest.approx(expected.values, abs=0.02)
    assert len(followed.output.events_named("boil")) == (power_w > 1000.0)


DISSOLVES_AT_A_RATE = ("reaction", {"equation": "KNO3 -> K+ + NO3-", "rate_per_s": 50.0})


@pytest.mark.parametrize(
    "tables", [(), pytest.param((DISSOLVES_AT_A_RATE,), marks=pytest.mark.slow)], ids=["at once", "at a rate"]
)
def test_potassium_nitrate_dissolves_when_heated_and_crystallises_when_cooled(tables):
    """The solid left follows the solubility at the dish's temperature, from a table, also where it takes time."""
    salt = {"solid": {"formula": "KNO3", "mass_g": 15.0}}
    falls = ("precipitation", {"solid": "KNO3"})
    three_seconds = [1.0] * 5 + [0.01] * 30 + [1.0] * 30
    effects = over_flame(salt, FOLLOW, falls, *tables, xs=three_seconds, loss_w_per_k=67.0, power_w=3000.0)
    solid, celsius = effects["precipitation"].series["dish/KNO3"], effects["heat"].series["dish/temperature"]
    # g in 100 g of water. Source: A. Seidell, Solubilities, 1940.
    soluble = np.interp(celsius.values, range(0, 61, 10), [13.3, 20.9, 31.6, 45.8, 63.9, 85.5, 110.0])
    left = np.maximum(0.0, 15.0 - soluble * 20.0 * 0.998 / 100.0)
    followed = celsius.times > (0.5 if tables else -1.0)  # what dissolves at a rate is solid at first
    assert np.interp(celsius.times, solid.times, solid.values)[followed] == pytest.approx(left[followed], abs=0.4)
    assert (np.diff(celsius.times) > 0.0).all(), "a vessel that cools in steps has their times in order"
    dissolved, again = effects["precipitation"].events
    assert (dissolved.name, again.name) == ("dissolved", "precipitate")
    # 15 g in 19.96 g of water are 75.2 g in 100 g.
    if not tables:
        assert dissolved.values["celsius"] == pytest.approx(45.2, abs=1.0)
    assert again.values["celsius"] == pytest.approx(45.2, abs=1.0)
    assert f"fall out again in dish from {again.values['celsius']:.1f} degC on" in again.text


MIX = ("mixing", {"in": ["b"]})
TILT_DEGREES = [0.0, 60.0, 60.0, 0.0]


def acid(name, volume):
    """A glass of concentrated sulfuric acid, 18 mol/L."""
    return glass(name, volume, solute="H2SO4", molar=18.0, water_molar=4.1)


def effects_of_mixing(bodies, degrees=TILT_DEGREES, **more):
    """Effects of a run in which glass a is poured into b, for two frames of 10 ms; ``more``: keys of the heat."""
    return effects_of_tilt_degrees(degrees, bodies, MIX, ("heat", {**DILUTION, **more}))


def test_acid_into_water_gives_off_the_heat_of_the_table():
    """NBS Circular 500: 67.03, 72.3 and 73.34 kJ/mol in 10, 25 and 50 mol of water, 15.73 in a half."""
    effects = effects_of_mixing((acid("a", volume=60.0), glass("b", volume_ml=60.0)))
    moved = effects["pour"].events[0].values["volume_ml"]
    h2so4, water = 0.018 * moved, 0.0041 * moved + 0.060 * water_molar({})
    # Up to a half mol of water the heat is that of H2SO4 and 1.8 mol of water, n / (n + 1.8).
    before = 15.73e3 * (2.3 / 0.5) * 4.1 / (4.1 + 1.8 * 18.0)
    given = h2so4 * (np.interp(np.log(water / h2so4), np.log([10.0, 25.0, 50.0]), [67.03e3, 72.3e3, 73.34e3]) - before)
    celsius = effects["heat"].series["b/temperature"].values
    assert celsius[-1] == pytest.approx(20.0 + given / (4.0 * (60.0 + moved)), rel=0.01)
    (event,) = effects["heat"].events
    assert (
        event.name == "warmest" and event.values["to_c"] == celsius[-1] and event.values["from_c"] == celsius[0] == 20.0
    )
    assert effects["heat"].frames_run == 3


def test_water_into_acid_is_the_wrong_order():
    """Water is poured into 60 mL of acid, from frame 1 on, which is at 10 ms."""
    effects = effects_of_mixing((glass("a", volume_ml=60.0), acid("b", volume=60.0)), boils_c=400.0)
    (event,) = effects["heat"].output.events_named("wrong-order")
    assert event.level == "error" and event.bodies == ("a", "b")
    assert event.time == pytest.approx(0.01)
    assert event.values["volume_ml"] == pytest.approx(effects["pour"].events[0].values["volume_ml"], rel=1e-9)
    assert effects["heat"].series["b/temperature"].values[-1] > 25.0


def test_a_boiling_liquid_gets_no_hotter():
    """A liquid that boils at 40 degC over a flame, and acid whose heat would bring water above 100 degC."""
    assert heat_of_flame(X_OVER_FLAME_FOR_10_S, boils_c=40.0).series["dish/temperature"].values.max() == 40.0
    hot = effects_of_mixing((glass("a", volume_ml=60.0), acid("b", volume=60.0)), [0.0, *([60.0] * 12)])["heat"]
    assert hot.series["b/temperature"].values.max() == 100.0 and "boils" in hot.output.events_named("boil")[0].text


COLOUR_CHANGE = {"turns_c": 23.0, "from_colour": "blue", "to_colour": "white"}
SALT = {"heat_capacity_j_per_k": 60.0, "solid": {"formula": "CuSO4.5H2O", "mass_g": 5.0}}


def dish_of_salt(more, properties=SALT):
    """A session of a dish with a solid over a flame for 3 s; ``more``: keys of the flame's heat."""
    dish = SceneBody("dish", instrument="evaporating_dish", extra={"properties": properties})
    poses = {"lamp": poses_at_rest(count=30), "dish": poses_at_rest(count=30, position=(0.0, 0.2, 0.0))}
    return session_with_effects(poses, (SceneBody("lamp"), dish), ("heat", {**FLAME, **more}), step_ns=100_000_000)


def test_a_heated_solid_changes_colour_once():
    """160 W heat 60 J/K, which lose 0.4 W/K, from 20 to 23 degC: blue becomes white; at 90 degC it would, too late."""
    heat = compute(dish_of_salt(COLOUR_CHANGE)).effects["heat"]
    (event,) = heat.output.events_named("turned")
    # m c dT/dt = P - k (T - Ta), solved for 3 kelvin.
    seconds = -60.0 / 0.4 * np.log(1.0 - 3.0 * 0.4 / 160.0)
    assert event.time == pytest.approx(seconds, abs=0.1) and event.time >= seconds
    assert event.text == "CuSO4.5H2O in dish turns from blue to white"
    drawn = heat.output.liquids["dish"]
    assert drawn.rgba.tolist() == [list(COLOURS["blue"]), list(COLOURS["white"])] and drawn.times[1] == event.time
    assert drawn.level[0] > drawn.floor
    cool = compute(dish_of_salt({**COLOUR_CHANGE, "turns_c": 90.0})).effects["heat"]
    assert not cool.output.events_named("turned") and len(cool.output.liquids["dish"].times) == 1


@pytest.mark.parametrize(("is_wet", "seconds"), [(None, 1.0), ([True, False, True, True], 2.0), ([False] * 4, None)])
def test_boiling_begins_at_the_boiling_point_of_a_liquid(is_wet, seconds):
    """Water is at 100 degC from second 1 on; without water nothing boils."""
    findings = Findings(4)
    celsius = Series(np.arange(4.0), np.array([20.0, 100.0, 100.0, 99.0]), "degC")
    note_temperature(findings, "pot", celsius, boils_c=100.0, is_wet=None if is_wet is None else np.array(is_wet))
    assert [event.time for event in findings.events] == ([] if seconds is None else [seconds])
