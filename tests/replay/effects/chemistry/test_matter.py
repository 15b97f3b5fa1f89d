"""When a vessel counts as mixed, and which heats of dilution the ledger follows."""

from types import SimpleNamespace

import numpy as np

from replay.effects.chemistry.contents import Contents
from replay.effects.chemistry.matter import Matter, dilution_of

TIMES = np.array([0.0, 0.1, 0.2, 0.3, 2.0])
FILLING = np.array([0.0, 1.0, 2.0, 3.0, 3.0])
"""mL at the times: one more by each of 0.1, 0.2 and 0.3 s, and then nothing."""


def mixed_at(contents, times=TIMES, volume_ml=FILLING):
    """Whether a vessel with these contents at first is mixed at each time."""
    recipe = SimpleNamespace(contents={} if contents is None else {"a": contents})
    history = SimpleNamespace(times=TIMES)
    return Matter(recipe, ledger=None, vessels={}, histories={"a": history}).is_mixed("a", times, volume_ml).tolist()


def test_vessel_without_a_dry_solid_is_always_mixed():
    """A vessel counts as mixed while no dry solid lies in it that water, which is still coming in, has yet to wet.

    Three millilitres come until 0.3 s, and none from then to 2 s, the last of five times; none of these vessels has a
    dry solid at first, so all five are mixed.
    """
    for case, contents in {
        "contents not known": None,
        "solid in 5 mL of water": Contents(volume_ml=5.0, amounts={}, solids={"NaCl": 1.0}, solubility={}),
        "empty": Contents(volume_ml=0.0, amounts={}, solids={}, solubility={}),
    }.items():
        assert mixed_at(contents) == [True] * 5, case


def test_dry_solid_is_mixed_at_start_and_after_the_inflow():
    """A dry solid gets a millilitre of water by each of 0.1, 0.2 and 0.3 s, and none until 2 s.

    At 0.1 and 0.2 s some of it is still to be wetted. Of the rows at 0.1 and 0.2 s alone the last counts as mixed.
    """
    dry = Contents(volume_ml=0.0, amounts={}, solids={"NaCl": 1.0}, solubility={})
    assert mixed_at(dry) == [True, False, False, True, True]
    assert mixed_at(dry, times=TIMES[1:3], volume_ml=FILLING[1:3]) == [False, True]


def test_phreeqc_replaces_dilution_heats_beyond_fifty_mol_of_water():
    """J per mol of sulfuric acid by mol of water, of Felder and Rousseau's table, which goes on beyond 50 mol.

    With PHREEQC it ends at 50 mol, as that has the heat of sulfate ions in much water. Without acid there is no table.
    """
    table, table_with_phreeqc = (dilution_of("H2SO4", has_phreeqc=present) for present in (False, True))
    assert max(table) > 50.0
    assert table_with_phreeqc == {water: joule for water, joule in table.items() if water <= 50.0}
    assert dilution_of("", has_phreeqc=True) == {}
