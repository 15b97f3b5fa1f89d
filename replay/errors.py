"""Every error that is raised on purpose; each message is one sentence that says what to do.

``except replay.ERRORS`` catches them all::

    ERRORS
    ├── ReplayError          the tool: this module
    │   ├── WrongInputError      (TypeError)   what was given is of another kind
    │   ├── UnknownLabelError    (KeyError)    a run has no such detector
    │   ├── DetectorSpecError, PolicyError, NoiseError, PlanError, StudyError, ...   (ValueError)
    │   └── OutputError, PlaceError   (OSError)
    ├── SessionError         recordings: sessions.errors
    └── CollisionCoreError   detectors: cdcore.errors
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Final, Self, TypeGuard

from cdcore.errors import CollisionCoreError
from sessions.errors import SessionError, first_of


class ReplayError(Exception):
    """The root of the tree: catch it to catch everything the tool raises on purpose."""


ERRORS: Final = (ReplayError, SessionError, CollisionCoreError)
"""The roots of all errors that are raised on purpose, for ``except``."""


class WrongInputError(ReplayError, TypeError):
    """An argument is of another type than required."""


class UnknownLabelError(ReplayError, KeyError):
    """A run has no detector of this label."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class DetectorSpecError(ReplayError, ValueError):
    """A detector was asked for in words that mean nothing."""


class AssemblyError(ReplayError, ValueError):
    """A session and its scene do not make a motion."""


class PlanError(ReplayError, ValueError):
    """A scene declares effects that cannot be planned: file, table and key of the first of its ``faults``."""

    def __init__(self, *faults: str) -> None:
        self.faults = faults
        super().__init__(first_of(faults))


class EffectError(ReplayError, ValueError):
    """An effect cannot be loaded, or cannot do its work with what the recording holds."""


class CutError(ReplayError, ValueError):
    """A mesh cannot be cut into convex pieces, or not in the time that was given."""


class AuditError(ReplayError, ValueError):
    """Two detections do not cover the same frames and pairs."""


class PolicyError(ReplayError, ValueError):
    """A policy was asked for in words that mean nothing."""


class RefusedError(ReplayError, ValueError):
    """A recording has a fault that the policy refuses."""


class NoiseError(ReplayError, ValueError):
    """A noise was asked for in words that mean nothing, or of a body in which it cannot be measured."""


class OutputError(ReplayError, OSError):
    """A result cannot be written where it was asked for."""


class PlaceError(ReplayError, OSError):
    """A file or folder at a URL cannot be reached."""


MOST_PROBLEMS: Final = 50
"""Problems of a file that a message lists."""


class RunFolderError(ReplayError, ValueError):
    """A folder is not a run folder, one of another version, or a file in it is damaged."""

    problems: tuple[str, ...] = ()
    """Every value that is not as a run writes it, with its path; the message has the first of them."""

    @classmethod
    def of_problems(cls, file: Path, problems: Sequence[str]) -> Self:
        """Return the error for a file with values that no run writes, of which there is one at least."""
        count = len(problems)
        number = "1 value that no run writes" if count == 1 else f"{count:,} values that no run writes"
        listed = "; ".join(problems[:MOST_PROBLEMS])
        rest = f"; and {count - MOST_PROBLEMS:,} more" if count > MOST_PROBLEMS else ""
        error = cls(f"{file} has {number}: {listed}{rest}. Run its session again")
        error.problems = tuple(problems)
        return error

    @classmethod
    def unreadable(cls, file: Path, error: BaseException) -> Self:
        """Return the error for a file of a run folder that cannot be opened, or that is damaged.

        The words of the library that failed speak of its own format and stay in the traceback.
        """
        reason = f"cannot be opened ({error.strerror})" if _is_from_the_system(error) else "is damaged"
        return cls(f"{file} {reason}; run its session again")


def _is_from_the_system(error: BaseException) -> TypeGuard[OSError]:
    return isinstance(error, OSError) and error.strerror is not None


class StudyError(ReplayError, ValueError):
    """Metrics, a questionnaire or a codebook do not make a study."""


class WorkerError(ReplayError, RuntimeError):
    """A process among several ended without an answer, or workers cannot be used."""


class ShrinkError(ReplayError, ValueError):
    """A fault to be shrunk is not there, or does not happen again."""


class StressError(ReplayError, ValueError):
    """Hard cases were asked for in words, numbers or files that mean nothing."""


class TradeoffError(ReplayError, ValueError):
    """The cost of accuracy cannot be measured: no contact to miss, a grid without cells."""
