"""Physics engines that are asked for their own contacts; each is imported in one module of this room."""

from cdcore.engines.bullet_world import BulletWorld
from cdcore.engines.engine_detector import EngineDetector, EngineSettings, EngineWorld, ShapedSettings
from cdcore.engines.engine_solids import EngineSolid
from cdcore.engines.mujoco_world import MujocoWorld
from cdcore.engines.physx_world import PhysxWorld
from cdcore.engines.quiet import quiet
from cdcore.engines.rapier_world import RapierWorld

__all__ = [
    "BulletWorld", "EngineDetector", "EngineSettings", "EngineSolid", "EngineWorld", "MujocoWorld", "PhysxWorld",
    "RapierWorld", "ShapedSettings", "quiet",
]  # fmt: skip
