"""What things stand on: bench, test tube rack, stand with clamp and wire gauze of `united.toml`, and a tripod."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.geometry.solids import box
from sessions.glassware.instrument import Instrument, metres, weighed
from sessions.glassware.solid_parts import bent, cylinder, fitted, fitted_union, grounded, ring, rod, sections_for
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined, subtracted, united


@cache
def united_rows() -> dict[str, dict[str, Any]]:
    """The rows of `united.toml`."""
    return tomllib.loads(Path(__file__).with_name("united.toml").read_text(encoding="utf-8"))


def from_row(faces: int, *, name: str) -> Instrument:
    """Return the instrument that a row of `united.toml` describes."""
    row = united_rows()[name]

    def build(spacing: float) -> MeshData:
        whole = united([_solid(part, spacing) for part in row["parts"]])
        if "holes" in row:
            whole = subtracted(whole, [_solid(hole, spacing) for hole in row["holes"]])
        return refined(whole, spacing * row.get("coarser", 1.0))

    return weighed(name, fitted(build, faces, metres(row["spacing"]))[0], row["tags"], row["material"])


def _solid(part: dict[str, Any], spacing: float) -> MeshData:
    if "box" in part:
        return box([metres(size) for size in part["box"]], [metres(value) for value in part["at"]])
    radius = metres(part["radius"])
    around = sections_for(metres(part.get("round", part["radius"])), spacing, part.get("least", 8))
    if "arc" in part:
        reach, (x, y, z) = metres(part["arc"]), (metres(value) for value in part["at"])
        count = max(9, round(4.9 * reach / spacing))
        angles = np.radians(np.linspace(part["from_deg"], part["to_deg"], count))
        path = np.column_stack([x + reach * np.cos(angles), np.full_like(angles, y), z - reach * np.sin(angles)])
        return rod(path, radius, around)
    start, end = ([metres(value) for value in part[key]] for key in ("from", "to"))
    return cylinder(start, end, radius, around, metres(part.get("end_radius", part["radius"])))


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


def _leg_path(angle_deg: float, ring_radius: float, height: float, foot: float, spacing: float) -> NDArray[np.float64]:
    outward = np.array([np.cos(np.radians(angle_deg)), 0.0, -np.sin(np.radians(angle_deg))])
    places = [(ring_radius, height), (ring_radius, height - 0.02), (ring_radius + 0.03, foot)]
    return bent([outward * r + np.array([0.0, y, 0.0]) for r, y in places], 0.02, spacing)
