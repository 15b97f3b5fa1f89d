"""Bodies with convex pieces as their colliders, as the settings of a compound ask for them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import quote, unquote

from cdcore.detectors.collider import ColliderSettings
from cdcore.protocol import Body, Solids
from replay.cutting.convex_solids import solids_of
from replay.cutting.piece_store import Cut, Watch, convex_pieces
from replay.errors import DetectorSpecError


def with_pieces(bodies: Sequence[Body], settings: ColliderSettings, watch: Watch | None = None) -> tuple[Body, ...]:
    """The bodies with at most ``settings.pieces`` convex pieces each as colliders; equal meshes are cut once.

    Where ``settings.bodies`` names some, only these are cut: others keep the colliders that they have, else a hull.
    Raises ``DetectorSpecError``: there is no body of such a name; and as ``convex_pieces``.
    """
    names = {unquote(name) for name in settings.bodies.split("+")} if settings.bodies else {b.name for b in bodies}
    unknown = ", ".join(sorted(names - {body.name for body in bodies}))
    if unknown:
        known = ", ".join(body.name for body in bodies)
        raise DetectorSpecError(f"no body {unknown} to cut into convex pieces; there are: {known}")
    solids: dict[tuple[str, bool], Solids] = {}
    made = []
    for body in bodies:
        chosen = body.name in names
        if not chosen and body.colliders is not None:
            made.append(body)
            continue
        key = body.mesh.content_hash, chosen
        if key not in solids:
            cut = Cut(body.mesh, settings.method if chosen else "hull", settings.pieces if chosen else 1)
            solids[key] = solids_of(convex_pieces(cut, watch))
        made.append(replace(body, colliders=solids[key]))
    return tuple(made)


def seconds_to_cut(bodies: Sequence[Body], settings: Mapping[str, Any]) -> float:
    """About how long it takes to cut all of these bodies as a compound of these settings, where nothing is kept."""
    asked = ColliderSettings(**{key: settings[key] for key in ("pieces", "method") if key in settings})
    cuts = {body.mesh.content_hash: Cut(body.mesh, asked.method, asked.pieces) for body in bodies}
    return sum(cut.seconds for cut in cuts.values())


def names_as_setting(names: Sequence[str]) -> str:
    """Names of bodies as the setting ``bodies`` takes them: signs that mean something in a spec as ``%2C``."""
    text = "+".join(quote(name, safe="") for name in names)
    # Read as a setting, this text is a number or a truth value: written with its first sign as a code, it is a name.
    return text if not _reads_as_value(text) else f"%{ord(text[0]):02X}{text[1:]}"


def _reads_as_value(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return text.lower() in ("true", "false", "none")
    return True
