"""Low-form beakers of 50 to 600 mL with a spout, and the gas jar."""

from __future__ import annotations

import numpy as np

from sessions.glassware.instrument import TYPICAL, Instrument, Part, Site, mass_of
from sessions.glassware.profile import Line, rounded
from sessions.glassware.rings import turned_solid
from sessions.glassware.vessel import Shape, Spout, turned_vessel

GLASS = "borosilicate glass 3.3"
MILLILITRE = 1e-6

# capacity in mL: outer diameter, height, wall in mm
LOW_FORM = {
    50: (42.0, 60.0, 1.0),
    100: (50.0, 70.0, 1.1),
    250: (70.0, 95.0, 1.3),
    400: (80.0, 110.0, 1.4),
    600: (90.0, 125.0, 1.5),
}
BEAKER_SOURCES = (
    "outer diameter and height: low form beakers of the DURAN catalogue (DWK Life Sciences), a series made to ISO 3819",
    f"wall, fillet and spout: {TYPICAL}",
)


def beaker(faces: int, *, millilitres: int = 250) -> Instrument:
    """Return a low-form beaker with spout towards +X; the mark stands at its nominal capacity."""
    diameter, height, wall = (value * 1e-3 for value in LOW_FORM[millilitres])
    radius, top = diameter / 2.0 - wall, height - wall / 2.0
    fillet, flare = 0.11 * diameter, 0.02 * diameter
    spout = Spout(depth=0.065 * diameter, height=0.2 * height, half_angle=np.radians(24.0))
    spout_from = top - spout.height
    strokes = [
        *rounded([(0.0, wall), (radius, wall), (radius, spout_from)], [fillet]),
        Line((radius, spout_from), (radius, top - flare), least=2),
        Line((radius, top - flare), (radius + flare / 3.0, top)),
    ]
    turned = turned_vessel(Shape(strokes=strokes, wall=wall, spout=spout), faces)
    return Instrument(
        name=f"beaker_{millilitres}",
        mesh=turned.mesh,
        tags=("glass", "vessel", "beaker", "open"),
        material=GLASS,
        sources=BEAKER_SOURCES,
        mass=mass_of(turned.mesh, GLASS),
        wall=turned.wall(),
        cavity=turned.cavity(millilitres * MILLILITRE),
    )


def gas_jar(faces: int) -> Instrument:
    """Return a gas jar, a wide cylinder with a flat flange, and the ground glass plate that covers it."""
    wall, radius, top = 2.0e-3, 28.0e-3, 199.0e-3
    strokes = rounded(
        [(0.0, wall), (radius, wall), (radius, top - 5.0e-3), (radius + 7.0e-3, top - 1.0e-3), (radius + 12.0e-3, top)],
        [8.0e-3, 4.0e-3, 0.0],
        [2, 3, 1],
    )
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    cover = gas_jar_cover(faces)
    return Instrument(
        name="gas_jar",
        mesh=turned.mesh,
        tags=("glass", "vessel", "gas_jar", "open"),
        material=GLASS,
        sources=(f"60 x 200 mm: {TYPICAL}",),
        mass=mass_of(turned.mesh, GLASS),
        wall=turned.wall(),
        cavity=turned.cavity(400.0 * MILLILITRE),
        sites={"cover": Site(point=(0.0, 0.2015, 0.0))},
        parts=(Part(instrument=cover, position=(0.0, 0.2015, 0.0)),),
    )


def gas_jar_cover(faces: int) -> Instrument:
    """Return the round glass plate, 84 mm wide and 3 mm thick, that closes a gas jar."""
    radius, thickness, bevel = 42.0e-3, 3.0e-3, 0.5e-3
    sections = max(12, round((faces / 10.0) ** 0.5 * 1.8))
    bands = max(2, round(faces / 2.0 / sections))
    across = np.linspace(radius - bevel, 0.0, max(2, (bands - 3) // 2 + 1))
    edge = [(radius, bevel), (radius, thickness - bevel)]
    outline = [*((r, 0.0) for r in across[::-1]), *edge, *((r, thickness) for r in across)]
    mesh = turned_solid(np.array(outline), sections)
    return Instrument(
        name="gas_jar_cover",
        mesh=mesh,
        tags=("glass", "plate"),
        material=GLASS,
        sources=(TYPICAL,),
        mass=mass_of(mesh, GLASS),
    )
