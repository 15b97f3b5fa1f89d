"""Tables of the chemistry's constants beside the values that a second source gives.

    python .ci/constant_tables.py

prints every row of [solubility], [strongest], [strong_water], [volume], [dissolved] and [dilution] with what the
parameters in `constant_tables.toml` or a data base of the library phreeqc give, and names those without a source here.
"""

import tomllib
from collections import Counter
from pathlib import Path

import phreeqc

from replay.effects.chemistry.enthalpy import CONSTANTS
from replay.effects.chemistry.formulas import atoms, molar_mass
from replay.effects.chemistry.salts import SOLUBILITY_G_PER_100_G

PARAMETERS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
FOLDER = Path(phreeqc.__file__).parent / "databases"
COLD_C = 1.0
"""Near the freezing point."""

TOLERANCE = {
    "solubility": 0.06, "strongest": 0.04, "strong_water": 0.02, "dissolved": 0.2, "dilution": 0.09,
}  # fmt: skip
"""Fraction by which a row may differ; of a volume 3 mL."""

VOLUME_ML = 3.0


def agrees(table, stands, value):
    """Whether a value of a table is that of its source, as well as it is known."""
    return abs(stands - value) <= (VOLUME_ML if table == "volume" else TOLERANCE[table] * abs(value))


def rows():
    """Table, key, entry, what stands there, its source, and the source's value, ``None``: no source here."""
    for salt, values in SOLUBILITY_G_PER_100_G.items():
        yield from _solubility(salt, values)
    for formula, molar in CONSTANTS["strongest"].items():
        yield "strongest", formula, "mol/L", molar, "density", _strength(*PARAMETERS["strongest"][formula], formula)
    for formula, (molar, grams) in CONSTANTS["strong_water"].items():
        percent, density = PARAMETERS["strong_water"][formula]
        yield "strong_water", formula, "mol/L", molar, "density", _strength(percent, density, formula)
        if percent < 98.0:
            yield "strong_water", formula, "g of water", grams, "density", 10.0 * (100.0 - percent) * density
    volumes = _volumes()
    for ion, values in CONSTANTS["volume"].items():
        yield "volume", ion, "mL", values[0], "phreeqc.dat", volumes.get(ion)
    for gas, molar in CONSTANTS["dissolved"].items():
        source = PARAMETERS["dissolved"].get(gas)
        yield "dissolved", gas, "mol/L", molar, f"{source}.dat", source and _henry(source, gas)
    thomsen = PARAMETERS["dilution"]["H2SO4"]
    for water, kilojoule in CONSTANTS["dilution"]["H2SO4"].items():
        count = float(water)
        value = thomsen["heat"] * count / (count + thomsen["half"]) if 1.0 <= count <= thomsen["most"] else None
        yield "dilution", "H2SO4", f"{water} water", kilojoule, "Thomsen", value


def _solubility(salt, values):
    """Rows of a salt by the handbook's per cent, by other copies, and by pitzer.dat at other temperatures."""
    percents = dict(zip((20, 60), PARAMETERS["saturated"].get(salt, ()), strict=False))
    for celsius, grams in values.items():
        source, value = "CRC", None
        if celsius in percents:
            value = 100.0 * percents[celsius] / (100.0 - percents[celsius])
        elif str(int(celsius)) in PARAMETERS["copies"].get(salt, {}):
            source, value = "copy", PARAMETERS["copies"][salt][str(int(celsius))]
        elif celsius in PARAMETERS["pitzer"].get(salt, ("", "", ()))[2]:
            source, value = "pitzer.dat", _pitzer(salt, celsius)
        yield "solubility", salt, f"{celsius:g} degC", grams, source, value


def _strength(percent, density, formula):
    return 10.0 * percent * density / molar_mass(formula)


def _library(name):
    library = phreeqc.Phreeqc()
    library.LoadDatabaseString((FOLDER / name).read_text(encoding="latin-1"))
    return library


def _run(library, text):
    if library.RunString(text):
        raise ValueError(library.GetErrorString())
    return library.GetSelectedOutput()


def _pitzer(salt, celsius):
    """Grams of a salt in 100 g of water beside its solid."""
    solids, element, _ = PARAMETERS["pitzer"][salt]
    phases = "".join(f" {phase} 0 0\n" for phase in solids.split())
    text = f"SOLUTION 1\n temp {celsius}\nEQUILIBRIUM_PHASES 1\n{phases}INCREMENTAL_REACTIONS true\n"
    text += f"REACTION 1\n {salt} 1\n 12 moles in 60 steps\n"
    output = f"SELECTED_OUTPUT\n -reset false\n -high_precision true\n -totals {element}\nEND\n"
    molal = _run(_library("pitzer.dat"), text + output)[f"{element}(mol/kgw)"][-1]
    return molal / atoms(salt)[element] * molar_mass(salt) / 10.0


def _volumes():
    """Ion -> mL/mol in much water by phreeqc.dat."""
    names = PARAMETERS["volume"]
    metals = "\n ".join(
        f"{name} 1e-6" for name in ("K", "Mg", "Ca", "Sr", "Ba", "Fe", "Cu", "Zn", "Pb", "Al", "F", "Br")
    )
    lines = [f'{10 * row + 10} PUNCH VM("{name}")' for row, name in enumerate(names.values())]
    heads = " ".join(f"v{row}" for row in range(len(names)))
    text = f"SOLUTION 1\n pH 4\n Na 1e-3\n Cl 1e-3 charge\n C(4) 1e-6\n N(5) 1e-6\n S(6) 1e-6\n {metals}\n"
    text += f"USER_PUNCH 1\n -headings {heads}\n" + "\n".join(lines) + "\n"
    output = "SELECTED_OUTPUT 1\n -reset false\n -user_punch true\n -high_precision true\nEND\n"
    columns = _run(_library("phreeqc.dat"), text + output)
    return {ion: columns[f"v{row}"][-1] for row, ion in enumerate(names)}


def _henry(source, gas):
    """mol/kg of a gas under one atmosphere in cold water."""
    text = f'SOLUTION 1\n temp {COLD_C}\nUSER_PUNCH\n -headings k\n 10 PUNCH LK_PHASE("{gas}(g)")\n'
    output = "SELECTED_OUTPUT\n -reset false\n -high_precision true\nEND\n"
    return 10.0 ** _run(_library(f"{source}.dat"), text + output)["k"][0]


if __name__ == "__main__":
    known, again = Counter(), Counter()
    for table, key, entry, stands, source, value in rows():
        if value is None:
            print(f"[{table}] {key}, {entry}: {stands}; no source here")
            continue
        known[table] += 1
        again[table] += agrees(table, stands, value)
        print(f"[{table}] {key}, {entry}: {stands}; {source} {value:.4g}")
    for table, count in known.items():
        print(f"[{table}] {again[table]} of {count} rows with a source are printed again")
