"""Temperatures as series and events, of a flame and of liquids alike."""

import numpy as np
from numpy.typing import NDArray

from replay.effects.chemistry.warming import WATER_BOILS_C
from replay.effects.declaring import Declaration
from replay.effects.output import EffectEvent, Findings, Series


def note_temperature(
    findings: Findings, name: str, celsius: Series, boils_c: float, is_wet: NDArray[np.bool_] | None = None
) -> None:
    """The series, and an event when it first reaches its boiling point.

    ``is_wet``: whether there is a liquid to boil, as many as values; ``None``: always.
    """
    findings.series[f"{name}/temperature"] = celsius
    is_boiling = celsius.values >= boils_c
    for row in np.flatnonzero(is_boiling if is_wet is None else is_boiling & is_wet)[:1].tolist():
        text = f"{name} reaches {boils_c:g} degC and boils: it gets no hotter, what boils off is not computed"
        findings.events.append(EffectEvent(float(celsius.times[row]), "boil", (name,), None, {}, text, "warning"))


def boils(declared: Declaration) -> float:
    """Boiling point of what a flame heats without a ledger, as declared; else it never boils."""
    return np.inf if declared["boils_c"] is None else float(declared["boils_c"])


def liquid_boils(declared: Declaration) -> float:
    """Boiling point of liquids: as declared, else that of water."""
    return WATER_BOILS_C if declared["boils_c"] is None else float(declared["boils_c"])
