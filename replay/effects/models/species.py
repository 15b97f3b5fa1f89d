"""The constants of chemistry at 25 degC, each with its source, and what a dissolved formula stands as.

In the ledger an acid stands as protons and its last anion, whatever its strength, and a base as what it is less the
protons it takes: ``CH3COOH`` is H+ and CH3COO-, ``NH4Cl`` is NH3, H+ and Cl-, ``NaOH`` is Na+ and H2O less H+. Which of
them are free is found by `replay.effects.models.equilibrium`. Concentrations stand for activities.
"""

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, Final

from replay.effects.models.equation import atoms, charge_of

_TABLES: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    resources.files(__package__).joinpath("constants.toml").read_text(encoding="utf-8")
)
"""Every constant; the file says what each is and where it comes from."""

PKW: Final[float] = _TABLES["water"]["pkw"]
WATER_KJ_MOL: Final[float] = _TABLES["water"]["kj_mol"]
ATMOSPHERE_PA: Final[float] = _TABLES["air"]["pascal"]
CATIONS: Final[Sequence[str]] = _TABLES["ions"]["metals"]
NEUTRAL: Final[Sequence[str]] = _TABLES["ions"]["neutral"]
PKA: Final[Mapping[str, Sequence[float]]] = _TABLES["pka"]
HYDROLYSIS: Final[Mapping[str, Sequence[tuple[int, float]]]] = _TABLES["hydrolysis"]
KSP: Final[Mapping[str, float]] = _TABLES["ksp"]
HENRY: Final[Mapping[str, tuple[str, int, float]]] = _TABLES["henry"]
ENTHALPY: Final[Mapping[str, Sequence[float]]] = _TABLES["enthalpy"]
SOLIDS: Final = frozenset((*KSP, *_TABLES["solids"]["formulas"]))
GASES: Final = frozenset(_TABLES["gases"]["formulas"])
IONS: Final = frozenset((*CATIONS, *PKA, *_TABLES["ions"]["others"]))
MOST_MOLAR: Final[Mapping[str, float]] = _TABLES["strongest"]


@dataclass(frozen=True)
class Chemistry:
    """The tables above and what a scene adds to them."""

    acids: Mapping[str, Sequence[float]] = field(default_factory=dict)  # formula -> pKa of each proton, rising
    bases: Mapping[str, float] = field(default_factory=dict)  # formula -> pKa of the conjugate acid
    pka: Mapping[str, tuple[float, ...]] = field(init=False)  # anion or base -> pKa, the scene's among them

    def __post_init__(self) -> None:
        found = {part: tuple(steps) for part, steps in PKA.items()}
        for formula, steps in self.acids.items():
            if steps:
                found[self._anion(formula, len(steps))] = tuple(steps)
        for formula, step in self.bases.items():
            anion = next((part for part in _salt(formula, found) or () if len(found.get(part, "ab")) < 2), formula)
            found[formula if anion == "OH-" else anion] = (step,)
        object.__setattr__(self, "pka", found)

    def parts(self, formula: str) -> dict[str, int] | None:
        """What a dissolved formula stands as, part -> number, of H+ below 0 in a base; ``None``: it stays whole."""
        if formula in ("H+", "H2O") or formula in CATIONS or (formula in self.pka and formula != "OH-"):
            return {formula: 1}
        if formula == "H3O+":
            return {"H2O": 1, "H+": 1}
        if formula in self.acids:
            steps = self.acids[formula]
            return {"H+": len(steps), self._anion(formula, len(steps)): 1} if steps else None
        found = _salt(formula, self.pka)
        if found is not None and "OH-" in found:
            many = found.pop("OH-")
            found["H2O"] = found.get("H2O", 0) + many
            found["H+"] = found.get("H+", 0) - many
        return None if found is None else {part: many for part, many in found.items() if many}

    def dissolved(self, formula: str) -> Mapping[str, int]:
        """Parts of a formula in solution; one that stays whole is its only part."""
        return self.parts(formula) or {formula: 1}

    def is_acid(self, formula: str) -> bool:
        """Whether it gives protons, or is the salt of a metal ion that water takes apart."""
        return (self.parts(formula) or {}).get("H+", 0) > 0

    def is_base(self, formula: str) -> bool:
        """Whether it takes protons."""
        parts = self.parts(formula) or {}
        return sum(many * len(self.pka.get(part, ())) for part, many in parts.items()) > parts.get("H+", 0)

    def known(self, formula: str) -> bool:
        """Whether its part in the charge balance is known."""
        return formula in self.acids or formula in NEUTRAL or self.parts(formula) is not None

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
    if body == "NH4+":
        return {"NH3": 1, "H+": 1}
    for anion in (one for one in anions if charge_of(one) < 0):
        rest = atoms(body)
        for count in range(1, 4):
            rest.subtract(atoms(anion))
            if min(rest.values()) < 0:
                break
            found = _cations(+rest, charge_of(body) - count * charge_of(anion))
            if found is not None and not (anion == "OH-" and set(found) == {"H+"}):
                return Counter({anion: count}) + found + Counter({"H2O": water})
    return None


def _cations(rest: Counter[str], charge: int) -> Counter[str] | None:
    """Positive ions of these atoms with this charge together: of one metal or ammonium, and protons."""
    protons, others = rest["H"], set(rest) - {"H"}
    if not others and protons == charge:
        return +Counter({"H+": protons})
    ammonia = rest["N"]
    if others == {"N"} and protons - 3 * ammonia == charge >= ammonia:
        return Counter({"NH3": ammonia, "H+": charge})
    for cation in CATIONS:
        metal = cation.rstrip("+0123456789^")
        if others == {metal} and rest[metal] * charge_of(cation) + protons == charge:
            return +Counter({cation: rest[metal], "H+": protons})
    return None
