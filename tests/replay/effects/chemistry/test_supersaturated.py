"""Hydroxides that ammonia dissolves fresh and not aged are told, by what stands in a vessel at its end."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.chemistry.supersaturated import aged_hydroxide_events


def matter(ph=9.5, **mol):
    """A vessel in which so many mol of each column stand at the end."""
    return SimpleNamespace(
        histories={"flask": SimpleNamespace(times=np.array([0.0, 2.0]))},
        ledger=SimpleNamespace(column=dict.fromkeys(mol, 0)),
        solver=object(),
        amount=lambda vessel, column: np.array([0.0, mol.get(column, 0.0)]),
        equilibria=lambda vessel, times: (None, SimpleNamespace(ph=np.array([ph]))),
    )


@pytest.mark.parametrize(
    ("solid", "dissolved", "ammonia", "ph", "percent"),
    [
        (0.5, 0.5, 2.0, 9.5, "50 %"), (0.9, 0.1, 1.1, 9.5, "10 %"), (0.5, 0.5, 0.9, 9.5, ""),
        (0.97, 0.03, 2.0, 9.5, ""),
        (0.5, 0.5, 2.0, 6.5, ""), (0.5, 0.5, 2.0, 12.0, ""),
    ],
    ids=["half", "a tenth", "little ammonia", "hardly any dissolved", "acid", "lye"],
)  # fmt: skip
def test_aluminium_that_ammonia_keeps_dissolved_is_fresh(solid, dissolved, ammonia, ph, percent):
    amounts = {"Al(OH)3(s)": solid, "Al^3+": dissolved, "NH3": ammonia}
    texts = [event.text for event in aged_hydroxide_events(matter(ph, **amounts)) if event.name == "fresh"]
    assert len(texts) == bool(percent) and all(text.startswith(f"{percent} of the aluminium") for text in texts)


def test_aluminium_is_not_fresh_where_nobody_knows_the_ph():
    contents = matter(**{"Al(OH)3(s)": 0.5, "Al^3+": 0.5, "NH3": 2.0})
    contents.solver = None
    assert list(aged_hydroxide_events(contents)) == []


@pytest.mark.parametrize(
    ("hydroxide", "copper", "ammonia", "anion", "salt"),
    [
        (0.5, 0.5, 5.0, "SO4^2-", "Cu4(OH)6SO4"), (0.5, 0.5, 5.0, "NO3-", "Cu2(OH)3NO3"), (0.5, 0.5, 5.0, "F-", ""),
        (0.5, 0.5, 3.0, "SO4^2-", ""), (0.005, 0.995, 5.0, "SO4^2-", ""), (0.02, 0.98, 5.0, "SO4^2-", "Cu4(OH)6SO4"),
        (0.5, 0.5, 0.0, "SO4^2-", ""),
    ],
)  # fmt: skip
def test_copper_hydroxide_left_beside_much_ammonia_is_aged(hydroxide, copper, ammonia, anion, salt):
    """In mol: 5 of ammonia are much, 3 are not; hydroxide of 1 in 200 of the copper is no remnant."""
    amounts = {"Cu(OH)2(s)": hydroxide, "Cu^2+": copper, "NH3": ammonia, anion: 1.0}
    texts = [event.text for event in aged_hydroxide_events(matter(**amounts)) if event.name == "aged"]
    assert len(texts) == bool(salt) and all(f"at first is {salt}, which" in text for text in texts)
