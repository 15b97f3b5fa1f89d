"""An equation that ran and that no other event reports says how far; so does a solid that dissolved or fell out."""

from types import SimpleNamespace

import numpy as np

from replay.effects.chemistry.limits import Cause
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.reacted import reacted_events, solid_events
from replay.effects.equivalence import Equivalence
from replay.effects.output import EffectEvent

MAGNESIUM = Process("Mg + 2 HCl", {"Mg(s)": -1.0, "H+": -2.0, "Mg^2+": 1.0})
CARBONATE = Process("CaCl2 + Na2CO3", {"Ca^2+": -1.0, "CO3^2-": -1.0, "CaCO3(s)": 1.0})


def flask_in_which(process, extent, limits):
    """A flask in which a process ran to these mol (``extent``) at 0, 1, 2 and 3 s.

    ``limits``: cause -> mol by which the process could run on; 0 mol: this cause has ended it.
    """
    history = SimpleNamespace(
        times=np.arange(4.0), extents=np.array(extent, dtype=float)[:, None], amounts=np.zeros((4, 1))
    )
    return SimpleNamespace(
        recipe=SimpleNamespace(processes=[process], reagent=lambda row, column: column),
        histories={"flask": history},
        ledger=SimpleNamespace(limits=SimpleNamespace(by_cause=lambda row, amounts: limits)),
    )


def test_equation_states_how_far_it_ran_and_what_ended_it():
    """Magnesium dissolves in acid: the equation has run by 0, 0, 3 and 5 mmol at 0, 1, 2 and 3 s.

    The event starts at 2 s, the first time at which that has grown. Magnesium could run it on by 0 mol, so it ended it;
    chloride and acid could by 10 mmol.
    """
    limits = {"Mg(s)": np.array(0.0), "Cl-": np.array(0.01), Cause.ACID: np.array(0.01)}
    flask = flask_in_which(MAGNESIUM, extent=[0.0, 0.0, 0.003, 0.005], limits=limits)
    (event,) = reacted_events(flask, followed=(), earlier_events=())
    assert event.text == "Mg + 2 HCl runs in flask by 5 mmol, until no Mg is left"
    assert event.time == 2.0 and event.end == 3.0 and event.values["moles"] == 0.005


def test_used_up_reagent_is_named_and_not_the_acid():
    """Magnesium and acid are both used up in the end; a reagent of the equation says more than its protons."""
    limits = {"Mg(s)": np.array(0.0), Cause.ACID: np.array(0.0)}
    flask = flask_in_which(MAGNESIUM, extent=[0.0, 0.0, 0.003, 0.005], limits=limits)
    (event,) = reacted_events(flask, followed=(), earlier_events=())
    assert event.text.endswith("until no Mg is left")


def test_solid_that_an_equation_makes_has_its_mass():
    """Calcium and carbonate make 2 mmol of CaCO3, 100.09 g/mol, from 0 to 1 s; calcium for a mol more is left.

    Where an effect precipitation follows the solid there is no event here, as it reports it.
    """
    flask = flask_in_which(CARBONATE, extent=[0.001, 0.003, 0.003, 0.003], limits={"Ca^2+": np.array(1.0)})
    (event,) = reacted_events(flask, followed=(), earlier_events=())
    assert event.text == "CaCl2 + Na2CO3 runs in flask by 2 mmol; 0.2 g CaCO3 come as a solid"
    assert event.time == 1.0 and event.end is None
    assert list(reacted_events(flask, followed=("CaCO3",), earlier_events=())) == []


OTHERS = [
    ("stopped", {"equation": "Mg + 2 HCl"}, True),
    ("stopped", {"equation": "Zn + 2 HCl"}, False),
    ("colour-change", {"equation": "Mg + 2 HCl"}, False),
    ("end-point", {}, True),
    ("not-reached", {"of": Equivalence.OXIDANT_AND_REDUCTANT}, True),
    ("end-point", {"of": Equivalence.ACID_AND_BASE}, False),
    ("colour-change", {"of": Equivalence.OXIDANT_AND_REDUCTANT}, False),
]


def test_an_equation_that_another_event_reports_is_not_repeated():
    """Magnesium has dissolved in acid, Mg + 2 HCl; ``name``, ``values``: of an earlier event in the same flask.

    ``reports_it``: whether that event stands for this equation: a stop that names it, or an end point that is not of
    acid and base, as a redox equation has it.
    """
    for name, values, reports_it in OTHERS:
        earlier = EffectEvent(time=1.0, name=name, bodies=("flask",), end=None, values=values)
        flask = flask_in_which(MAGNESIUM, extent=[0.0, 0.0, 0.0, 0.005], limits={"Mg(s)": np.array(1.0)})
        events = list(reacted_events(flask, followed=(), earlier_events=[earlier]))
        assert len(events) == (0 if reports_it else 1), (name, values)


def test_gas_and_dissolving_salts_have_events_of_their_own():
    """An equation has run by a mol of X. Gas that it frees, or a salt that it dissolves, has an event of its own.

    So no event "reacted" says again that X reacted, as it does for magnesium in the tests above.
    """
    for case, process in {
        "frees a gas": Process("", {"X": -1.0, "H2(g)": 1.0}),
        "dissolves a salt": Process("", {"X": -1.0}, salt=object()),
    }.items():
        flask = flask_in_which(process, extent=[0.0, 0.0, 0.0, 1.0], limits={"X": np.array(1.0)})
        assert list(reacted_events(flask, followed=(), earlier_events=())) == [], case


def test_change_of_a_solid_is_reported_where_it_is_visible():
    """``moles``: of CaCO3, 100 g/mol, at 0, 1, 2 and 3 s; ``expected``: second and text of the event.

    A change is visible from a milligram and a thousandth of what there was. Where an effect precipitation follows
    CaCO3, it reports the change, and there is no event here.
    """
    for case, (moles, expected) in {
        "falls out": ([0.0, 0.0, 0.001, 0.002], [(2.0, "0.2 g CaCO3 fall out in flask")]),
        "dissolves": ([0.01, 0.01, 0.009, 0.008], [(2.0, "0.2 g of 1 g CaCO3 dissolve in flask")]),
        "half a milligram": ([0.0, 0.0, 0.0, 5e-6], []),
        "a two-thousandth": ([1.0, 1.0, 1.0, 0.9995], []),
    }.items():
        reactions = SimpleNamespace(phases=np.array([0]), salt_columns=np.zeros(0, dtype=int))
        flask = SimpleNamespace(
            ledger=SimpleNamespace(columns=["CaCO3(s)"], reactions=reactions),
            histories={"flask": SimpleNamespace(times=np.arange(4.0), amounts=np.array(moles)[:, None])},
            brines=lambda vessel: {},
        )
        assert [(event.time, event.text) for event in solid_events(flask, ())] == expected, case
        assert not list(solid_events(flask, ("CaCO3",))), case
