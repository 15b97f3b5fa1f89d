"""Glass that is mostly tube: test tube, graduated cylinder, funnel, volumetric pipette, dropper, burette.

The stopcock of the burette turns in the barrel about Z.
"""

import numpy as np

from sessions.geometry.profile import Arc, Line, level_holding, rounded, sampled
from sessions.geometry.rings import turned_solid
from sessions.geometry.solids import box
from sessions.glassware.flasks import solved_for_capacity
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
)
from sessions.glassware.solid_parts import across_corners, across_flats, cylinder, fitted, sections_for
from sessions.glassware.vessel import Foot, Shape, Spout, turned_vessel
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined, subtracted, united

TUBING = "DURAN tubing of borosilicate glass 3.3, product list (SCHOTT)"
# The burette, in metres: bore and wall, heights of its parts, radius of the key and how far it stays off the glass.
BORE, WALL = 5.5e-3, 1.0e-3
TOP, STOPCOCK = 0.74, 0.10
BARREL_FROM, LAST_MARK = 0.135, 0.15
KEY_RADIUS, KEY_CLEARANCE = 5.0e-3, 0.1e-3
CAPACITY = 50.0 * MILLILITRE
LEAST_SECTIONS = 8
TIP = Site(point=(0.0, 0.0, 0.0), direction=(0.0, -1.0, 0.0))


def test_tube(faces: int) -> Instrument:
    """Return a test tube of 16 x 160 mm with a flared rim; it stands on the lowest point of its round bottom."""
    wall, radius, top = 1.2e-3, 6.8e-3, 159.4e-3
    strokes = [
        Arc((0.0, radius + wall), radius, -np.pi / 2.0, 0.0, least=4),
        *rounded([(radius, radius + wall), (radius, top - 2.0e-3), (radius + 1.0e-3, top)], [0.0]),
    ]
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    sources = (f"outer diameter 16 mm, wall 1.2 mm: {TUBING}", f"length 160 mm, filled to 10 mL: {TYPICAL}")
    return turned.instrument("test_tube", 10.0 * MILLILITRE, "glass vessel open test_tube", sources)


test_tube.__test__ = False  # type: ignore[attr-defined]  # pytest collects names that start with test


def graduated_cylinder(faces: int) -> Instrument:
    """Return a 100 mL measuring cylinder with hexagonal foot and spout towards +X."""
    wall, radius, top, floor = 1.5e-3, 13.5e-3, 259.2e-3, 14.0e-3
    spout = Spout(depth=4.5e-3, height=14.0e-3, half_angle=np.radians(32.0))
    outer = radius + wall
    strokes = [
        *rounded([(0.0, floor), (radius, floor), (radius, top - spout.height)], [2.5e-3]),
        Line((radius, top - spout.height), (radius, top - 1.0e-3), least=2),
        Line((radius, top - 1.0e-3), (radius + 0.5e-3, top)),
    ]
    waist = [(outer, 17.0e-3), (outer + 2.5e-3, 11.0e-3)]
    outline = [*waist, (31.0e-3, 7.0e-3), (33.0e-3, 5.5e-3), (33.0e-3, 0.0), (0.0, 0.0)]
    foot = Foot(top=17.0e-3, outline=outline, hexagonal_beyond=25.0e-3)
    turned = turned_vessel(Shape(strokes=strokes, wall=wall, spout=spout, foot=foot), faces)
    sources = (
        "100 mL with spout on a hexagonal foot: a type of ISO 4788, which leaves the form of the base open",
        f"30 x 260 mm, wall 1.5 mm: {TYPICAL}",
    )
    return turned.instrument("graduated_cylinder", 100.0 * MILLILITRE, "glass vessel open cylinder", sources)


