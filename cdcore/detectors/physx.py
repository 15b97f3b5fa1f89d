"""A real engine: PhysX itself decides, at fixed steps."""

from dataclasses import dataclass
from typing import ClassVar

from cdcore.engines import EngineDetector, EngineSolid, PhysxWorld, ShapedSettings
from cdcore.protocol.settings import MOST_METRES, number


@dataclass(frozen=True, kw_only=True)
class PhysxSettings(ShapedSettings):
    """Settings of ``physx``.

    ``shape``: hull, which PhysX cuts to at most 64 corners; or mesh, the triangles of what is not convex.
    ``rate_hz``: looks per second of session time, 50 is Unity's own step; ``None``: every frame. ``contact_offset_m``:
    metres around each body within which PhysX reports contact, so that two bodies are in contact below twice that
    distance; 0.01 is Unity's default; ``None``: what PhysX computes from gravity and step, 0.00545.
    """

    contact_offset_m: float | None = number(None, 0, MOST_METRES, above=True, unit="metres")


class PhysxDetector(EngineDetector[PhysxSettings]):
    """Asks PhysX 5, the engine inside Unity, for its reports of contact; two triangle meshes it does not test.

    Choose it to see what Unity's engine says, where ``collider`` re-creates it. A hull within a hull is CONTACT. It
    lists no faces. It runs on the processor; each look takes three milliseconds and more, most of them to hand over
    poses.

    Source: contact reports of ovphysx. Needs the extra ``physx``, else a MissingEngineError.
    """

    name: ClassVar[str] = "physx"
    title: ClassVar[str] = "PhysX"
    Settings: ClassVar[type] = PhysxSettings
    sources: ClassVar[tuple[str, ...]] = (
        "NVIDIA, PhysX 5 by way of ovphysx 0.7, https://nvidia-omniverse.github.io/PhysX/ovphysx/latest",
    )
    choose_when: ClassVar[str] = "your engine is Unity, Unreal 4 or Omniverse, which have PhysX inside"
    cannot: ClassVar[str] = "test two triangle meshes, list faces, or be timed: handing over poses takes most of it"

    def _make_world(self, solids: list[EngineSolid]) -> PhysxWorld:
        return PhysxWorld(solids, self.settings.contact_offset_m)
