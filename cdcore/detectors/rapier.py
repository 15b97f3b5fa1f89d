"""A real engine: Rapier itself decides, at fixed steps."""

from dataclasses import dataclass
from typing import ClassVar

from cdcore.engines import EngineDetector, EngineSolid, RapierWorld, ShapedSettings
from cdcore.protocol.settings import MOST_METRES, number


@dataclass(frozen=True, kw_only=True)
class RapierSettings(ShapedSettings):
    """Settings of ``rapier``.

    ``shape``: hull or mesh, the triangles of what is not convex. ``rate_hz``: looks per second of session time, 60 is
    Rapier's own step; ``None``: every frame. ``prediction_m``: metres of distance below which two bodies are in
    contact, Rapier's ``normalized_prediction_distance``; 0.02 is its default.
    """

    prediction_m: float = number(0.02, 0, MOST_METRES, unit="metres")


class RapierDetector(EngineDetector[RapierSettings]):
    """Asks Rapier, the engine of Bevy and of many pages on the web, for pairs with an active contact.

    Choose it to see a shipped engine's own answer, where ``collider`` re-creates one. A hull within a hull is CONTACT;
    of triangle meshes only surfaces count. It lists no faces.

    Source: ``NarrowPhase`` of rapier3d. Needs the extra ``engines``, else a MissingEngineError.
    """

    name: ClassVar[str] = "rapier"
    title: ClassVar[str] = "Rapier"
    meshes_meet: ClassVar[bool] = True
    Settings: ClassVar[type] = RapierSettings
    sources: ClassVar[tuple[str, ...]] = ("Dimforge, Rapier 0.36, https://rapier.rs/docs: collision detection",)
    choose_when: ClassVar[str] = "your engine is Rapier (Bevy, the web)"
    cannot: ClassVar[str] = (
        "list faces, or tell the distance between edges: it measures at corners, millimetres too far"
    )

    def _make_world(self, solids: list[EngineSolid]) -> RapierWorld:
        return RapierWorld(solids, self.settings.prediction_m)
