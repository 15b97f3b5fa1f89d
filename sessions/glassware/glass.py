"""Glass that no row of a table describes: a burette, a gas delivery tube, the cover of a gas jar."""

import numpy as np

from sessions.geometry.profile import rounded_strokes, sampled_polyline
from sessions.geometry.rings import revolved_solid, sewn
from sessions.glassware.instrument import MILLILITRE, Cavity, Instrument, Opening, weighed_instrument
from sessions.glassware.united import across_flats, bent, cylinder, divided_path, fitted_mesh, sections_for, swept
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined_mesh, subtracted_mesh, united_mesh

# The burette, in metres: bore and wall, heights of its parts, radius of the hole for the key. Barrel of 13 mm:
# DURAN tubing of borosilicate glass 3.3, product list (SCHOTT); bore and capacity give 526 mm of scale. Length and
# stopcock are our own choice; burettes are the subject of ISO 385.
BORE, WALL = 5.5e-3, 1.0e-3
TOP, STOPCOCK = 0.74, 0.10
BARREL_FROM, LAST_MARK = 0.135, 0.15
KEY_RADIUS = 5.0e-3
CAPACITY = 50.0 * MILLILITRE
LEAST_SECTIONS = 8


def burette(faces: int) -> Instrument:
    """Return a 50 mL burette, tip at the origin; its key belongs at the site ``stopcock``.

    The mark is the zero line. What stands below the 50 mL line is never delivered by reading and is not counted. As
    `burette_stopcock` stands it is closed (handle across); a quarter turn about Z opens it (handle along the barrel).
    """
    mesh, spacing = fitted_mesh(_barrel, faces, 0.004)
    column = np.array([(0.0, LAST_MARK), (BORE, LAST_MARK), (BORE, TOP), (0.0, TOP)])
    cavity = Cavity(
        capacity_m3=CAPACITY,
        floor_height=LAST_MARK,
        mark_height=LAST_MARK + CAPACITY / (np.pi * BORE**2),
        to_brim=revolved_solid(column, sections_for(BORE, spacing, LEAST_SECTIONS)),
        opening=Opening.upwards(BORE, TOP),
    )
    sites = {"stopcock": (0.0, STOPCOCK, 0.0)}
    return weighed_instrument("burette", mesh, "glass vessel burette open drains", cavity=cavity, sites=sites)


def _barrel(spacing: float) -> MeshData:
    """Return the glass: outline and bore turned with equal sections, so that the wall between them is exact."""
    sections = sections_for(BORE, spacing, LEAST_SECTIONS)
    outer = BORE + WALL
    tip = [(0.0, 0.0), (1.4e-3, 0.0), (3.5e-3, 40e-3), (3.5e-3, STOPCOCK + 16e-3, 4e-3)]
    points = [*tip, (outer, BARREL_FROM, 6e-3), (outer, TOP, 0.5e-3), (0.0, TOP)]
    outline = sampled_polyline(rounded_strokes(points), round(0.3 / max(spacing, 0.02)))
    narrow = [(0.0, -1e-3), (0.5e-3, -1e-3), (0.5e-3, 2e-3), (1.2e-3, 40e-3), (1.2e-3, STOPCOCK + 12e-3)]
    bore = np.array([*narrow, (BORE, BARREL_FROM + 2e-3), (BORE, TOP + 1e-3), (0.0, TOP + 1e-3)])
    around = sections_for(8e-3, spacing, 8)
    housing = cylinder((0.0, STOPCOCK, -13e-3), (0.0, STOPCOCK, 13e-3), (8.0e-3, 8.0e-3), around)
    body = united_mesh([revolved_solid(outline, sections), housing])
    key = across_flats(KEY_RADIUS, around)
    hole = cylinder((0.0, STOPCOCK, -20e-3), (0.0, STOPCOCK, 20e-3), (key, key), around)
    return refined_mesh(subtracted_mesh(body, [revolved_solid(bore, sections), hole]), spacing * 2.0)


def delivery_tube(faces: int) -> Instrument:
    """Return a gas delivery tube with two right bends; a rubber stopper with its lower face at the origin holds it.

    Outer diameter 8 mm and wall 1 mm: DURAN tubing of borosilicate glass 3.3, product list (SCHOTT).
    """
    outer, wall, bend = 4.0e-3, 1.0e-3, 0.02
    corners = [(0.0, -0.012, 0.0), (0.0, 0.075, 0.0), (0.17, 0.075, 0.0), (0.17, -0.11, 0.0)]

    def build(spacing: float) -> MeshData:
        path = divided_path(bent(corners, bend, spacing, least=4), spacing)
        sections = sections_for(outer, spacing * 0.6)
        walls = [swept(path, [radius] * len(path), sections) for radius in (outer - wall, outer)]
        # Both ends face downwards, and are round.
        ends = [0.5 * (walls[0][i] + walls[1][i]) + [0.0, -0.5 * wall, 0.0] for i in (-1, 0)]
        return sewn([*walls[0], ends[0], *walls[1][::-1], ends[1]], around=True, falling_from=len(path) + 1)

    return weighed_instrument("delivery_tube", fitted_mesh(build, faces, 0.02)[0], "glass tube delivery_tube")


def gas_jar_cover(faces: int) -> Instrument:
    """Return the round glass plate, 84 mm wide and 3 mm thick, that closes a gas jar."""
    radius, thickness, bevel = 42.0e-3, 3.0e-3, 0.5e-3
    sections = max(12, round((faces / 10.0) ** 0.5 * 1.8))
    bands = max(2, round(faces / 2.0 / sections))
    across = np.linspace(radius - bevel, 0.0, max(2, (bands - 3) // 2 + 1))
    edge = [(radius, bevel), (radius, thickness - bevel)]
    outline = [*((r, 0.0) for r in across[::-1]), *edge, *((r, thickness) for r in across)]
    return weighed_instrument("gas_jar_cover", revolved_solid(np.array(outline), sections), "glass plate")
