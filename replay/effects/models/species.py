"""The constants of chemistry at 25 degC, each with its source, and what a dissolved formula stands as.

In the ledger an acid stands as protons and its last anion, whatever its strength, and a base as what it is less the
protons it takes: ``CH3COOH`` is H+ and CH3COO-, ``NH4Cl`` is NH3, H+ and Cl-, ``NaOH`` is Na+ and H2O less H+. Which of
them are free is found by `replay.effects.models.equilibrium`. Concentrations stand for activities.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from replay.effects.models.equation import atoms, charge_of

PKW: Final = 13.995
"""Ion product of water at 25 degC and 0.1 MPa. Source: IAPWS R11-07."""

CATIONS: Final = (
    "Li+", "Na+", "K+", "Rb+", "Cs+", "Ag+", "Mg^2+", "Ca^2+", "Sr^2+", "Ba^2+", "Zn^2+", "Cu^2+", "Fe^2+", "Fe^3+",
    "Al^3+", "Pb^2+", "Mn^2+", "Ni^2+", "Co^2+", "Hg^2+", "Sn^2+", "Cd^2+", "Cr^3+",
)  # fmt: skip
PKA: Final[Mapping[str, tuple[float, ...]]] = {
    "OH-": (), "Cl-": (), "Br-": (), "I-": (), "NO3-": (), "ClO4-": (), "ClO3-": (), "MnO4-": (), "SCN-": (),
    "SO4^2-": (-3.0, 1.99), "CH3COO-": (4.756,), "HCOO-": (3.75,), "F-": (3.20,), "NO2-": (3.25,), "CN-": (9.21,),
    "ClO-": (7.40,), "CO3^2-": (6.35, 10.33), "C2O4^2-": (1.25, 3.81), "SO3^2-": (1.85, 7.2), "S2O3^2-": (0.6, 1.6),
    "CrO4^2-": (0.74, 6.49), "Cr2O7^2-": (), "S^2-": (7.05, 19.0), "PO4^3-": (2.16, 7.21, 12.32), "S4O6^2-": (),
}  # fmt: skip
"""Anion without protons -> pKa of the acid, one per proton, rising; none where the acid is strong.

Source: CRC Handbook of Chemistry and Physics, 97th ed., "Dissociation Constants of Inorganic Acids and Bases" and "of
Organic Acids and Bases"; what general chemistry calls strong has none (or below 0).
"""

BASES: Final[Mapping[str, float]] = {"NH3": 9.25}
"""Base without charge -> pKa of its conjugate acid. Source: as of the acids."""

HYDROLYSIS: Final[Mapping[str, tuple[tuple[int, float], ...]]] = {
    "Fe^3+": ((1, -2.19),), "Hg^2+": ((1, -3.40),), "Sn^2+": ((1, -3.40),), "Cr^3+": ((1, -4.0),),
    "Al^3+": ((1, -4.97),), "Pb^2+": ((1, -7.71),), "Cu^2+": ((1, -8.0), (2, -10.36)), "Zn^2+": ((1, -8.96),),
    "Fe^2+": ((1, -9.5),), "Co^2+": ((1, -9.65),), "Ni^2+": ((1, -9.86),), "Cd^2+": ((1, -10.08),),
    "Mn^2+": ((1, -10.59),),
}  # fmt: skip
"""Metal ion -> k and log10 of the constant of k M + k H2O = Mk(OH)k + k H+: the first hydrolysis; of copper the dimer
too, which at 0.1 mol/L is more than the single ion. Ions of alkali and alkaline-earth metals and of silver are taken as
they are: their hydrolysis begins above pH 11. Source: Baes and Mesmer, The Hydrolysis of Cations, 1976."""

KSP: Final[Mapping[str, float]] = {
    "AgCl": 1.77e-10, "AgBr": 5.35e-13, "AgI": 8.52e-17, "Ag2CrO4": 1.12e-12, "Ag2CO3": 8.46e-12, "Ag2SO4": 1.20e-5,
    "BaSO4": 1.08e-10, "BaCO3": 2.58e-9, "CaCO3": 3.36e-9, "CaSO4": 4.93e-5, "CaC2O4": 2.32e-9, "CaF2": 3.45e-11,
    "Ca(OH)2": 5.02e-6, "Cu(OH)2": 2.2e-20, "Al(OH)3": 1.3e-33, "Fe(OH)2": 4.87e-17, "Fe(OH)3": 2.79e-39,
    "Mg(OH)2": 5.61e-12, "MgCO3": 6.82e-6, "Ni(OH)2": 5.48e-16, "PbCl2": 1.70e-5, "PbCO3": 7.40e-14, "PbI2": 9.8e-9,
    "PbSO4": 2.53e-8, "SrCO3": 5.60e-10, "SrSO4": 3.44e-7, "ZnCO3": 1.46e-10, "Zn(OH)2": 3e-17,
}  # fmt: skip
"""Solid -> solubility product, mol/L to the number of ions. Source: CRC Handbook, 97th ed., "Solubility Product
Constants"; Al(OH)3 and Cu(OH)2: Lange's Handbook of Chemistry, 15th ed., table 8.6."""

