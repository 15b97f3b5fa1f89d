"""Things made of boxes and round bars, from the rows of `united.toml`: furniture, and the key of a stopcock."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sessions.geometry.solids import box
from sessions.glassware.instrument import Instrument, metres, weighed
from sessions.glassware.solid_parts import across_corners, bent, cylinder, fitted, grounded, ring, rod, sections_for
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

    mesh = fitted(build, faces, metres(row["spacing"]))[0]
    return weighed(name, grounded(mesh) if row.get("grounded") else mesh, row["tags"], row["material"])


def _solid(part: dict[str, Any], spacing: float) -> MeshData:
    if "box" in part:
        return box([metres(size) for size in part["box"]], [metres(value) for value in part["at"]])
    radius = metres(part["radius"])
    around = sections_for(metres(part.get("round", part["radius"])), spacing, part.get("least", 8))
    if "hoop" in part:
        width, height = (metres(size) / 2.0 for size in part["hoop"])
        corners = [(-width, -height), (width, -height), (width, height), (-width, height)]
        return ring([(radius + r, metres(part["at"][1]) + y) for r, y in corners], around)
    if "path" in part:
        angle = np.radians(part["turned_deg"])
        outward, up = np.array([np.cos(angle), 0.0, -np.sin(angle)]), np.array([0.0, 1.0, 0.0])
        points = [outward * metres(r) + up * metres(y) for r, y in part["path"]]
        return rod(bent(points, metres(part["bend"]), spacing), radius, around)
    if "arc" in part:
        reach, (x, y, z) = metres(part["arc"]), (metres(value) for value in part["at"])
        count = max(9, round(4.9 * reach / spacing))
        angles = np.radians(np.linspace(part["from_deg"], part["to_deg"], count))
        path = np.column_stack([x + reach * np.cos(angles), np.full_like(angles, y), z - reach * np.sin(angles)])
        return rod(path, radius, around)
    if part.get("across") == "corners":
        radius = across_corners(radius, around)
    start, end = ([metres(value) for value in part[key]] for key in ("from", "to"))
    end_radius = metres(part["end_radius"]) if "end_radius" in part else None
    return cylinder(start, end, radius, around, end_radius)
