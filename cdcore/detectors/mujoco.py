"""A real engine: MuJoCo itself decides about the convex hulls of the meshes, at fixed steps."""

from dataclasses import dataclass
from typing import ClassVar

from cdcore.engines import EngineDetector, EngineSettings, EngineSolid, MujocoWorld
from cdcore.protocol.settings import MOST_METRES, number


@dataclass(frozen=True, kw_only=True)
class MujocoSettings(EngineSettings):
    """Settings of ``mujoco``.

    ``rate_hz``: looks per second of session time, 500 is MuJoCo's own step; ``None``: every frame.
    ``margin_m``: metres of distance at which MuJoCo already lists a contact.
    """

    margin_m: float = number(0.0, 0, MOST_METRES, unit="metres")


class MujocoDetector(EngineDetector[MujocoSettings]):
    """Asks MuJoCo for its list of contacts between convex hulls, and holds each answer until its next look.

    Choose it to see a shipped engine's own answer, where ``collider`` re-creates one. A hull within a hull is CONTACT.
    It lists no faces. A mesh thinner than 10 micrometres gets that thickness, because MuJoCo refuses flat ones.

    Source: ``mj_collision`` with MuJoCo's own settings. Needs the extra ``engines``, else a MissingEngineError.
    """

    name: ClassVar[str] = "mujoco"
    title: ClassVar[str] = "MuJoCo"
    least_thickness: ClassVar[float] = 1e-5
    Settings: ClassVar[type] = MujocoSettings
    sources: ClassVar[tuple[str, ...]] = (
        "E. Todorov, T. Erez, Y. Tassa, MuJoCo: a physics engine for model-based control, IROS 2012",
    )
    choose_when: ClassVar[str] = "you want the answer of a shipped engine, not of its re-creation"
    cannot: ClassVar[str] = "see hollows, list faces, or tell distances below a micrometre"

    def _make_world(self, solids: list[EngineSolid]) -> MujocoWorld:
        return MujocoWorld(solids, self._columns, self.settings.margin_m)
