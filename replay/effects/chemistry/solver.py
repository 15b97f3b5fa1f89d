"""Asks PHREEQC what a solution comes to; what it has answered once it is not asked again."""

from collections.abc import Sequence
from contextlib import chdir
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray
from replay.effects.chemistry.mixture import Mixture, phase_name, phreeqc_data
from replay.errors import EffectError

WATER_KG_MOL: Final = 0.0180153
"""Molar mass of water, kg/mol. Source: IUPAC 2021."""

COLDEST_C, HOTTEST_C = 0.0, 100.0
"""Temperatures between which PHREEQC is asked: liquid water."""

AT_ONCE: Final = 256
"""Compositions in one call."""

STANDING: Final = 0.999
"""Share of what could be solid that PHREEQC starts with as solid: no start is far beyond saturation."""

LEAST: Final = 1e-25
"""mol/kg below which nothing is left of a part."""

TOLERANCE: Final = 1e-12
"""Of PHREEQC's sums, as a share."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What there is of rows: ``species`` (n, s) and ``phases`` (n, p) in mol, ``ph`` and ``ionic`` (n,), mol/kg.

    Of a row for which PHREEQC has no answer ``ph`` is NaN, and all is thought bare ions.
    """

    species: FloatArray
    phases: FloatArray
    ph: FloatArray
    ionic: FloatArray


