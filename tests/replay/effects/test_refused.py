"""What cannot be is refused before the run in words that say what to give: one scene of every kind, one slip a row."""

import re

import numpy as np
import pytest
from support.effect_proofs import TABLES, scene

from replay.effects.effect_plan import plan
from replay.errors import PlanError


def reaction(equation, **more):
    return {"kind": "reaction", "equation": equation, **more}


SOLUTES, LIQUID = "flask.properties.liquid.solutes", "flask.properties.liquid"
TURNS = ("flame.turns_c", 23.0, "flame.from_colour", "blue", "flame.to_colour", "white")
DILUTED = ("warm.solute", "HCl", "warm.heat_j_mol", 7e4, "warm.half_water")
LEAD = (
    "a.properties.liquid.solutes", {"Pb(NO3)2": 0.1}, SOLUTES, {"HCl": 0.1, "K2CrO4": 0.1, "NaCl": 0.1}, "falls", None,
    "silver.equation", "Pb(NO3)2 + K2CrO4 -> PbCrO4(s) + 2 KNO3",
    "lead", reaction("Pb(NO3)2 + 2 NaCl -> PbCl2(s) + 2 NaNO3"),
)  # fmt: skip
"""Two solids without a solubility product that want the same ion."""
NO_REACTION = tuple(one for name in ("neutral", "silver", "zinc", "falls", "gas", "pink") for one in (name, None))