def funnel(faces: int) -> Instrument:
    """Return a 60 degree filter funnel, 75 mm wide, standing on the end of its stem."""
    wall, bore, rim, stem = 1.5e-3, 3.0e-3, 36.0e-3, 75.0e-3
    top = stem + (rim - bore) / np.tan(np.radians(30.0))
    strokes = rounded([(bore, wall / 2.0), (bore, stem), (rim, top)], [6.0e-3])
    turned = turned_vessel(Shape(strokes=strokes, wall=wall, open_below=True), faces)
    sources = ("60 degree cone: the usual angle of filter funnels", f"75 mm wide, stem 75 mm: {TYPICAL}")
    tags = "glass vessel open funnel drains"
    return turned.instrument("funnel", 20.0 * MILLILITRE, tags, sources, sites={"tip": TIP})


def pipette(faces: int) -> Instrument:
    """Return a 10 mL volumetric pipette, tip down; the bulb is solved so that the mark holds 10 mL from the tip."""
    wall, bore, top, mark, capacity = 1.0e-3, 2.0e-3, 449.5e-3, 340.0e-3, 10.0 * MILLILITRE

    def shape(radius: float) -> Shape:
        stem = [(0.5e-3, wall / 2.0), (0.5e-3, 2.0e-3), (bore, 28.0e-3), (bore, 165.0e-3)]
        bulb = [(radius, 178.0e-3), (radius, 242.0e-3), (bore, 255.0e-3), (bore, mark), (bore, top)]
        radii = [0.0, 0.0, 8.0e-3, 8.0e-3, 8.0e-3, 8.0e-3, 0.0]
        return Shape(strokes=rounded([*stem, *bulb], radii), wall=wall, open_below=True)

    turned = turned_vessel(solved_for_capacity(shape, capacity, mark, faces, (3.0e-3, 12.0e-3)), faces)
    sources = ("10 mL one-mark pipette with bulb: a type of ISO 648", f"450 mm long, bore 4 mm, wall 1 mm: {TYPICAL}")
    sites = {"tip": TIP, "grip": Site(point=(0.0, 0.4, 0.0))}
    return turned.instrument("pipette", capacity, "glass vessel open pipette tool drains", sources, sites=sites)


def dropper(faces: int) -> Instrument:
    """Return a dropper, tip down: a drawn tube under a bulb, one wall throughout; its mark stands at 1 mL."""
    wall, height = 1.0e-3, 150.0e-3
    # Turned upside down, bulb at the bottom, so that the tip is the vessel's rim.
    bulb = [(0.0, wall), (7.5e-3, wall), (7.5e-3, 34.0e-3), (5.2e-3, 40.0e-3), (5.2e-3, 48.0e-3)]
    stem = [(3.0e-3, 54.0e-3), (3.0e-3, 120.0e-3), (0.8e-3, 138.0e-3), (0.8e-3, height - wall / 2.0)]
    strokes = rounded([*bulb, *stem], [6.0e-3, 5.0e-3, 0.0, 0.0, 0.0, 6.0e-3, 4.0e-3])
    turned = turned_vessel(Shape(strokes=strokes, wall=wall), faces)
    over = np.diag([1.0, -1.0, 1.0, 1.0])
    over[1, 3] = height
    capacity, full = 1.0 * MILLILITRE, turned.inner[-1, 1]
    level = level_holding(turned.inner, turned.brimful().volume - capacity)
    return weighed(
        "dropper",
        turned.mesh.transformed(over),
        "glass tool dropper drains",
        GLASS,
        wall=Wall(thickness=wall, span=(height - full, height - wall)),
        cavity=Cavity(
            capacity_m3=capacity,
            floor_height=height - full,
            mark_height=height - level,
            to_mark=turned.between(level, full).transformed(over),
            to_brim=turned.brimful().transformed(over),
            opening=Opening(
                centre=(0.0, height - full, 0.0),
                normal=(0.0, -1.0, 0.0),
                radius=float(turned.inner[-1, 0]),
                lip=(0.0, 0.0, 0.0),
                pour_direction=(0.0, -1.0, 0.0),
            ),
        ),
        sites={"tip": TIP, "bulb": Site(point=(0.0, height - 0.02, 0.0))},
    )


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
            "tip": TIP,
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
