"""Every error the collision core raises on purpose, in one tree; each message says what to do."""

from typing import Final


class CollisionCoreError(Exception):
    """The root of the tree: catch it to catch everything the core raises on purpose."""


class InvalidMeshError(CollisionCoreError, ValueError):
    """A mesh is empty, has an index out of range or a coordinate that is not finite."""


class InvalidTrianglesError(CollisionCoreError, ValueError):
    """Triangles are not finite or do not have the shape the predicate asks for."""


class InvalidPoseError(CollisionCoreError, ValueError):
    """A pose is not finite or not rigid."""


class InvalidPairError(CollisionCoreError, ValueError):
    """A pair names a body that does not exist, or the same body twice."""


class InvalidSettingError(CollisionCoreError, ValueError):
    """A detector has no such setting, or the value is outside its range."""


class UnknownDetectorError(CollisionCoreError, KeyError):
    """No detector of this name is in the table."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class MissingEngineError(CollisionCoreError, ImportError):
    """A detector needs an engine that is not installed."""


CHOICE_ERRORS: Final = (InvalidSettingError, UnknownDetectorError, MissingEngineError)
"""Those that speak of the detector that was chosen: no other mesh and no other pose helps."""


class OwnDetectorError(CollisionCoreError, RuntimeError):
    """A detector from outside the table raised an exception, or answered with what is no verdict."""


class NotRecordedError(CollisionCoreError, LookupError):
    """A result holds no such data because it was not asked for."""
