"""Turned vessels of the bench: those of `turned.toml`, and those whose profile follows from a few sizes."""

import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sessions.geometry.profile import Arc, Line, Stroke, level_holding, rounded, sampled, solved, volume_below
from sessions.geometry.rings import turned_solid
from sessions.glassware.instrument import GLASS, MILLILITRE, Cavity, Instrument, Opening, metres, weighed
from sessions.glassware.vessel import Foot, Shape, Spout, turned_vessel

# Low form beakers of the DURAN catalogue (DWK Life Sciences), a series made to ISO 3819; wall, fillet and spout are our
# own choice. Capacity in mL: outer diameter, height, wall in mm
LOW_FORM = {
    50: (42.0, 60.0, 1.0),
    100: (50.0, 70.0, 1.1),
    250: (70.0, 95.0, 1.3),
    400: (80.0, 110.0, 1.4),
    600: (90.0, 125.0, 1.5),
}
# Narrow neck Erlenmeyer flasks of the DURAN catalogue, a series made to ISO 1773; wall and roundings are our own.
# Capacity in mL: body, height, outer neck diameter, wall in mm
CONICAL = {100: (64.0, 105.0, 22.0, 1.2), 250: (85.0, 145.0, 34.0, 1.4), 500: (105.0, 180.0, 34.0, 1.6)}


@cache
def turned_rows() -> dict[str, dict[str, Any]]:
    """The rows of `turned.toml`."""
    return tomllib.loads(Path(__file__).with_name("turned.toml").read_text(encoding="utf-8"))


def from_row(faces: int, *, name: str) -> Instrument:
    """Return the instrument that a row of `turned.toml` describes."""
    row = turned_rows()[name]
    material = row.get("material", GLASS)
    if "outline" in row:
        outline = sampled(_strokes(row["outline"]), round((faces / 4.0) ** 0.5 * row["points"]))
        sections = max(row["least_sections"], round(faces / 2.0 / (len(outline) - 2)))
        return weighed(name, turned_solid(outline, sections), row["tags"], material)
    capacity = row["millilitres"] * MILLILITRE
    shape = _shape(row)
    if "mark" in row:
        # A narrow neck has no room to correct a bulb that holds 1 % too little (9 mm of a 12 mm neck for 100 mL), so
        # the bulb is what is solved, its profile sampled as for so many faces.
        def missing(bulb: float) -> float:
            trial = _shape(row, bulb)
            inner = sampled(trial.strokes, trial.resolution(faces)[1])
            return volume_below(inner, metres(row["mark"])) - capacity

        shape = _shape(row, solved(missing, *map(metres, row["bulb_between"])))
    turned = turned_vessel(shape, faces)
    rim = float(turned.mesh.bounds[1, 1])
    sites = {site: (0.0, rim + metres(height), 0.0) for site, height in row.get("above_rim", {}).items()}
    return turned.instrument(name, capacity, row["tags"], material, sites)


def _shape(row: dict[str, Any], bulb: float = 1.0) -> Shape:
    spout, foot = row.get("spout"), row.get("foot")
    return Shape(
        strokes=_strokes(row["inside"], bulb),
        wall=metres(row["wall"]),
        spout=spout
        and Spout(
            depth=metres(spout["depth"]),
            height=metres(spout["height"]),
            half_angle=np.radians(spout["half_angle_deg"]),
        ),
        foot=foot
        and Foot(
            top=metres(foot["top"]),
            outline=[(metres(r), metres(y)) for r, y in foot["outline"]],
            hexagonal_beyond=metres(foot["hexagonal_beyond"]),
        ),
        open_below=row.get("open_below", False),
    )


def _strokes(corners: Sequence[Sequence[Any]], bulb: float = 1.0) -> list[Stroke]:
    """Strokes along rows of corners; the radius of a bulb in metres."""
    rows: list[tuple[float, ...]] = []
    for r, y, *how in corners:
        radius = float(r.removesuffix("bulb")) * bulb if isinstance(r, str) else metres(r)
        rows.append((radius, metres(y), *map(metres, how[:1]), *how[1:]))
    return rounded(rows)


