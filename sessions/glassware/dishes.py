"""Watch glass and evaporating dish."""

from __future__ import annotations

import numpy as np

from sessions.glassware.beakers import GLASS, MILLILITRE
from sessions.glassware.instrument import TYPICAL, Instrument, mass_of
from sessions.glassware.profile import Arc, Line, Stroke
from sessions.glassware.vessel import Shape, Spout, turned_vessel


def watch_glass(faces: int) -> Instrument:
    """Return a watch glass of 80 mm, a shallow cap of a sphere that rests on its lowest point."""
    wall, curvature, radius = 1.5e-3, 75.0e-3, 39.5e-3
    half = float(np.arcsin(radius / curvature))
    strokes = [Arc((0.0, wall + curvature), curvature, -np.pi / 2.0, half - np.pi / 2.0, least=5)]
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    return Instrument(
        name="watch_glass",
        mesh=turned.mesh,
        tags=("glass", "vessel", "dish", "open"),
        material=GLASS,
        sources=(f"80 mm wide, radius of curvature 75 mm, filled to 5 mL: {TYPICAL}",),
        mass=mass_of(turned.mesh, GLASS),
        wall=turned.wall(),
        cavity=turned.cavity(5.0 * MILLILITRE),
    )


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
    return Instrument(
        name="evaporating_dish",
        mesh=turned.mesh,
        tags=("porcelain", "vessel", "dish", "open"),
        material="porcelain",
        sources=(f"80 mm wide, wall 2.2 mm, filled to 60 mL: {TYPICAL}",),
        mass=mass_of(turned.mesh, "porcelain"),
        wall=turned.wall(),
        cavity=turned.cavity(60.0 * MILLILITRE),
    )
