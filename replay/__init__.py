"""Replay recorded VR laboratory sessions: see what your collision detection missed, and what catching it costs."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from replay.api.advisor import Advice, advise
    from replay.api.auditor import AuditResult, audit
    from replay.api.runner import run
    from replay.effects.effect_plan import Plan, plan
    from replay.outputs.results.data_set import read
    from replay.pipeline.run_result import RunResult, Tradeoff
    from replay.pipeline.settings import RunSettings
    from replay.studies.stress.stress_runner import StressResult, stress
    from replay.studies.synthetic_sessions import synthetic_session as synthetic_session
    from replay.tradeoffs.sweep import tradeoff

__all__ = [
    "Advice", "AuditResult", "Plan", "RunResult", "RunSettings", "StressResult", "Tradeoff", "advise", "audit", "plan",
    "read", "run", "stress", "synthetic_session", "tradeoff",
]  # fmt: skip

# Not the library lazy_loader: it needs stub files with relative imports, and its error does not list the names.
_HOME = {
    "Advice": "replay.api.advisor",
    "AuditResult": "replay.api.auditor",
    "Plan": "replay.effects.effect_plan",
    "RunResult": "replay.pipeline.run_result",
    "RunSettings": "replay.pipeline.settings",
    "StressResult": "replay.studies.stress.stress_runner",
    "Tradeoff": "replay.pipeline.run_result",
    "advise": "replay.api.advisor",
    "audit": "replay.api.auditor",
    "plan": "replay.effects.effect_plan",
    "read": "replay.outputs.results.data_set",
    "run": "replay.api.runner",
    "stress": "replay.studies.stress.stress_runner",
    "synthetic_session": "replay.studies.synthetic_sessions:synthetic_session",
    "tradeoff": "replay.tradeoffs.sweep",
}
"""Public name -> module, or ``module:name`` where the names differ; loaded on first use, for a quick ``--help``."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute or name)


def __dir__() -> list[str]:
    return __all__
