"""Formulas and equations as they are written: atoms, charge, coefficients, phases.

The charge at the end of a formula may be read in two ways: ``IO3-`` is one minus or three, ``SO42-`` is of four oxygens
or of 42. An equation takes the readings with which it balances.
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from itertools import product
from typing import Final

from periodictable import elements
from periodictable import formula as parse_formula

COMMON_FORMULAS: Final = (
    "HCl", "HBr", "HNO3", "H2SO4", "CH3COOH", "NaOH", "KOH", "Ba(OH)2", "NH3", "NaCl", "KCl", "AgNO3", "KI", "CuSO4",
    "NaHCO3", "Na2CO3", "ZnCl2", "CaCl2", "BaCl2", "MgCl2", "Na2SO4", "KMnO4", "AgCl", "H2O",
)  # fmt: skip
"""Formulas for "did you mean"."""

ARROWS: Final = ("<=>", "<->", "-->", "==>", "->", "=>", "→", "⟶", "⇌", "⇄", "↔")

_TERM = re.compile(r"^(\d+)?\s*(\S+?)(?:\s+\^?(\d*[+-]))?\s*(?:\((s|l|g|aq)\))?$")
_CHARGE = re.compile(r"^(.*?)(\^?)(\d*)([+-])$")
_EDTA = re.compile(r"EDTA|Y\s?\^?\d?-(?!>)")
_ELECTRON = re.compile(r"(?:^|[\s+>=\d])e(?:\s*\^?\s*1?-|\s*(?=$|[\s+]))")
_COMPLEX = re.compile(r"\[([^\[\]]+)\]")
_SPELLINGS = str.maketrans({"−": "-", "·": ".", "•": ".", "⋅": ".", "∙": ".", "*": ".", "↓": "(s)", "↑": "(g)"})

MOST_CHARGE: Final = 6
"""No ion of a school's laboratory has more."""


@dataclass(frozen=True)
class Equation:
    """``2 A + B -> C``."""

    # reagents, products: formula -> coefficient
    reagents: Mapping[str, int]
    products: Mapping[str, int]
    phases: Mapping[str, str]  # formula -> ``s``, ``l``, ``g`` or ``aq`` where the equation says so
    dissolved: frozenset[str] = frozenset()  # solid reagents that the other side has dissolved: C6H12O6(s) -> C6H12O6

    @property
    def formulas(self) -> tuple[str, ...]:
        """Formulas of both sides."""
        return (*self.reagents, *self.products)

    @property
    def changes(self) -> dict[str, int]:
        """Formula -> how many it makes, below 0 of what it uses up."""
        changes = {formula: -many for formula, many in self.reagents.items()}
        return changes | {formula: many + changes.get(formula, 0) for formula, many in self.products.items()}

    def terms(self, states: Mapping[str, str]) -> Iterator[tuple[str, int, str]]:
        """Formula, how many it makes, below 0 of reagents, and its state, of every term that does not cancel."""
        for formula, many in self.changes.items():
            if formula not in self.dissolved:
                yield formula, many, states.get(formula, "")
        for formula in sorted(self.dissolved):
            yield formula, -self.reagents[formula], "s"
            yield formula, self.products[formula], ""


@dataclass(frozen=True)
class _Term:
    """One term of an equation with every reading of its formula."""

    readings: tuple[str, ...]
    coefficient: int
    phase: str


