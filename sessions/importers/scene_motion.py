"""A scene of another program with poses over time, as a session in the canonical frame."""

from collections.abc import Mapping
from dataclasses import replace

from sessions.importers.ledger import FACT, Ledger
from sessions.model.assumption import ASSUMPTIONS_FACT, assumptions_fact
from sessions.model.scene import Scene
from sessions.model.session import Session, Track
from sessions.scene_formats.scene_source import SceneSource, Surface, surface_assumptions


def session_of_scene(
    scene: SceneSource, tracks: Mapping[str, Track], ledger: Ledger, *, name: str, clock: str, surface: Surface
) -> Session:
    """The session of a scene whose moving bodies have tracks; a body without one is fixed where the scene has it.

    Parameters
    ----------
    tracks : poses in the canonical frame, by the name of the body.
    clock : where the stamps come from, in words.
    surface : as requested of the scene.
    """
    up = "XYZ"[int(scene.rotation[1].argmax())]
    rotated = [] if up == "Y" else [f"world +{up} up to +Y up"]
    conversions = [*rotated, "meshes in the axes of their bodies", *scene.notes]
    conversions += [f"not taken: {sentence}" for sentence in dict.fromkeys(scene.left_out)]
    facts = {
        "conversions": "; ".join(conversions),
        "source_units": "m",
        "source_convention": "canonical",
        "handedness": "right",
        "clock": clock,
        FACT: ledger.as_text(),
        ASSUMPTIONS_FACT: assumptions_fact(surface_assumptions(scene, surface)),
    }
    bodies = (replace(body, moves=body.name in tracks) for body in scene.bodies.values())
    session = Session.from_tracks(
        tracks,
        facts=facts,
        meshes={name: body.mesh for name, body in scene.bodies.items()},
        scene=Scene(
            name=name,
            bodies=tuple(body.declared(scene.rotation) for body in bodies),
            ignore=scene.excluded,
        ),
    )
    colliders = {name: body.colliders for name, body in scene.bodies.items() if body.colliders}
    return replace(session, colliders=colliders)
