"""PHREEQC's data as a set of ions that keep their oxidation states: minteq.v4, what it lacks, and what a scene adds.

PHREEQC brings all oxidation states of an element to equilibrium: iron(III) with iodide, nitrate with ammonia. On a
bench that takes minutes or ages, and a scene declares it as an equation. So each oxidation state becomes an element of
its own here. The constants, their temperature dependence and their activities stay as PHREEQC's file has them.
"""

import importlib.util
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from replay.effects.chemistry.components import ELEMENTS, PROTON, WATER, component_of
from replay.effects.chemistry.formulas import charge_of
from replay.errors import EffectError

ELECTRON: Final = "e-"
KILOJOULES_PER_UNIT: Final[Mapping[str, float]] = {"kcal": 4.184, "cal": 4.184e-3, "j": 1e-3, "joules": 1e-3}
"""kJ in a unit of ``delta_h``; PHREEQC takes kJ where none is written."""

READ_BLOCKS: Final = ("SOLUTION_MASTER_SPECIES", "SOLUTION_SPECIES", "PHASES")
"""Blocks that are read; the others of a data base are not asked."""

_BLOCK = re.compile(r"^[A-Z_]{3,}(?:\s|$)")
_TERM = re.compile(r"^(\d*\.?\d*)\s*(\S+)$")
_CHARGE = re.compile(r"([+-])(\d*)$")

Makeup = Mapping[str, float]
"""Column, ``H+``, ``H2O`` or ``e-`` -> how many are in one species or phase."""

BARE_IONS: Final[Mapping[str, Makeup]] = {PROTON: {PROTON: 1}, WATER: {WATER: 1}, ELECTRON: {ELECTRON: 1}}
"""Names that equations may use before any element is defined."""


@dataclass(frozen=True)
class Entry:
    """A species or phase of PHREEQC."""

    name: str
    makeup: Makeup = field(compare=False)
    equation: str = field(compare=False)  # as the file writes it
    options: tuple[str, ...] = field(compare=False)  # the lines below it
    log_k: float = 0.0  # of its formation from the ions of the file, or of a phase's dissolution
    kilojoule: float = 0.0  # enthalpy of the same


@dataclass(frozen=True, eq=False)
class Database:
    """Everything that PHREEQC may be asked for.

    ``species``, ``phases``: by PHREEQC's names; ``ions``: name -> makeup of all that its equations are written in;
    ``masters``: column -> the ion by which PHREEQC counts it.
    """

    species: Mapping[str, Entry]
    phases: Mapping[str, Entry]
    ions: Mapping[str, Makeup]
    masters: Mapping[str, str]


def phreeqc_folder() -> Path:
    """Folder of the data bases of the library phreeqc. Raises EffectError: it is not installed."""
    module_spec = importlib.util.find_spec("phreeqc")
    if module_spec is None or not module_spec.submodule_search_locations:
        raise EffectError(
            "the chemistry of this scene needs PHREEQC; install it: pip install 'vrlab-replay[chemistry]'"
        )
    return Path(module_spec.submodule_search_locations[0]) / "databases"


@cache
def database_of(extra_text: str = "") -> Database:
    """The data of minteq.v4 and of `constants.phr`, and after them those of a piece of PHREEQC text.

    Raises EffectError: PHREEQC is not installed; ValueError: the text is wrong, a line for each fault.
    """
    reading = _Reading(_own_data(phreeqc_folder()), strict=True)
    reading.read(extra_text)
    if reading.problems:
        raise ValueError("\n".join(reading.problems))
    return Database(reading.species, reading.phases, reading.ions, reading.masters)


@cache
def _own_data(folder: Path) -> Database:
    """The data of minteq.v4 and of `constants.phr`, without what a scene adds."""
    database_text = (folder / "minteq.v4.dat").read_text(encoding="utf-8", errors="replace")
    added_text = resources.files(__package__).joinpath("constants.phr").read_text(encoding="utf-8")
    # Not reported: surfaces, formulas of halves and what needs an element that is not read.
    reading = _Reading(Database(species={}, phases={}, ions=BARE_IONS, masters={}), strict=False)
    for source in (database_text, added_text):
        reading.read(source)
    return Database(reading.species, reading.phases, reading.ions, reading.masters)