ATMOSPHERE_PA: Final = 101325.0
HENRY: Final[Mapping[str, tuple[str, int, float]]] = {
    "CO2": ("CO3^2-", 2, 3.3e-4), "SO2": ("SO3^2-", 2, 1.2e-2), "H2S": ("S^2-", 2, 1.0e-3), "NH3": ("NH3", 0, 5.9e-1),
}  # fmt: skip
"""Gas -> its part in solution, with how many protons, and its solubility in mol/(m3 Pa). Source: R. Sander, Compilation
of Henry's law constants, Atmos. Chem. Phys. 15 (2015) 4399."""

AIR_CO2: Final = 4.2e-4
"""Share of CO2 in the air. Source: NOAA Global Monitoring Laboratory, global mean of 2023, 419 ppm."""

WATER_KJ_MOL: Final = -285.83
ENTHALPY: Final[Mapping[str, tuple[float, ...]]] = {
    "H+": (0.0,), "OH-": (-229.99,), "Li+": (-278.49,), "Na+": (-240.12,), "K+": (-252.38,), "Ag+": (105.58,),
    "Mg^2+": (-466.85,), "Ca^2+": (-542.83,), "Sr^2+": (-545.80,), "Ba^2+": (-537.64,), "Zn^2+": (-153.89,),
    "Cu^2+": (64.77,), "Fe^2+": (-89.1,), "Fe^3+": (-48.5,), "Al^3+": (-531.0,), "Pb^2+": (-1.7,), "Mn^2+": (-220.75,),
    "Ni^2+": (-54.0,), "Co^2+": (-58.2,), "Cd^2+": (-75.90,), "Cl-": (-167.16,), "Br-": (-121.55,), "I-": (-55.19,),
    "NO3-": (-205.0,), "ClO4-": (-129.33,), "ClO3-": (-103.97,), "MnO4-": (-541.4,), "SCN-": (76.44,),
    "SO4^2-": (-909.27, -887.34, -887.34), "CH3COO-": (-486.01, -485.76), "HCOO-": (-425.55, -425.43),
    "F-": (-332.63, -320.08), "NO2-": (-104.6, -119.2), "CN-": (150.6, 107.1), "ClO-": (-107.1, -120.9),
    "CO3^2-": (-677.14, -691.99, -699.63), "SO3^2-": (-635.5, -626.22, -608.81), "S^2-": (33.1, -17.6, -39.7),
    "PO4^3-": (-1277.4, -1292.14, -1296.29, -1288.34), "NH3": (-80.29, -132.51), "CO2(g)": (-393.51,),
    "SO2(g)": (-296.83,), "H2S(g)": (-20.63,), "NH3(g)": (-46.11,), "H2(g)": (0.0,), "O2(g)": (0.0,), "N2(g)": (0.0,),
    "Cl2(g)": (0.0,), "NO(g)": (90.25,), "NO2(g)": (33.18,), "Zn(s)": (0.0,), "Mg(s)": (0.0,), "Fe(s)": (0.0,),
    "Cu(s)": (0.0,), "Al(s)": (0.0,), "Ag(s)": (0.0,), "Pb(s)": (0.0,), "Ca(s)": (0.0,), "Na(s)": (0.0,),
    "K(s)": (0.0,), "AgCl(s)": (-127.07,), "AgBr(s)": (-100.37,), "AgI(s)": (-61.84,), "Ag2CrO4(s)": (-731.74,),
    "BaSO4(s)": (-1473.2,), "BaCO3(s)": (-1216.3,), "CaCO3(s)": (-1206.92,), "Ca(OH)2(s)": (-986.09,),
    "Cu(OH)2(s)": (-449.8,), "Fe(OH)3(s)": (-823.0,), "Mg(OH)2(s)": (-924.54,), "PbI2(s)": (-175.48,),
    "PbSO4(s)": (-919.94,), "NaOH(s)": (-425.61,), "KOH(s)": (-424.76,), "NaCl(s)": (-411.15,), "KCl(s)": (-436.75,),
    "KNO3(s)": (-494.63,), "NH4Cl(s)": (-314.43,), "NH4NO3(s)": (-365.56,), "Na2CO3(s)": (-1130.68,),
    "CaCl2(s)": (-795.8,), "CuSO4(s)": (-771.36,), "CuSO4.5H2O(s)": (-2279.65,), "MgO(s)": (-601.70,),
    "CaO(s)": (-635.09,), "CuO(s)": (-157.3,),
}  # fmt: skip
"""Enthalpy of formation in kJ/mol, of an anion or base with 0, 1, ... protons. Source: Wagman et al., The NBS Tables of
Chemical Thermodynamic Properties, J. Phys. Chem. Ref. Data 11, supplement 2, 1982 (CO3^2- with two protons: CO2(aq) and
water). H2SO4 counts as HSO4-: it gives its first proton whole. Hydrolysis of metal ions is taken to give no heat."""

