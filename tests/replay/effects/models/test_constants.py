"""The table of constants against the data bases of PHREEQC, read as text: other hands compiled them.

A deviation of more than the tolerance is named with its reason; one that is none any longer fails too.
"""

import re
from pathlib import Path

import numpy as np
import pytest

from replay.effects.models.species import ENTHALPY, HYDROLYSIS, KSP, PKA, PKW, WATER_KJ_MOL, Chemistry

CHEMISTRY = Chemistry()
KCAL = 4.184

WITHIN_PKA, WITHIN_KSP = 0.1, 0.3
"""Of a logarithm; handbooks differ by a factor of two in one solubility product."""

WITHIN_KJ = 2.5
"""Of an enthalpy of reaction, of which the data bases print two or three digits in kcal."""

DEVIATIONS = {
    "protons of HS-": "19 in the CRC Handbook; the older 12.9 of the data bases leaves as little of S^2- below pH 12",
    "enthalpy of HSO4-": "22 kJ/mol in the NBS tables and in CODATA; the data bases have 16",
    "enthalpy of KCl": "17.2 kJ/mol by all handbooks; phreeqc.dat prints 8.5 without a unit",
    "enthalpy of CuSO4": "the NBS tables; the data base is 2.8 kJ/mol off",
    "Ksp of Cu(OH)2": "Lange's Handbook; the data base is a factor of two off",
    "enthalpy of Cu(OH)2": "the NBS tables have -449.8 kJ/mol; the data base's is of another preparation",
    "Ksp of Al(OH)3": "Lange's Handbook, between fresh (-31.2) and gibbsite (-33.9) of the data bases",
    "Ksp of Fe(OH)3": "CRC Handbook, aged; the data bases have the fresh solid",
    "Ksp of Ni(OH)2": "CRC Handbook, fresh; the data base has the aged solid",
    "Ksp of MgCO3": "CRC Handbook, of a fresh precipitate; the data base has magnesite, which takes years",
}


def signed(text):
    """``Mg(OH)2 + 2H+ = Mg+2 + 2H2O`` as what it makes, less what it uses: formula -> number."""
    found = {}
    for side, sign in zip(text.replace("[S-2]", "S").split("="), (-1, 1), strict=True):
        for term in re.split(r"\s+\+\s*", side.strip()):
            many, formula = re.fullmatch(r"(\d*)\s*(\S+)", term.strip()).groups()
            found[formula] = found.get(formula, 0) + sign * int(many or 1)
    return frozenset((formula, many) for formula, many in found.items() if many)


@pytest.fixture(scope="module")
def reactions():
    """Reaction -> log10 of its constant and enthalpy in kJ/mol (NaN: none), of each solid or data base that has it."""
    folder = Path(pytest.importorskip("phreeqpython").__file__).parent / "database"
    found = {}
    for file in ("phreeqc.dat", "wateq4f_PWN.dat"):
        last = None
        for line in (row.split("#")[0].strip() for row in (folder / file).read_text(errors="replace").splitlines()):
            constant = re.match(r"-?log_k\s+([-+.\d]+)", line)
            heat = re.match(r"-?delta_h\s+([-+.\d]+)\s*(kJ|kcal)?", line, re.IGNORECASE)
            if constant and last is not None:
                found.setdefault(last, []).append([float(constant.group(1)), np.nan])
            elif heat and last in found:
                found[last][-1][1] = float(heat.group(1)) * (KCAL if (heat.group(2) or "kJ").lower() == "kcal" else 1.0)
            elif line.count("=") == 1:
                try:
                    last = signed(line)
                except (AttributeError, ValueError):
                    last = None
    return found


def there(part):
    """``Cu^2+`` as ``Cu+2``."""
    return re.sub(r"\^(\d+)([+-])$", r"\2\1", part)


def asked(reactions, made):
    """Constants and enthalpies of a reaction, formula -> number made, or of its reverse."""
    forth = frozenset((there(part), many) for part, many in made.items() if many)
    back = frozenset((part, -many) for part, many in forth)
    return [*reactions.get(forth, []), *([-log, -joule] for log, joule in reactions.get(back, []))]


def check(name, mine, theirs, within):
    """Whether any of several figures is near, unless it is said why none is."""
    near = [value for value in theirs if np.isfinite(value)]
    if not near:
        return 0
    far = min(near, key=lambda value: abs(value - mine))
    words = f"{name}: {mine:.2f} here, {far:.2f} there: {DEVIATIONS.get(name, 'no reason is given')}"
    assert (abs(far - mine) > within) == (name in DEVIATIONS), words
    return 1


PROTONATED = {
    "CO3^2-": ("HCO3-", "CO2"), "SO4^2-": ("HSO4-",), "PO4^3-": ("HPO4-2", "H2PO4-", "H3PO4"), "F-": ("HF",),
    "NH3": ("NH4+",), "S^2-": ("HS-",),
}  # fmt: skip
"""Anion or base -> with one proton more each, as the data bases write it."""


def test_acids_hold_their_protons_as_in_the_data_bases(reactions):
    assert check("pKw", PKW, [-log for log, _ in asked(reactions, {"H2O": -1, "OH-": 1, "H+": 1})], 0.01)
    for part, species in PROTONATED.items():
        for protons, name in enumerate(species, start=1):
            taken = {part: -1, "H+": -protons, name: 1} | ({"H2O": 1} if name == "CO2" else {})
            found = asked(reactions, taken)
            mine = sum(sorted(PKA[part], reverse=True)[:protons])
            assert check(f"protons of {name}", mine, [log for log, _ in found], WITHIN_PKA), name
            heat = ENTHALPY[part][protons] - ENTHALPY[part][0]
            check(f"enthalpy of {name}", heat, [joule for _, joule in found], WITHIN_KJ)


def test_metal_ions_are_taken_apart_by_water_as_in_the_data_bases(reactions):
    compared = 0
    for metal, species in HYDROLYSIS.items():
        for many, log in species:
            used = {(there(metal), -many), ("H2O", -many), ("H+", many)}
            found = [row[0] for made, rows in reactions.items() if used < made and len(made) == 4 for row in rows]
            compared += check(f"hydrolysis of {metal}, {many}", log, found, WITHIN_PKA)
    assert compared >= 10


def test_salts_dissolve_as_in_the_data_bases(reactions):
    compared = {"ksp": 0, "heat": 0}
    for solid in dict.fromkeys([*KSP, *(name.removesuffix("(s)") for name in ENTHALPY if name.endswith("(s)"))]):
        parts = CHEMISTRY.parts(solid)
        if parts is None or "NH3" in parts:
            continue
        # Forth alone: the reverse, which makes it of its ions, is of a pair of ions that is dissolved.
        made = {(there(part), many) for part, many in parts.items() if many} | {(solid.replace(".", ":"), -1)}
        found = reactions.get(frozenset(made), [])
        hydroxides = -min(0, parts.get("H+", 0))
        if solid in KSP:
            products = [log - hydroxides * PKW for log, _ in found]
            compared["ksp"] += check(f"Ksp of {solid}", float(np.log10(KSP[solid])), products, WITHIN_KSP)
        if solid + "(s)" in ENTHALPY and all(part in ENTHALPY or part == "H2O" for part in parts):
            heat = -ENTHALPY[solid + "(s)"][0]
            heat += sum(many * (WATER_KJ_MOL if part == "H2O" else ENTHALPY[part][0]) for part, many in parts.items())
            compared["heat"] += check(f"enthalpy of {solid}", heat, [joule for _, joule in found], WITHIN_KJ)
    assert compared["ksp"] >= 22 and compared["heat"] >= 14, compared
