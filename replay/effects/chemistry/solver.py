"""Asks PHREEQC what a solution comes to; what it has answered once it is not asked again."""

from collections.abc import Sequence
from contextlib import chdir
from dataclasses import dataclass
from itertools import pairwise
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray
from replay.effects.chemistry.components import METALS, PROTON, WATER
from replay.effects.chemistry.mixture import Mixture, phase_name, phreeqc_data
from replay.errors import EffectError

WATER_KG_MOL: Final = 0.0180153
"""Molar mass of water, kg/mol. Source: IUPAC 2021."""

COLDEST_C, HOTTEST_C = 0.0, 100.0
"""Temperatures between which PHREEQC is asked: liquid water."""

COMPOSITIONS_PER_CALL: Final = 256
"""Compositions in one call."""

FIRST_SOLID_FRACTION: Final = 0.999
"""Share of what could be solid that PHREEQC starts with as solid: no start is far beyond saturation."""

LEAST_WATER_KG: Final = 1e-6
"""kg of water below which PHREEQC is asked for about a kilogram of the same solution: its sums of traces diverge."""

MOST_MOLAL: Final = 60.0
"""mol/kg of one part: more is no solution."""

LEAST_MOLAL: Final = 1e-25
"""mol/kg below which nothing is left of a part."""

SUM_TOLERANCE: Final = 1e-12
"""Of PHREEQC's sums, as a share."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equilibria of rows: ``species`` (n, s) and ``phases`` (n, p) in mol, ``ph`` and ``ionic`` (n,), mol/kg.

    ``log_activity`` (n, m): of the bare ion of each component, NaN of one that PHREEQC knows with protons alone.

    Of a row for which PHREEQC has no answer ``ph`` is NaN, and all is thought bare ions.
    """

    species: FloatArray
    phases: FloatArray
    ph: FloatArray
    ionic: FloatArray
    log_activity: FloatArray


