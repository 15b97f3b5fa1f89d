"""Families of first-year mixtures against PHREEQC's own minteq.v4 and against the amounts of a laboratory manual."""

import tomllib
from pathlib import Path

import numpy as np
import phreeqc
import pytest
from support.liquid_worlds import glass
from support.second_opinions import answer, mixture

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.formulas import ion_of, molar_mass
from replay.effects.chemistry.ledger_columns import UNFOLLOWED_WARMTH
from replay.effects.chemistry.mixture import mixture_of, phreeqc_data
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.effect_plan import plan
from replay.errors import PlanError
from sessions.model.scene import Scene, SceneEffect

MIXTURES, MORE = (
    tomllib.loads(Path(__file__).with_name(name).read_text("utf-8"))["mixture"]
    for name in ("mixtures.toml", "more_mixtures.toml")
)
FORMER = tomllib.loads(Path(__file__).with_name("given_mixtures.toml").read_text("utf-8"))
"""Mixtures of the former solver: names of rows of mixtures.toml (``computed``), and whole rows (``refused``)."""

LARGE = {"radius": 0.05, "height": 0.08}
"""A beaker that holds 600 mL."""

WITHIN = {"pH": {"abs": 0.1}, "solid": {"rel": 0.05, "abs": 1e-7}, "complex": {"rel": 0.1}}


def scene_of(row):
    """Three glasses, everything mixed, and the row's equations."""
    bodies = []
    for name in "abc":
        vessel = row.get(name, {})
        solid = {}
        if "solid" in vessel:
            grams = vessel["moles"] * molar_mass(vessel["solid"])
            solid = {"solid": {"formula": vessel["solid"], "mass_g": grams}}
        liquid = {"solutes": vessel["solutes"]} if "solutes" in vessel else {}
        bodies.append(glass(name, vessel.get("ml", 0.0), cavity=LARGE, properties=solid, **liquid))
    keys = {"rate_per_s": row["rate_per_s"]} if "rate_per_s" in row else {}
    keys |= row.get("keys", {})
    effects = [SceneEffect("pour", {"from": ["a", "c"], "into": ["b"]}), SceneEffect("mixing", {"in": ["b"]})]
    effects += [SceneEffect("reaction", {"equation": equation, **keys}) for equation in row["equations"]]
    effects += [SceneEffect("precipitation", {"solid": solid, "colour": "white"}) for solid in row.get("falls", ())]
    return Scene(bodies=tuple(bodies), effects=tuple(effects))


def mixed(row):
    """Name -> what came out, with everything poured into b at one moment and left for a minute."""
    scene = scene_of(row)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    contents = contents_of_scene(scene, "scene.toml")
    recipe = recipe_of(tables, contents)
    ledger = recipe.ledger(0.0, UNFOLLOWED_WARMTH)
    ledger.begin(0.0)
    for number, name in enumerate("ac", start=1):
        volume = contents[name].volume_ml if name in contents else 0.0
        if volume:
            moment = np.array([number]), np.array([0.1 * number])
            ledger.flow(*moment, [(name, "b")], np.array([[volume]]), np.zeros(1, dtype=bool))
    ledger.end(600, 60.0)
    amounts = ledger.amounts[ledger.at["b"]]
    result = {
        name.removesuffix("(s)").removesuffix("(g)"): amounts[index]
        for name, index in ledger.column.items()
        if name.endswith(("(s)", "(g)"))
    }
    if len(ledger.processes):
        result["extent"] = ledger.extents[ledger.at["b"], 0]
    if recipe.solver is not None:
        mixture = recipe.solver.mixture
        standing = amounts[None, ledger.reactions.phases] * ~ledger.reactions.gas
        totals = (amounts - standing @ ledger.reactions.formation)[:, ledger.reactions.components]
        solved = recipe.solver.equilibrium(totals, amounts[None, ledger.water], np.array([25.0]), ~ledger.reactions.gas)
        result["pH"] = solved.ph[0]
        for expected in row["expected"]:
            index = None if expected in (*result, "extent") else mixture.row_of(ion_of(expected))
            if index is not None:
                result[expected] = solved.species[0, index]
        dissolved = solved.species[0] @ mixture.powers + solved.phases[0] @ mixture.uses
        assert dissolved == pytest.approx(totals[0], rel=1e-8, abs=1e-12)
    return result


