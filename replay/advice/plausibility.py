"""The alternative of an import's guess that is clearly more like a real scene, if one is.

Nothing that rests stands deep in what it rests on: that alone tells a wrong reading. Bodies that move pass through each
other in virtual reality. Bodies that touch while they are carried, that touch where they rest, or that touch at all are
no more frequent under the right reading: in half of the experiments nothing touches
(tests/replay/advice/test_plausibility.py).
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from replay.advice.scene_outcome import Outcome
from sessions import Session
from sessions.importers.unstated_units import LARGEST_RADIUS_M, SMALLEST_RADIUS_M
from sessions.meshes.mesh_match import UNITS
from sessions.model.assumption import Assumption

MOST_DEEP_FRACTION: Final = 0.3
"""Fraction of the contact frames of resting bodies, at most, in which they are deep in each other if it is right."""

LEAST_DEEP_FRACTION: Final = 0.5
"""The same fraction, at least, of a reading that is clearly wrong."""


def plausible_length_unit(session: Session, row: Assumption) -> str:
    """Returns the only unit of lengths with which the farthest pose of a recording is in a room, or ``""``."""
    positions = session.frames.position
    distances = np.linalg.norm(positions[np.isfinite(positions).all(axis=2)], axis=1)
    farthest_in_units = float(distances.max(initial=0.0)) / UNITS[row.value]
    fitting_units = [
        unit for unit in row.alternatives if SMALLEST_RADIUS_M <= farthest_in_units * UNITS[unit] <= LARGEST_RADIUS_M
    ]
    return fitting_units[0] if len(fitting_units) == 1 else ""


def more_plausible(outcome_of_value: Mapping[str, Outcome]) -> str:
    """Returns the value under which resting bodies are seldom deep in each other, but often under all others.

    ``""``: there is none, or no other to compare with. A reading without a contact is as plausible as one with shallow
    contacts.
    """
    plausible_values = [
        value for value, outcome in outcome_of_value.items() if outcome.deep_at_rest <= MOST_DEEP_FRACTION
    ]
    implausible_values = [
        value for value, outcome in outcome_of_value.items() if outcome.deep_at_rest >= LEAST_DEEP_FRACTION
    ]
    if len(plausible_values) == 1 and implausible_values and len(implausible_values) == len(outcome_of_value) - 1:
        return plausible_values[0]
    return ""
