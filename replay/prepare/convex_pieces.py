"""A compound collider: a mesh cut into convex pieces, as engines ship them. The only module that imports ``coacd``.

Cutting takes seconds, so the pieces are kept in the user's cache folder under the hash of the mesh.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import reduce
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

import numpy as np
from platformdirs import user_cache_path

from cdcore.bounding.hull import hull_collider, hull_of
from cdcore.errors import MissingEngineError
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from cdcore.protocol import Body, Solids
from sessions.whole_files import whole_file

if TYPE_CHECKING:
    from manifold3d import Manifold

SEARCH: Final = {"mcts_nodes": 10, "mcts_iterations": 60}
"""Half of CoACD's usual search: 16 pieces of a beaker of 3,168 faces take 10 s, not 30 (2 cores, 2026-11)."""
CUT_SECONDS: Final = 10.0

WATCH_SECONDS: Final = 0.5
"""How often somebody who waits for pieces is called."""

Watch = Callable[[], None]
"""Called while pieces are cut; raises to end that."""

MOST_TRIANGLES: Final = 255
"""Of one convex collider: the limit of Unity and of PhysX."""


def in_convex_pieces(bodies: Sequence[Body], most: int) -> tuple[Body, ...]:
    """The bodies with at most this many convex pieces each as their colliders; equal meshes are cut once."""
    cut: dict[str, Solids] = {}
    for body in bodies:
        if body.mesh.content_hash not in cut:
            cut[body.mesh.content_hash] = solids_of(convex_pieces(body.mesh, most))
    return tuple(replace(body, colliders=cut[body.mesh.content_hash]) for body in bodies)


def solids_of(parts: Sequence[TriangleMesh]) -> Solids:
    """Solids with the surface around them."""
    return Solids(tuple(parts), union_of(parts))


def convex_pieces(mesh: TriangleMesh, most: int, watch: Watch | None = None) -> tuple[TriangleMesh, ...]:
    """At most this many convex solids that together stand for a mesh, always the same ones; of one, the hull.

    ``watch`` is called twice a second while they are cut; what it raises ends the cutting and is raised here.

    A flat mesh, which has no inside, is its own piece. Fewer come out where fewer leave no hollow of 5 % of the size.
    Each has at most 255 triangles, as engines want it, so that corners of a mesh stick out by tenths of a millimetre.

    Source: CoACD (Wei, Liu, Ling, Su 2022). Raises MissingEngineError: ``coacd`` is not installed.
    """
    hull = hull_collider(mesh)
    if hull is mesh:
        return (hull,)
    if most == 1:
        return (within_triangles(hull),)
    return tuple(
        within_triangles(piece) for corners in _kept(mesh, most, watch) if (piece := hull_of(corners)) is not None
    )


def within_triangles(piece: TriangleMesh) -> TriangleMesh:
    """A convex solid with as few triangles as engines take: the hull of the corners that leave least outside."""
    corners = piece.vertices
    if len(piece.faces) <= MOST_TRIANGLES:
        return piece
    ways = np.array([way for way in np.ndindex(3, 3, 3) if way != (1, 1, 1)], dtype=np.float64) - 1.0
    chosen = np.unique((corners @ ways.T).argmax(axis=0))
    while (hull := hull_of(corners[chosen])) is not None:
        outside = beyond_planes(corners, hull)
        # A closed convex solid of V corners has 2 V - 4 triangles. One at a time: neighbours lie outside together.
        if 2 * (len(chosen) + 1) - 4 > MOST_TRIANGLES:
            return hull
        chosen = np.union1d(chosen, outside.argmax())
    return piece


def beyond_planes(points: FloatArray, piece: TriangleMesh) -> FloatArray:
    """Metres by which points (n, 3) lie beyond the planes of the faces of a convex piece, at most 0 inside."""
    corners = piece.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return np.asarray((points @ normals.T - (normals * corners[:, 0]).sum(axis=1)).max(axis=1))


