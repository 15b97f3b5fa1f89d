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
    """A dish of 60 J/K that loses 0.4 W/K to a room of 20 degC is over a flame of 160 W from 0.5 to 10.5 s.

    Newton's law: over the flame it goes towards 160 W / 0.4 W/K = 400 K above the room, beside it towards the room.
    Frames are 0.1 s apart; the series has a row at the start, and rows from the frame before the heating on.
    """
    effect = heat_of_flame(X_OVER_FLAME_FOR_10_S)
    (event,) = effect.events
    room_c, per_second = 20.0, 0.4 / 60.0
    peak = room_c + 400.0 * -np.expm1(-10.0 * per_second)
    assert event.name == "heated" and (event.time, event.end) == pytest.approx((0.5, 10.5))
    assert event.values == {"to_c": pytest.approx(peak, rel=1e-9), "seconds": pytest.approx(10.0)}
    assert event.text.endswith(" in 10.0 s")
    celsius = effect.series["dish/temperature"]
    assert celsius.values.max() == pytest.approx(peak, rel=1e-9) and celsius.values[0] == room_c
    assert celsius.times[:3].tolist() == pytest.approx([0.0, 0.4, 0.5])
    after = room_c + (peak - room_c) * np.exp(-(celsius.times[-1] - 10.5) * per_second)
    assert celsius.values[-1] == pytest.approx(after, rel=1e-9)
    cold_frames = 5  # before the flame: nothing to compute
    assert effect.frames_run == len(X_OVER_FLAME_FOR_10_S) - cold_frames


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
    """The flame reaches 2 cm around x = 0, from 0.10 to 0.35 m up; the dish is 0.2 m up where no height is given.

    ``xs``: metres beside the flame, frame by frame; a single frame over it is taken for noise.
    """
    effect = heat_of_flame(**where)
    assert effect.events == ()
    assert effect.frames_run == 0
    assert set(effect.series["dish/temperature"].values) == {FLAME["ambient_c"]}


def over_flame(contents, *tables, xs=X_OVER_FLAME_FOR_10_S, **more):
    """The effects of a dish of 20 mL that is over a flame from 0.5 to 10.5 s, or where else ``xs`` is near 0."""
    points = np.zeros((len(xs), 3))
    points[:, 0], points[:, 1] = xs, 0.2
    poses = {"lamp": poses_at_rest(len(xs)), "dish": (points, poses_at_rest(len(xs))[1])}
    bodies = (SceneBody("lamp"), glass("dish", volume_ml=20.0, properties=contents))
    return compute(
        session_with_effects(poses, bodies, ("heat", {**FLAME, **more}), *tables, step_ns=100_000_000)
    ).effects


MIXING_IN_DISH = ("mixing", {"in": ["dish"]})
"""Follows what is in the dish."""


@pytest.mark.parametrize(("power_w", "boils"), [(160.0, 0), (2000.0, 1)])
def test_followed_water_adds_to_the_heat_capacity(power_w, boils):
    """A dish of 60 J/K with 20 mL of water, which an effect mixing follows, is over a flame for 10 s.

    It warms like a dish to whose 60 J/K the water's 20 mL x 4.18 J/(mL K) are added by hand, without mixing. To boil
    takes 80 K x 143.6 J/K = 11.5 kJ: ``boils`` is 1 where the flame gives 20 kJ, 0 where it gives 1.6 kJ.
    """
    followed = over_flame({"heat_capacity_j_per_k": 60.0}, MIXING_IN_DISH, power_w=power_w)["heat"]
    by_hand = over_flame({"heat_capacity_j_per_k": 60.0 + 20.0 * 4.18}, power_w=power_w, boils_c=100.0)["heat"]
    expected = by_hand.series["dish/temperature"]
    counted = followed.series["dish/temperature"]
    celsius = np.interp(expected.times, counted.times, counted.values)
    assert celsius == pytest.approx(expected.values, abs=0.02)
    assert len(followed.output.events_named("boil")) == boils


DISSOLVES_AT_A_RATE = ("reaction", {"equation": "KNO3 -> K+ + NO3-", "rate_per_s": 50.0})


