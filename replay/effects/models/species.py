"""What dissolves into what: ions of salts, acids and bases with their pKa, and what is a solid or a gas.

In the ledger an acid stands as protons and its last anion, whatever its strength: ``CH3COOH`` is H+ and CH3COO-,
``NH4Cl`` is NH3, H+ and Cl-. How many of the protons are free is the pH's affair (`replay.effects.models.acid_base`).

Sources: pKa at 25 degC from the CRC Handbook of Chemistry and Physics, 97th ed., "Dissociation Constants of Inorganic
Acids and Bases" and "of Organic Acids and Bases"; what general chemistry calls strong has none (or below 0).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from replay.effects.models.equation import atoms, charge_of

CATIONS: Final = (
    "Li+", "Na+", "K+", "Rb+", "Cs+", "Ag+", "Mg^2+", "Ca^2+", "Sr^2+", "Ba^2+", "Zn^2+", "Cu^2+", "Fe^2+", "Fe^3+",
    "Al^3+", "Pb^2+", "Mn^2+", "Ni^2+", "Co^2+", "Hg^2+", "Sn^2+", "Cd^2+", "Cr^3+",
)  # fmt: skip
PKA: Final[Mapping[str, tuple[float, ...]]] = {
    "OH-": (), "Cl-": (), "Br-": (), "I-": (), "NO3-": (), "ClO4-": (), "ClO3-": (), "MnO4-": (), "SCN-": (),
    "SO4^2-": (-3.0, 1.99), "CH3COO-": (4.756,), "HCOO-": (3.75,), "F-": (3.20,), "NO2-": (3.25,), "CN-": (9.21,),
    "ClO-": (7.40,), "CO3^2-": (6.35, 10.33), "C2O4^2-": (1.25, 3.81), "SO3^2-": (1.85, 7.2), "S2O3^2-": (0.6, 1.6),
    "CrO4^2-": (0.74, 6.49), "Cr2O7^2-": (), "S^2-": (7.05, 19.0), "PO4^3-": (2.16, 7.21, 12.32),
}  # fmt: skip
"""Anion without protons -> pKa of the acid, one per proton, rising; none where the acid is strong."""

BASES: Final[Mapping[str, float]] = {"NH3": 9.25}
"""Base without charge -> pKa of its conjugate acid."""

NEUTRAL: Final = frozenset(
    ("H2O", "C2H5OH", "CH3OH", "C2H6O", "C6H12O6", "C12H22O11", "H2O2", "CO(NH2)2", "I2", "C3H8O3", "O2")
)
"""Dissolved molecules that leave the pH as it is."""

SOLIDS: Final = frozenset(
    ("AgCl", "AgBr", "AgI", "BaSO4", "CaCO3", "PbI2", "PbSO4", "Cu(OH)2", "Mg(OH)2", "Fe(OH)3", "Al(OH)3", "Zn(OH)2",
     "Ag2CrO4", "CaC2O4", "CuO", "CuS", "BaCO3", "Cu", "Zn", "Mg", "Fe", "Al", "Ag", "Pb", "Ca", "Na", "K", "C", "S")
)  # fmt: skip
"""Formulas that are solid where nothing says otherwise; solubility rules of general chemistry."""

GASES: Final = frozenset(("H2", "O2", "N2", "CO2", "Cl2", "SO2", "CO", "NO", "NO2"))

IONS: Final = frozenset((*CATIONS, *PKA, "H+", "NH4+", "HSO4-", "HCO3-", "H2PO4-", "HPO4^2-", "H3O+"))


@dataclass(frozen=True)
class Chemistry:
    """The tables above and what a scene adds to them."""

    acids: Mapping[str, Sequence[float]] = field(default_factory=dict)  # formula -> pKa of each proton, rising
    bases: Mapping[str, float] = field(default_factory=dict)  # formula -> pKa of the conjugate acid
    pka: Mapping[str, tuple[float, ...]] = field(init=False)  # anion -> pKa, the scene's acids among them

    def __post_init__(self) -> None:
        found = dict(PKA)
        for formula, steps in self.acids.items():
            if steps:
                found[self._anion(formula, len(steps))] = tuple(steps)
        for formula, step in self.bases.items():
            for part in _salt(formula, found) or ():
                if part in found and part != "OH-" and len(found[part]) < 2:
                    found[part] = (step,)
        object.__setattr__(self, "pka", found)

    def parts(self, formula: str) -> dict[str, int] | None:
        """What a dissolved formula stands as, part -> number; ``None``: it stays whole."""
        if formula == "H3O+":
            return {"H2O": 1, "H+": 1}
        if formula in ("H+", "H2O", *BASES) or formula in self.pka or formula in CATIONS:
            return {formula: 1}
        if formula in self.acids:
            steps = self.acids[formula]
            return {"H+": len(steps), self._anion(formula, len(steps)): 1} if steps else None
        return _salt(formula, self.pka)

    def molecule_base(self, formula: str) -> float | None:
        """pKa of the conjugate acid of a base that stays whole."""
        return self.bases.get(formula, BASES.get(formula))

    def known(self, formula: str) -> bool:
        """Whether its part in the charge balance is known."""
        told = formula in self.acids or self.molecule_base(formula) is not None
        return told or formula in NEUTRAL or self.parts(formula) is not None

    def _anion(self, formula: str, protons: int) -> str:
        """The acid without its protons, by the name of the tables where they have it."""
        wanted = atoms(formula)
        wanted["H"] -= protons
        for anion in PKA:
            if charge_of(anion) == -protons and atoms(anion) == +wanted:
                return anion
        body = "".join(f"{atom}{count if count > 1 else ''}" for atom, count in sorted((+wanted).items()))
        return f"{body}{f'^{protons}' if protons > 1 else ''}-"


def _salt(formula: str, anions: Mapping[str, tuple[float, ...]]) -> dict[str, int] | None:
    """Cations, protons and one anion that have the atoms and the charge of a formula; water of crystals goes along."""
    body, *waters = formula.split(".")
    water = sum(int(one.removesuffix("H2O") or 1) for one in waters if one.endswith("H2O"))
    if len(waters) != sum(one.endswith("H2O") for one in waters):
        return None
    wanted, charge = atoms(body), charge_of(body)
    if body == "NH4+":
        return {"NH3": 1, "H+": 1}
    for anion in anions:
        own = atoms(anion)
        for count in range(1, 4):
            rest = wanted - Counter({atom: many * count for atom, many in own.items()})
            if any(wanted[atom] < many * count for atom, many in own.items()):
                break
            found = _cations(rest, charge - count * charge_of(anion))
            if found is not None and not (anion == "OH-" and "H+" in found and len(found) == 1):
                return Counter({anion: count}) + Counter(found) + Counter({"H2O": water})
    return None


def _cations(rest: Counter[str], charge: int) -> dict[str, int] | None:
    """Positive ions of these atoms with this charge together: of one metal or ammonium, and protons."""
    protons = dict(rest)
    if set(protons) <= {"H"}:
        return {one: many for one, many in (("H+", charge),) if many} if protons.get("H", 0) == charge >= 0 else None
    if set(protons) == {"N", "H"}:
        count = protons["N"]
        free = protons["H"] - 3 * count
        return {"NH3": count, "H+": free} if free == charge >= count else None
    for cation in CATIONS:
        metal = cation.rstrip("+0123456789^")
        if metal in protons and set(protons) <= {metal, "H"}:
            many, free = protons[metal], protons.get("H", 0)
            if many * charge_of(cation) + free == charge:
                return {cation: many, **({"H+": free} if free else {})}
    return None
