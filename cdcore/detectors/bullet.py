"""A real engine: Bullet itself decides, at fixed steps."""

from dataclasses import dataclass
from typing import ClassVar

from cdcore.engines import BulletWorld, EngineDetector, EngineSolid, ShapedSettings
from cdcore.protocol.settings import MOST_METRES, number


@dataclass(frozen=True, kw_only=True)
class BulletSettings(ShapedSettings):
    """Settings of ``bullet``.

    ``shape``: hull or mesh, the triangles of what is not convex. ``rate_hz``: looks per second of session time, 240 is
    the step of pybullet; ``None``: every frame. ``margin_m``: metres around each body that Bullet adds to its surface
    (``collisionMargin``); 0.001 is the default of pybullet. Bullet lists contacts a little farther than both margins:
    by the contact breaking threshold, 2 % of the smaller body's size.
    """

    margin_m: float = number(0.001, 0, MOST_METRES, unit="metres")


class BulletDetector(EngineDetector[BulletSettings]):
    """Asks Bullet for its points of contact; two triangle meshes it does not test.

    Choose it to see a shipped engine's own answer, where ``collider`` re-creates one. A hull within a hull is CONTACT.
    It lists no faces.

    Source: ``performCollisionDetection`` and ``getContactPoints`` of pybullet. Needs the extra ``engines``, else a
    MissingEngineError.
    """

    name: ClassVar[str] = "bullet"
    title: ClassVar[str] = "Bullet"
    Settings: ClassVar[type] = BulletSettings
    sources: ClassVar[tuple[str, ...]] = (
        "E. Coumans, Y. Bai, PyBullet, a Python module for physics simulation, http://pybullet.org, 2016-2021",
    )
    choose_when: ClassVar[str] = "your engine is Bullet (PyBullet, Godot 3, Panda3D)"
    cannot: ClassVar[str] = "test two triangle meshes, list faces, or tell a gap from a touch within its margins"

    def _make_world(self, solids: list[EngineSolid]) -> BulletWorld:
        return BulletWorld(solids, self.settings.margin_m)
