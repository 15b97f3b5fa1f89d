"""Open vessels: low-form beakers of 50 to 600 mL with a spout, gas jar, watch glass and evaporating dish."""

import numpy as np

from sessions.geometry.profile import Arc, Line, Stroke, rounded
from sessions.geometry.rings import turned_solid
from sessions.glassware.instrument import GLASS, MILLILITRE, TYPICAL, Instrument, Part, Site, weighed
from sessions.glassware.vessel import Shape, Spout, turned_vessel

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
    capacity = millilitres * MILLILITRE
    return turned.instrument(f"beaker_{millilitres}", capacity, "glass vessel beaker open", BEAKER_SOURCES)


def gas_jar(faces: int) -> Instrument:
    """Return a gas jar, a wide cylinder with a flat flange, and the ground glass plate that covers it."""
    wall, radius, top = 2.0e-3, 28.0e-3, 199.0e-3
    flange = [(radius, top - 5.0e-3), (radius + 7.0e-3, top - 1.0e-3), (radius + 12.0e-3, top)]
    strokes = rounded([(0.0, wall), (radius, wall), *flange], [8.0e-3, 4.0e-3, 0.0], [2, 3, 1])
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    seat, sources = (0.0, 0.2015, 0.0), (f"60 x 200 mm: {TYPICAL}",)
    sites, cover = {"cover": Site(point=seat)}, Part(instrument=gas_jar_cover(faces), position=seat)
    tags = "glass vessel gas_jar open"
    return turned.instrument("gas_jar", 400.0 * MILLILITRE, tags, sources, sites=sites, parts=(cover,))


def gas_jar_cover(faces: int) -> Instrument:
    """Return the round glass plate, 84 mm wide and 3 mm thick, that closes a gas jar."""
    radius, thickness, bevel = 42.0e-3, 3.0e-3, 0.5e-3
    sections = max(12, round((faces / 10.0) ** 0.5 * 1.8))
    bands = max(2, round(faces / 2.0 / sections))
    across = np.linspace(radius - bevel, 0.0, max(2, (bands - 3) // 2 + 1))
    edge = [(radius, bevel), (radius, thickness - bevel)]
    outline = [*((r, 0.0) for r in across[::-1]), *edge, *((r, thickness) for r in across)]
    return weighed("gas_jar_cover", turned_solid(np.array(outline), sections), "glass plate", GLASS)


def watch_glass(faces: int) -> Instrument:
    """Return a watch glass of 80 mm, a shallow cap of a sphere that rests on its lowest point."""
    wall, curvature, radius = 1.5e-3, 75.0e-3, 39.5e-3
    half = float(np.arcsin(radius / curvature))
    strokes = [Arc((0.0, wall + curvature), curvature, -np.pi / 2.0, half - np.pi / 2.0, least=5)]
    sources = (f"80 mm wide, radius of curvature 75 mm, filled to 5 mL: {TYPICAL}",)
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    return turned.instrument("watch_glass", 5.0 * MILLILITRE, "glass vessel dish open", sources)


def evaporating_dish(faces: int) -> Instrument:
    """Return a porcelain evaporating dish of 80 mm with a small flat base and a spout towards +X."""
    wall, flat, sphere = 2.2e-3, 12.0e-3, 38.0e-3
    centre = wall + float(np.sqrt(sphere**2 - flat**2))
    begin = float(-np.arccos(flat / sphere))
    lip_from = np.radians(-8.0)
    end = (sphere * np.cos(lip_from), centre + sphere * np.sin(lip_from))
    spout = Spout(depth=5.0e-3, height=10.0e-3, half_angle=np.radians(20.0))
    strokes: list[Stroke] = [
        Line((0.0, wall), (flat, wall)),
        Arc((0.0, centre), sphere, begin, float(lip_from), least=5),
        Line(end, (end[0] + 1.4e-3, end[1] + 5.0e-3), least=2),
    ]
    turned = turned_vessel(Shape(strokes=strokes, wall=wall, spout=spout), faces)
    sources = (f"80 mm wide, wall 2.2 mm, filled to 60 mL: {TYPICAL}",)
    tags = "porcelain vessel dish open"
    return turned.instrument("evaporating_dish", 60.0 * MILLILITRE, tags, sources, material="porcelain")
