"""Every error the tool raises on purpose, in one tree; each message is one sentence that says what to do.

::

    ReplayError
    ├── DetectorSpecError     text or value that names no detector, or a label that cannot be one
    ├── AssemblyError         a session that offers a detector nothing to look at, or whose scene contradicts itself
    ├── PlanError             a scene that declares an effect, field, body or tag there is not
    ├── EffectError           an effect that cannot be loaded, or asks for what its spec does not name
    ├── AuditError            detections that cannot be compared
    ├── PolicyError           words that name no policy
    ├── RefusedError          a recording with a fault that the policy refuses
    ├── NoiseError            noise asked for in words that mean nothing, or that cannot be measured
    ├── ProofError            a proof of what is none: verdicts not of `exact`, frames that are not the recording's
    ├── OutputError           a run folder or file that cannot be written
    ├── PlaceError            a URL that nobody here can read or write
    ├── RunFolderError        a folder that holds no run, or a run of another version
    ├── TradeoffError         settings whose price cannot be measured: nothing to miss, no grid
    ├── WorkerError           a process of several that ended without an answer, or workers that cannot be used
    ├── CalibrationError      wall times that cannot be read or are of another experiment
    ├── FixtureError          a number of faces in which no pose of two meshes meets
    ├── ShrinkError           a wrong answer that there is not, or that does not happen again
    ├── StressError           hard cases asked for in words or files that mean nothing
    └── StudyError            metrics, questionnaire or codebook that cannot be analysed
        └── StudyRefusedError a result that a rule of the study forbids (replay.studies.class_study.refusals)
"""

from sessions.errors import first_of


class ReplayError(Exception):
    """The root of the tree: catch it to catch everything the tool raises on purpose."""


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


class AuditError(ReplayError, ValueError):
    """Two detections do not cover the same frames and pairs."""


class PolicyError(ReplayError, ValueError):
    """A policy was asked for in words that mean nothing."""


class RefusedError(ReplayError, ValueError):
    """A recording has a fault that the policy refuses."""


class NoiseError(ReplayError, ValueError):
    """A noise was asked for in words that mean nothing, or of a body in which it cannot be measured."""


class ProofError(ReplayError, ValueError):
    """Verdicts for which no proof can be written."""


class OutputError(ReplayError, OSError):
    """A result cannot be written where it was asked for."""


class PlaceError(ReplayError, OSError):
    """A file or folder elsewhere cannot be reached."""


class RunFolderError(ReplayError, ValueError):
    """A folder is not a run folder, or one of another version."""


class StudyError(ReplayError, ValueError):
    """Metrics, a questionnaire or a codebook do not make a study."""


class WorkerError(ReplayError, RuntimeError):
    """A process among several ended without an answer, or workers cannot be used."""


class ShrinkError(ReplayError, ValueError):
    """A fault to be shrunk is not there, or does not happen again."""


class StressError(ReplayError, ValueError):
    """Hard cases were asked for in words, numbers or files that mean nothing."""


class TradeoffError(ReplayError, ValueError):
    """What accuracy costs cannot be measured so: nothing to miss, a grid without cells."""
