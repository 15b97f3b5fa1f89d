"""What hands hold, and what closes a vessel: stirring rod, tongs, delivery tube, stopper, cover of a gas jar."""

import numpy as np
from numpy.typing import NDArray

from sessions.geometry.profile import Arc, Line, Stroke, sampled
from sessions.geometry.rings import sewn, turned_solid
from sessions.glassware.instrument import Instrument, weighed
from sessions.glassware.solid_parts import (
    bent,
    cylinder,
    fitted,
    grounded,
    ring,
    rod,
    sections_for,
    swept,
)
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined, united


def stirring_rod(faces: int) -> Instrument:
    """Return a solid glass rod of 6 mm with round ends, upright on its lower end."""
    radius, length = 3.0e-3, 0.2
    strokes: list[Stroke] = [
        Arc((0.0, radius), radius, -np.pi / 2.0, 0.0, least=3),
        Line((radius, radius), (radius, length - radius)),
        Arc((0.0, length - radius), radius, 0.0, np.pi / 2.0, least=3),
    ]
    segments = round(faces / 2.0 / float(np.clip((faces / 20.0) ** 0.5, 10.0, 96.0)))
    outline = sampled(strokes, segments)
    mesh = turned_solid(outline, max(8, round(faces / 2.0 / (len(outline) - 2))))
    return weighed("stirring_rod", mesh, "glass tool rod", sites={"grip": (0.0, 0.85 * length, 0.0)})


def tongs(faces: int) -> Instrument:
    """Return crucible tongs, 240 mm long, lying flat, 10 degrees open: one rigid piece.

    Jaws towards -Z, the pivot over the origin.
    """
    radius, handle = 3.0e-3, 15.0e-3
    jaw = [(-2e-3, 0.0, -0.118), (-4e-3, 0.0, -0.1), (-17e-3, 0.0, -0.072), (-6e-3, 0.0, -0.03)]

    def arm(mirror: float, spacing: float) -> list[MeshData]:
        half = np.radians(5.0)
        turn = np.array([[np.cos(half), 0.0, np.sin(half)], [0.0, 1.0, 0.0], [-np.sin(half), 0.0, np.cos(half)]])
        flip, shift = np.array([mirror, 1.0, 1.0]), np.array([0.0, radius, 0.0])
        path = bent([*jaw, (0.0, 0.0, 0.0), (12e-3, 0.0, 0.085)], 0.02, spacing, least=1)
        around = sections_for(radius, spacing, 5)
        angle = np.linspace(0.0, 2.0 * np.pi, max(8, round(2.0 * np.pi * handle / spacing)), endpoint=False)
        circle = np.column_stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)])
        loop = np.array((12e-3 + handle, 0.0, 0.085)) + handle * circle
        rings = swept(np.concatenate([loop[-1:], loop, loop[:1]]), [radius] * (len(loop) + 2), around)[1:-1]
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.diag(flip) @ turn, shift
        bar = rod((path @ turn.T) * flip + shift, radius, around)
        return [bar, sewn(rings, around=True).transformed(pose)]

    def parts(spacing: float) -> list[MeshData]:
        pin = cylinder((0.0, 0.0, 0.0), (0.0, 2.6 * radius, 0.0), 6.0e-3, sections_for(6e-3, spacing))
        return [pin, *arm(1.0, spacing), *arm(-1.0, spacing)]

    mesh, _ = fitted(lambda spacing: refined(united(parts(spacing)), spacing), faces, 0.008)
    return weighed("tongs", grounded(mesh), "tongs metal tool", "steel")


def delivery_tube(faces: int) -> Instrument:
    """Return a gas delivery tube with two right bends; a rubber stopper with its lower face at the origin holds it.

    Outer diameter 8 mm and wall 1 mm: DURAN tubing of borosilicate glass 3.3, product list (SCHOTT).
    """
    outer, wall, bend = 4.0e-3, 1.0e-3, 0.02
    corners = [(0.0, -0.012, 0.0), (0.0, 0.075, 0.0), (0.17, 0.075, 0.0), (0.17, -0.11, 0.0)]

    def build(spacing: float) -> MeshData:
        path = bent(corners, bend, spacing, least=4)
        pieces = [_cut(path[i], path[i + 1], spacing) for i in range(len(path) - 1)]
        fine = np.concatenate([*pieces, path[-1:]])
        sections = sections_for(outer, spacing * 0.6)
        walls = [swept(fine, [radius] * len(fine), sections) for radius in (outer - wall, outer)]
        ends = [
            0.5 * (walls[0][i] + walls[1][i]) + 0.5 * wall * step / np.linalg.norm(step)
            for i, step in ((-1, fine[-1] - fine[-2]), (0, fine[0] - fine[1]))
        ]
        return sewn([*walls[0], ends[0], *walls[1][::-1], ends[1]], around=True, falling_from=len(fine) + 1)

    return weighed("delivery_tube", fitted(build, faces, 0.02)[0], "glass tube delivery_tube")


def rubber_stopper(faces: int) -> Instrument:
    """Return a bored rubber stopper, 29 to 33 mm wide and 28 mm high, that fits the delivery tube."""

    def build(spacing: float) -> MeshData:
        hole = 4.1e-3
        corners = np.array([(hole, 0.0), (14.5e-3, 0.0), (16.5e-3, 28e-3), (hole, 28e-3), (hole, 0.0)])
        outline = np.concatenate([_cut(corners[i], corners[i + 1], spacing) for i in range(4)])
        return ring(outline, sections_for(16e-3, spacing, 12))

    return weighed("rubber_stopper", fitted(build, faces, 0.004)[0], "rubber stopper", "rubber")


def gas_jar_cover(faces: int) -> Instrument:
    """Return the round glass plate, 84 mm wide and 3 mm thick, that closes a gas jar."""
    radius, thickness, bevel = 42.0e-3, 3.0e-3, 0.5e-3
    sections = max(12, round((faces / 10.0) ** 0.5 * 1.8))
    bands = max(2, round(faces / 2.0 / sections))
    across = np.linspace(radius - bevel, 0.0, max(2, (bands - 3) // 2 + 1))
    edge = [(radius, bevel), (radius, thickness - bevel)]
    outline = [*((r, 0.0) for r in across[::-1]), *edge, *((r, thickness) for r in across)]
    return weighed("gas_jar_cover", turned_solid(np.array(outline), sections), "glass plate")


def _cut(start: NDArray[np.float64], end: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return points from ``start``, included, to ``end``, left out, about ``spacing`` apart."""
    count = max(1, round(float(np.linalg.norm(end - start)) / spacing))
    return np.linspace(start, end, count, endpoint=False)
