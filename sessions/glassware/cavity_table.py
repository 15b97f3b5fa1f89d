"""A vessel's cavity as a scene writes it."""

from typing import Any

import numpy as np

from sessions.glassware.instrument import Cavity, Instrument


def cavity_table(instrument: Instrument) -> dict[str, Any]:
    """The space for liquid of a vessel in words of the scene: metres and millilitres, in the body's frame."""
    cavity = instrument.cavity
    assert cavity is not None
    table: dict[str, Any] = {
        "capacity_ml": round(float(cavity.capacity_m3) * 1e6, 3),
        "floor": round(float(cavity.floor_height), 6),
        "mark": round(float(cavity.mark_height), 6),
    }
    if {"beaker", "gas_jar"} & set(instrument.tags):
        table["radius"], table["height"] = (round(size, 6) for size in cylinder_of(cavity))
    table["opening_radius"] = round(float(cavity.opening.radius), 6)
    table["opening"] = [round(float(value), 6) for value in cavity.opening.centre]
    table["lip"] = [round(float(value), 6) for value in cavity.opening.lip]
    return table


def cylinder_of(cavity: Cavity) -> tuple[float, float]:
    """Inner radius and height, metres, of the cylinder that holds as much as the vessel up to its mark and its lip."""
    floor = float(cavity.floor_height)
    radius = float(np.sqrt(cavity.capacity_m3 / (np.pi * (cavity.mark_height - floor))))
    return radius, float(cavity.opening.centre[1]) - floor
