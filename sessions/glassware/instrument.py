"""What an instrument is: a closed mesh, what it is made of, where liquid stands in it, and which parts move.

Conventions: metres, +Y up; the origin is the centre of the base, unless ``Instrument.origin`` names another place.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sessions.mesh_data import MeshData

Point = tuple[float, float, float]

TYPICAL = "typical dimensions, own choice"
GLASS = "borosilicate glass 3.3"
MILLILITRE = 1e-6

# kg/m3. Borosilicate 3.3: ISO 3585 states 2.23 g/cm3. The others are round handbook values: masses are estimates.
DENSITY: Mapping[str, float] = {
    GLASS: 2230.0, "porcelain": 2400.0, "steel": 7850.0, "wood": 650.0,
    "rubber": 1100.0, "laminate": 1400.0, "tissue": 1050.0, "plastic": 1050.0,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Opening:
    """The disc through which liquid enters and leaves.

    ``lip`` is the point it leaves from when the vessel tips towards ``pour_direction``: the spout's edge, or the rim.
    """

    centre: Point
    normal: Point
    radius: float
    lip: Point
    pour_direction: Point

    @classmethod
    def upwards(cls, radius: float, height: float, reach: float = 0.0) -> "Opening":
        """Return the opening of an upright vessel; its lip lies towards +X, ``reach`` metres beyond the radius."""
        lip = (radius + reach, height, 0.0)
        centre, up, x = (0.0, height, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
        return cls(centre=centre, normal=up, radius=radius, lip=lip, pour_direction=x)


@dataclass(frozen=True, kw_only=True, eq=False)
class Cavity:
    """The space where liquid stands: closed meshes whose walls are the inner walls of the glass.

    ``to_mark`` and ``to_brim`` are the liquid when filled to the mark, and to the rim. ``capacity_m3`` is the nominal
    volume up to the mark, which ``to_mark`` encloses between the heights y ``floor_height`` and ``mark_height``.
    """

    capacity_m3: float
    floor_height: float
    mark_height: float
    to_mark: MeshData
    to_brim: MeshData
    opening: Opening

    def __post_init__(self) -> None:
        object.__setattr__(self, "to_mark", in_single_precision(self.to_mark))
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
            **{name: [round(float(value), 6) for value in place] for name, place in points.items()},
        }


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A wall of constant ``thickness`` wherever the inner surface lies at a height y in ``span``."""

    thickness: float
    span: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Site:
    """A named place of an instrument: a tip, the axis of a clamp, a hole of a rack."""

    point: Point
    direction: Point = (0.0, 1.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A revolute joint: the part turns about ``axis`` through ``origin`` (both in the parent's frame), in radians."""

    origin: Point
    axis: Point
    lower: float
    upper: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """An instrument that belongs to another one: where its origin lies in the parent, and how it may move."""

    instrument: "Instrument"
    position: Point = (0.0, 0.0, 0.0)
    joint: Joint | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Instrument:
    """One instrument of the bench.

    Attributes
    ----------
    name, mesh : the row of the table it was made from, and its closed surface.
    tags : what effects select by: ``glass vessel hot sharp tool furniture hand ...``.
    material, mass : mass in kg is volume times density, an estimate, unless the maker states one.
    wall, cavity : only where they apply: a rod has neither.
    sites : named places.
    parts : movable or loose parts, each with a closed mesh of its own.
    sources : where the dimensions come from.
    """

    name: str
    mesh: MeshData
    tags: tuple[str, ...]
    material: str
    sources: tuple[str, ...]
    mass: float
    wall: Wall | None = None
    cavity: Cavity | None = None
    sites: Mapping[str, Site] = field(default_factory=dict)
    parts: tuple[Part, ...] = ()
    origin: str = "centre of the base"

    def __post_init__(self) -> None:
        object.__setattr__(self, "mesh", in_single_precision(self.mesh))


def in_single_precision(mesh: MeshData) -> MeshData:
    """Return the mesh with its vertices rounded to what float32 holds.

    Then what a viewer draws, an engine computes with and a session file keeps is one geometry, and the file needs no
    second copy in float64. The rounding is at most 6e-8 of a coordinate: 0.03 um for the tallest glass here.
    """
    return MeshData(mesh.vertices.astype(np.float32), mesh.faces)


def mass_of(mesh: MeshData, material: str) -> float:
    """Return the volume of the closed mesh times the density of its material, in kg."""
    return mesh.volume * DENSITY[material]


def weighed(
    name: str, mesh: MeshData, tags: str, material: str, sources: tuple[str, ...] = (TYPICAL,), **more: Any
) -> Instrument:
    """Return the instrument of this mesh, weighed unless ``mass`` is given; ``tags`` are the words of one string."""
    fields = {"tags": tuple(tags.split()), "sources": sources, "mass": mass_of(mesh, material), **more}
    return Instrument(name=name, mesh=mesh, material=material, **fields)