@pytest.mark.parametrize(
    "tables", [(), pytest.param((DISSOLVES_AT_A_RATE,), marks=pytest.mark.slow)], ids=["at once", "at a rate"]
)
def test_potassium_nitrate_dissolves_when_heated_and_crystallises_when_cooled(tables):
    """10 g of the salt lie in 20 mL of water over a flame of 3 kW for 1.4 s, and then cool beside it, by 67 W/K.

    The solid left follows the solubility at the dish's temperature, from a table, within 0.4 g. All is dissolved, and
    falls out again, at 32.4 degC. Where an equation dissolves it by 50 a second, that lags: it is compared after 0.5 s,
    and only the temperature at which the salt falls out.
    """
    salt = {"solid": {"formula": "KNO3", "mass_g": 10.0}}
    falls = ("precipitation", {"solid": "KNO3"})
    heated_and_cooled = [1.0] * 5 + [0.01] * 14 + [1.0] * 15  # metres beside the flame, 0.1 s each
    effects = over_flame(salt, MIXING_IN_DISH, falls, *tables, xs=heated_and_cooled, loss_w_per_k=67.0, power_w=3000.0)
    solid, celsius = effects["precipitation"].series["dish/KNO3"], effects["heat"].series["dish/temperature"]
    # g in 100 g of water at 0, 10, ... 60 degC. Source: A. Seidell, Solubilities, 1940.
    soluble = np.interp(celsius.values, range(0, 61, 10), [13.3, 20.9, 31.6, 45.8, 63.9, 85.5, 110.0])
    water_g = 20.0 * 0.998
    left = np.maximum(0.0, 10.0 - soluble * water_g / 100.0)
    followed = celsius.times > (0.5 if tables else -1.0)  # what dissolves at a rate is solid at first
    assert np.interp(celsius.times, solid.times, solid.values)[followed] == pytest.approx(left[followed], abs=0.4)
    assert (np.diff(celsius.times) > 0.0).all(), "a vessel that cools in steps has their times in order"
    dissolved, again = effects["precipitation"].events
    assert (dissolved.name, again.name) == ("dissolved", "precipitate")
    # 10 g in 19.96 g of water are 50.1 g in 100 g: between 45.8 g at 30 degC and 63.9 g at 40 degC.
    saturated_c = pytest.approx(32.4, abs=0.5)
    if not tables:
        assert dissolved.values["celsius"] == saturated_c
    assert again.values["celsius"] == saturated_c
    assert f"fall out again in dish from {again.values['celsius']:.1f} degC on" in again.text


MIX = ("mixing", {"in": ["b"]})
TILT_DEGREES = [0.0, 60.0, 60.0, 0.0]


def acid(name, volume):
    """A glass of concentrated sulfuric acid, 18 mol/L."""
    return glass(name, volume, solute="H2SO4", molar=18.0, water_molar=4.1)


def effects_of_pour(bodies, degrees=TILT_DEGREES, **more):
    """Effects of a run in which glass a is poured into b, for two frames of 10 ms; ``more``: keys of the heat."""
    return effects_of_tilt_degrees(degrees, bodies, MIX, ("heat", {**DILUTION, **more}))


def test_acid_into_water_gives_off_the_heat_of_the_table():
    """Sulfuric acid with 18 mol/L of H2SO4 and 4.1 mol/L of water is poured for 2 frames into 60 mL of water.

    NBS Circular 500: a mol of H2SO4 gives off 67.03, 72.3 and 73.34 kJ in 10, 25 and 50 mol of water, 15.73 in a half.
    What the acid gave off with its own water is not given off again; the liquids take up 4 J/(mL K), from 20 degC.
    """
    effects = effects_of_pour((acid("a", volume=60.0), glass("b", volume_ml=60.0)))
    moved_ml = effects["pour"].events[0].values["volume_ml"]
    h2so4_mol, water_mol = 0.018 * moved_ml, 0.0041 * moved_ml + 0.060 * water_molar({})
    # Up to a half mol of water a mol the heat goes by n / (n + 1.8), n: mol of water a mol of H2SO4; here 4.1 / 18.
    before_j = 15.73e3 * (2.3 / 0.5) * 4.1 / (4.1 + 1.8 * 18.0)
    table_j = np.interp(np.log(water_mol / h2so4_mol), np.log([10.0, 25.0, 50.0]), [67.03e3, 72.3e3, 73.34e3])
    released_j = h2so4_mol * (table_j - before_j)
    celsius = effects["heat"].series["b/temperature"].values
    assert celsius[-1] == pytest.approx(20.0 + released_j / (4.0 * (60.0 + moved_ml)), rel=0.01)
    (event,) = effects["heat"].events
    assert event.name == "warmest"
    assert event.values["to_c"] == celsius[-1] and event.values["from_c"] == celsius[0] == 20.0
    assert effects["heat"].frames_run == 3, "two of the pour, and the frame after it"


