"""Contents of each vessel after all that was poured and run in: perfectly mixed, volumes added."""

import numpy as np

from replay.effects.chemistry.ledger_columns import ADDED_SUFFIX
from replay.effects.chemistry.matter import matter_of
from replay.effects.chemistry.recipe_checks import check_chemistry
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectOutput, Findings, Series
from replay.effects.protocol import spec_of


def compute(inputs: EffectInputs) -> EffectOutput:
    """Volume, concentrations as if nothing reacted and level of each vessel wherever they change."""
    matter, findings = matter_of(inputs), Findings(len(inputs))
    for name in dict.fromkeys(name for declared in inputs.declared for name in declared["in"]):
        history = matter.histories[name]
        changed_rows = np.flatnonzero(np.diff(history.volume_ml, prepend=matter.vessels[name].volume_ml))
        findings.ran[history.frames[changed_rows]] = True
        findings.series[f"{name}/volume"] = Series(history.times, history.volume_ml, "mL")
        litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.nan)
        for column in matter.ledger.columns:
            amount = matter.amount(name, column)
            if column.endswith(ADDED_SUFFIX) and amount.any():
                findings.series[f"{name}/{column}"] = Series(history.times, amount / litres, "mol/L")
        findings.liquids[name] = matter.vessels[name].liquid_to_draw(history.times, history.volume_ml)
    return findings.output()


SPEC = spec_of("mixing", compute, check_all=check_chemistry)
