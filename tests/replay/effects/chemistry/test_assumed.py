"""Gaps in the data are reported: solids without a constant, iodine beyond its solubility, end points of ions."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass

from replay.effects.chemistry.assumed import assumption_events
from replay.effects.chemistry.processes import Process

OPEN = [*([0.0] * 2), *([90.0] * 50), *([0.0] * 3)]
"""Degrees of the stopcock, one a frame of 40 ms: some 2.5 mL run in."""

PRUSSIAN = "4 FeCl3 + 3 K4Fe(CN)6 -> Fe4(Fe(CN)6)3 + 12 KCl"
PEROXIDE = "H2O2 + 2 I- + 2 H+ -> I2 + 2 H2O"


def reaction(burette, flask, equation):
    """Output of the reaction of a burette's liquid that runs into 2 mL in the flask; both: solute -> mol/L."""
    titrant = glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN)
    sample = glass("flask", volume_ml=2.0, solutes=flask)
    return effects_of_tap_degrees(
        OPEN,
        MIXING_IN_FLASK,
        ("reaction", {"equation": equation}),
        burette=titrant,
        flask=sample,
        step_ns=40_000_000,
    )["reaction"].output


@pytest.mark.parametrize(
    ("burette", "flask", "equation", "solid"),
    [
        ({"KCl": 1.0}, {"C4H6O6": 0.5}, "C4H6O6 + KCl -> KHC4H4O6(s) + HCl", "KHC4H4O6"),
        pytest.param({"FeCl3": 0.1}, {"K4Fe(CN)6": 0.05}, PRUSSIAN, "Fe4(Fe(CN)6)3", marks=pytest.mark.slow),
    ],
    ids=["potassium bitartrate", "Prussian blue"],
)
def test_a_solid_without_a_constant_is_named(burette, flask, equation, solid):
    """Some 2.5 mL run from a burette into 2 mL in a flask and make a solid, whose solubility no table has.

    ``burette``, ``flask``: solute -> mol/L. The event comes once some has run in, not at the first frame, 0 s.
    """
    (event,) = reaction(burette, flask, equation).events_named("assumed")
    assert event.text.startswith(f"no data know how much {solid} dissolves") and event.time > 0.0


@pytest.mark.parametrize(("iodide_molar", "events"), [(0.01, 1), (0.5, 0)], ids=["little iodide", "much iodide"])
def test_iodine_beyond_its_solubility_is_reported(iodide_molar, events):
    """Peroxide runs into iodide in acid and makes iodine of it: of 0.01 mol/L half as much; 1.4 mmol/L of it dissolve.

    Much iodide binds all iodine as triiodide, and no event says that it falls out.
    """
    output = reaction({"H2O2": 0.1}, {"KI": iodide_molar, "H2SO4": 0.2}, PEROXIDE)
    texts = [event.text for event in output.events_named("beyond")]
    assert len(texts) == events
    assert all("falls out as a solid" in text for text in texts)


def test_a_known_solid_assumes_nothing():
    """Silver nitrate runs into chloride; PHREEQC has a constant of silver chloride, so no event warns of a gap."""
    silver = reaction({"AgNO3": 0.1}, {"NaCl": 0.05}, "AgNO3 + NaCl -> AgCl + NaNO3")
    assert not silver.events_named("assumed") and not silver.events_named("beyond")


# Edta is brought as its disodium salt in a buffer of ammonia; the other two are a Fajans and a sulfate titration.
@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("burette", "flask", "equation", "formula", "molar"),
    [
        ({"AgNO3": 0.1}, {"NaCl": 0.05}, "AgNO3 + NaCl -> AgCl + NaNO3", "NaCl", 0.05),
        ({"BaCl2": 0.1}, {"Na2SO4": 0.05}, "BaCl2 + Na2SO4 -> BaSO4 + 2 NaCl", "Na2SO4", 0.05),
        (
            {"C10H14N2Na2O8": 0.01}, {"CaCl2": 0.005, "NH3": 0.2, "NH4Cl": 0.02},
            "Ca2+ + C10H12N2O8^4- -> CaC10H12N2O8^2-", "CaCl2", 0.005,
        ),
    ],
)  # fmt: skip
def test_ions_of_a_solid_or_complex_have_an_end_point(burette, flask, equation, formula, molar):
    """A titrant's ion makes a solid or a complex with an ion in the flask; both: solute -> mol/L.

    ``molar``: the concentration of ``formula`` in the flask, which the end point reveals.
    """
    (event,) = reaction(burette, flask, equation).events_named("end-point")
    assert event.values["formula"] == formula and event.values["mol_per_l"] == pytest.approx(molar, rel=0.01)


