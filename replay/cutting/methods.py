"""The table of ways to put convex pieces in place of a mesh. The only module that imports ``vhacdx`` and ``coacd``."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Final

import numpy as np

from cdcore.bounding.collider_shapes import box_collider, capsule_collider, sphere_collider
from cdcore.bounding.hull import hull_collider
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.numerics import FloatArray, IntArray
from replay.cutting import planes, sectors
from replay.cutting.convex_solids import area_of, volume_of
from replay.cutting.joins import Ladder
from replay.cutting.planes import plane_ladder
from replay.cutting.sectors import round_axis, sector_ladder

AUTO_METHOD: Final = "auto"
"""Name that stands for ``sectors`` of a round body, and for ``vhacd`` of another one."""

COACD_SEARCH: Final = {"mcts_nodes": 10, "mcts_iterations": 60}
"""Half of CoACD's usual search: 16 pieces of a beaker of 3,168 faces take 10 s, not 30 (2 cores, 2026-11)."""

VHACD_VOXELS: Final = 100_000
"""A quarter of V-HACD's usual resolution: 16 pieces of a beaker of 3,168 faces take 4 s, not 9 (2 cores, 2026-11)."""

VHACD_SECONDS: Final = 1.35e-4
"""Seconds that V-HACD takes for a voxel at the surface of a body whose hull fills its box (2 cores, 2026-11)."""

LEAST_FILLED_FRACTION: Final = 0.05
"""Fraction of its box that a hull fills at least, as far as time is concerned."""

USUAL_FACES: Final = 3000
"""Of the mesh for which the seconds of the other methods are given; more faces hardly take them longer."""

SEED: Final = 0

NOT_INSTALLED: Final = "none"
"""Stands for the version of a package that is not installed."""


@dataclass(frozen=True)
class Method:
    """One way to put convex pieces in place of a mesh.

    Parameters
    ----------
    words : what it is called in a sentence.
    seconds : of a mesh -> that it takes on one core, about; ``None``: no process of its own is worth it.
    cut : a mesh and the most pieces -> all pieces it may come to; ``None``: the method cannot cut this mesh.
    version : of what cuts: pieces that another version made are made again; ``NOT_INSTALLED``: its package is absent.
    package : that cuts, as ``pip install`` takes it; ``""``: this project does.
    counts : whether it takes the most pieces; otherwise it always gives one.
    ladder : whether one cut serves every number of pieces.
    """

    words: str
    seconds: Callable[[TriangleMesh], float] | None
    cut: Callable[[TriangleMesh, int], Ladder | None]
    version: Callable[[], str]
    package: str = ""
    counts: bool = True
    ladder: bool = False

    @property
    def not_installed(self) -> str:
        """Why no mesh can be cut, as the end of a sentence; ``""``: what it needs is installed."""
        if self.version() != NOT_INSTALLED:
            return ""
        return f"{self.words} needs the package {self.package}, which is not installed (pip install {self.package})"


def method_of(name: str, mesh: TriangleMesh) -> str:
    """The row of the table for a mesh: that of the name, and of ``auto`` the quickest that can cut it."""
    if name != AUTO_METHOD:
        return name
    return "sectors" if _is_round(mesh) else "vhacd"


@once_a_mesh
def _is_round(mesh: TriangleMesh) -> bool:
    return mesh.is_closed and round_axis(mesh) is not None


def _single_piece_cut(make: Callable[[TriangleMesh], TriangleMesh]) -> Callable[[TriangleMesh, int], Ladder]:
    """A cut that gives one solid."""
    return lambda mesh, _most: _separate_pieces([make(mesh).vertices])


def _separate_pieces(corners: list[FloatArray]) -> Ladder:
    """Pieces of these corners, none of which joins another."""
    ends: IntArray = np.cumsum([len(piece) for piece in corners])
    return Ladder(np.concatenate(corners), ends, np.zeros((0, 2), dtype=np.int64))


