"""Constants of the chemistry as other data bases of the library phreeqc have them, by activities at equilibrium.

    python .ci/constant_sources.py

prints log_k and enthalpy of every reaction that `constants.phr` names as a source, beside the value that stands there,
and every "-analytic" that is the course by temperature of another data base.
"""

import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import phreeqc

from replay.effects.chemistry.formulas import atoms

CONSTANTS = Path(__file__).parents[1] / "replay/effects/chemistry/constants.phr"
FOLDER = Path(phreeqc.__file__).parent / "databases"
FILES = {
    "llnl": "llnl.dat", "sit": "sit.dat", "wateq4f": "wateq4f.dat", "minteq.v4": "minteq.v4.dat",
    "thermoddem": "PHREEQC_ThermoddemV1.10_15Dec2020.dat",
}  # fmt: skip
ELEMENTS = {
    "F-": "F", "ClO-": {"": "Cl(1)"}, "IO3-": {"": "I(5)"}, "NO2-": {"": "N(3)"}, "SO3-2": {"": "S(4)", "sit": "S(+4)"},
    "S2O3-2": {"": "S(2)", "sit": "S(+2)"}, "Ox-2": "Ox",
    "Pyrophos-4": "Pyrophos", "HGlu-": "Glu", "Na+": "Na", "K+": "K",
    "NH4+": "N(-3)", "Ca+2": "Ca", "Mg+2": "Mg", "Ba+2": "Ba",
    "Sr+2": "Sr", "CO3-2": "C(4)", "Cl-": "Cl",
    "Fe+2": {"": "Fe(2)"}, "Fe+3": {"": "Fe(3)"}, "Ag+": "Ag", "Ni+2": "Ni", "Zn+2": "Zn",
    "Co+2": {"": "Co(2)"}, "Pb+2": "Pb", "Cd+2": "Cd", "SO4-2": "S(6)", "Cu+2": {"": "Cu", "minteq.v4": "Cu(2)"},
}  # fmt: skip
"""Ion of a reaction -> the element that brings it, by data base where they differ."""

GAS_CONSTANT = 8.314462618
COOLER_C, WARMER_C = 23.0, 27.0
"""Temperatures whose difference gives the enthalpy."""

_FORMATION = re.compile(r"^#+\s*Enthalpy of formation:\s*([-+]?[\d.]+)\s*(\S+)")
_COURSE = re.compile(r"^\t-analytic (.+?) # course of (\S+): (\S+)$")
_SOURCE = re.compile(r"^\tlog_k (\S+) # (\S+): (.+)$")


def entries():
    """Equation, log_k, kJ or nothing, source and reaction or book, of each constant."""
    lines = CONSTANTS.read_text(encoding="utf-8").splitlines()
    for row, line in enumerate(lines):
        match = _SOURCE.match(line)
        if match:
            heat = lines[row + 1].split() if row + 1 < len(lines) else []
            kilojoule = float(heat[1]) if heat[:1] == ["delta_h"] else None
            yield lines[row - 1].strip(), float(match[1]), kilojoule, match[2], match[3]


def courses():
    """Phase of `constants.phr`, its log_k at 25 degC, its coefficients, data base and phase of the course."""
    phase, value = "", 0.0
    for line in CONSTANTS.read_text(encoding="utf-8").splitlines():
        if re.match(r"^[A-Z]\S*$", line):
            phase = line
        if line.startswith("\tlog_k"):
            value = float(line.split()[1])
        match = _COURSE.match(line)
        if match:
            yield phase, value, [float(text) for text in match[1].split()], match[2], match[3]


def course(source, phase, value):
    """Coefficients of 1, T, 1/T, log10 T: log_k of a phase by temperature, moved so that it is ``value`` at 25 degC."""
    kelvin = np.array([273.15, 298.15, 323.15, 348.15, 373.15])
    logs = np.array([phase_log_k(source, phase, float(celsius) - 273.15) for celsius in kelvin])
    terms = np.array([1.0 / kelvin - 1.0 / kelvin[1], np.log10(kelvin / kelvin[1])]).T
    inverse, logarithm = np.linalg.lstsq(terms, logs - logs[1], rcond=None)[0].tolist()
    return [value - inverse / kelvin[1] - logarithm * np.log10(kelvin[1]), 0.0, inverse, logarithm]


def phase_log_k(source, phase, celsius):
    """log_k of a phase of a data base at a temperature."""
    library = _library(source)
    text = f'SOLUTION 1\n temp {celsius}\nUSER_PUNCH\n -headings k\n 10 PUNCH LK_PHASE("{phase}")\n'
    if library.RunString(text + "SELECTED_OUTPUT\n -reset false\n -high_precision true\nEND\n"):
        raise ValueError(library.GetErrorString())
    return library.GetSelectedOutput()["k"][0]