def test_water_into_acid_is_the_wrong_order():
    """Water is poured from a into b, 60 mL of concentrated sulfuric acid, from frame 1 on, which is at 10 ms.

    The error names both glasses and the volume of the pour; the acid warms by more than 5 K above the room's 20 degC.
    """
    never_boils_c = 400.0
    effects = effects_of_pour((glass("a", volume_ml=60.0), acid("b", volume=60.0)), boils_c=never_boils_c)
    (event,) = effects["heat"].output.events_named("wrong-order")
    assert event.level == "error" and event.bodies == ("a", "b")
    assert event.time == pytest.approx(0.01)
    assert event.values["volume_ml"] == pytest.approx(effects["pour"].events[0].values["volume_ml"], rel=1e-9)
    assert effects["heat"].series["b/temperature"].values[-1] > 25.0


def test_a_flame_heats_a_liquid_to_its_boiling_point():
    """A scene says that a liquid of 60 J/K boils at 40 degC.

    Otherwise the flame's 160 W, less 0.4 W/K, would make 46 degC of it in 10 s: 20 + 400 (1 - exp(-10 x 0.4 / 60)).
    """
    assert heat_of_flame(X_OVER_FLAME_FOR_10_S, boils_c=40.0).series["dish/temperature"].values.max() == 40.0


def test_water_poured_into_acid_heats_it_to_the_boiling_point():
    """The heat of mixing would bring acid and water above 100 degC; they boil at 100 degC, and an event says so."""
    water_into_acid = (glass("a", volume_ml=60.0), acid("b", volume=60.0))
    hot = effects_of_pour(water_into_acid, degrees=[0.0, *([60.0] * 12)])["heat"]
    assert hot.series["b/temperature"].values.max() == 100.0
    assert "boils" in hot.output.events_named("boil")[0].text


COLOUR_CHANGE = {"turns_c": 23.0, "from_colour": "blue", "to_colour": "white"}
SALT = {"heat_capacity_j_per_k": 60.0, "solid": {"formula": "CuSO4.5H2O", "mass_g": 5.0}}


def dish_of_salt(more, properties=SALT):
    """A session of a dish with a solid over a flame for 3 s; ``more``: keys of the flame's heat."""
    dish = SceneBody("dish", instrument="evaporating_dish", extra={"properties": properties})
    poses = {"lamp": poses_at_rest(count=30), "dish": poses_at_rest(count=30, position=(0.0, 0.2, 0.0))}
    return session_with_effects(poses, (SceneBody("lamp"), dish), ("heat", {**FLAME, **more}), step_ns=100_000_000)


def test_a_heated_solid_changes_colour_once():
    """Copper sulfate in a dish of 60 J/K that loses 0.4 W/K turns from blue to white at 23 degC.

    160 W bring it there from 20 degC within 3 s; the event is at the next frame (0.1 s), and the colour drawn changes.
    """
    heat = compute(dish_of_salt(COLOUR_CHANGE)).effects["heat"]
    (event,) = heat.output.events_named("turned")
    # m c dT/dt = P - k (T - Ta), solved for 3 kelvin.
    seconds = -60.0 / 0.4 * np.log(1.0 - 3.0 * 0.4 / 160.0)
    assert event.time == pytest.approx(seconds, abs=0.1) and event.time >= seconds
    assert event.text == "CuSO4.5H2O in dish turns from blue to white"
    drawn = heat.output.liquids["dish"]
    assert drawn.rgba.tolist() == [list(COLOURS["blue"]), list(COLOURS["white"])] and drawn.times[1] == event.time
    assert drawn.level[0] > drawn.floor, "the solid has a height"


def test_a_solid_that_stays_cooler_keeps_its_colour():
    """A blue salt changes its colour at 90 degC; 160 W bring 60 J/K from 20 to below 28 degC in 3 s."""
    heat = compute(dish_of_salt({**COLOUR_CHANGE, "turns_c": 90.0})).effects["heat"]
    assert not heat.output.events_named("turned")
    assert heat.output.liquids["dish"].rgba.tolist() == [list(COLOURS["blue"])]


def test_boiling_begins_at_the_boiling_point_of_a_liquid():
    """A pot is at 100 degC in the seconds 1 and 2 of four; ``is_wet``: whether there is water in it, second by second.

    Boiling begins at the first second with 100 degC and water; a pot whose water is not followed counts as wet.
    """
    for case, (is_wet, boiling_times) in {
        "wetness not followed": (None, [1.0]),
        "dry in second 1": ([True, False, True, True], [2.0]),
        "always dry": ([False] * 4, []),
    }.items():
        findings = Findings(4)
        celsius = Series(np.arange(4.0), np.array([20.0, 100.0, 100.0, 99.0]), "degC")
        note_temperature(findings, "pot", celsius, boils_c=100.0, is_wet=None if is_wet is None else np.array(is_wet))
        assert [event.time for event in findings.events] == boiling_times, case
