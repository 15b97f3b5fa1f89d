"""Rows that ask a real engine, which decides itself, at fixed steps; ``cdcore.engines`` puts the bodies into it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.engines.bullet_world import BulletWorld
from cdcore.engines.engine_detector import EngineDetector, ShapedSettings
from cdcore.engines.mujoco_world import MujocoWorld
from cdcore.engines.newton_world import NewtonWorld
from cdcore.engines.physx_world import PhysxWorld
from cdcore.engines.rapier_world import RapierWorld
from cdcore.protocol.settings import MOST_METRES, RateSettings, number

UNITY_OFFSET_M: Final = 0.00545
"""Metres: the contact offset that PhysX computes where none is given."""

BULLET_BREAKING: Final = 0.02
"""Bullet keeps contacts up to this fraction of the smaller body's half diagonal, its contact breaking threshold."""


@dataclass(frozen=True, kw_only=True)
class MujocoSettings(RateSettings):
    """Settings of ``mujoco``.

    ``rate_hz``: looks per second of session time, 500 is MuJoCo's own step; ``None``: every frame.
    ``margin_m``: metres of distance at which MuJoCo already lists a contact.
    """

    margin_m: float = number(0.0, 0, MOST_METRES, unit="metres")


class MujocoDetector(EngineDetector[MujocoSettings]):
    """Asks MuJoCo for its list of contacts between convex hulls, and holds each answer until its next look.

    A hull within a hull is CONTACT. A mesh thinner than 10 micrometres gets that thickness, because MuJoCo refuses flat
    ones.

    Source: ``mj_collision`` with MuJoCo's own settings. Needs the extra ``engines``, else a MissingEngineError.
    """

    name = "mujoco"
    title = "MuJoCo"
    World = MujocoWorld
    least_thickness = 1e-5
    Settings = MujocoSettings
    sources = ("E. Todorov, T. Erez, Y. Tassa, MuJoCo: a physics engine for model-based control, IROS 2012",)
    choose_when = "you want the answer of a shipped engine, not of its re-creation"
    cannot = "see hollows, list faces, or tell distances below a micrometre"

    def contact_reach(self, _pair: int) -> float:
        """The margin between two bodies, metres."""
        return self.settings.margin_m


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

    A hull within a hull is CONTACT; of triangle meshes only surfaces count.

    Source: ``NarrowPhase`` of rapier3d. Needs the extra ``engines``, else a MissingEngineError.
    """

    name = "rapier"
    title = "Rapier"
    World = RapierWorld
    meshes_meet = True
    Settings = RapierSettings
    sources = ("Dimforge, Rapier 0.36, https://rapier.rs/docs: collision detection",)
    choose_when = "your engine is Rapier (Bevy, the web)"
    cannot = "list faces, or tell the distance between edges: it measures at corners, millimetres too far"

    def contact_reach(self, _pair: int) -> float:
        """The prediction between two bodies, metres."""
        return self.settings.prediction_m


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

    A hull within a hull is CONTACT.

    Source: ``performCollisionDetection`` and ``getContactPoints`` of pybullet. Needs the extra ``engines``, else a
    MissingEngineError.
    """

    name = "bullet"
    title = "Bullet"
    World = BulletWorld
    Settings = BulletSettings
    sources = ("E. Coumans, Y. Bai, PyBullet, a Python module for physics simulation, http://pybullet.org, 2016-2021",)
    choose_when = "your engine is Bullet (PyBullet, Godot 3, Panda3D)"
    cannot = "test two triangle meshes, list faces, or tell a gap from a touch within its margins"

    def contact_reach(self, pair: int) -> float:
        """The margins of both bodies and the contact breaking threshold of the smaller body, metres."""
        margin = self.settings.margin_m
        # The box of a body is larger by the margin on every side.
        halves = [np.ptp(self.bodies[body].mesh.bounds, axis=0) / 2 + margin for body in self.pairs[pair].tolist()]
        smaller = min(float(np.linalg.norm(half)) for half in halves)
        return 2.0 * margin + BULLET_BREAKING * smaller


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

    A hull within a hull is CONTACT. It runs on the processor; each look takes three milliseconds and more, most of them
    to hand over poses.

    Source: contact reports of ovphysx. Needs the extra ``physx``, else a MissingEngineError.
    """

    name = "physx"
    title = "PhysX"
    World = PhysxWorld
    Settings = PhysxSettings
    sources = ("NVIDIA, PhysX 5 by way of ovphysx 0.7, https://nvidia-omniverse.github.io/PhysX/ovphysx/latest",)
    choose_when = "your engine is Unity, Unreal 4 or Omniverse, which have PhysX inside"
    cannot = "test two triangle meshes, list faces, or be timed: handing over poses takes most of it"

    def contact_reach(self, _pair: int) -> float:
        """The contact offsets of both bodies, metres."""
        offset = self.settings.contact_offset_m
        return 2.0 * (UNITY_OFFSET_M if offset is None else offset)


@dataclass(frozen=True, kw_only=True)
class NewtonSettings(ShapedSettings):
    """Settings of ``newton``.

    ``shape``: hull or mesh, the triangles of what is not convex. ``rate_hz``: looks per second of session time;
    ``None``: every frame. ``gap_m``: metres around each body within which Newton lists a contact, so that two bodies
    are in contact below twice that distance; at 0 they touch. Newton's own default, 0.1, lists contacts early and
    pushes nothing apart before it touches.
    """

    gap_m: float = number(0.0, 0, MOST_METRES, unit="metres")


class NewtonDetector(EngineDetector[NewtonSettings]):
    """Asks Newton, on the processor, for its list of contacts.

    A hull within a hull is CONTACT. Triangles count from outside: a hull whose middle is inside a mesh, between the
    faces of a wall for instance, is CLEAR. Kernels are compiled once per machine, which
    takes 17 s to three minutes.

    Source: ``CollisionPipeline`` of newton. Needs the extra ``newton``, else a MissingEngineError.
    """

    name = "newton"
    title = "Newton"
    World = NewtonWorld
    meshes_meet = True
    Settings = NewtonSettings
    sources = ("The Newton developers, Newton 1.8, https://newton-physics.github.io/newton: collisions",)
    choose_when = "your engine is Newton"
    cannot = "list faces, or see hulls whose middle is inside a triangle mesh"

    def contact_reach(self, _pair: int) -> float:
        """The gaps of both bodies, metres."""
        return 2.0 * self.settings.gap_m