NEUTRAL: Final = frozenset(
    ("H2O", "C2H5OH", "CH3OH", "C2H6O", "C6H12O6", "C12H22O11", "H2O2", "CO(NH2)2", "I2", "C3H8O3", "O2")
)
"""Dissolved molecules that leave the pH as it is."""

SOLIDS: Final = frozenset((
    *KSP, "CuO", "CuS", "Cu", "Zn", "Mg", "Fe", "Al", "Ag", "Pb", "Ca", "Na", "K", "C", "S",
))  # fmt: skip
"""Formulas that are solid where nothing says otherwise; solubility rules of general chemistry."""

GASES: Final = frozenset(("H2", "O2", "N2", "CO2", "Cl2", "SO2", "CO", "NO", "NO2"))

IONS: Final = frozenset(
    (*CATIONS, *PKA, "H+", "NH4+", "HSO4-", "HCO3-", "H2PO4-", "HPO4^2-", "H3O+", "HSO3-", "HS-", "HC2O4-", "HCrO4-")
)

MOST_MOLAR: Final[Mapping[str, float]] = {
    "HCl": 13.0, "HBr": 9.0, "HI": 8.0, "HNO3": 24.0, "HClO4": 12.0, "H2SO4": 18.8, "H3PO4": 19.0, "HF": 29.0,
    "CH3COOH": 17.5, "HCOOH": 26.6, "NH3": 18.5, "NaOH": 20.0, "KOH": 15.0,
}  # fmt: skip
"""mol/L of the strongest solution there is at room temperature: saturated, or the pure liquid. Source: CRC Handbook,
"Concentrative Properties of Aqueous Solutions" and densities of the pure acids; rounded up."""


@dataclass(frozen=True)
class Chemistry:
    """The tables above and what a scene adds to them."""

    acids: Mapping[str, Sequence[float]] = field(default_factory=dict)  # formula -> pKa of each proton, rising
    bases: Mapping[str, float] = field(default_factory=dict)  # formula -> pKa of the conjugate acid
    pkw: float = PKW
    pka: Mapping[str, tuple[float, ...]] = field(init=False)  # anion or base -> pKa, the scene's among them

    def __post_init__(self) -> None:
        found = dict(PKA)
        for formula, steps in self.acids.items():
            if steps:
                found[self._anion(formula, len(steps))] = tuple(steps)
        found.update((formula, (step,)) for formula, step in BASES.items())
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

    def room(self, formula: str) -> int:
        """How many protons more a formula takes; 0: it is no base."""
        parts = self.parts(formula) or {}
        free = sum(many * len(self.pka.get(part, ())) for part, many in parts.items())
        return max(0, free - parts.get("H+", 0))

    def is_acid(self, formula: str) -> bool:
        """Whether it gives protons, or is the salt of a metal ion that water takes apart."""
        return (self.parts(formula) or {}).get("H+", 0) > 0

    def is_base(self, formula: str) -> bool:
        """Whether it takes protons."""
        return self.room(formula) > 0

    def known(self, formula: str) -> bool:
        """Whether its part in the charge balance is known."""
        return formula in self.acids or formula in NEUTRAL or self.parts(formula) is not None

    def anion_of(self, acid: str) -> str:
        """The part that keeps protons of a declared acid; ``""`` where it has none."""
        steps = self.acids.get(acid, ())
        return self._anion(acid, len(steps)) if steps else ""

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
        for count in range(1, 4) if charge_of(anion) < 0 else ():
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
