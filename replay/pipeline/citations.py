"""The sources behind a run: of every detector and every effect that ran, and no others."""

from __future__ import annotations

from collections.abc import Mapping

from cdcore.detectors import load_detector
from replay.effects import load_effect
from replay.pipeline.run_result import RunResult

NONE_NAMED = ("names no sources",)


def sources_behind(result: RunResult) -> dict[str, tuple[str, ...]]:
    """``detector NAME`` or ``effect KIND`` -> citations, in the order of the run, each name once."""
    names = dict.fromkeys(detector["name"] for detector in result.summary["detectors"].values())
    behind = {f"detector {name}": tuple(getattr(load_detector(name), "sources", ())) for name in names}
    behind |= {f"effect {kind}": tuple(load_effect(kind).sources) for kind in result.effects}
    return {what: sources or NONE_NAMED for what, sources in behind.items()}


def citations(behind: Mapping[str, tuple[str, ...]]) -> str:
    """The sources as text: what was used, its sources indented below it."""
    return "\n  ".join(["sources", *("\n    ".join([what, *sources]) for what, sources in behind.items())])
