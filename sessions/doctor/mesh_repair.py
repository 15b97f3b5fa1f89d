"""Mends a mesh as a mesh editor would: every step is named, and the surface that was there stays where it was."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.meshes import SAME_PLACE_M, degenerate_faces
from sessions.mesh_data import MeshData, is_closed
from sessions.meshes.mesh_files import outward

Faces = NDArray[np.int64]


def repaired(mesh: MeshData) -> tuple[MeshData, list[str]]:
    """The mesh without doubled vertices, flat and repeated faces, holes and faces that wind inwards; what was done.

    A hole gets a fan of faces about the mean of its rim: right for a flat hole, a guess for any other, and a lid where
    it was the mouth of a thin vessel. Edges of three or more faces stay as they are, and so does a face by itself.
    """
    said, points, faces = [], mesh.vertices, mesh.faces
    if not is_closed(mesh):  # of two closed parts that touch, joining makes one with edges of four faces
        places = np.round(points / SAME_PLACE_M)
        _, first, place = np.unique(places, axis=0, return_index=True, return_inverse=True)
        points, faces = points[first], place.reshape(-1)[faces]
        said += _told(len(places) - len(first), "vertex", "vertices", "at the place of another joined")
    flat = degenerate_faces(MeshData(points, faces))
    faces = faces[~flat]
    said += _told(int(flat.sum()), "face", "faces", "without area removed")
    _, kept = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    said += _told(len(faces) - len(kept), "repeated face", "repeated faces", "removed")
    faces = faces[np.sort(kept)]
    if not len(faces):
        return mesh, ["nothing is left of it without its flat faces; it stays as it was"]
    alone = {tuple(face) for face in np.sort(faces, axis=1).tolist()}
    holes = [rim for rim in _holes(faces) if tuple(sorted(rim)) not in alone]
    for rim in holes:
        middle = len(points)
        points = np.concatenate([points, points[rim].mean(axis=0, keepdims=True)])
        faces = np.concatenate([faces, [(b, a, middle) for a, b in zip(rim, np.roll(rim, -1), strict=True)]])
    said += _told(len(holes), "hole", "holes", "closed")
    turned = outward(MeshData(points, faces))
    inward = int((turned.faces != faces).any(axis=1).sum())
    said += _told(inward, "face", "faces", "turned to wind outwards")
    used, number = np.unique(turned.faces, return_inverse=True)
    return MeshData(turned.vertices[used], number.reshape(-1, 3)), said


def _told(count: int, one: str, several: str, done: str) -> list[str]:
    return [f"{count:,} {one if count == 1 else several} {done}"] if count else []


def _holes(faces: Faces) -> Iterator[list[int]]:
    """Rims of holes, each as the vertices along it in the sense of the faces that it belongs to."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    _, edge, uses = np.unique(np.sort(np.stack([start, end], 1), 1), axis=0, return_inverse=True, return_counts=True)
    rim = uses[edge.reshape(-1)] == 1
    after: dict[int, list[int]] = {}
    for a, b in zip(start[rim].tolist(), end[rim].tolist(), strict=True):
        after.setdefault(a, []).append(b)
    while after:
        way = [next(iter(after))]
        while way[-1] in after:
            onward = after[way[-1]].pop()
            if not after[way[-1]]:
                del after[way[-1]]
            if onward in way:  # a rim that touches itself is cut into loops
                loop = way[way.index(onward) :]
                yield loop
                way = way[: way.index(onward) + 1]
            else:
                way.append(onward)
