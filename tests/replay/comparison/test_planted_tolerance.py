"""Contacts and gaps of less than tau, and a detector that decides them the other way: excused to the frame, and shown.

Unit cubes in a row: b one metre right of a, c one metre left, each a little less or more. Rounding up moves b away from
a (to 1.000002 m where it cut up to 1 micrometre deep) and c towards it (to 0.999999 m from up to 2 micrometres off).
"""

import numpy as np
import pytest
from support.small_worlds import cubes

import replay

RIGHT = [0.4e-6, 0.9e-6, 2.5e-6, 1e-3, 1e-3, 1e-3, 0.9e-6, 0.4e-6, -1e-3, -1e-3]
"""How deep b is in a; below 0 apart."""
LEFT = [-1e-3, -0.9e-6, -0.4e-6, 1e-3, 1e-3, 1e-3, 1e-3, -0.4e-6, -1.5e-6, -1e-3]
"""How deep c is in a."""


def planted(right=RIGHT, left=LEFT):
    return cubes({"a": [0] * len(right), "b": 1 - np.array(right), "c": np.array(left) - 1})


def audited(**changed):
    return replay.audit(planted(), detectors="it=support.planted_detectors:Rounding", **changed)


def test_what_rounding_by_less_than_tau_changed_is_excused_frame_by_frame():
    found = audited()
    frames = found.summary["it"]["pair_frames"]
    assert (frames["WITHIN_TOLERANCE"], frames["MISSED"], frames["INVENTED"]) == (4 + 4, 0, 0)
    assert (frames["BOTH"], frames["NEITHER"]) == (4 + 4, 2 + 2 + 10)
    assert not found.results[0].misses["it"] and found.summary["it"]["episodes"]["missed"] == 0


@pytest.mark.parametrize(
    ("tau", "excused", "missed", "invented"), [(1.2e-6, 7, 0, 1), (0.42e-6, 4, 2, 2), (0.0, 0, 4, 4)]
)
def test_a_smaller_tau_excuses_only_what_it_holds(tau, excused, missed, invented):
    frames = audited(tau=tau).summary["it"]["pair_frames"]
    assert (frames["WITHIN_TOLERANCE"], frames["MISSED"], frames["INVENTED"]) == (excused, missed, invented)