class _Reading:
    """Reads text of PHREEQC, block by block, after other data; what it defines may stand in any order.

    ``strict``: whether a block or an element that is not read is a problem.
    """

    def __init__(self, data: Database, *, strict: bool) -> None:
        self.ions = dict(data.ions)
        self.species = dict(data.species)
        self.masters = dict(data.masters)
        self.phases = dict(data.phases)
        self.problems: list[str] = []
        self.strict = strict

    def read(self, text: str) -> None:
        """Add what a text defines; ``problems`` gets a line for each fault."""
        blocks = _keyword_blocks(text)
        for name, lines in blocks:
            if name == "SOLUTION_MASTER_SPECIES":
                for line in lines:
                    self._add_master(line)
            elif name not in READ_BLOCKS and lines and self.strict:
                self.problems.append(f"{name} is not read; give {', '.join(READ_BLOCKS)}")
        pending_entries = [
            entry for name, lines in blocks if name == "SOLUTION_SPECIES" for entry in _equation_entries(lines)
        ]
        while pending_entries:
            remaining_entries = [entry for entry in pending_entries if not self._add_species(*entry)]
            if len(remaining_entries) == len(pending_entries):
                self.problems += [
                    f"{equation!r} has a species that nothing defines" for equation, _ in remaining_entries
                ]
                break
            pending_entries = remaining_entries
        for name, lines in blocks:
            if name == "PHASES":
                for phase, equation, options in _phase_entries(lines):
                    self._add_phase(phase, equation, options)

    def _add_master(self, line: str) -> None:
        element, species, *_ = line.split()
        column = _COLUMN.get(element)
        if column is None:
            if self.strict:
                known_elements = ", ".join(sorted(set(ELEMENTS.values())))
                self.problems.append(f"element {element!r} is not an element that formulas may hold: {known_elements}")
            return
        self.ions[species] = _makeup_of_master(species, column)
        self.masters[column] = species
        self.species.setdefault(species, Entry(species, self.ions[species], "", ()))

    def _add_species(self, equation: str, options: tuple[str, ...]) -> bool:
        """Add one species; False: a species that it is made from is not known yet."""
        left, right = _sides_of_equation(equation)
        if not right:
            self.problems.append(f"{equation!r} has no =; write A + B = AB")
            return True
        name = right[0][1]
        if name in self.ions and [(1.0, name)] == left == right:
            self.species[name] = Entry(name, self.ions[name], equation, options)
            return True
        if name in self.ions and name in _MASTERS:
            # A second oxidation state, which the file makes of the first with electrons.
            self.species[name] = Entry(
                name, self.ions[name], "", tuple(option for option in options if "gamma" in option)
            )
            return True
        combined_sum = self._difference_of_sides(left, right[1:])
        if combined_sum is None:
            return False
        makeup, log_k, kilojoule = combined_sum
        # Polysulfides of minteq.v4 stand unbalanced, beside solid sulfur: in a solution without any there are none.
        is_unbalanced = any("no_check" in option for option in options) and not self.strict
        if makeup.get(ELECTRON) or is_unbalanced:
            return True
        if self.strict and not self._has_balanced_charge(name, makeup, equation):
            return True
        own_constants = _log_k_and_enthalpy(options)
        if own_constants is None:
            if self.strict:
                self.problems.append(f"{equation!r} has no log_k")
            return True
        self.ions[name] = makeup
        self.species[name] = Entry(
            name, makeup, equation, options, log_k + own_constants[0], kilojoule + own_constants[1]
        )
        return True

    def _add_phase(self, name: str, equation: str, options: tuple[str, ...]) -> None:
        left, right = _sides_of_equation(equation)
        combined_sum = self._difference_of_sides(right, left[1:])
        own_constants = _log_k_and_enthalpy(options)
        if combined_sum is None or own_constants is None:
            self.problems.append(f"{name}: {equation!r} has a species that nothing defines, or no log_k")
            return
        if combined_sum[1] and any("analytic" in option for option in options):
            self.problems.append(
                f"{name}: -analytic holds for an equation of the data base's own ions; write it with them"
            )
            return
        if not combined_sum[0].get(ELECTRON):
            # In terms of the file's ions, whatever species its equation is written with.
            log_k, kilojoule = own_constants[0] - combined_sum[1], own_constants[1] - combined_sum[2]
            self.phases[name] = Entry(name, combined_sum[0], equation, options, log_k, kilojoule)

    def _difference_of_sides(
        self, more: Sequence[tuple[float, str]], less: Sequence[tuple[float, str]]
    ) -> tuple[Makeup, float, float] | None:
        """Makeup, log_k and enthalpy of one side less another; ``None``: a species is not known."""
        summed_makeup: Counter[str] = Counter()
        log_k = kilojoule = 0.0
        for sign, terms in ((1.0, more), (-1.0, less)):
            for many, name in terms:
                if name not in self.ions:
                    return None
                for column, count in self.ions[name].items():
                    summed_makeup[column] += sign * many * count  # type: ignore[assignment]
                known_species = self.species.get(name)
                if known_species is not None:
                    log_k += sign * many * known_species.log_k
                    kilojoule += sign * many * known_species.kilojoule
        return {column: many for column, many in summed_makeup.items() if abs(many) > 1e-9}, log_k, kilojoule

    def _has_balanced_charge(self, name: str, makeup: Makeup, equation: str) -> bool:
        charge = sum(many * charge_of(column) for column, many in makeup.items())
        if charge == _phreeqc_charge(name):
            return True
        self.problems.append(f"{equation!r} is not balanced: charge {charge:+g} and {_phreeqc_charge(name):+d}")
        return False