REFUSED = [
    ("from: no body is 'cap'; did you mean 'tap'", "pour.from", "cap"),
    ("no body is 'tag:vesel'; did you mean 'tag:vessel'", "pour.from", "tag:vesel"),
    ("from is empty", "pour.from", []),
    ("from names 3", "pour.from", [3]),
    ("which stands for a, cup, .*; give one body", "gas.jar", "tag:vessel"),
    (r"between is \['hand'\]; give two", "burn.between", ["hand"]),
    ("pairs 'hand' with itself", "burn.between", ["hand", "hand"]),
    *((r"seconds is .*; give a finite number in s", "burn.seconds", one) for one in ("long", np.nan, True)),
    ("seconds is -1.0; give at least 0.0 s", "burn.seconds", -1.0),
    ("indicator is ''; give text", "pink.indicator", ""),
    ("tip is .*; give three finite numbers", "test.tip", [1, 2]),
    ("acids is 3; give a table", "neutral.acids", 3),
    (r"burn-exposure'\): unknown key 'secnds'; did you mean 'seconds'", "burn.secnds", 0.5),
    ("not balanced", "neutral.equation", "HCl + NaOH -> NaCl"),
    ("has no ->", "neutral.equation", "salt"),
    ("equation: nobody brings 'KOH'; there are: ", "neutral.equation", "HCl + KOH -> KCl + H2O"),
    ("nothing happens", "neutral.equation", "NaCl + KNO3 -> KCl + NaNO3"),
    ("rate_per_s: acids and bases meet at once; leave it out", "neutral.rate_per_s", 0.5),
    ("acids and bases meet", "weak", reaction("CH3COOH + NaOH -> CH3COONa + H2O", rate_per_s=0.5)),
    ("acids and bases meet", "weak", reaction("NH3 + HCl -> NH4Cl", rate_per_s=0.5)),
    ("rate_per_s: a solid with a solubility product falls out at once; leave it out", "silver.rate_per_s", 0.5),
    ("the ksp of 'PbCrO4' is missing", *LEAD),
    (r"rate_per_s is missing: 'CO2' wants H\+ too", f"{SOLUTES}.NaHCO3", 0.1, "zinc.rate_per_s", None,
     "soda", reaction("NaHCO3 + HCl -> NaCl + H2O + CO2")),
    ("rising list", "neutral.acids", {"HF": 3.2}),
    ("rising list", "neutral.acids", {"HF": [5.0, 3.0]}),
    ("conjugate acid", "neutral.bases", {"NH3": [9.25]}),
    ("acids: nobody brings 'HCI'; did you mean 'HCl'", "neutral.acids", {"HCI": [1.0]}),
    (r"acids.CH3COOH is \[4.8\] and another table says", "neutral.acids", {"CH3COOH": [4.7]},
     "zinc.acids", {"CH3COOH": [4.8]}),
    ("no table knows the enthalpies of 'C3H5O2-'", "weak", reaction("C3H6O2 + NaOH -> C3H5NaO2 + H2O"),
     "weak.acids", {"C3H6O2": [4.87]}, f"{SOLUTES}.C3H6O2", 0.1),
    ("heat_kj_mol: its heat follows from tables", "neutral.heat_kj_mol", -50.0),
    ("at most 1000", "falls.ksp", 1e10),
    ("ksp is 1e-05 and .* says 1.77e-10", "again", {**TABLES["falls"], "ksp": 1e-5}),
    (r"\[\[effect\]\] 11 .*solid: no reaction makes 'AgI'; there are: AgCl", "falls.solid", "AgI"),
    ("holds 50 mol/L of 'HCl'; the strongest solution", f"{SOLUTES}.HCl", 50.0),
    ("'flask' holds 'HCl' twice", f"{LIQUID}.solute", "HCl", f"{LIQUID}.molar", 0.1),
    ("unknown element L; did you mean 'HCl'", f"{SOLUTES}.HCL", 0.1),
    ("the pH needs data of 'C4H8O2' in 'flask'", f"{SOLUTES}.C4H8O2", 0.1),
    *(("'flask' has liquid.molar", f"{LIQUID}.solute", "HBr", f"{LIQUID}.molar", one) for one in (-1.0, "x", np.nan)),
    *(("'flask' has liquid.volume_ml = ", f"{LIQUID}.volume_ml", one) for one in (None, -1.0, "full", True, np.nan)),
    ("has liquid.volume_ml = 308 and a brim at 75 mL", f"{LIQUID}.volume_ml", 308.0),
    ("'a' has.*cavity.radius = -1.0", "a.cavity.radius", -1.0),
    ("'a' has.*cavity.lip", "a.cavity.lip", [0, 1]),
    ("'a' is poured from and its cavity has no radius", "a.cavity.radius", None),
    ("'a' has no cavity", "a.cavity", {}),
    ("mark that is not above", "burette.cavity.mark", 0.1),
    ("body 'tap' has no cavity; give capacity_ml", "mixing.in", ["tap"]),
    ("pours into itself", "pour.into", ["a"]),
    ("axis is", "drip.axis", [0, 0, 0]),
    ("joint is 'burette' and so is body; name two bodies", "drip.joint", "burette"),
    ("into: 'burette' runs into itself; name what stands below", "drip.into", ["flask", "burette"]),
    ("jar is 'flask' and so is from; name two bodies", "gas.jar", "flask"),
    ("body 'lamp' has no cavity", "gas.jar", "lamp"),
    ("from: nothing is mixed in 'cup'; name it in an effect mixing", "gas.from", "cup"),
    ("no gas is collected", "gas.antoine", [9.0, 1.0, 233.0]),
    ("Antoine's formula", "gas.antoine", [8.0, 1700.0, -20.0]),
    ("from_ph is not below to_ph", "pink.from_ph", 10.0),
    *((f"in: nothing is mixed in '{name}'; name it in an effect mixing", "pink.in", name) for name in ("tap", "cup")),
    ("gives 'flask' a pH", "neutral", None, "zinc", None, "gas", None, "warm", None),
    ("dips: 'c' is none of the vessels", "test.dips", {"c": "NaCl"}),
    ("which salt is in 'flask'", "test.dips", {}),
    ("colours: no vessel of dips holds 'NaCL'", "test.colours", {"NaCL": "yellow"}),
    (r"colours is \{'NaCl': 3\}; give a table of words", "test.colours", {"NaCl": 3}),
    ("of is 'flme'; did you mean 'flame'", "flame.of", "flme"),
    ("power_w is missing", "flame.power_w", None),
    ("solute belongs to heat of a dilution", "flame.solute", "HCl"),
    ("ambient_c is missing", "flame.ambient_c", None),
    ("half_water is 0.0; give above 0.0", *DILUTED, 0.0),
    ("from_colour is missing: heat of a turning solid needs turns_c, from_colour, to_colour", *TURNS[:2]),
    *(("'dish' has heat_capacity_j_per_k", "dish.properties.heat_capacity_j_per_k", one)
      for one in (0.0, -1.0, None, "small")),
    *(("'dish' holds nothing that turns; give it properties", "dish.properties.solid", one, *TURNS)
      for one in (None, {"mass_g": 1.0})),
    *(("'dish' has solid.density_g_ml = ", "dish.properties.solid.density_g_ml", one, *TURNS) for one in (0.0, "x")),
    ("how much water is with the HCl", *DILUTED, 1.8),
    ("nothing says how hot 'dish' is; give surface_c or an effect heat", "flame", None),
    ("of: no effect reaction says what gives the heat", *NO_REACTION),
    ("loss_w_per_k is 7.0 and .* says 0.4", "again", {**TABLES["warm"], "loss_w_per_k": 7.0}),
    ("power_w is 7.0 and .* says .*; one heat has one", "again", {**TABLES["flame"], "power_w": 7.0}),
    *(("'cup' opens downwards: its bulb holds the liquid", "cup.cavity", None, f"pour.{key}", ["cup"])
      for key in ("from", "into")),
]  # fmt: skip


@pytest.mark.parametrize(("words", "changes"), [(words, changes) for words, *changes in REFUSED])
def test_a_slip_is_refused_before_the_run_in_words_that_say_what_to_give(words, changes):
    with pytest.raises(PlanError) as refused:
        plan(scene(*changes))
    assert any(re.search("^scene.toml: .*" + words, fault) for fault in refused.value.faults), refused.value.faults


def test_the_scene_without_a_slip_is_planned_with_a_solute_that_keeps_its_protons_too():
    assert plan(scene()).effects
    assert plan(scene(f"{SOLUTES}.C4H8O2", 0.1, "neutral.acids", {"C4H8O2": []})).effects
