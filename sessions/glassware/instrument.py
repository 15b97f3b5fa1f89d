"""Instruments: a closed mesh, its mass, its cavity for liquid, and named points for procedures.

Conventions: metres, +Y up; the origin is the centre of the base, unless the instrument's function names another place.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sessions.mesh_data import MeshData

Point = tuple[float, float, float]

GLASS = "borosilicate glass 3.3"
MILLILITRE = 1e-6

# kg/m3. Borosilicate 3.3: ISO 3585 states 2.23 g/cm3. The others are round handbook values: masses are estimates.
DENSITY: Mapping[str, float] = {
    GLASS: 2230.0,
    "porcelain": 2400.0,
    "steel": 7850.0,
    "wood": 650.0,
    "rubber": 1100.0,
    "laminate": 1400.0,
    "tissue": 1050.0,
    "plastic": 1050.0,
}


@dataclass(frozen=True, kw_only=True)
class Opening:
    """The disc through which liquid enters and leaves.

    ``lip`` is the point it leaves from when the vessel tips towards +X: the spout's edge, or the rim.
    """

    centre: Point
    normal: Point
    radius: float
    lip: Point

    @classmethod
    def upwards(cls, radius: float, height: float, reach: float = 0.0) -> "Opening":
        """Return the opening of an upright vessel; its lip lies ``reach`` metres beyond the radius."""
        lip = (radius + reach, height, 0.0)
        return cls(centre=(0.0, height, 0.0), normal=(0.0, 1.0, 0.0), radius=radius, lip=lip)


@dataclass(frozen=True, kw_only=True, eq=False)
class Cavity:
    """The space where liquid stands.

    ``to_brim`` is the liquid when filled to the rim: a closed mesh whose walls are the inner walls of the glass.
    ``capacity_m3`` is the nominal volume, between the heights y ``floor_height`` and ``mark_height``.
    """

    capacity_m3: float
    floor_height: float
    mark_height: float
    to_brim: MeshData
    opening: Opening

    def __post_init__(self) -> None:
        object.__setattr__(self, "to_brim", in_single_precision(self.to_brim))

    @property
    def table(self) -> dict[str, Any]:
        """The cavity as a scene writes it: metres and millilitres, in the body's frame."""
        points = {"opening": self.opening.centre, "lip": self.opening.lip}
        return {
            "capacity_ml": round(float(self.capacity_m3) * 1e6, 3),
            "floor": round(float(self.floor_height), 6),
            "mark": round(float(self.mark_height), 6),
            "opening_radius": round(float(self.opening.radius), 6),
            **{name: [round(float(value), 6) for value in point] for name, point in points.items()},
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Instrument:
    """One instrument of the bench.

    Attributes
    ----------
    name, mesh : the row of the table it was made from, and its closed surface.
    tags : what effects select by: ``glass vessel hot sharp tool furniture hand ...``.
    mass : kg, volume times density, an estimate, unless the maker states one.
    cavity : of a vessel.
    sites : places in its frame that a procedure needs: a grip, a flame.
    """

    name: str
    mesh: MeshData
    tags: tuple[str, ...]
    mass: float
    cavity: Cavity | None = None
    sites: Mapping[str, Point] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mesh", in_single_precision(self.mesh))


def in_single_precision(mesh: MeshData) -> MeshData:
    """Return the mesh with its vertices rounded to what float32 holds.

    Then what a viewer draws, an engine computes with and a session file keeps is one geometry, and the file needs no
    second copy in float64. The rounding is at most 6e-8 of a coordinate: 0.03 um for the tallest glass here.
    """
    return MeshData(mesh.vertices.astype(np.float32), mesh.faces)


def weighed_instrument(
    name: str,
    mesh: MeshData,
    tags: str,
    material: str = GLASS,
    *,
    mass: float | None = None,
    cavity: Cavity | None = None,
    sites: Mapping[str, Point] | None = None,
) -> Instrument:
    """Return the instrument of this mesh, weighed unless ``mass`` is given; ``tags`` are the words of one string."""
    kilograms = mesh.volume * DENSITY[material] if mass is None else mass
    return Instrument(name=name, mesh=mesh, tags=tuple(tags.split()), mass=kilograms, cavity=cavity, sites=sites or {})


@cache
def rows(table: str) -> dict[str, dict[str, Any]]:
    """Return the rows of a table of this package, by instrument."""
    return tomllib.loads(Path(__file__).with_name(table).read_text(encoding="utf-8"))


def metres(millimetres: Any) -> Any:
    """Return a length, or nested lists of lengths, in metres: the same numbers as if they were written in metres."""
    if isinstance(millimetres, list):
        return [metres(value) for value in millimetres]
    return float(f"{millimetres}e-3")