class Solver:
    """PHREEQC with the data of one mixture. Raises EffectError: it is not installed, or refuses the data."""

    def __init__(self, mixture: Mixture) -> None:
        self.mixture = mixture
        self.asked = 0  # compositions that PHREEQC was asked for
        self.unanswered = 0
        self.remember = True
        self._answers: dict[bytes, FloatArray] = {}
        self._library: Any = None

    def equilibrium(self, totals: FloatArray, water_mol: FloatArray, celsius: FloatArray) -> Equilibrium:
        """Amounts at equilibrium of mixtures in rows.

        ``totals`` : (n, m) mol of each part, dissolved and in phases together; below 0 only the first, ``H+``.
        ``water_mol`` : (n,) mol of water, above 0; ``celsius`` : (n,).
        """
        table = np.column_stack([np.maximum(totals, np.where(np.arange(totals.shape[1]) == 0, -np.inf, 0.0)),
                                 water_mol, np.clip(celsius, COLDEST_C, HOTTEST_C)])  # fmt: skip
        keys = [row.tobytes() for row in table]
        missing = {key: row for row, key in enumerate(keys) if key not in self._answers}
        rows = list(missing.values())
        for start in range(0, len(rows), AT_ONCE):
            chosen = rows[start : start + AT_ONCE]
            for row, answer in zip(chosen, self._ask(table[chosen]), strict=True):
                self._answers[keys[row]] = answer
        answers = np.array([self._answers[key] for key in keys]).reshape(len(keys), -1)
        if not self.remember:
            self._answers.clear()
        species = len(self.mixture.species)
        return Equilibrium(answers[:, 2 : 2 + species], answers[:, 2 + species :], answers[:, 0], answers[:, 1])

    def _ask(self, table: FloatArray) -> Sequence[FloatArray]:
        """Answers (pH, ionic strength, species, phases) of rows; those that fail together are asked one by one."""
        self.asked += len(table)
        found = self._run(table)
        if found is not None:
            return list(found)
        if len(table) == 1:
            self.unanswered += 1
            return [self._bare(table[0])]
        answers = [self._run(table[row : row + 1]) for row in range(len(table))]
        self.unanswered += sum(one is None for one in answers)
        return [self._bare(table[row]) if one is None else one[0] for row, one in enumerate(answers)]

    def _bare(self, row: FloatArray) -> FloatArray:
        """All as bare ions: no pH."""
        mixture = self.mixture
        species = np.zeros(len(mixture.species))
        for place, entry in enumerate(mixture.species):
            if len(entry.makeup) == 1 and set(entry.makeup.values()) == {1.0}:
                species[place] = row[mixture.parts.index(next(iter(entry.makeup)))]
        return np.concatenate([[np.nan, np.nan], species, np.zeros(len(mixture.phases))])

    def _run(self, table: FloatArray) -> FloatArray | None:
        """Answers (n, 2 + s + p) of rows by PHREEQC; ``None``: it found none for one of them."""
        mixture, library = self.mixture, self._phreeqc()
        text = [self._row(number, row) for number, row in enumerate(table, start=1)]
        if _without_its_file(library, "".join(text)):
            return None
        columns = library.GetSelectedOutput()
        wanted = "react" if mixture.phases else "i_soln"
        rows = [row for row, state in enumerate(columns["state"]) if state == wanted]
        if len(rows) != len(table):
            return None
        water = np.array([columns["mass_H2O"][row] for row in rows])
        found = [[columns[name][row] for row in rows] for name in ("pH", "mu")]
        for entry in mixture.species:
            values = columns[f"m_{mixture.names[entry.name]}(mol/kgw)"]
            found.append(np.array([values[row] for row in rows]) * water)
        for number in range(len(mixture.phases)):
            values = columns[phase_name(number)]
            found.append([values[row] for row in rows])
        return np.array(found, dtype=np.float64).T

    def _row(self, number: int, row: FloatArray) -> str:
        """The text that asks for one composition."""
        mixture = self.mixture
        totals = row[: len(mixture.parts)]
        # Hydroxide is counted as water less a proton, and is none.
        water = (float(row[-2]) + min(0.0, float(totals[0]))) * WATER_KG_MOL
        solid = self._start(totals)
        dissolved = totals - solid @ mixture.uses
        lines = [f"SOLUTION {number}", f" temp {float(row[-1])!r}", " units mol/kgw", f" water {water!r}"]
        lines.append(f" pH {self._guess(dissolved, water)!r} charge")
        molal = dissolved[1:] / water
        for symbol, amount in zip(mixture.symbols, molal.tolist(), strict=True):
            if amount > LEAST:
                lines.append(f" {symbol} {amount!r}")
        # What a scene declares of ions may be charged: an ion that does nothing stands against it.
        charge = float(totals @ mixture.charges) / water
        if abs(charge) > 1e-13 * float(np.abs(totals) @ np.abs(mixture.charges)) / water:
            lines.append(f" {'Zn' if charge > 0.0 else 'Zp'} {abs(charge)!r}")
        if mixture.phases:
            lines.append(f"EQUILIBRIUM_PHASES {number}")
            lines += [f" {phase_name(place)} 0 {amount!r}" for place, amount in enumerate(solid.tolist())]
        return "\n".join([*lines, "END", ""])

    def _start(self, totals: FloatArray) -> FloatArray:
        """Mol (p,) of each phase that PHREEQC starts with: nearly all there could be, one after the other."""
        left, found = totals.copy(), np.zeros(len(self.mixture.phases))
        for place, uses in enumerate(self.mixture.uses):
            taking = uses[1:] > 0.0
            gas = self.mixture.phases[place].column.endswith("(g)")
            if taking.any() and not gas:
                found[place] = STANDING * max(0.0, float((left[1:][taking] / uses[1:][taking]).min()))
                left = left - found[place] * uses
        return found

    def _guess(self, totals: FloatArray, water: float) -> float:
        """A pH to start from, by the protons that no base takes."""
        molal = float(totals[0]) / water
        if molal > 1e-3:
            return max(1.0, min(4.0, -float(np.log10(molal))))
        return 11.0 if molal < -1e-3 else 7.0

    def _phreeqc(self) -> Any:
        if self._library is None:
            import phreeqc

            library = phreeqc.Phreeqc()
            mixture = self.mixture
            names = " ".join(mixture.names[entry.name] for entry in mixture.species)
            phases = " ".join(phase_name(row) for row in range(len(mixture.phases)))
            output = (
                f"KNOBS\n -convergence_tolerance {TOLERANCE}\n -iterations 400\n"
                "SELECTED_OUTPUT 1\n -reset false\n -state true\n -pH true\n -ionic_strength true\n -water true\n"
                f" -high_precision true\n -molalities {names}\n"
            )
            if phases:
                output += f" -equilibrium_phases {phases}\n"
            if library.LoadDatabaseString(phreeqc_data(mixture)) or library.RunString(output + "END\n"):
                raise EffectError(f"PHREEQC refuses the scene's chemistry: {library.GetErrorString().strip()}")
            self._library = library
        return self._library


def _without_its_file(library: Any, text: str) -> int:
    """Number of errors of a run; the file that PHREEQC leaves in the current folder when it finds no answer is none.

    That folder is another one only while PHREEQC works: it has no other way of saying where the file goes.
    """
    with TemporaryDirectory() as folder, chdir(folder):
        return int(library.RunString(text))


def answered(equilibrium: Equilibrium) -> BoolArray:
    """(n,) rows for which PHREEQC has an answer."""
    return ~np.isnan(equilibrium.ph)
