"""Bodies with convex pieces as their colliders, as the settings of a compound ask for them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from cdcore.bounding.hull import hull_collider
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.protocol import Body, Solids
from replay.cutting.convex_solids import solids_of
from replay.cutting.piece_store import Cut, Watch, convex_pieces

if TYPE_CHECKING:
    from cdcore.detectors.collider import ColliderSettings


def with_pieces(bodies: Sequence[Body], settings: "ColliderSettings", watch: Watch | None = None) -> tuple[Body, ...]:
    """The bodies with at most ``settings.pieces`` convex pieces each as colliders; equal meshes are cut once.

    Where ``settings.cut`` names some, only these are cut: others keep the colliders that they have, else their hull.
    Raises ``InvalidSettingError``: there is no body of such a name; and as ``convex_pieces``.
    """
    # The module of a detector imports numba, which a run without contacts does without.
    from cdcore.detectors.collider import bodies_to_cut

    names = bodies_to_cut(settings, bodies)
    bodies_with_pieces = []
    for body in bodies:
        if body.name in names:
            bodies_with_pieces.append(
                replace(body, colliders=_cut_solids(Cut(body.mesh, settings.method, settings.pieces), watch))
            )
        elif body.colliders is None:
            bodies_with_pieces.append(replace(body, colliders=_hull_of(body.mesh)))
        else:
            bodies_with_pieces.append(body)
    return tuple(bodies_with_pieces)


def _cut_solids(cut: Cut, watch: Watch | None) -> Solids:
    """The pieces of a mesh, kept as long as the mesh: detectors of one run share them and their trees."""
    if hull_collider(cut.mesh) is cut.mesh:
        return Solids((cut.mesh,), cut.mesh)
    solids = _of_mesh(cut.mesh)
    cut_key = cut.name, cut.most
    if cut_key not in solids:
        solids[cut_key] = solids_of(convex_pieces(cut, watch))
    return solids[cut_key]


@once_a_mesh
def _of_mesh(_mesh: TriangleMesh) -> dict[tuple[str, int], Solids]:
    return {}


def _hull_of(mesh: TriangleMesh) -> Solids:
    hull = hull_collider(mesh)
    return Solids((hull,), hull)


def seconds_to_cut(bodies: Sequence[Body], settings: Mapping[str, Any]) -> float:
    """About how long it takes to cut all of these bodies as a compound of these settings, where nothing is kept."""
    # The module of a detector imports numba, which a run without contacts does without.
    from cdcore.detectors.collider import ColliderSettings

    requested_settings = ColliderSettings(**{key: settings[key] for key in ("pieces", "method") if key in settings})
    cuts = {
        body.mesh.content_hash: Cut(body.mesh, requested_settings.method, requested_settings.pieces) for body in bodies
    }
    return sum(cut.seconds for cut in cuts.values())


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
