"""The colliders that people ship: a GLB with a collider per node, named as engines name them."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from sessions.errors import MeshFileError
from sessions.mesh_data import MeshData
from sessions.meshes.glb_tree import GlbTree, read_glb, rigid_of
from sessions.meshes.mesh_files import hull, read_bytes

NAMED: Final = re.compile(r"(UBX|USP|UCP|UCX|UTM)_(.+?)(?:_[0-9]+)?")
"""A box, sphere, capsule or convex collider of a body, as Unreal's importer takes them: ``UCX_Beaker_03``; a mesh."""


def read_colliders(path: Path, names: Sequence[str] | None) -> tuple[dict[str, tuple[MeshData, ...]], str]:
    """Body -> its colliders in its own frame, in the order of the nodes; and what was read, in words.

    ``names`` of the bodies; ``None``: whichever the nodes name.

    A node ``UBX_``, ``USP_``, ``UCP_`` or ``UCX_``, a body's name, ``_`` and a number is a convex collider of it: the
    hull of its corners. ``UTM_`` is one as it is, and so is any other mesh on or below a node of a body's name. The
    body's frame is that of the node of its name, without scale; the file's own where there is none.

    Raises MeshFileError: no GLB, or no collider of any of these bodies.

    Source: Epic Games, FBX Static Mesh Pipeline, collision (the prefixes).
    """
    try:
        tree = read_glb(read_bytes(path))
    except MeshFileError as error:
        raise MeshFileError(f"collider file {path}: {error}") from None
    except Exception as error:  # as in mesh files: any error means damaged
        raise MeshFileError(f"collider file {path}: this is no readable GLB ({error}); export it again") from error
    found: dict[str, list[MeshData]] = {}
    left = []
    for part in sorted(tree.parts, key=lambda part: (part.node, part.place)):
        named = NAMED.fullmatch(tree.names[part.node])
        body, convex = (named[2], named[1] != "UTM") if named else (_above(tree, part.node, names or ()), False)
        if not body or (names is not None and body not in names):
            left.append(tree.names[part.node])
            continue
        frame = rigid_of(tree.poses[tree.names.index(body)]) if body in tree.names else np.eye(4)
        mesh = part.mesh.transformed(np.linalg.inv(frame) @ tree.poses[part.node])
        found.setdefault(body, []).append(hull(mesh) if convex else mesh)
    if not found:
        wanted = "name its nodes UCX_BODY_01 and so on, or hang them on a node of the body's name"
        raise MeshFileError(f"collider file {path}: no collider of {', '.join((names or ['any body'])[:8])}; {wanted}")
    words = f"colliders of {path.name}: " + ", ".join(f"{name} {len(solids)}" for name, solids in found.items())
    words += f" (of no body: {', '.join(left[:8])})" * bool(left)
    return {name: tuple(solids) for name, solids in found.items()}, words


def _above(tree: GlbTree, node: int, names: Sequence[str]) -> str:
    """The body on whose node this one hangs, or ``""``."""
    while node >= 0 and tree.names[node] not in names:
        node = tree.parents[node]
    return tree.names[node] if node >= 0 else ""
