"""When a vessel counts as mixed, and which heats of dilution the ledger follows."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.chemistry.contents import Contents
from replay.effects.chemistry.matter import Matter, dilution_of

TIMES = np.array([0.0, 0.1, 0.2, 0.3, 2.0])
FILLING = np.array([0.0, 1.0, 2.0, 3.0, 3.0])
"""mL at the times: a millilitre comes by each of the first four, and then nothing."""


def mixed(contents, times=TIMES, volume_ml=FILLING):
    """Whether a vessel with these contents at first is mixed at each time."""
    recipe = SimpleNamespace(contents={} if contents is None else {"a": contents})
    history = SimpleNamespace(times=TIMES)
    return Matter(recipe, ledger=None, vessels={}, histories={"a": history}).is_mixed("a", times, volume_ml).tolist()


@pytest.mark.parametrize(
    "contents",
    [
        None,
        Contents(volume_ml=5.0, amounts={}, solids={"NaCl": 1.0}, solubility={}),
        Contents(volume_ml=0.0, amounts={}, solids={}, solubility={}),
    ],
)
def test_vessel_without_a_dry_solid_is_always_mixed(contents):
    """Nothing is known of its contents; a solid stands in 5 mL of water; or it is empty."""
    assert mixed(contents) == [True] * 5


def test_dry_solid_is_mixed_at_start_and_after_the_inflow():
    """Water comes until 0.3 s: in the rows 0.1 and 0.2 s some of the solid is still to be wetted."""
    dry = Contents(volume_ml=0.0, amounts={}, solids={"NaCl": 1.0}, solubility={})
    assert mixed(dry) == [True, False, False, True, True]
    assert mixed(dry, TIMES[1:3], FILLING[1:3]) == [False, True], "of a part its last row counts, not its first"


def test_phreeqc_replaces_dilution_heats_beyond_fifty_mol_of_water():
    """PHREEQC has the heat of sulfate ions in much water; Felder and Rousseau's table has both."""
    tabled, beside_phreeqc = (dilution_of("H2SO4", has_phreeqc=known) for known in (False, True))
    assert max(tabled) > 50.0 and beside_phreeqc == {water: joule for water, joule in tabled.items() if water < 51.0}
    assert dilution_of("", has_phreeqc=True) == {}