def union_of(pieces: Sequence[TriangleMesh]) -> TriangleMesh:
    """One closed surface around convex solids that may overlap: only there does parity tell inside from outside.

    Where one is open, which none of the convex ones is, they are laid beside each other as they are.
    """
    if len(pieces) == 1:
        return pieces[0]
    if not all(one.is_closed for one in pieces):
        starts = np.cumsum([0, *(len(one.vertices) for one in pieces)])
        faces = [one.faces + start for one, start in zip(pieces, starts, strict=False)]
        return TriangleMesh(np.concatenate([one.vertices for one in pieces]), np.concatenate(faces))
    from manifold3d import Manifold

    # Faces without area, which a thin hull may have, are no manifold: the hull is computed anew.
    solids = [manifold_of(one) or Manifold.hull_points(one.vertices) for one in pieces]
    whole = reduce(lambda joined, solid: joined + solid, solids).to_mesh64()
    return TriangleMesh(whole.vert_properties[:, :3], np.asarray(whole.tri_verts).astype(np.int64))


def manifold_of(mesh: TriangleMesh) -> Manifold | None:
    """A closed mesh for the library manifold; ``None``: it takes it for no solid."""
    from manifold3d import Error, Manifold, Mesh64

    solid = Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    return solid if solid.status() == Error.NoError else None


def seconds_to_cut(meshes: Iterable[TriangleMesh], most: int) -> float:
    """About how long it takes to cut those that are not kept; infinite where ``coacd`` is not installed."""
    if find_spec("coacd") is None:
        return float("inf")
    hashes = {mesh.content_hash for mesh in meshes}
    return CUT_SECONDS * sum(not _file(one, most).is_file() for one in hashes)


def cache_folder() -> Path:
    """Where this user's programs keep what they can compute again."""
    return user_cache_path("vrlab-replay", appauthor=False, opinion=False)


def _file(content_hash: str, most: int) -> Path:
    return cache_folder() / f"pieces-{content_hash[:32]}-{most}-coacd-{version('coacd')}.npz"


def _kept(mesh: TriangleMesh, most: int, watch: Watch | None) -> list[FloatArray]:
    """Corners of every piece, (n, 3): from the cache folder, else cut and left there if it can be written."""
    try:
        import coacd
    except ImportError as error:
        raise MissingEngineError('coacd is not installed; pip install "vrlab-replay[engines]"') from error
    file = _file(mesh.content_hash, most)
    with suppress(Exception), np.load(file) as kept:  # whatever a damaged file raises, it is made again
        return np.split(kept["corners"], kept["ends"][:-1])
    if watch is not None:
        return _cut_in_child(mesh, most, watch)
    coacd.set_log_level("off")
    cut = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), max_convex_hull=most, seed=0, **SEARCH)
    corners = [np.array(piece, dtype=np.float64) for piece, _ in cut]
    # Whole or not at all: another process may be reading, or the disk be full.
    with suppress(OSError), whole_file(file, OSError, parents=True) as fresh:
        np.savez(fresh, corners=np.concatenate(corners), ends=np.cumsum([len(piece) for piece in corners]))
    return corners


def _cut_in_child(mesh: TriangleMesh, most: int, watch: Watch) -> list[FloatArray]:
    """Corners of every piece, cut by a process of its own: the library cannot be interrupted in ours.

    The child leaves the pieces in the cache folder; where that cannot be written, they are cut here and not watched.
    """
    with TemporaryDirectory(prefix="replay-") as folder:
        file = Path(folder) / "mesh.npz"
        np.savez(file, vertices=mesh.vertices, faces=mesh.faces)
        child = subprocess.Popen([sys.executable, "-P", "-c", CHILD, str(file), str(most)])
        try:
            while True:
                try:
                    child.wait(WATCH_SECONDS)
                    break
                except subprocess.TimeoutExpired:
                    watch()
        finally:
            child.kill()
            child.wait()
    return _kept(mesh, most, None)


CHILD: Final = """
import sys
import numpy as np
from cdcore.mesh import TriangleMesh
from replay.prepare.convex_pieces import convex_pieces
with np.load(sys.argv[1]) as mesh:
    convex_pieces(TriangleMesh(mesh["vertices"], mesh["faces"]), int(sys.argv[2]))
"""
"""What a child process runs: it cuts a mesh from a file, and leaves the pieces in the cache folder."""