def log_k(source, reaction, celsius=25.0):
    """log10 of the constant of a reaction at a temperature, from the activities of a solution at equilibrium."""
    terms = []
    for sign, side in zip((-1, 1), reaction.split(" = "), strict=True):
        for term in side.split(" + "):
            count, _, name = term.rpartition(" ")
            terms.append((sign * float(count or 1), name))
    elements = [ELEMENTS[name] for _, name in terms if name in ELEMENTS]
    return quotient(
        source, [item if isinstance(item, str) else item.get(source, item[""]) for item in elements], terms, celsius
    )


def quotient(source, elements, terms, celsius=25.0, pe=4.0):
    """log10 of a reaction quotient in a solution of elements at equilibrium at pH 7.

    ``terms``: (count, species or [phase]), below 0 of what is used up.
    """
    sums = [f'({many})*SI("{name[1:-1]}")' if name[0] == "[" else f'({many})*LA("{name}")' for many, name in terms]
    library = _library(source)
    text = f"SOLUTION 1\n temp {celsius}\n units mol/kgw\n pH 7\n pe {pe}\n"
    text += "".join(f" {item} 1e-6\n" for item in elements)
    text += f"USER_PUNCH\n -headings k\n 10 PUNCH {' + '.join(sums)}\n"
    if library.RunString(text + "SELECTED_OUTPUT\n -reset false\n -high_precision true\nEND\n"):
        raise ValueError(library.GetErrorString())
    return library.GetSelectedOutput()["k"][0]


@cache
def _library(source):
    """PHREEQC with a data base: read once, in about 45 ms."""
    library = phreeqc.Phreeqc()
    library.LoadDatabase(str(FOLDER / FILES[source]))
    return library


def kilojoule(source, reaction):
    """Enthalpy of a reaction at 25 degC by van 't Hoff's equation."""
    cooler, warmer = (log_k(source, reaction, celsius) for celsius in (COOLER_C, WARMER_C))
    inverse = 1.0 / (WARMER_C + 273.15) - 1.0 / (COOLER_C + 273.15)
    return -1e-3 * GAS_CONSTANT * math.log(10.0) * (warmer - cooler) / inverse


def enthalpies(formulas):
    """(is a phase, atoms, charge) -> kJ/mol of formation by data base, from the comments of llnl.dat and sit.dat.

    ``formulas``: entries of other elements than one of these has are left out; to read them all takes seconds.
    """
    elements_of_formulas = {_elements(formula) for formula in formulas}
    table = {}
    for source in ("llnl", "sit"):
        equation, phases = "", False
        for line in (FOLDER / FILES[source]).read_text(encoding="utf-8", errors="replace").splitlines():
            text = line.strip()
            phases |= line.startswith("PHASES")
            if "=" in text and text[0] not in "#-":
                equation = text
            match = _FORMATION.match(text)
            if match and equation:
                left, _, right = equation.partition("=")
                name = re.sub(r"^\d[\d.]*\s*", "", (left if phases else right).split(" + ")[0].strip())
                value = float(match[1]) * (4.184 if match[2].startswith("kcal") else 1.0)
                key = _makeup(name) if _elements(name) in elements_of_formulas else None
                if key is not None and value:
                    table.setdefault((phases, *key), {}).setdefault(source, []).append(value)
    return table


def _elements(formula):
    return frozenset(re.findall(r"[A-Z][a-z]?", formula))


def _makeup(name):
    """Atoms and charge of PHREEQC's formula; nothing where it is none."""
    match = re.search(r"([+-])(\d*)$", name)
    charge = int(match[1] + (match[2] or "1")) if match else 0
    body = re.sub(r":(\d*)H2O", r".\1H2O", name[: match.start()] if match else name)
    try:
        return tuple(sorted(atoms(body).items())), charge
    except ValueError:
        return None


if __name__ == "__main__":
    for equation, ours, heat, source, reaction in entries():
        if source in FILES:
            print(
                f"{equation}: {ours} {heat}; {source} {log_k(source, reaction):.3f} {kilojoule(source, reaction):.1f}"
            )
        else:
            print(f"{equation}: {ours} {heat}; {source}, {reaction}")
    for phase, value, coefficients, source, other in courses():
        print(phase, coefficients, source, other, [float(f"{number:.7g}") for number in course(source, other, value)])
