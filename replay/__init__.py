"""Replay recorded VR laboratory sessions: see what your collision detection missed, and what catching it costs."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdcore.errors import CollisionCoreError
    from replay.advice.sweep import tradeoff
    from replay.document.run_result import Tradeoff
    from replay.effects.effect_plan import Plan, plan
    from replay.errors import ERRORS, ReplayError
    from replay.running.advisor import Advice, advise
    from replay.running.auditor import AuditResult, audit
    from replay.running.run_result import RunResult
    from replay.running.runner import run
    from replay.settings import RunSettings
    from replay.show.results.data_set import read
    from replay.show.viewing import share, view
    from replay.studies.diff.runs import diff_runs as diff
    from replay.studies.stress.runner import stress
    from replay.studies.stress.tally import StressResult
    from replay.studies.synthetic_sessions import synthetic_session as synthetic_session
    from sessions.errors import SessionError
    from sessions.mcap.reader import read_session
    from sessions.model.session import Session

__all__ = [
    "ERRORS", "Advice", "AuditResult", "CollisionCoreError", "Plan", "ReplayError", "RunResult", "RunSettings",
    "Session", "SessionError", "StressResult", "Tradeoff", "advise", "audit", "diff", "plan", "read", "read_session",
    "run", "share", "stress", "synthetic_session", "tradeoff", "view",
]  # fmt: skip

# Not the library lazy_loader: it needs stub files with relative imports, and its error does not list the names.
_HOME = {
    "ERRORS": "replay.errors",
    "Advice": "replay.running.advisor",
    "AuditResult": "replay.running.auditor",
    "CollisionCoreError": "cdcore.errors",
    "Plan": "replay.effects.effect_plan",
    "ReplayError": "replay.errors",
    "RunResult": "replay.running.run_result",
    "RunSettings": "replay.settings",
    "Session": "sessions.model.session",
    "SessionError": "sessions.errors",
    "StressResult": "replay.studies.stress.tally",
    "Tradeoff": "replay.document.run_result",
    "advise": "replay.running.advisor",
    "audit": "replay.running.auditor",
    "diff": "replay.studies.diff.runs:diff_runs",
    "plan": "replay.effects.effect_plan",
    "read": "replay.show.results.data_set",
    "read_session": "sessions.mcap.reader",
    "run": "replay.running.runner",
    "share": "replay.show.viewing",
    "stress": "replay.studies.stress.runner",
    "synthetic_session": "replay.studies.synthetic_sessions:synthetic_session",
    "tradeoff": "replay.advice.sweep",
    "view": "replay.show.viewing",
}
"""Public name -> module, or ``module:name`` where the names differ; loaded on first use, for a quick ``--help``."""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return version("vrlab-replay")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute or name)


def __dir__() -> list[str]:
    return __all__