_COLUMN: Final[Mapping[str, str]] = {element: column for column, element in ELEMENTS.items()}
_MASTERS: Final = frozenset(
    ("Fe+2", "Fe+3", "Cu+", "Cu+2", "Mn+2", "Mn+3", "Co+2", "Co+3", "Cr+2", "Cr(OH)2+", "CrO4-2", "Hg(OH)2", "Hg2+2",
     "NH4+", "NO2-", "NO3-", "HS-", "SO4-2", "Sn(OH)2", "Sn(OH)6-2", "MnO4-", "MnO4-2", "H3AsO3", "H3AsO4", "Tl+",
     "VO+2", "VO2+", "SeO4-2"),
)  # fmt: skip
"""Ions of minteq.v4 by which it counts an oxidation state."""


def _makeup_of_master(species: str, column: str) -> Makeup:
    """Protons and water by which PHREEQC's ion differs from the column."""
    master_component = component_of(column)
    charge = _phreeqc_charge(species)
    body = _CHARGE.sub("", species)
    hydroxides = re.search(r"\(OH\)(\d*)", body)
    hydroxide_count = 0 if hydroxides is None else int(hydroxides.group(1) or 1)
    if hydroxide_count and master_component.oxygen == 0:
        return {column: 1, PROTON: -hydroxide_count, WATER: hydroxide_count}
    protons = charge - master_component.charge
    return {column: 1, PROTON: protons} if protons else {column: 1}


def formula_of(name: str) -> str:
    """PHREEQC's name of an ion as formulas are written here: ``Cu(NH3)4+2`` becomes ``Cu(NH3)4^2+``."""
    match = _CHARGE.search(name)
    if match is None:
        return name
    sign, digits = match.groups()
    return name[: match.start()] + (f"^{digits}{sign}" if digits not in ("", "1") else sign)


def _phreeqc_charge(name: str) -> int:
    match = _CHARGE.search(name)
    return 0 if match is None else int(match.group(1) + (match.group(2) or "1"))


def _keyword_blocks(text: str) -> list[tuple[str, list[str]]]:
    blocks: list[tuple[str, list[str]]] = []
    for written_line in text.splitlines():
        line = written_line.partition("#")[0].rstrip()
        if _BLOCK.match(line) and "=" not in line:
            blocks.append((line.split()[0], []))
        elif line.strip() and blocks:
            blocks[-1][1].append(line.strip())
        elif line.strip():
            blocks.append((line.split()[0], [line]))
    return blocks


def _equation_entries(lines: Iterable[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    equation, options = "", list[str]()
    for line in lines:
        if "=" in line:
            if equation:
                yield equation, tuple(options)
            equation, options = line, []
        else:
            options.append(line)
    if equation:
        yield equation, tuple(options)


def _phase_entries(lines: Sequence[str]) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    equation_rows = [row for row, line in enumerate(lines) if "=" in line and row > 0]
    for start, stop in zip(equation_rows, [*equation_rows[1:], len(lines) + 1], strict=True):
        yield lines[start - 1].split()[0], lines[start], tuple(lines[start + 1 : stop - 1])


def _sides_of_equation(equation: str) -> tuple[list[tuple[float, str]], list[tuple[float, str]]]:
    left, _, right = equation.partition("=")
    return _side(left), _side(right)


def _side(text: str) -> list[tuple[float, str]]:
    terms = []
    for term in re.split(r"\s+\+\s+", text.strip()):
        match = _TERM.match(term.strip())
        if match is not None:
            terms.append((float(match.group(1) or 1.0), match.group(2)))
    return terms


def _log_k_and_enthalpy(options: Iterable[str]) -> tuple[float, float] | None:
    """log_k and kJ of an entry's lines; ``None``: it has no log_k."""
    log_k, kilojoule = None, 0.0
    for line in options:
        key, *values = line.lower().split()
        if key.lstrip("-") in ("log_k", "logk") and values:
            log_k = float(values[0])
        if key.lstrip("-") in ("delta_h", "deltah") and values:
            unit = values[1] if len(values) > 1 else "kj"
            kilojoule = float(values[0]) * next(
                (many for name, many in KILOJOULES_PER_UNIT.items() if unit.startswith(name)), 1.0
            )
    return None if log_k is None else (log_k, kilojoule)