@pytest.mark.sampled(4)
@pytest.mark.parametrize("row", [*MIXTURES, *MORE], ids=lambda row: row["name"])
def test_a_mixture_comes_out_as_phreeqc_or_the_manual_says(row):
    """All vessels of a ``row`` are poured into one and left for a minute, with its equations.

    ``expected``: by a call of PHREEQC or by a laboratory manual, the pH within 0.1, mol of a solid or gas within 5 %,
    mol of a dissolved species within 10 %.
    """
    result = mixed(row)
    for name, expected in row["expected"].items():
        is_dissolved = "^" in name or name in ("NH3", "Ag(NH3)2+") or name in row.get("species", {})
        kind = "pH" if name == "pH" else "complex" if is_dissolved else "solid"
        assert result.get(name, 0.0) == pytest.approx(expected, **WITHIN[kind]), (name, result)


def test_every_family_has_its_rows():
    """The two files of mixtures that are tested above are of these nine families, and none gets shorter.

    mixtures.toml has rows of each, 80 or more in all, more_mixtures.toml 60 or more, of some.
    """
    families = {
        "acids and bases", "hydrolysis", "gases", "precipitates", "copper", "complexes", "redox", "metals", "solids",
    }  # fmt: skip
    assert {row["family"] for row in MIXTURES} == families
    assert {row["family"] for row in MORE} <= families
    assert len(MIXTURES) >= 80
    assert len(MORE) >= 60


def test_the_56_mixtures_of_the_former_solver_are_all_tested():
    """56 mixtures were compared with PHREEQC when it replaced the former solver: given_mixtures.toml lists them.

    At least 50 are ``computed``, by names of rows of mixtures.toml, all of which are computed by a test; the others are
    ``refused``, each with a whole row, which a test of refusals plans.
    """
    names_of_rows = {row["name"] for row in MIXTURES}
    assert set(FORMER["computed"]) - names_of_rows == set()
    assert len(FORMER["computed"]) + len(FORMER["refused"]) == 56
    assert len(FORMER["computed"]) >= 50


@pytest.mark.parametrize("row", FORMER["refused"], ids=lambda row: row["name"])
def test_a_refused_mixture_names_the_remedy(row):
    """``row``: vessels and equations of a scene that is refused, with ``words`` of the fault, which say what to do.

    Some only have keys that are refused: ``without_keys`` they are computed, with the pH of PHREEQC, within 0.1.
    """
    with pytest.raises(PlanError) as refused:
        plan(scene_of(row))
    assert row["words"] in str(refused.value)
    if "without_keys" in row:
        plain = {**row, "keys": {}, "expected": {}}
        assert mixed(plain)["pH"] == pytest.approx(row["without_keys"]["pH"], abs=0.1)


def pour_into_b(ledger, source, frames, millilitres):
    """Pours so much from a vessel into b, evenly over frames of 0.1 s."""
    volume_ml = np.full((len(frames), 1), millilitres / len(frames))
    ledger.flow(frames, 0.1 * frames, [(source, "b")], volume_ml, over=np.zeros(1, dtype=bool))


