"""A burette of 50 mL and its stopcock, which turns in the barrel about Z."""

from __future__ import annotations

import numpy as np

from sessions.glassware.instrument import (
    GLASS,
    MILLILITRE,
    TYPICAL,
    Cavity,
    Instrument,
    Joint,
    Opening,
    Part,
    Site,
    Wall,
    weighed,
)  # fmt: skip
from sessions.glassware.profile import rounded, sampled
from sessions.glassware.rings import turned_solid
from sessions.glassware.solids import across_corners, across_flats, cylinder, fitted, sections_for
from sessions.glassware.tubes import TUBING
from sessions.mesh_data import MeshData
from sessions.meshes import refined, subtracted, united
from sessions.synthetic.solids import box

BORE, WALL = 5.5e-3, 1.0e-3
TOP, STOPCOCK = 0.74, 0.10
BARREL_FROM, LAST_MARK = 0.135, 0.15
KEY_RADIUS, KEY_CLEARANCE = 5.0e-3, 0.1e-3
CAPACITY = 50.0 * MILLILITRE
LEAST_SECTIONS = 8


def burette(faces: int) -> Instrument:
    """Return a 50 mL burette, tip at the origin, with its stopcock as a part.

    The mark is the zero line; ``to_mark`` is the graduated column between it and the 50 mL line. What stands below
    that line is never delivered by reading and is not counted. The joint's angle is 0 when closed (handle across)
    and a quarter turn when open (handle along the barrel).
    """
    mesh, spacing = fitted(_barrel, faces, 0.004)
    sections = sections_for(BORE, spacing, LEAST_SECTIONS)
    zero = LAST_MARK + CAPACITY / (np.pi * BORE**2)
    key = (0.0, STOPCOCK, 0.0)
    quarter = Joint(origin=key, axis=(0.0, 0.0, 1.0), lower=0.0, upper=float(np.pi / 2.0))
    return weighed(
        "burette",
        mesh,
        "glass vessel burette open drains",
        GLASS,
        (
            f"barrel 13 mm, wall 1.0 mm: {TUBING}; bore and capacity give 526 mm of scale",
            f"length 740 mm, stopcock: {TYPICAL}; burettes are the subject of ISO 385",
        ),
        wall=Wall(thickness=WALL, span=(LAST_MARK, TOP - 2.0 * WALL)),
        cavity=Cavity(
            capacity_m3=CAPACITY,
            floor_height=LAST_MARK,
            mark_height=zero,
            to_mark=_column(LAST_MARK, zero, sections),
            to_brim=_column(LAST_MARK, TOP, sections),
            opening=Opening.upwards(BORE, TOP),
        ),
        sites={
            "tip": Site(point=(0.0, 0.0, 0.0), direction=(0.0, -1.0, 0.0)),
            "stopcock": Site(point=key, direction=(0.0, 0.0, 1.0)),
            "clamp": Site(point=(0.0, 0.45, 0.0)),
        },
        parts=(Part(instrument=burette_stopcock(faces), position=key, joint=quarter),),
    )


def burette_stopcock(faces: int) -> Instrument:
    """Return the key of the burette's stopcock: a plug along Z with a hole across and a handle; closed as it stands."""

    def build(spacing: float) -> MeshData:
        around, thin = sections_for(KEY_RADIUS, spacing), sections_for(1.2e-3, spacing, 6)
        plug = across_corners(KEY_RADIUS - KEY_CLEARANCE, around)
        along_z = [(-17e-3, 18e-3, plug), (-20e-3, -14e-3, 7.5e-3), (14e-3, 20e-3, 7.0e-3)]
        rounds = [cylinder((0.0, 0.0, low), (0.0, 0.0, high), radius, around) for low, high, radius in along_z]
        body = united([*rounds, box((40e-3, 9e-3, 5e-3), (0.0, 0.0, 20e-3))])
        return refined(subtracted(body, [cylinder((-0.03, 0.0, 0.0), (0.03, 0.0, 0.0), 1.2e-3, thin)]), spacing)

    mesh, _ = fitted(build, faces, 0.005)
    origin = "on the axis it turns about, at the middle of its hole"
    return weighed("burette_stopcock", mesh, "plastic stopcock tool", "plastic", origin=origin)


def _barrel(spacing: float) -> MeshData:
    """Return the glass: outline and bore turned with equal sections, so that the wall between them is exact."""
    sections = sections_for(BORE, spacing, LEAST_SECTIONS)
    outer = BORE + WALL
    tip = [(0.0, 0.0), (1.4e-3, 0.0), (3.5e-3, 40e-3), (3.5e-3, STOPCOCK + 16e-3)]
    points = [*tip, (outer, BARREL_FROM), (outer, TOP), (0.0, TOP)]
    outline = sampled(rounded(points, [0.0, 0.0, 4e-3, 6e-3, 0.5e-3]), round(0.3 / max(spacing, 0.02)))
    narrow = [(0.0, -1e-3), (0.5e-3, -1e-3), (0.5e-3, 2e-3), (1.2e-3, 40e-3), (1.2e-3, STOPCOCK + 12e-3)]
    bore = np.array([*narrow, (BORE, BARREL_FROM + 2e-3), (BORE, TOP + 1e-3), (0.0, TOP + 1e-3)])
    around = sections_for(8e-3, spacing, 8)
    housing = cylinder((0.0, STOPCOCK, -13e-3), (0.0, STOPCOCK, 13e-3), 8.0e-3, around)
    body = united([turned_solid(outline, sections), housing])
    hole = cylinder((0.0, STOPCOCK, -20e-3), (0.0, STOPCOCK, 20e-3), across_flats(KEY_RADIUS, around), around)
    return refined(subtracted(body, [turned_solid(bore, sections), hole]), spacing * 2.0)


def _column(low: float, high: float, sections: int) -> MeshData:
    return turned_solid(np.array([(0.0, low), (BORE, low), (BORE, high), (0.0, high)]), sections)