def equation_of(text: str, is_known: Callable[[str], bool] = lambda _: False) -> Equation:
    """Read an equation; of several readings that balance, those of ions that are known (``is_known``) are taken.

    Raises ValueError: it cannot be read, or no reading of it has the same atoms and charge on both sides, or two have.
    """
    plain_text = _plain_spelling(text)
    arrow = next((sign for sign in ARROWS if sign in plain_text), "")
    if not arrow:
        raise ValueError(f"{text!r} has no ->; write it as HCl + NaOH -> NaCl + H2O")
    # Y with a negative charge is EDTA, never yttrium.
    if _EDTA.search(plain_text):
        raise ValueError("write EDTA as C10H12N2O8^4-, as in Ca2+ + C10H12N2O8^4- -> CaC10H12N2O8^2-")
    if _ELECTRON.search(plain_text):
        raise ValueError(
            f"{text!r} is half an equation; add the half that gives or takes its electrons, so that they cancel, as in "
            "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"
        )
    left, _, right = plain_text.partition(arrow)
    sides = _terms_of_side(left), _terms_of_side(right)
    written_terms = list(dict.fromkeys(term.readings for side in sides for term in side))
    balanced_equations: list[Equation] = []
    readings: list[Equation] = []
    for chosen_readings in product(*written_terms):
        reading = dict(zip(written_terms, chosen_readings, strict=True))
        equation = _equation(sides, reading)
        readings.append(equation)
        if _count_atoms_and_charge(equation.reagents) == _count_atoms_and_charge(equation.products):
            balanced_equations.append(equation)
    familiar_equations = [
        equation
        for equation in balanced_equations
        if all(charge_of(formula) == 0 or is_known(formula) for formula in equation.formulas)
    ]
    if len(balanced_equations) == 1 or len(familiar_equations) == 1:
        return (familiar_equations or balanced_equations)[0]
    if balanced_equations:
        raise ValueError(f"{text!r} can be read in {len(balanced_equations)} ways; write charges with ^, as SO4^2-")
    # Of readings that do not balance the one that misses least is meant: NH4+ is ammonium, not NH with four charges.
    nearest_equation = min(readings, key=_imbalance)
    atoms_of_reagents, atoms_of_products = (
        _count_atoms_and_charge(nearest_equation.reagents),
        _count_atoms_and_charge(nearest_equation.products),
    )
    unbalanced_atoms = sorted(
        atom for atom in {*atoms_of_reagents, *atoms_of_products} if atoms_of_reagents[atom] != atoms_of_products[atom]
    )
    atom_differences = ", ".join(
        f"{atom} {atoms_of_reagents[atom]} and {atoms_of_products[atom]}" for atom in unbalanced_atoms
    )
    raise ValueError(f"{text!r} is not balanced: {atom_differences}; correct its coefficients")


def _imbalance(equation: Equation) -> int:
    """Atoms and charges that one side of an equation has more than the other."""
    atoms_of_reagents, atoms_of_products = (
        _count_atoms_and_charge(equation.reagents),
        _count_atoms_and_charge(equation.products),
    )
    return sum(
        abs(atoms_of_reagents[atom] - atoms_of_products[atom]) for atom in {*atoms_of_reagents, *atoms_of_products}
    )


def ion_of(formula: str, is_known: Callable[[str], bool] = lambda _: False) -> str:
    """A formula in the form of the tables: ``Cu2+`` becomes ``Cu^2+``, ``SO42-`` ``SO4^2-``, ``NH4+`` stays."""
    # A charge may stand behind a blank: ``PbI4 2-``.
    readings = readings_of(re.sub(r"\s+\^?(?=\d*[+-]$)", "^", _plain_spelling(formula.strip())))
    return next((reading for reading in readings if is_known(reading)), readings[0])


def readings_of(formula: str) -> tuple[str, ...]:
    """Every way in which the charge at a formula's end can be read, the likeliest first."""
    match = _CHARGE.match(formula)
    if match is None:
        return (formula,)
    body, caret, digits, sign = match.groups()
    # What stands behind the square brackets of a complex is its charge.
    if caret or not digits or _COMPLEX.fullmatch(body):
        return (_formula_with_charge(body, digits, sign),)
    formula_with_charge = _formula_with_charge(body, digits, sign)
    subscript = body + digits + sign
    readings = (
        [f"{body}{digits[:-1]}^{digits[-1]}{sign}", subscript] if len(digits) > 1 else [formula_with_charge, subscript]
    )
    # After a bracket or an O the digit counts atoms; after a bare metal it is the charge.
    if re.search(r"[)\]O]$", body) and len(digits) == 1:
        readings.reverse()
    return tuple(reading for reading in readings if abs(charge_of(reading)) <= MOST_CHARGE)


def _formula_with_charge(body: str, digits: str, sign: str) -> str:
    complex_ion = _COMPLEX.fullmatch(body)
    if complex_ion is not None:
        body = complex_ion.group(1)
    return f"{body}^{digits}{sign}" if digits not in ("", "1") else body + sign


