"""A balanced equation as written on a blackboard: formulas with charges and phases, and arrows of every kind."""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from typing import Final

from periodictable import elements
from periodictable import formula as parsed

COMMON: Final = (
    "HCl", "HBr", "HNO3", "H2SO4", "CH3COOH", "NaOH", "KOH", "Ba(OH)2", "NH3", "NaCl", "KCl", "AgNO3", "KI", "CuSO4",
    "NaHCO3", "Na2CO3", "ZnCl2", "CaCl2", "BaCl2", "MgCl2", "Na2SO4", "KMnO4", "AgCl", "H2O",
)  # fmt: skip
"""Formulas for "did you mean"."""

ARROWS: Final = ("<=>", "<->", "-->", "==>", "->", "=>", "→", "⟶", "⇌", "⇄", "↔")

_TERM = re.compile(r"^(\d+)?\s*(\S+?)\s*(?:\((s|l|g|aq)\))?$")
_CHARGE = re.compile(r"^(.*?)(?:\^?(\d*)([+-]))?$")
_WORDS = str.maketrans({"−": "-", "·": ".", "•": ".", "*": ".", "↓": "(s)", "↑": "(g)"})


@dataclass(frozen=True)
class Equation:
    """``2 A + B -> C``."""

    # reagents, products: formula -> coefficient
    reagents: Mapping[str, int]
    products: Mapping[str, int]
    phases: Mapping[str, str]  # formula -> ``s``, ``l``, ``g`` or ``aq`` where the equation says so

    @property
    def formulas(self) -> tuple[str, ...]:
        """Of both sides."""
        return (*self.reagents, *self.products)

    @property
    def changes(self) -> dict[str, int]:
        """Formula -> how many it makes, below 0 of what it uses up."""
        changes = {formula: -many for formula, many in self.reagents.items()}
        return changes | {formula: many + changes.get(formula, 0) for formula, many in self.products.items()}


def equation_of(text: str, ions: Iterable[str] = ()) -> Equation:
    """Read an equation; ``ions``: formulas by which ``NH4+`` is told from ``Cu2+``.

    Raises ValueError: it cannot be read, or its two sides do not have the same atoms and charge.
    """
    plain = unicodedata.normalize("NFKC", text).translate(_WORDS)
    arrow = next((one for one in ARROWS if one in plain), "")
    if not arrow:
        raise ValueError(f"{text!r} has no ->; write it as HCl + NaOH -> NaCl + H2O")
    phases: dict[str, str] = {}
    left, _, right = plain.partition(arrow)
    known = frozenset(ions)
    equation = Equation(_side(left, phases, known), _side(right, phases, known), phases)
    before, after = (_counted(side) for side in (equation.reagents, equation.products))
    if before != after:
        wrong = sorted(atom for atom in {*before, *after} if before[atom] != after[atom])
        counted = ", ".join(f"{atom} {before[atom]} and {after[atom]}" for atom in wrong)
        raise ValueError(f"{text!r} is not balanced: {counted}; correct its coefficients")
    return equation


def ion_of(formula: str, ions: Iterable[str] = ()) -> str:
    """A formula in the form of the tables: ``Cu2+`` becomes ``Cu^2+``, ``SO42-`` ``SO4^2-``, ``NH4+`` stays."""
    plain = unicodedata.normalize("NFKC", formula.strip()).translate(_WORDS)
    match = _CHARGE.match(plain)
    if match is None or not match.group(3):
        return plain
    body, digits, sign = match.groups()
    forms = [f"{body}^{digits}{sign}" if digits not in ("", "1") else body + digits + sign]
    if digits and "^" not in plain:
        forms += [body + digits + sign, f"{body}{digits[:-1]}^{digits[-1]}{sign}"]
    known = frozenset(ions)
    return next((form for form in forms if form in known), forms[0])


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
        counted = parsed(formula.translate(str.maketrans(".[]", "+()"))).atoms
    except Exception as error:  # the library's grammar raises what its parser has
        why = f": {error}" if isinstance(error, ValueError) else ""
        close = get_close_matches(formula, COMMON, n=1)
        meant = f"; did you mean {close[0]!r}?" if close else "; write for example Ca(OH)2 or CuSO4.5H2O"
        raise ValueError(f"{formula!r} is no formula{why}{meant}") from error
    return {element.symbol: int(many) for element, many in counted.items()}


def molar_mass(formula: str) -> float:
    """g/mol, by the standard atomic weights that the library periodictable has. Raises ValueError: it is no formula."""
    return float(sum(many * elements.symbol(atom).mass for atom, many in atoms(formula).items()))


def _side(text: str, phases: dict[str, str], ions: frozenset[str]) -> dict[str, int]:
    found: Counter[str] = Counter()
    # A plus between blanks parts terms; without blanks one does that no charge ends with.
    terms = re.split(r"\s\+\s", text) if re.search(r"\s\+\s", text) else re.split(r"\+(?=[\dA-Z])", text)
    for term in terms:
        match = _TERM.match(term.strip())
        if match is None:
            raise ValueError(f"{term.strip()!r} is no formula with its coefficient; write for example 2 HCl")
        formula = ion_of(match.group(2), ions)
        atoms(formula)
        found[formula] += int(match.group(1) or 1)
        if match.group(3):
            phases[formula] = match.group(3)
    if min(found.values()) < 1:
        raise ValueError(f"{text.strip()!r} has a coefficient 0; leave it out")
    return dict(found)


def _counted(side: Mapping[str, int]) -> Counter[str]:
    total: Counter[str] = Counter()
    for formula, coefficient in side.items():
        for atom, count in (*atoms(formula).items(), ("charge", charge_of(formula))):
            total[atom] += coefficient * count
    return total