def test_a_weak_complex_has_no_end_point():
    """Iron(III) runs into thiocyanate, of which a good part stays free at equal amounts; both: solute -> mol/L."""
    output = reaction({"FeCl3": 0.1}, {"KSCN": 0.05, "HCl": 0.5}, "Fe3+ + SCN- -> FeSCN^2+")
    assert not output.events_named("end-point")


@pytest.mark.parametrize(
    ("metal", "anion", "equation", "formulas"),
    [
        ({"ZnSO4": 0.1}, {"Na2C2O4": 0.05}, "Zn2+ + C2O4^2- -> ZnC2O4", ["ZnC2O4"]),
        ({"MgCl2": 0.1}, {"Na2SO4": 0.05}, "Mg2+ + SO4^2- -> MgSO4", []),
    ],
    ids=["zinc oxalate", "magnesium sulfate"],
)
def test_a_salt_known_as_complex_alone_is_doubted(metal, anion, equation, formulas):
    """PHREEQC has both salts as dissolved complexes; ``formulas``: those for which an event says that it is a guess.

    Zinc oxalate falls out (solubility product 1.4e-9, CRC Handbook), of which PHREEQC has no constant; magnesium
    sulfate dissolves, as the tables know. ``metal``, ``anion``: in burette and flask, mol/L.
    """
    events = reaction(metal, anion, equation).events_named("assumed")
    assert [event.values["formula"] for event in events] == formulas


def reported_assumptions(
    mol=(), *, ph=7.0, celsius=20.0, processes=(), extent=0.0, reactions=(), phases=(), free_of_equilibrium=True
):
    """Formulas or equations of the warnings on 10 mL that come at 1 s with so many mol of each formula."""
    amounts = dict(mol)
    extents = np.full((3, max(1, len(processes))), extent) * np.array([[0.0], [1.0], [2.0]])
    history = SimpleNamespace(times=np.arange(3.0), volume_ml=np.array([0.0, 10.0, 10.0]), extents=extents)
    matter = SimpleNamespace(
        recipe=SimpleNamespace(reactions=reactions),
        histories={"flask": history},
        solver=SimpleNamespace(mixture=SimpleNamespace(phases=phases)),
        ledger=SimpleNamespace(
            processes=processes,
            column=dict.fromkeys(amounts, 0),
            warmth=SimpleNamespace(followed=True),
            limits=SimpleNamespace(has_equilibrium=lambda row: not free_of_equilibrium),
        ),
        amount=lambda vessel, column: np.array([0.0, 1.0, 1.0]) * amounts.get(column, 0.0),
        celsius=lambda vessel, times: np.full(len(times), celsius),
        equilibria=lambda vessel, times: (np.arange(len(times)), SimpleNamespace(ph=np.full(len(times), ph))),
    )
    events = list(assumption_events(matter))
    assert all(event.time == 1.0 for event in events)
    return [event.values.get("formula", event.values.get("equation")) for event in events]


def equation(*reagents, process=-1, free_energy_j=np.nan):
    """A reaction of these reagents."""
    sides = SimpleNamespace(formulas=reagents, reagents=dict.fromkeys(reagents, 1), products={})
    return SimpleNamespace(
        equation=sides, process=process, phases={}, free_energy_j=free_energy_j, declared={"equation": "A -> B"}
    )


CHLORINE = {
    "no equation": (1e-4, (), ["Cl2"]),
    "a trace": (1e-7, (), []),
    "with water": (1e-4, ("Cl2", "H2O"), []),
    "with hydroxide": (1e-4, ("Cl2", "OH-"), []),
    "with iodide": (1e-4, ("Cl2", "I-"), ["Cl2"]),
    "of other reagents": (1e-4, ("HCl", "OH-"), ["Cl2"]),
}  # fmt: skip


def test_chlorine_water_without_its_acid_is_reported():
    """``mol``: of chlorine in 10 mL; ``reagents``: of the scene's equation, () where it has none.

    Chlorine makes acid with water, which is not computed; ``expected``: the formula of the warning. Traces, below 1e-4
    mol/L, are not reported, nor chlorine whose equation lets it react with water or hydroxide.
    """
    for case, (mol, reagents, expected) in CHLORINE.items():
        assert reported_assumptions({"Cl2": mol}, reactions=[equation(*reagents)] if reagents else ()) == expected, case