def beaker(faces: int, *, millilitres: int = 250) -> Instrument:
    """Return a low-form beaker with spout towards +X; the mark stands at its nominal capacity."""
    diameter, height, wall = (value * 1e-3 for value in LOW_FORM[millilitres])
    radius, top, flare = diameter / 2.0 - wall, height - wall / 2.0, 0.02 * diameter
    spout = Spout(depth=0.065 * diameter, height=0.2 * height, half_angle=np.radians(24.0))
    floor = [(0.0, wall), (radius, wall, 0.11 * diameter), (radius, top - spout.height)]
    strokes = rounded([*floor, (radius, top - flare, 0.0, 2), (radius + flare / 3.0, top)])
    turned = turned_vessel(Shape(strokes=strokes, wall=wall, spout=spout), faces)
    return turned.instrument(f"beaker_{millilitres}", millilitres * MILLILITRE, "glass vessel beaker open")


def erlenmeyer_flask(faces: int, *, millilitres: int = 250) -> Instrument:
    """Return a narrow-necked conical flask."""
    body, height, neck, wall = (value * 1e-3 for value in CONICAL[millilitres])
    radius, throat, top = body / 2.0 - wall, neck / 2.0 - wall, height - wall / 2.0
    shoulder, fillet = 0.63 * height, 0.12 * body
    corner = _corner_for(radius, fillet, throat, shoulder - wall)
    cone = [(0.0, wall), (corner, wall, fillet), (throat, shoulder, 0.16 * body)]
    rim = [(throat, top - 0.03 * height, 0.03 * height), (throat + 0.012 * height, top)]
    turned = turned_vessel(Shape(strokes=rounded([*cone, *rim]), wall=wall), faces)
    inner = turned.inner
    narrowest = float(np.min(inner[inner[:, 1] > 0.7 * inner[-1, 1], 0]))
    sites = {"neck": (0.0, float(inner[-1, 1]) - 2.0 * narrowest, 0.0)}
    tags = "glass vessel flask open"
    return turned.instrument("erlenmeyer_flask", millilitres * MILLILITRE, tags, sites=sites)


def dropper(faces: int) -> Instrument:
    """Return a dropper, tip down: a drawn tube under a bulb, one wall throughout; its mark stands at 1 mL."""
    wall, height = 1.0e-3, 150.0e-3
    # Turned upside down, bulb at the bottom, so that the tip is the vessel's rim.
    bulb = [(0.0, wall), (7.5e-3, wall, 6.0e-3), (7.5e-3, 34.0e-3, 5.0e-3), (5.2e-3, 40.0e-3), (5.2e-3, 48.0e-3)]
    stem = [(3.0e-3, 54.0e-3), (3.0e-3, 120.0e-3, 6.0e-3), (0.8e-3, 138.0e-3, 4.0e-3), (0.8e-3, height - wall / 2.0)]
    turned = turned_vessel(Shape(strokes=rounded([*bulb, *stem]), wall=wall), faces)
    over = np.diag([1.0, -1.0, 1.0, 1.0])
    over[1, 3] = height
    radius, full = turned.inner[-1].tolist()
    capacity, brim = 1.0 * MILLILITRE, turned.brimful()
    cavity = Cavity(
        capacity_m3=capacity,
        floor_height=height - full,
        mark_height=height - level_holding(turned.inner, brim.volume - capacity),
        to_brim=brim.transformed(over),
        opening=Opening(centre=(0.0, height - full, 0.0), normal=(0.0, -1.0, 0.0), radius=radius, lip=(0.0, 0.0, 0.0)),
    )
    return weighed("dropper", turned.mesh.transformed(over), "glass tool dropper drains", cavity=cavity)


def watch_glass(faces: int) -> Instrument:
    """Return a watch glass of 80 mm, a shallow cap of a sphere that rests on its lowest point."""
    wall, curvature, radius = 1.5e-3, 75.0e-3, 39.5e-3
    half = float(np.arcsin(radius / curvature))
    strokes = [Arc((0.0, wall + curvature), curvature, -np.pi / 2.0, half - np.pi / 2.0, least=5)]
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    return turned.instrument("watch_glass", 5.0 * MILLILITRE, "glass vessel dish open")


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
    return turned.instrument("evaporating_dish", 60.0 * MILLILITRE, "porcelain vessel dish open", "porcelain")


def _corner_for(radius: float, fillet: float, throat: float, rise: float) -> float:
    """Return where the floor must end so that the cone, its lower edge rounded by ``fillet``, is ``radius`` wide."""
    corner = radius
    for _ in range(40):  # each step leaves about a fifth of the error
        half_angle = 0.5 * np.arctan2(rise, corner - throat)
        corner = radius - fillet + fillet / float(np.tan(half_angle))
    return corner
