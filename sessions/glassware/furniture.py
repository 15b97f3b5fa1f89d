"""What things stand on: bench, test tube rack, stand with clamp, tripod with wire gauze."""

import numpy as np
from numpy.typing import NDArray

from sessions.geometry.solids import box
from sessions.glassware.instrument import Instrument, weighed
from sessions.glassware.solid_parts import bent, cylinder, fitted, fitted_union, grounded, ring, rod, sections_for
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined, subtracted, united

RACK_HOLES = 6
RACK_PITCH = 36.0e-3


def bench(faces: int, *, width: float = 1.6, depth: float = 0.75, height: float = 0.9) -> Instrument:
    """Return a laboratory bench on four legs; its working surface is the plane y = ``height``."""
    top, leg, inset = 0.04, 0.06, 0.03

    def parts(_: float) -> list[MeshData]:
        slab = box((width, top, depth), (0.0, height - top / 2.0, 0.0))
        rail = box((width - 4.0 * inset, 0.08, 0.02), (0.0, height - top - 0.035, -depth / 2.0 + inset + leg / 2.0))
        x, z, tall = width / 2.0 - inset - leg / 2.0, depth / 2.0 - inset - leg / 2.0, height - top / 2.0
        legs = [box((leg, tall, leg), (sx * x, tall / 2.0, sz * z)) for sx in (-1, 1) for sz in (-1, 1)]
        return [slab, rail, *legs]

    return weighed("bench", fitted_union(parts, faces, 0.1), "bench furniture", "laminate")


def test_tube_rack(faces: int) -> Instrument:
    """Return a wooden rack for six tubes of 16 mm, `RACK_PITCH` apart along X; they stand in hollows of its floor."""
    length, depth, tall, floor, hollow = RACK_HOLES * RACK_PITCH + 24.0e-3, 60.0e-3, 95.0e-3, 14.0e-3, 4.0e-3
    places = [(i - (RACK_HOLES - 1) / 2.0) * RACK_PITCH for i in range(RACK_HOLES)]

    def build(spacing: float) -> MeshData:
        ends = [-length / 2.0 + 5.0e-3 + 1.0e-3, length / 2.0 - 5.0e-3 - 1.0e-3]
        boards = [
            box((length, floor, depth), (0.0, floor / 2.0, 0.0)),
            box((length, 8.0e-3, depth), (0.0, tall - 10.0e-3, 0.0)),
            *(box((10.0e-3, tall, depth - 6.0e-3), (x, tall / 2.0 + 1.0e-3, 0.0)) for x in ends),
        ]
        sections = sections_for(9.0e-3, spacing)
        holes = [cylinder((x, floor - hollow, 0.0), (x, tall + 0.05, 0.0), 9.0e-3, sections) for x in places]
        return refined(subtracted(united(boards), holes), spacing * 2.0)

    return weighed("test_tube_rack", fitted(build, faces, 0.01)[0], "rack furniture", "wood")


test_tube_rack.__test__ = False  # type: ignore[attr-defined]  # pytest collects names that start with test


def stand(faces: int, *, clamp_height: float = 0.45, grip_radius: float = 7.0e-3) -> Instrument:
    """Return a stand with a clamp that grips ``grip_radius``; the axis of what it holds is 60 mm before its middle."""
    base, rod_radius, tall, back, jaw = 12.0e-3, 6.0e-3, 0.65, -0.07, 3.5e-3
    axis_z = back + 0.13

    def parts(spacing: float) -> list[MeshData]:
        around = sections_for(rod_radius, spacing)
        reach = grip_radius + jaw
        angles = np.radians(np.linspace(-50.0, 230.0, max(9, round(4.9 * reach / spacing))))
        away = axis_z - reach * np.sin(angles)
        bow = np.column_stack([reach * np.cos(angles), np.full_like(angles, clamp_height), away])
        thin, screw = sections_for(4.0e-3, spacing), axis_z - 0.04
        # x, height above the clamp and z of both ends, radius
        rounds = [
            (0.0, 0.0, back, 0.0, 0.0, axis_z - reach, 5.0e-3),
            (8.0e-3, 0.0, back, 34.0e-3, 0.0, back, 4.0e-3),
            (30.0e-3, 0.0, back, 38.0e-3, 0.0, back, 9.0e-3),
            (0.0, 2e-3, screw, 0.0, 0.028, screw, 3.0e-3),
            (0.0, 0.024, screw, 0.0, 0.03, screw, 8.0e-3),
        ]
        return [
            box((0.14, base, 0.22), (0.0, base / 2.0, 0.01)),
            cylinder((0.0, base / 2.0, back), (0.0, tall, back), rod_radius, around),
            box((28.0e-3, 34.0e-3, 26.0e-3), (0.0, clamp_height, back)),
            *(
                cylinder((x0, clamp_height + y0, z0), (x1, clamp_height + y1, z1), radius, thin)
                for x0, y0, z0, x1, y1, z1, radius in rounds
            ),
            rod(bow, jaw, thin),
        ]

    return weighed("stand", fitted_union(parts, faces), "stand metal furniture", "steel")


def tripod(faces: int) -> Instrument:
    """Return a tripod, 0.21 m high; a wire gauze lies on its ring."""
    tall, ring_radius, leg = 0.21, 62.0e-3, 4.0e-3
    middle = tall - 4.0e-3

    def parts(spacing: float) -> list[MeshData]:
        outline = [(-7e-3, -4e-3), (7e-3, -4e-3), (7e-3, 4e-3), (-7e-3, 4e-3)]
        hoop = ring([(ring_radius + r, middle + y) for r, y in outline], sections_for(ring_radius, spacing, 18))
        thin = sections_for(leg, spacing, 6)
        paths = [_leg_path(angle, ring_radius, middle, leg, spacing) for angle in (90, 210, 330)]
        return [hoop, *(rod(path, leg, thin) for path in paths)]

    return weighed("tripod", grounded(fitted_union(parts, faces)), "tripod metal furniture", "steel")


def wire_gauze(faces: int) -> Instrument:
    """Return a square wire gauze of 125 mm with a ceramic centre, as a solid plate."""
    side, plate, disc = 0.125, 1.2e-3, 2.4e-3

    def parts(spacing: float) -> list[MeshData]:
        across = sections_for(45.0e-3, spacing, 16)
        middle = cylinder((0.0, plate / 2.0, 0.0), (0.0, disc, 0.0), 45.0e-3, across, 43.5e-3)
        wires = [-side / 2.0 + 4.0e-3, side / 2.0 - 4.0e-3]
        hems = [box((side - 3e-3, plate, 3e-3), (0.0, plate * 0.8, z)) for z in wires]
        hems += [box((3e-3, plate, side - 3e-3), (x, plate * 0.8, 0.0)) for x in wires]
        return [box((side, plate, side), (0.0, plate / 2.0, 0.0)), middle, *hems]

    return weighed("wire_gauze", fitted_union(parts, faces), "gauze metal", "steel")


def _leg_path(angle_deg: float, ring_radius: float, height: float, foot: float, spacing: float) -> NDArray[np.float64]:
    outward = np.array([np.cos(np.radians(angle_deg)), 0.0, -np.sin(np.radians(angle_deg))])
    places = [(ring_radius, height), (ring_radius, height - 0.02), (ring_radius + 0.03, foot)]
    return bent([outward * r + np.array([0.0, y, 0.0]) for r, y in places], 0.02, spacing)
