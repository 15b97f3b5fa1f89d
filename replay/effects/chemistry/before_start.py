"""Events of what reacted before the first frame: what stands together at first has come to rest by then."""

from collections.abc import Collection, Iterator
from typing import Final

from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.output import EffectEvent
from replay.words import quantity

LEAST_MOL: Final = 1e-6
"""Of a gas or a reaction that nobody notices: a bubble of 0.02 mL."""

LEAST_G: Final = 1e-3
"""Of a solid that nobody sees."""

BEFORE_CLAUSE: Final = "before the recording begins"


def reacted_before(matter: Matter, followed: Collection[str]) -> Iterator[EffectEvent]:
    """An event ``before`` for each gas that left, solid that fell out and equation that ran before the first frame.

    ``followed``: solids that an effect precipitation tells.
    """
    ledger = matter.ledger
    for vessel, history in matter.histories.items():
        contents = matter.recipe.contents.get(vessel)
        sentences: list[tuple[str, dict[str, float | str]]] = []
        for column, index in ledger.column.items():
            moles = float(history.amounts[0, index])
            formula = column[: -len(GAS)]
            if column.endswith(GAS) and moles > LEAST_MOL:
                sentence = f"{quantity(1e3 * moles, 'mmol')} {formula} have left {vessel} as gas {BEFORE_CLAUSE}"
                sentences.append((sentence, {"formula": formula, "moles": moles}))
        for index in (*ledger.reactions.phases.tolist(), *ledger.reactions.salt_columns.tolist()):
            column = ledger.columns[index]
            formula = column.removesuffix(SOLID)
            brought_mol = contents.solids.get(formula, 0.0) if contents else 0.0
            moles = float(history.amounts[0, index]) - brought_mol
            if column.endswith(SOLID) and formula not in followed and moles * molar_mass(formula) > LEAST_G:
                mass = quantity(moles * molar_mass(formula), "g")
                sentence = f"{mass} {formula} have fallen out in {vessel} {BEFORE_CLAUSE}"
                sentences.append((sentence, {"formula": formula, "moles": moles}))
        for reaction in matter.recipe.reactions:
            moles = float(history.extents[0, reaction.process]) if reaction.process >= 0 else 0.0
            if moles > LEAST_MOL:
                equation = reaction.declared["equation"]
                sentence = f"{equation} has run in {vessel} {BEFORE_CLAUSE}, by {quantity(1e3 * moles, 'mmol')}"
                sentences.append((sentence, {"equation": equation, "moles": moles}))
        for sentence, values in sentences:
            yield EffectEvent(float(history.times[0]), "before", (vessel,), None, values, sentence)
