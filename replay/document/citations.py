"""The sources behind a run: of every detector and every effect that ran, and no others."""

from collections.abc import Iterable, Mapping

from cdcore.detectors.detector_table import load_detector
from replay.detection.recorded import RECORDED_DETECTOR, RecordedDetector
from replay.effects.effects_runner import EffectRun

NO_SOURCES = ("names no sources",)


def sources_behind(
    detectors: Iterable[str], effects: Iterable[tuple[str, EffectRun]] = ()
) -> dict[str, tuple[str, ...]]:
    """``detector NAME`` or ``effect KIND`` -> citations, in the order given, each name once."""
    sources_of = {
        f"detector {detector_name}": tuple(getattr(_class_of(detector_name), "sources", ()))
        for detector_name in detectors
    }
    sources_of |= {f"effect {kind}": run.spec.sources for kind, run in effects}
    return {subject: sources or NO_SOURCES for subject, sources in sources_of.items()}


def _class_of(detector: str) -> type:
    """The class of a detector by its name; ``recorded`` is the one that no table of the core holds."""
    return RecordedDetector if detector == RECORDED_DETECTOR else load_detector(detector)


def citations(behind: Mapping[str, tuple[str, ...]]) -> str:
    """The sources as text: what was used, its sources indented below it."""
    return "\n  ".join(["sources", *("\n    ".join([subject, *sources]) for subject, sources in behind.items())])