def phreeqc_in_steps(steps):
    """Mol of CO2 that PHREEQC lets leave when 15 mmol of HCl come in so many steps to 5 mmol of BaCO3 in 100 mL.

    What left after a step is no longer there in the next.
    """
    library = phreeqc.Phreeqc()
    library.LoadDatabase(str(Path(phreeqc.__file__).parent / "databases" / "minteq.v4.dat"))
    output = "SELECTED_OUTPUT\n -reset false\n -high_precision true\n -equilibrium_phases Witherite CO2(g)\n"
    solution = "SOLUTION 1\n units mol/kgw\n water 0.1\n pH 7 charge\n Na 0.1\n C(4) 0.05\n Ba 0.05\n Cl 0.1\n"
    assert not library.RunString(output + solution + "EQUILIBRIUM_PHASES 1\n Witherite 0 0\nSAVE solution 1\nEND\n")
    witherite, gone = library.GetSelectedOutput()["Witherite"][-1], 0.0
    for _ in range(steps):
        assert not library.RunString(
            f"USE solution 1\nEQUILIBRIUM_PHASES 2\n Witherite 0 {witherite!r}\n CO2(g) 0 0\n"
            f"REACTION 1\n HCl {0.015 / steps!r}\n H2O {0.05 / 0.0180153 / steps!r}\n 1\nSAVE solution 1\nEND\n"
        )
        columns = library.GetSelectedOutput()
        witherite, gone = columns["Witherite"][-1], gone + columns["CO2(g)"][-1]
    return gone


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("steps", "leaves"), [(3, True), (1, False), (5, True), (50, True)])
def test_acid_in_steps_frees_the_gas_of_phreeqc_in_steps(steps, leaves):
    """Glass a, 50 mL, is poured into b, which makes 100 mL with 5 mmol of BaCO3; then 15 mmol of acid, 50 mL, from c.

    The acid comes in so many ``steps``, and as much CO2 leaves as by PHREEQC in as many. All at once it stays dissolved
    in 150 mL; in 3 steps 0.44 mmol leave while there are only 133 mL. ``leaves``: whether more than 0.1 mmol do.
    """
    row = next(row for row in MIXTURES if row["name"] == "BaCl2 + Na2CO3, then HCl")
    scene = scene_of(row)
    contents = contents_of_scene(scene, "scene.toml")
    recipe = recipe_of({kind: step.declared for kind, step in plan(scene).steps.items()}, contents)
    ledger = recipe.ledger(0.0, UNFOLLOWED_WARMTH)
    ledger.begin(0.0)
    pour_into_b(ledger, "a", frames=np.array([1]), millilitres=50.0)
    pour_into_b(ledger, "c", frames=np.arange(2, 2 + steps), millilitres=50.0)
    gone_mol = ledger.amounts[ledger.at["b"], ledger.column["CO2(g)"]]
    assert gone_mol == pytest.approx(phreeqc_in_steps(steps), rel=0.01, abs=1e-9)
    hardly_any_mol = 1e-4
    assert (gone_mol > hardly_any_mol) == leaves


@pytest.mark.parametrize("row", [row for row in MORE if row["by"] == "PHREEQC"][::9], ids=lambda row: row["name"])
def test_tabled_mixtures_are_reproduced_by_phreeqc(row):
    """The amounts that more_mixtures.toml expects come from PHREEQC: a plain call, without the product, has them again.

    ``row``: every ninth, with what is in its vessels.
    """
    moles, litres = mixture(row)
    computed = answer(moles, row.get("phases", {}), litres, row.get("species", {}))
    assert computed == pytest.approx(row["expected"], rel=1e-5, abs=1e-9)


def test_complex_has_the_activity_of_its_metal_at_equal_charge():
    """PHREEQC's data base minteq.v4 has an ion size of 6 for copper(II) and iron(III), and none for their complexes.

    The product's text of data for PHREEQC, in which a size is "-gamma", gives 6 to complexes of the ion's charge too.
    """
    copper, iron = (phreeqc_data(mixture_of(database_of(), ions, ())) for ions in (["Cu^2+", "NH3"], ["Fe^3+", "NO3-"]))
    assert copper.count("-gamma 6 0\n") == 6, "the ion, Cu2(OH)2^2+ and four ammines"
    assert copper.count("-gamma 5 0\n") == 0, "Cu(OH)3- and Cu(OH)4^2- have that of Davies"
    assert iron.count("-gamma 6 0\n") == 1, "FeNO3^2+ has another charge than the ion"
