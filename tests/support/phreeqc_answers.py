"""PHREEQC's own answers to the mixtures of the tests, by its minteq.v4 as it is, without a line of the product.

    python tests/support/phreeqc_answers.py tests/replay/effects/chemistry/mixtures.toml

prints the expected values of every mixture that minteq.v4 can answer, to be compared with those in the file.
"""

import sys
import tomllib
from collections import Counter
from pathlib import Path

import phreeqc

DATA = Path(phreeqc.__file__).parent / "databases" / "minteq.v4.dat"

TOTALS = {
    "HCl": "Cl", "HBr": "Br", "HNO3": "N(5)", "H2SO4": "S(6)", "H3PO4": "P", "CH3COOH": "Acetate", "HCOOH": "Formate",
    "C6H8O7": "Citrate", "KHC8H4O4": "K Phthalate", "NaOH": "Na", "KOH": "K", "Ba(OH)2": "Ba", "Ca(OH)2": "Ca",
    "LiOH": "Li", "NH3": "N(-3)", "NH4Cl": "N(-3) Cl", "NH4NO3": "N(-3) N(5)", "CH3COONa": "Na Acetate",
    "HCOONa": "Na Formate", "Na2CO3": "Na Na C(4)", "NaHCO3": "Na C(4)", "K2CO3": "K K C(4)", "Na2SO4": "Na Na S(6)",
    "NaH2PO4": "Na P", "Na2HPO4": "Na Na P", "K2HPO4": "K K P", "Na3PO4": "Na Na Na P", "NaF": "Na F", "HF": "F",
    "NaNO2": "Na N(3)", "AlCl3": "Al Cl Cl Cl", "FeCl3": "Fe(3) Cl Cl Cl", "FeSO4": "Fe(2) S(6)", "AgNO3": "Ag N(5)",
    "NaCl": "Na Cl", "KCl": "K Cl", "KBr": "K Br", "KI": "K I", "K2CrO4": "K K Cr(6)", "BaCl2": "Ba Cl Cl",
    "CuSO4": "Cu(2) S(6)", "CuCl2": "Cu(2) Cl Cl", "Pb(NO3)2": "Pb N(5) N(5)", "ZnSO4": "Zn S(6)", "ZnCl2": "Zn Cl Cl",
    "MgCl2": "Mg Cl Cl", "MgSO4": "Mg S(6)", "CaCl2": "Ca Cl Cl", "SrCl2": "Sr Cl Cl", "NiSO4": "Ni S(6)",
    "NiCl2": "Ni Cl Cl", "CoCl2": "Co(2) Cl Cl", "MnSO4": "Mn(2) S(6)", "CdCl2": "Cd Cl Cl", "CrCl3": "Cr(3) Cl Cl Cl",
    "H3BO3": "B", "Na2B4O7": "Na Na B B B B", "CaCO3": "Ca C(4)", "CuO": "Cu(2)", "CuSO4.5H2O": "Cu(2) S(6)",
    "AgCl": "Ag Cl", "Na2SO4.10H2O": "Na Na S(6)", "FeS": "Fe(2) S(-2)", "Mg(OH)2": "Mg", "NaHSO4": "Na S(6)",
    "Na2S": "Na Na S(-2)", "Na2B4O7.10H2O": "Na Na B B B B",
}  # fmt: skip
"""Formula -> the elements of minteq.v4 that a mol of it brings; protons and hydroxide follow from the charges."""


def answer(moles, phases, kilograms):
    """pH, and mol of each phase, of so many mol of formulas in so much water at 25 degC."""
    totals = Counter()
    for formula, amount in moles.items():
        for element in TOTALS[formula].split():
            totals[element] += amount
    lines = ["SOLUTION 1", " units mol/kgw", f" water {kilograms}", " pH 7 charge"]
    lines += [f" {element} {float(amount / kilograms)!r}" for element, amount in totals.items() if amount]
    if phases:
        lines += ["EQUILIBRIUM_PHASES 1", *(f" {phase} 0 0" for phase in phases.values())]
    names = " ".join(phases.values())
    output = f"SELECTED_OUTPUT\n -reset false\n -pH true\n -high_precision true\n -equilibrium_phases {names}\n"
    library = phreeqc.Phreeqc()
    library.LoadDatabase(str(DATA))
    if library.RunString(output + "\n".join([*lines, "END\n"])):
        raise ValueError(library.GetErrorString())
    columns = library.GetSelectedOutput()
    return {"pH": columns["pH"][-1], **{formula: columns[phase][-1] for formula, phase in phases.items()}}


def mixture(row):
    """mol of everything in the three vessels of a row, and kg of water, a litre being one."""
    moles, litres = Counter(), 0.0
    for vessel in (row.get(name, {}) for name in "abc"):
        volume = vessel.get("ml", 0.0) * 1e-3
        litres += volume
        for formula, molar in vessel.get("solutes", {}).items():
            moles[formula] += volume * molar
        if "solid" in vessel:
            moles[vessel["solid"]] += vessel["moles"]
    return moles, litres


if __name__ == "__main__":
    for row in tomllib.loads(Path(sys.argv[1]).read_text("utf-8"))["mixture"]:
        moles, litres = mixture(row)
        if row.get("by") == "PHREEQC":
            found = answer(moles, row.get("phases", {}), litres)
            print(row["name"], {name: round(value, 6) for name, value in found.items()}, sep=": ")