HALOGENS = {
    "iodine": ("I2", 5e-6, 9.5, (), ["I2"]),
    "iodine below pH 9": ("I2", 5e-6, 8.5, (), []),
    "bromine": ("Br2", 5e-6, 8.5, (), ["Br2"]),
    "a trace": ("Br2", 5e-7, 8.5, (), []),
    "with hydroxide": ("I2", 5e-6, 9.5, ("I2", "OH-"), []),
    "with thiosulfate": ("I2", 5e-6, 9.5, ("I2", "S2O3^2-"), ["I2"]),
    "equation of another halogen": ("I2", 5e-6, 9.5, ("Br2", "OH-"), ["I2"]),
}  # fmt: skip


def test_halogens_in_lye_are_reported_without_their_equation():
    """Lye takes halogens apart, which is not computed: iodine is reported above pH 9, bromine above pH 8.

    Not reported are traces, below 1e-4 mol/L, and halogens whose equation has hydroxide. ``mol``: in 10 mL;
    ``reagents``: of the scene's equation, () where it has none; ``expected``: the formula of the warning.
    """
    for case, (formula, mol, ph, reagents, expected) in HALOGENS.items():
        assert (
            reported_assumptions({formula: mol}, ph=ph, reactions=[equation(*reagents)] if reagents else ()) == expected
        ), case


def test_permanganate_in_little_acid_is_doubted():
    """An equation makes ``product`` of permanganate and has run by ``extent`` mol.

    Above pH 4 permanganate makes MnO2 instead of Mn^2+: a warning names the equation that says Mn^2+ (``expected``).
    """
    for case, (product, ph, extent, expected) in {
        "little acid": ("Mn^2+", 5.0, 1e-3, ["equation of permanganate"]),
        "enough acid": ("Mn^2+", 3.0, 1e-3, []),
        "another product": ("MnO4^2-", 5.0, 1e-3, []),
        "did not run": ("Mn^2+", 5.0, 0.0, []),
    }.items():
        process = Process("equation of permanganate", {"MnO4-": -1.0, product: 1.0})
        assert reported_assumptions(ph=ph, processes=[process], extent=extent) == expected, case


def test_equation_that_would_stop_early_is_named():
    """The equation A -> B has run to its end, by ``extent`` mol; ``free_of_equilibrium``: no earlier stop is computed.

    ``energy_j``: its free energy for a mol; at 1 kJ much of A would be left, which a warning says, at -1,000 kJ none.
    """
    for case, (energy_j, free_of_equilibrium, extent, expected) in {
        "even": (1e3, True, 1e-3, ["A -> B"]),
        "computed equilibrium": (1e3, False, 1e-3, []),
        "runs to its end": (-1e6, True, 1e-3, []),
        "did not run": (1e3, True, 1e-12, []),
    }.items():
        reactions = [equation("A", process=0, free_energy_j=energy_j)]
        processes = [Process("", {"A": -1.0})]
        warnings = reported_assumptions(
            reactions=reactions, processes=processes, extent=extent, free_of_equilibrium=free_of_equilibrium
        )
        assert warnings == expected, case


SOLIDS = {
    "hot": (0.5, 0.5, 60.0, (), ["AgBr"]),
    "warm": (0.5, 0.5, 40.0, (), []),
    "own course": (0.5, 0.5, 60.0, ("-analytic 1",), []),
    "hardly dissolved": (0.5, 0.01, 60.0, (), []),
    "no solid": (0.0, 0.5, 60.0, (), []),
}  # fmt: skip


def test_hot_solid_by_its_constant_at_25_degrees_is_doubted():
    """A vessel has ``solid`` mol of silver bromide and ``ion`` mol of each of its ions; its constant is of 25 degC.

    A warning names it above 45 degC, unless PHREEQC's data have the constant by temperature (``options``), no solid is
    there, or less than a twentieth as much is dissolved as is solid.
    """
    for case, (solid, ion, celsius, options, expected) in SOLIDS.items():
        ions = {"Ag+": 1, "Br-": 1}
        phase = SimpleNamespace(column="AgBr(s)", components=ions, entry=SimpleNamespace(options=options))
        mol = {"AgBr(s)": solid, "Ag+": ion, "Br-": ion}
        assert reported_assumptions(mol, celsius=celsius, phases=[phase]) == expected, case
