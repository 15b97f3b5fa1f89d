"""Solids that a solution is supersaturated with although no table names them, and old ones in place of fresh ones."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from replay import words
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.limits import NEUTRAL_PH
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import SOLID, Phase, mixture_of
from replay.effects.chemistry.recipe import undeclared_phases
from replay.effects.chemistry.solver import Solver
from replay.effects.output import EffectEvent

EXAMINED_ROWS: Final = 24
"""Compositions of a vessel that are examined, evenly over its history."""

LEAST_SATURATION_INDEX: Final = 0.3
"""Saturation index, log10, from which a solid counts: twice its product; constants are hardly known better."""


LEAST_AGED_FRACTION: Final = 0.01
"""Share of the copper that is left as hydroxide, from which it is told."""

LEAST_FRESH_FRACTION: Final = 0.05
"""Share of the aluminium that ammonia keeps dissolved, from which it is told."""

LYE_PH: Final = 11.5
"""From which on aluminium hydroxide dissolves in textbooks too."""


BASIC_SALTS: Final = {"SO4^2-": "Cu4(OH)6SO4", "NO3-": "Cu2(OH)3NO3", "Cl-": "Cu2(OH)3Cl"}
"""Anion -> basic salt of copper that ammonia brings down first."""


def aged_hydroxide_events(matter: Matter) -> Iterator[EffectEvent]:
    """Events ``aged`` of copper hydroxide that outlasts ammonia, ``fresh`` of aluminium hydroxide that does not."""
    yield from _fresh_aluminium(matter)
    ledger = matter.ledger
    column_names = ("Cu(OH)2(s)", "Cu^2+", "NH3")
    if not set(column_names) <= set(ledger.column):
        return
    for vessel, history in matter.histories.items():
        hydroxide, copper, ammonia = (matter.amount(vessel, name)[-1] for name in column_names)
        basic_salt = _basic_salt(matter, vessel)
        if (
            basic_salt
            and hydroxide > LEAST_AGED_FRACTION * (hydroxide + copper)
            and ammonia > 4.0 * (hydroxide + copper)
        ):
            is_named = basic_salt + SOLID in ledger.column
            advice = f"name {basic_salt} alone and not Cu(OH)2" if is_named else "name that solid instead"
            message = (
                f"Cu(OH)2 is left in {vessel} beside ammonia, as aged hydroxide is; what falls out of this copper salt "
                f"at first is {basic_salt}, which dissolves in less ammonia: {advice}"
            )
            event_values: dict[str, float | str] = {"formula": "Cu(OH)2", "moles": float(hydroxide)}
            yield EffectEvent(float(history.times[-1]), "aged", (vessel,), None, event_values, message, "warning")


def _fresh_aluminium(matter: Matter) -> Iterator[EffectEvent]:
    """An event for each vessel in which ammonia keeps aluminium dissolved, as it does of the fresh hydroxide alone."""
    if matter.solver is None or not {"Al(OH)3(s)", "NH3"} <= set(matter.ledger.column):
        return
    for vessel, history in matter.histories.items():
        solid, dissolved, ammonia = (matter.amount(vessel, name)[-1] for name in ("Al(OH)3(s)", "Al^3+", "NH3"))
        if ammonia <= dissolved + solid or dissolved <= LEAST_FRESH_FRACTION * (dissolved + solid):
            continue
        _, equilibria = matter.equilibria(vessel, history.times[-1:])
        if len(equilibria.ph) and NEUTRAL_PH < equilibria.ph[0] < LYE_PH:
            percent = 100.0 * dissolved / (dissolved + solid)
            text = (
                f"{words.decimal(percent, 0)} % of the aluminium stays dissolved in {vessel} at pH "
                f"{words.decimal(float(equilibria.ph[0]), 1)}, as of Al(OH)3 that has just fallen out; when it ages it "
                "dissolves 30 times less, and ammonia leaves it"
            )
            values: dict[str, float | str] = {"formula": "Al(OH)3", "moles": float(dissolved)}
            yield EffectEvent(float(history.times[-1]), "fresh", (vessel,), None, values, text, "warning")


def _basic_salt(matter: Matter, vessel: str) -> str:
    """The basic salt that falls out of copper in a vessel in place of hydroxide, beside ammonia; ``""``: none."""
    if not matter.amount(vessel, "NH3").any():
        return ""
    return next((salt for anion, salt in BASIC_SALTS.items() if matter.amount(vessel, anion).any()), "")


def supersaturation_events(matter: Matter) -> Iterator[EffectEvent]:
    """An event ``supersaturated`` for each vessel and solid that would fall out there, and that no table names."""
    phases = undeclared_phases(matter.recipe)
    if not phases:
        return
    assert matter.solver is not None  # without one no phase is known
    ledger, mixture = matter.ledger, matter.solver.mixture
    solver = Solver(mixture_of(mixture.database, mixture.components, phases))
    columns = [ledger.column[name] for name in solver.mixture.components]
    for vessel, history in matter.histories.items():
        is_wet = (history.volume_ml > 0.0) & (history.amounts[:, ledger.water] > 0.0)
        is_mixed = history.added_ml[-1].any() or bool(matter.recipe.contents[vessel].solids) or matter.is_still
        rows = np.flatnonzero(is_wet) if is_mixed else np.zeros(0, dtype=np.int64)
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, EXAMINED_ROWS).astype(np.int64))] if len(rows) else rows
        if not len(rows):
            continue
        amounts = history.amounts[rows]
        celsius = matter.celsius(vessel, history.times[rows])
        indices = solver.saturation(amounts[:, columns], amounts[:, ledger.water], celsius)
        metals_of_salts = {
            name
            for phase, values in zip(phases, indices.T, strict=True)
            if len(_solutes(phase)) > 1 and (values > LEAST_SATURATION_INDEX).any()
            for name in _solutes(phase)
        }
        for phase, values in zip(phases, indices.T, strict=True):
            # What takes the metal away leaves its oxide or hydroxide none to be beyond its solubility.
            if len(_solutes(phase)) == 1 and _solutes(phase) <= metals_of_salts:
                continue
            saturated_rows = np.flatnonzero(values > LEAST_SATURATION_INDEX)
            solid = phase.column.removesuffix(SOLID)
            if solid == "Cu(OH)2":
                solid = _basic_salt(matter, vessel) or solid
            if not len(saturated_rows) or solid + SOLID in ledger.column:
                continue
            message = (
                f"{solid} is beyond its solubility in {vessel}, and no effect lets it fall out: it stays dissolved. "
                f'To let it fall out, add [[effect]] kind = "precipitation", solid = "{solid}"'
            )
            event_values: dict[str, float | str] = {
                "formula": solid,
                "saturation_index": float(values[saturated_rows].max()),
            }
            time = float(history.times[rows[saturated_rows[0]]])
            yield EffectEvent(time, "supersaturated", (vessel,), None, event_values, message, "warning")


def _solutes(phase: Phase) -> set[str]:
    """Columns that a solid is made of, but for protons and water: the metal alone of an oxide or hydroxide."""
    return set(phase.components) - {PROTON, WATER}
