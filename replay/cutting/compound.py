"""Bodies with convex pieces as their colliders, as the settings of a compound ask for them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from cdcore.bounding.hull import hull_collider
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.numerics import IntArray
from cdcore.protocol import Body, Solids
from replay.cutting.convex_solids import solids_of
from replay.cutting.piece_store import LONGEST_SECONDS, Cut, convex_pieces, cut_all, seconds_of_cuts

if TYPE_CHECKING:
    from cdcore.detectors.collider import ColliderSettings


def with_pieces(bodies: Sequence[Body], pairs: IntArray, settings: "ColliderSettings") -> tuple[Body, ...]:
    """The bodies with at most ``settings.pieces`` convex pieces each as colliders; equal meshes are cut once.

    Only bodies of the ``pairs`` (P, 2) are cut, since no other is tested, and where ``settings.cut`` names some, only
    these: others keep the colliders that they have, else their hull. Raises ``InvalidSettingError``: there is no body
    of such a name; and as ``convex_pieces``.
    """
    cut_of_body = cuts_of_bodies(bodies, pairs, settings)
    # All at once, since a machine cuts as many meshes at a time as it has cores.
    new_cuts = [cut for cut in cut_of_body.values() if (cut.name, cut.most) not in _of_mesh(cut.mesh)]
    cut_all(new_cuts, time_limit=LONGEST_SECONDS * len(new_cuts))
    bodies_with_pieces = []
    for body in bodies:
        if body.name in cut_of_body:
            bodies_with_pieces.append(replace(body, colliders=_cut_solids(cut_of_body[body.name])))
        elif body.colliders is None:
            bodies_with_pieces.append(replace(body, colliders=_hull_of(body.mesh)))
        else:
            bodies_with_pieces.append(body)
    return tuple(bodies_with_pieces)


def cuts_of_bodies(bodies: Sequence[Body], pairs: IntArray, settings: "ColliderSettings") -> dict[str, Cut]:
    """Name of each body of the pairs that a compound of these settings cuts -> its cut.

    Raises ``InvalidSettingError``: ``settings.cut`` names a body that there is not.
    """
    # The module of a detector imports numba, which a run without contacts does without.
    from cdcore.detectors.collider import bodies_to_cut

    names = bodies_to_cut(settings, bodies)
    paired_bodies = [bodies[number] for number in np.unique(pairs).tolist()]
    return {body.name: Cut(body.mesh, settings.method, settings.pieces) for body in paired_bodies if body.name in names}


def _cut_solids(cut: Cut) -> Solids:
    """The pieces of a mesh, kept as long as the mesh: detectors of one run share them and their trees."""
    solids = _of_mesh(cut.mesh)
    cut_key = cut.name, cut.most
    if cut_key not in solids:
        solids[cut_key] = solids_of(convex_pieces(cut))
    return solids[cut_key]


@once_a_mesh
def _of_mesh(_mesh: TriangleMesh) -> dict[tuple[str, int], Solids]:
    return {}


def _hull_of(mesh: TriangleMesh) -> Solids:
    hull = hull_collider(mesh)
    return Solids((hull,), hull)


def seconds_to_cut(bodies: Sequence[Body], pairs: IntArray, settings: Mapping[str, Any]) -> float:
    """About how long it takes to cut the bodies for a compound of these settings; pieces that are kept take none."""
    # The module of a detector imports numba, which a run without contacts does without.
    from cdcore.detectors.detector_table import settings_of

    return seconds_of_cuts(list(cuts_of_bodies(bodies, pairs, settings_of("collider", settings)).values()))


def names_as_setting(names: Sequence[str]) -> str:
    """Names of bodies as the setting ``cut`` takes them: signs that mean something in a spec as ``%2C``."""
    quoted_names = "+".join(quote(name, safe="") for name in names)
    # Read as a setting, this text is a number or a truth value: written with its first sign as a code, it is a name.
    return quoted_names if not _is_read_as_value(quoted_names) else f"%{ord(quoted_names[0]):02X}{quoted_names[1:]}"


def _is_read_as_value(setting_text: str) -> bool:
    try:
        float(setting_text)
    except ValueError:
        return setting_text.lower() in ("true", "false", "none")
    return True