class Solver:
    """PHREEQC with the data of one mixture. Raises EffectError: it is not installed, or refuses the data.

    A composition is first asked for as a solution alone, which is cheap. Only where a phase is beyond saturation, or
    the solution has no answer, is it asked for with its phases.

    ``saturation_index``: log10 of a solid's product by its constant at which it stands; 0 is saturation.
    """

    def __init__(self, mixture: Mixture, saturation_index: float = 0.0) -> None:
        self.mixture = mixture
        self._phase_targets = [0.0 if phase.column.endswith("(g)") else saturation_index for phase in mixture.phases]
        self.queries = 0  # compositions that PHREEQC was asked for
        self.unanswered_queries = 0
        self.remember = True
        self._solutions: dict[bytes, FloatArray] = {}
        self._answers_with_phases: dict[bytes, FloatArray] = {}
        self._library: Any = None
        self._folder: TemporaryDirectory[str] | None = None

    def equilibrium(
        self, totals: FloatArray, water_mol: FloatArray, celsius: FloatArray, phases: BoolArray | None = None
    ) -> Equilibrium:
        """Amounts at equilibrium of mixtures in rows.

        ``totals`` : (n, m) mol of each part, dissolved and in phases together; below 0 only the first, ``H+``.
        ``water_mol`` : (n,) mol of water, above 0; ``celsius`` : (n,).
        ``phases`` : (p,) those that may form; ``None``: all.
        """
        mixture = self.mixture
        allowed = np.ones(len(mixture.phases), dtype=np.bool_) if phases is None else phases
        table, keys, answers = self._answers_without_phases(totals, water_mol, celsius)
        _, species, phase_columns, indices, activities = self._columns()
        saturation = answers[:, indices]
        has_forming_phase = ((saturation > self._phase_targets) & allowed).any(axis=1) | (
            np.isnan(answers[:, 0]) & allowed.any()
        )
        rows = np.flatnonzero(has_forming_phase)
        if len(rows):
            marks = [allowed.tobytes() + keys[row] for row in rows.tolist()]
            self._fill_memory(self._answers_with_phases, table[rows], marks, allowed)
            answers[rows] = [self._answers_with_phases[mark] for mark in marks]
        if not self.remember:
            self._solutions.clear()
            self._answers_with_phases.clear()
        self.unanswered_queries += int(np.isnan(answers[:, 0]).sum())
        return Equilibrium(
            species=answers[:, species],
            phases=answers[:, phase_columns],
            ph=answers[:, 0],
            ionic=answers[:, 1],
            log_activity=answers[:, activities],
        )

    def saturation(self, totals: FloatArray, water_mol: FloatArray, celsius: FloatArray) -> FloatArray:
        """Saturation index (n, p) of each phase in solutions in rows; NaN where PHREEQC has no answer."""
        _, _, answers = self._answers_without_phases(totals, water_mol, celsius)
        return answers[:, self._columns()[3]]

    def _columns(self) -> tuple[slice, ...]:
        """Columns of an answer: pH and ionic strength, mol of species and of phases, saturation indices, activities."""
        mixture = self.mixture
        count = len(mixture.phases)
        widths = (2, len(mixture.species), count, count, len(mixture.components))
        starts = np.cumsum([0, *widths]).tolist()
        return tuple(slice(start, stop) for start, stop in pairwise(starts))

    def _answers_without_phases(
        self, totals: FloatArray, water_mol: FloatArray, celsius: FloatArray
    ) -> tuple[FloatArray, list[bytes], FloatArray]:
        """Compositions in rows, their keys in the memory, and their answers as solutions without any phase."""
        least = np.where(np.arange(totals.shape[1]) == 0, -np.inf, 0.0)
        clipped = np.clip(celsius, COLDEST_C, HOTTEST_C)
        table = np.column_stack([np.maximum(totals, least), water_mol, clipped])
        keys = [row.tobytes() for row in table]
        self._fill_memory(self._solutions, table, keys, np.zeros(len(self.mixture.phases), dtype=np.bool_))
        width = self._columns()[-1].stop
        return table, keys, np.array([self._solutions[key] for key in keys]).reshape(len(keys), width)

    def _fill_memory(
        self, memory: dict[bytes, FloatArray], table: FloatArray, marks: list[bytes], allowed: BoolArray
    ) -> None:
        """Ask for the rows that the memory does not hold."""
        missing = {mark: row for row, mark in enumerate(marks) if mark not in memory}
        rows = list(missing.values())
        for start in range(0, len(rows), COMPOSITIONS_PER_CALL):
            chosen = rows[start : start + COMPOSITIONS_PER_CALL]
            for row, answer in zip(chosen, self._answers_of_rows(table[chosen], allowed), strict=True):
                memory[marks[row]] = answer

    def _answers_of_rows(self, table: FloatArray, allowed: BoolArray) -> Sequence[FloatArray]:
        """Answers of rows; those that fail together are asked one by one.

        An answer is pH, ionic strength, mol of species, mol of phases, saturation indices of the phases, and log10 of
        activities of bare ions.
        """
        self.queries += len(table)
        count_of_components = len(self.mixture.components)
        water = np.maximum(table[:, -2], 1e-300) * WATER_KG_MOL
        # What is far beyond any solution is not asked for as one.
        is_beyond_solution = (np.abs(table[:, :count_of_components]).max(axis=1) > MOST_MOLAL * water) & ~allowed.any()
        rows = np.flatnonzero(~is_beyond_solution)
        answers = self._run_scaled(table[rows], allowed) if len(rows) else None
        if answers is None:
            singles = [
                self._run_scaled(table[row : row + 1], allowed) if len(rows) > 1 else None for row in rows.tolist()
            ]
            known = {row: single[0] for row, single in zip(rows.tolist(), singles, strict=True) if single is not None}
        else:
            known = dict(zip(rows.tolist(), answers, strict=True))
        return [known[row] if row in known else self._answer_of_bare_ions(table[row]) for row in range(len(table))]

    def _answer_of_bare_ions(self, row: FloatArray) -> FloatArray:
        """All as ions, and no pH: a proton on each of the strongest bases while there are protons, else hydroxide."""
        mixture = self.mixture
        row_of_makeup = {frozenset(entry.makeup.items()): index for index, entry in enumerate(mixture.species)}
        species, protons = np.zeros(len(mixture.species)), float(row[0])
        steps = {component: mixture.pka(component) for component in mixture.components[1:]}
        for component in sorted(steps, key=lambda name: max(steps[name], default=-np.inf), reverse=True):
            amount = float(row[mixture.components.index(component)])
            acid = row_of_makeup.get(frozenset({component: 1.0, PROTON: 1.0}.items()))
            bound = min(amount, max(0.0, protons)) if acid is not None and component not in METALS else 0.0
            if acid is not None:
                species[acid] = bound
            protons -= bound
            bare = row_of_makeup.get(frozenset({component: 1.0}.items()))
            if bare is not None:
                species[bare] = amount - bound
        water = {PROTON: 1.0} if protons > 0.0 else {PROTON: -1.0, WATER: 1.0}
        species[row_of_makeup[frozenset(water.items())]] = abs(protons)
        count = len(mixture.phases)
        unknown = np.full(count + len(mixture.components), np.nan)
        return np.concatenate([[np.nan, np.nan], species, np.zeros(count), unknown])

    def _run_scaled(self, table: FloatArray, allowed: BoolArray) -> FloatArray | None:
        """Answers (n, ...) of rows, traces of a solution by about a kilogram of it; ``None``: one has no answer.

        The factors are powers of two, so that no amount is rounded.
        """
        water = np.maximum(table[:, -2] * WATER_KG_MOL, 1e-300)
        factors = np.where(water < LEAST_WATER_KG, np.exp2(-np.floor(np.log2(water))), 1.0)[:, None]
        scaled = table.copy()
        scaled[:, :-1] *= factors
        answers = self._run_phreeqc(scaled, allowed)
        if answers is not None:
            _, species, phases, _, _ = self._columns()
            answers[:, species] /= factors
            answers[:, phases] /= factors
        return answers

    def _run_phreeqc(self, table: FloatArray, allowed: BoolArray) -> FloatArray | None:
        """Answers (n, ...) of rows by PHREEQC; ``None``: it found none for one of them."""
        mixture, library = self.mixture, self._loaded_library()
        text = self._solution_text(table, allowed)
        assert self._folder is not None
        # Where PHREEQC finds no answer it leaves a file in the current folder, and has no other way to say where.
        with chdir(self._folder.name):
            if library.RunString(text):
                return None
        columns = library.GetSelectedOutput()
        state_of_answer = "react" if allowed.any() else "i_soln"
        rows = [row for row, state in enumerate(columns["state"]) if state == state_of_answer]
        if len(rows) != len(table):
            return None

        def column(name: str) -> FloatArray:
            values = columns[name]
            return np.array([values[row] for row in rows], dtype=np.float64)

        water = column("mass_H2O")
        columns_of_answer = [column("pH"), column("mu")]
        columns_of_answer += [column(f"m_{mixture.names[entry.name]}(mol/kgw)") * water for entry in mixture.species]
        columns_of_answer += [column(phase_name(row)) for row in range(len(mixture.phases))]
        columns_of_answer += [column(f"si_{phase_name(row)}") for row in range(len(mixture.phases))]
        unknown = np.full(len(rows), np.nan)
        columns_of_answer += [unknown if name is None else column(f"la_{name}") for name in mixture.bare_names]
        return np.array(columns_of_answer).T

    def _solution_text(self, table: FloatArray, allowed: BoolArray) -> str:
        """The text that asks for compositions."""
        mixture = self.mixture
        totals = table[:, : len(mixture.components)]
        # Hydroxide is counted as water less a proton, and is none.
        water = (table[:, -2] + np.minimum(0.0, totals[:, 0])) * WATER_KG_MOL
        initial_solids = np.array([self._initial_phases(row, allowed) for row in totals]) if allowed.any() else None
        dissolved = totals if initial_solids is None else totals - initial_solids @ mixture.uses
        molal = dissolved[:, 1:] / water[:, None]
        acid = dissolved[:, 0] / water
        guess = np.where(acid > 1e-3, np.clip(-np.log10(np.maximum(acid, 1e-300)), 1.0, 4.0), 7.0)
        guess = np.where(acid < -1e-3, 11.0, guess)
        # What a scene declares of ions may be charged: an ion that does nothing stands against it.
        charge = totals @ mixture.charges / water
        neutral = np.abs(charge) <= 1e-13 * (np.abs(totals) @ np.abs(mixture.charges)) / water
        columns = zip(
            molal.tolist(),
            water.tolist(),
            table[:, -1].tolist(),
            guess.tolist(),
            np.where(neutral, 0.0, charge).tolist(),
            strict=True,
        )
        lines: list[str] = []
        for number, (amounts, kilograms, celsius, ph, excess) in enumerate(columns, start=1):
            lines.append(
                f"SOLUTION {number}\n temp {celsius!r}\n units mol/kgw\n water {kilograms!r}\n pH {ph!r} charge"
            )
            lines += [
                f" {symbol} {amount!r}"
                for symbol, amount in zip(mixture.symbols, amounts, strict=True)
                if amount > LEAST_MOLAL
            ]
            if excess:
                lines.append(f" {'Zn' if excess > 0.0 else 'Zp'} {abs(excess)!r}")
            if initial_solids is not None:
                lines.append(f"EQUILIBRIUM_PHASES {number}")
                lines += [
                    f" {phase_name(index)} {self._phase_targets[index]:g} {initial_solids[number - 1, index].item()!r}"
                    for index in np.flatnonzero(allowed).tolist()
                ]
                lines.append("END")
        return "\n".join([*lines, "END", ""])

    def _initial_phases(self, totals: FloatArray, allowed: BoolArray) -> FloatArray:
        """Mol (p,) of each phase that PHREEQC starts with: nearly all there could be, one after the other."""
        remaining_totals, started = totals.copy(), np.zeros(len(self.mixture.phases))
        for index, uses in enumerate(self.mixture.uses):
            taking = uses[1:] > 0.0
            gas = self.mixture.phases[index].column.endswith("(g)")
            if taking.any() and not gas and allowed[index]:
                started[index] = FIRST_SOLID_FRACTION * max(
                    0.0, float((remaining_totals[1:][taking] / uses[1:][taking]).min())
                )
                remaining_totals = remaining_totals - started[index] * uses
        return started

    def _loaded_library(self) -> Any:
        if self._library is None:
            import phreeqc

            library = phreeqc.Phreeqc()
            mixture = self.mixture
            names = " ".join(mixture.names[entry.name] for entry in mixture.species)
            bare = " ".join(name for name in mixture.bare_names if name is not None)
            phases = " ".join(phase_name(row) for row in range(len(mixture.phases)))
            output = (
                f"KNOBS\n -convergence_tolerance {SUM_TOLERANCE}\n -iterations 400\n"
                "SELECTED_OUTPUT 1\n -reset false\n -state true\n -pH true\n -ionic_strength true\n -water true\n"
                f" -high_precision true\n -molalities {names}\n -activities {bare}\n"
            )
            if phases:
                output += f" -equilibrium_phases {phases}\n -saturation_indices {phases}\n"
            if library.LoadDatabaseString(phreeqc_data(mixture)) or library.RunString(output + "END\n"):
                raise EffectError(f"PHREEQC refuses the scene's chemistry: {library.GetErrorString().strip()}")
            self._library = library
            self._folder = TemporaryDirectory()
        return self._library


def has_answer(equilibrium: Equilibrium) -> BoolArray:
    """(n,) rows for which PHREEQC has an answer."""
    return ~np.isnan(equilibrium.ph)