def charge_of(formula: str) -> int:
    """Charge of a formula of the tables: 2 for ``Cu^2+``."""
    match = re.search(r"(?:\^(\d+))?([+-])$", formula)
    return 0 if match is None else int(match.group(2) + (match.group(1) or "1"))


def atoms(formula: str) -> Counter[str]:
    """Atoms of a formula such as ``Ca(OH)2``, ``SO4^2-`` or ``CuSO4.5H2O``. Raises ValueError: it is no formula."""
    return Counter(_atoms(re.sub(r"(\^\d+)?[+-]$", "", formula)))


@cache
def _atoms(formula: str) -> Mapping[str, int]:
    try:
        if not re.fullmatch(r"[\w()\[\].]+", formula):
            raise ValueError("it is of letters, numbers and brackets")
        # The library joins parts by a plus, and has square brackets for isotopes.
        element_counts = parse_formula(formula.translate(str.maketrans(".[]", "+()"))).atoms
    except Exception as error:  # the library's grammar raises what its parser has
        error_text = f": {error}" if isinstance(error, ValueError) else ""
        close_formulas = get_close_matches(formula, COMMON_FORMULAS, n=1)
        suggestion = (
            f"; did you mean {close_formulas[0]!r}?" if close_formulas else "; write for example Ca(OH)2 or CuSO4.5H2O"
        )
        raise ValueError(f"{formula!r} is no formula{error_text}{suggestion}") from error
    return {element.symbol: int(many) for element, many in element_counts.items()}


def molar_mass(formula: str) -> float:
    """g/mol, by the standard atomic weights that the library periodictable has. Raises ValueError: it is no formula."""
    return float(sum(many * elements.symbol(atom).mass for atom, many in atoms(formula).items()))


def crystal_water(formula: str) -> int:
    """Molecules of water that a formula writes after a dot: 5 for ``CuSO4.5H2O``."""
    water_groups = [group for group in formula.split(".")[1:] if group.endswith("H2O")]
    return sum(int(group.removesuffix("H2O") or 1) for group in water_groups)


def _plain_spelling(text: str) -> str:
    plain_text = unicodedata.normalize("NFKC", text).translate(_SPELLINGS)
    # A hydrate written with blanks about its dot is one formula.
    return re.sub(r"\s*\.\s*(?=\d*\s*H2O)", ".", re.sub(r"(\.\s*\d+)\s+(?=H2O)", r"\1", plain_text))


def _terms_of_side(text: str) -> list[_Term]:
    # A plus between blanks parts terms; without blanks one does that no charge ends with.
    written_terms = re.split(r"\s\+\s", text) if re.search(r"\s\+\s", text) else re.split(r"\+(?=[\dA-Z(\[])", text)
    terms = []
    for term in written_terms:
        match = _TERM.match(term.strip())
        if match is None:
            raise ValueError(f"{term.strip()!r} is no formula with its coefficient; write for example 2 HCl")
        many, formula, charge, phase = match.groups()
        readings = (_formula_with_charge(formula, charge[:-1], charge[-1]),) if charge else readings_of(formula)
        for reading in readings:
            atoms(reading)
        if many is not None and int(many) < 1:
            raise ValueError(f"{text.strip()!r} has a coefficient 0; leave it out")
        terms.append(_Term(readings, int(many or 1), phase or ""))
    return terms


def _equation(sides: tuple[list[_Term], list[_Term]], reading: Mapping[tuple[str, ...], str]) -> Equation:
    phases: list[dict[str, str]] = []
    counted: list[dict[str, int]] = []
    for side in sides:
        counts: Counter[str] = Counter()
        phases.append({})
        for term in side:
            formula = reading[term.readings]
            counts[formula] += term.coefficient
            if term.phase:
                phases[-1][formula] = term.phase
        counted.append(dict(counts))
    before, after = phases
    dissolved = {formula for formula in counted[1] if before.get(formula) == "s" and after.get(formula) != "s"}
    return Equation(counted[0], counted[1], {**after, **before}, frozenset(dissolved))


def _count_atoms_and_charge(side: Mapping[str, int]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for formula, coefficient in side.items():
        for atom, count in (*atoms(formula).items(), ("charge", charge_of(formula))):
            counts[atom] += coefficient * count
    return counts
