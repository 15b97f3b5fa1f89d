"""The output of an experiment depends neither on the order of its tables and bodies nor on their names."""

import re
from functools import cache

import numpy as np
import pytest
from oracles.random_liquids import printed
from support.liquid_worlds import BURETTE_COLUMN, TAP, glass, poses_at_rest, poses_of_tilted_glass, tap_rotations

from sessions.model.scene import SceneBody

COUNT = 73
"""Frames of an experiment."""

STEP_NS = 30_000_000
"""From frame to frame."""

COLOURS = ("white", "yellow", "brown")
HEAT = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.3, "heat_capacity_j_per_ml_k": 4.18}


def ramp(first, last, degrees):
    """Poses of a glass that is tilted by so many degrees between two frames."""
    return poses_of_tilted_glass(np.interp(np.arange(COUNT), [first, last], [0.0, degrees]), (0.0, 0.2, 0.0))


def holding(name, volume, solids=None, cavity=None, **solutes):
    """A glass with these mol/L and solids."""
    return glass(name, volume, solutes=solutes, cavity=cavity, properties=solids and {"solid": solids})


def titration():
    """Soda and hydrogen carbonate, an indicator, and gas."""
    poses = {"burette": poses_at_rest(COUNT, (0.0, 0.15, 0.0)), "flask": poses_at_rest(COUNT)}
    poses["tap"] = tap_rotations([0.0, *([90.0] * (COUNT - 1))])
    bodies = (
        holding("burette", volume=50.0, cavity=BURETTE_COLUMN, HCl=0.5),
        holding("flask", volume=1.0, Na2CO3=0.05, NaHCO3=0.05),
        SceneBody("tap"),
    )
    orange = {"in": "flask", "indicator": "methyl orange", "from_ph": 3.1, "to_ph": 4.4, "acid_colour": "red",
              "base_colour": "yellow"}  # fmt: skip
    pink = {**orange, "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0, "acid_colour": "colourless"}
    return poses, bodies, (
        ("burette", TAP), ("mixing", {"in": ["flask", "burette"]}), ("colour", orange), ("colour", pink),
        ("reaction", {"equation": "Na2CO3 + 2 HCl -> 2 NaCl + H2O + CO2"}),
        ("reaction", {"equation": "NaHCO3 + HCl -> NaCl + H2O + CO2"}),
    )  # fmt: skip


def pours():
    """Three salts fall out of what two glasses pour into one, which grows warm and pours on."""
    poses = {
        "a": ramp(first=3, last=20, degrees=100.0),
        "b": poses_at_rest(COUNT),
        "c": ramp(first=23, last=47, degrees=100.0),
    }
    bodies = (
        holding("a", volume=30.0, AgNO3=0.2, BaCl2=0.05),
        holding("b", volume=10.0, NaCl=0.1, KI=0.1, Na2SO4=0.1),
        holding("c", volume=30.0, HCl=0.3, K2SO4=0.1),
    )
    falls = [("AgCl", "Ag+ + Cl- -> AgCl(s)"), ("AgI", "Ag+ + I- -> AgI(s)"), ("BaSO4", "Ba2+ + SO42- -> BaSO4(s)")]
    return poses, bodies, (
        ("pour", {"from": ["a", "c"], "into": ["b"]}), ("mixing", {"in": ["a", "b", "c"]}), ("heat", HEAT),
        *(("reaction", {"equation": equation}) for _, equation in falls),
        *(("precipitation", {"solid": falls[k][0], "colour": colour}) for k, colour in enumerate(COLOURS)),
    )  # fmt: skip


def chain():
    """Acid goes from glass to glass to glass over zinc that dissolves slowly, all at one time."""
    lower = (0.0, -0.2, 0.0)
    poses = {
        "a": ramp(first=3, last=50, degrees=110.0),
        "b": ramp(first=7, last=67, degrees=110.0),
        "c": poses_at_rest(COUNT, lower),
    }
    poses["b"] = (poses["b"][0] + np.array([0.0, -0.2, 0.0]), poses["b"][1])
    bodies = (
        holding("a", volume=50.0, HCl=1.0),
        holding("b", volume=40.0, solids={"formula": "Zn", "mass_g": 0.3}, NH3=0.5),
        holding("c", volume=5.0, NaOH=1.0),
    )
    return poses, bodies, (
        ("pour", {"from": ["b", "a"], "into": ["b", "c"]}), ("mixing", {"in": ["c", "b", "a"]}), ("heat", HEAT),
        ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 0.8}),
        ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"}), ("reaction", {"equation": "NH3 + HCl -> NH4Cl"}),
    )  # fmt: skip


SCENES = (titration, pours, chain)


@cache
def printed_as_declared(make):
    """Lines, figures and rows of the experiment with its own names and order."""
    return printed(make, step_ns=STEP_NS)


@pytest.mark.parametrize("make", SCENES)
def test_output_of_the_experiments_reads_as_it_did(make, snapshot):
    """``make``: of an experiment with poses, vessels and effects; the snapshot has all lines that a terminal prints.

    There are series of six quantities or more, so that the lines are of chemistry too.
    """
    lines, _figures, rows = printed_as_declared(make)
    assert len(rows) >= 6
    assert lines == snapshot


@pytest.mark.sampled(len(SCENES))
@pytest.mark.parametrize("make", SCENES)
def test_order_of_tables_and_names_change_no_output(make):
    """``make``: an experiment; with bodies and tables in the opposite order its output is the same.

    Output is printed lines, figures of the summary and rows of the series. It is the same too with new names, in the
    opposite order of the alphabet, once the old ones are put back; only lines of a moment may then change places.
    """
    lines, figures, rows = printed_as_declared(make)
    assert printed(make, order=lambda declared: declared[::-1], step_ns=STEP_NS) == (lines, figures, rows)

    poses, _bodies, _tables = make()
    names = sorted(poses)
    new_names = {name: f"z{len(names) - k}" for k, name in enumerate(names)}
    old_names = {new: name for name, new in new_names.items()}

    def with_old_names(text):
        return re.sub(r"z\d", lambda match: old_names[match.group()], text)

    renamed_lines, renamed_figures, renamed_rows = printed(make, names=new_names, back=with_old_names, step_ns=STEP_NS)
    assert sorted(renamed_lines) == sorted(lines)
    assert (renamed_figures, renamed_rows) == (figures, rows)