def _sector_pieces(mesh: TriangleMesh, _most: int) -> Ladder | None:
    return sector_ladder(mesh)


def _plane_pieces(mesh: TriangleMesh, _most: int) -> Ladder | None:
    return plane_ladder(mesh)


def _vhacd_pieces(mesh: TriangleMesh, most_pieces: int) -> Ladder | None:
    """Source: Mamou, V-HACD 4, what Godot and Unreal run. ``asyncACD`` off: with threads pieces change their order."""
    from vhacdx import compute_vhacd

    corners = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
    counted_faces = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).astype(np.uint32).ravel()
    pieces = compute_vhacd(corners, counted_faces, maxConvexHulls=most_pieces, resolution=VHACD_VOXELS, asyncACD=False)
    return _separate_pieces([np.array(piece, dtype=np.float64) for piece, _ in pieces]) if pieces else None


def _coacd_pieces(mesh: TriangleMesh, most_pieces: int) -> Ladder | None:
    """Source: CoACD (Wei, Liu, Ling, Su 2022)."""
    import coacd

    coacd.set_log_level("off")
    pieces = coacd.run_coacd(
        coacd.Mesh(mesh.vertices, mesh.faces), max_convex_hull=most_pieces, seed=SEED, **COACD_SEARCH
    )
    return _separate_pieces([np.array(piece, dtype=np.float64) for piece, _ in pieces]) if pieces else None


def _seconds_by_faces(seconds: float) -> Callable[[TriangleMesh], float]:
    """Seconds of a mesh that grow with its faces; ``seconds``: of one with ``USUAL_FACES`` or more.

    Cost: within 2.3 of what was measured for 10 hollow bodies of 1,500 to 5,400 faces, but 4.5 for CoACD of a headset.
    """
    return lambda mesh: seconds * min(1.0, max(0.3, len(mesh.faces) / USUAL_FACES))


def _vhacd_seconds(mesh: TriangleMesh) -> float:
    """Seconds of V-HACD: voxels at the surface, and the more of them the less of its box the hull of a mesh fills.

    Cost: within 1.8 of what it took for 19 instruments and hands of 500 to 5,400 faces, whatever the number of pieces.
    """
    box_sides = np.ptp(mesh.vertices, axis=0)
    voxel_edge = float(box_sides.max()) / VHACD_VOXELS ** (1.0 / 3.0)
    filled_fraction = abs(volume_of(hull_collider(mesh))) / max(float(box_sides.prod()), 1e-300)
    return float(VHACD_SECONDS * area_of(mesh) / voxel_edge**2 / max(filled_fraction, LEAST_FILLED_FRACTION))


def _own_version() -> str:
    return sectors.PIECES_VERSION


def _planes_version() -> str:
    return planes.PIECES_VERSION


def _version_of(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return NOT_INSTALLED


METHODS: Final[dict[str, Method]] = {
    "hull": Method("one hull", None, _single_piece_cut(hull_collider), _own_version, counts=False),
    "box": Method("one box", None, _single_piece_cut(box_collider), _own_version, counts=False),
    "sphere": Method("one sphere", None, _single_piece_cut(sphere_collider), _own_version, counts=False),
    "capsule": Method("one capsule", None, _single_piece_cut(capsule_collider), _own_version, counts=False),
    "sectors": Method("sectors by height and angle", _seconds_by_faces(1.4), _sector_pieces, _own_version, ladder=True),
    "planes": Method("planes", _seconds_by_faces(7.0), _plane_pieces, _planes_version, ladder=True),
    "vhacd": Method("V-HACD", _vhacd_seconds, _vhacd_pieces, lambda: _version_of("vhacdx"), package="vhacdx"),
    "coacd": Method("CoACD", _seconds_by_faces(12.0), _coacd_pieces, lambda: _version_of("coacd"), package="coacd"),
}
"""Name -> the method."""
