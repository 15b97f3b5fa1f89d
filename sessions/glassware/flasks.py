"""Erlenmeyer flask, volumetric flask and reagent bottle."""

from collections.abc import Callable
from typing import Any

import numpy as np

from sessions.geometry.profile import rounded, sampled, solved, volume_below
from sessions.geometry.rings import turned_solid
from sessions.glassware.instrument import GLASS, MILLILITRE, TYPICAL, Instrument, Part, Site, weighed
from sessions.glassware.vessel import Shape, Turned, turned_vessel

# Erlenmeyer flasks, capacity in mL: body, height, outer neck diameter, wall in mm.
CONICAL = {100: (64.0, 105.0, 22.0, 1.2), 250: (85.0, 145.0, 34.0, 1.4), 500: (105.0, 180.0, 34.0, 1.6)}


def erlenmeyer_flask(faces: int, *, millilitres: int = 250) -> Instrument:
    """Return a narrow-necked conical flask."""
    body, height, neck, wall = (value * 1e-3 for value in CONICAL[millilitres])
    radius, throat, top = body / 2.0 - wall, neck / 2.0 - wall, height - wall / 2.0
    shoulder, fillet = 0.63 * height, 0.12 * body
    corner = _corner_for(radius, fillet, throat, shoulder - wall)
    cone = [(0.0, wall), (corner, wall), (throat, shoulder)]
    rim = [(throat, top - 0.03 * height), (throat + 0.012 * height, top)]
    strokes = rounded([*cone, *rim], [fillet, 0.16 * body, 0.03 * height])
    sources = (
        "body, height and neck diameter: narrow neck Erlenmeyer flasks of the DURAN catalogue (DWK Life Sciences), "
        "a series made to ISO 1773",
        f"wall and roundings: {TYPICAL}",
    )
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    return _flask("erlenmeyer_flask", turned, millilitres * MILLILITRE, sources)


def volumetric_flask(faces: int) -> Instrument:
    """Return a 100 mL one-mark volumetric flask; the bulb is solved so that the mark on the neck holds 100 mL."""
    wall, throat, top, mark, capacity = 1.2e-3, 6.0e-3, 169.4e-3, 113.0e-3, 100.0 * MILLILITRE

    def shape(radius: float) -> Shape:
        bulb = [(0.0, wall), (0.8 * radius, wall), (radius * 1.05, 17.0e-3), (radius * 0.86, 38.0e-3)]
        neck = [(throat, 55.0e-3), (throat, mark), (throat, top - 4.0e-3), (throat + 1.0e-3, top)]
        radii = [4.0e-3, 15.0e-3, 15.0e-3, 10.0e-3, 0.0, 0.0]
        return Shape(strokes=rounded([*bulb, *neck], radii, [2, 2, 2, 3, 1, 1]), wall=wall)

    turned = turned_vessel(solved_for_capacity(shape, capacity, mark, faces, (20.0e-3, 40.0e-3)), faces)
    sources = (
        "100 mL, inner neck diameter 12 mm, height 170 mm: one-mark volumetric flasks to ISO 1042",
        f"wall and bulb outline: {TYPICAL}; bulb diameter solved for the capacity (about 60 mm)",
    )
    return _flask("volumetric_flask", turned, capacity, sources)


def reagent_bottle(faces: int) -> Instrument:
    """Return a 250 mL narrow-necked reagent bottle and its ground glass stopper."""
    wall, radius, throat, top = 2.2e-3, 32.8e-3, 9.0e-3, 130.9e-3
    body = [(0.0, wall), (radius, wall), (radius, 84.0e-3), (throat, 100.0e-3)]
    rim = [(throat, top - 9.0e-3), (throat + 3.0e-3, top - 5.0e-3), (throat + 7.0e-3, top)]
    strokes = rounded([*body, *rim], [6.0e-3, 13.0e-3, 5.0e-3, 4.0e-3, 0.0], [2, 2, 3, 2, 1])
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    seat, sources = (0.0, 104.0e-3, 0.0), (f"70 x 132 mm, 250 mL: {TYPICAL}",)
    sites, stopper = {"stopper": Site(point=seat)}, Part(instrument=reagent_bottle_stopper(faces), position=seat)
    capacity = 250.0 * MILLILITRE
    return _flask("reagent_bottle", turned, capacity, sources, " bottle", sites=sites, parts=(stopper,))


def reagent_bottle_stopper(faces: int) -> Instrument:
    """Return the solid stopper of the reagent bottle: a plug, a waist and a flat head."""
    plug = [(0.0, 0.0), (7.6e-3, 0.0), (8.8e-3, 17.0e-3), (7.0e-3, 27.5e-3)]
    head = [(17.0e-3, 31.0e-3), (17.0e-3, 37.0e-3), (0.0, 39.0e-3)]
    strokes = rounded([*plug, *head], [0.8e-3, 0.0, 4.0e-3, 1.5e-3, 2.0e-3])
    outline = sampled(strokes, round((faces / 4.0) ** 0.5 * 1.1))
    mesh = turned_solid(outline, max(12, round(faces / 2.0 / (len(outline) - 2))))
    return weighed("reagent_bottle_stopper", mesh, "glass stopper", GLASS)


def solved_for_capacity(
    shape: Callable[[float], Shape], capacity: float, mark: float, faces: int, bounds: tuple[float, float]
) -> Shape:
    """Return the shape whose profile, sampled as for ``faces`` faces, holds ``capacity`` m3 up to ``mark``.

    A narrow neck has no room to correct a bulb that holds 1 % too little (9 mm of a 12 mm neck for 100 mL), so the
    bulb is what is solved.
    """

    def missing(size: float) -> float:
        trial = shape(size)
        return volume_below(sampled(trial.strokes, trial.resolution(faces)[1]), mark) - capacity

    return shape(solved(missing, *bounds))


def _corner_for(radius: float, fillet: float, throat: float, rise: float) -> float:
    """Return where the floor must end so that the cone, its lower edge rounded by ``fillet``, is ``radius`` wide."""
    corner = radius
    for _ in range(40):  # each step leaves about a fifth of the error
        half_angle = 0.5 * np.arctan2(rise, corner - throat)
        corner = radius - fillet + fillet / float(np.tan(half_angle))
    return corner


def _flask(
    name: str, turned: Turned, capacity: float, sources: tuple[str, ...], tags: str = "", **more: Any
) -> Instrument:
    neck = float(np.min(turned.inner[turned.inner[:, 1] > 0.7 * turned.inner[-1, 1], 0]))
    sites = {"neck": Site(point=(0.0, float(turned.inner[-1, 1]) - 2.0 * neck, 0.0))}
    return turned.instrument(name, capacity, f"glass vessel flask open{tags}", sources, **{"sites": sites, **more})
