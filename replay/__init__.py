"""Replay recorded VR laboratory sessions: see what your collision detection missed, and what catching it costs."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from replay.auditor import AuditResult, audit
    from replay.made_up import made_up_session as synthetic_session
    from replay.plan import Plan, plan
    from replay.run_result import RunResult
    from replay.runner import run
    from replay.stress.runner import StressResult, stress
    from replay.run_result import Tradeoff, tradeoff

__all__ = [
    "AuditResult", "Plan", "RunResult", "StressResult", "Tradeoff", "audit", "plan", "run", "stress",
    "synthetic_session", "tradeoff",
]  # fmt: skip

# Not the library lazy_loader: it needs stub files with relative imports, and its error does not list the names.
_HOME = {
    "AuditResult": "replay.auditor",
    "Plan": "replay.plan",
    "RunResult": "replay.run_result",
    "StressResult": "replay.stress.runner",
    "Tradeoff": "replay.tradeoff.trading",
    "audit": "replay.auditor",
    "plan": "replay.plan",
    "run": "replay.runner",
    "stress": "replay.stress.runner",
    "synthetic_session": "replay.made_up:made_up_session",
    "tradeoff": "replay.tradeoff.trading",
}
"""Public name -> module, or ``module:name`` where the names differ; loaded on first use, for a quick ``--help``."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    module, _, attribute = _HOME[name].partition(":")
    return getattr(import_module(module), attribute or name)


def __dir__() -> list[str]:
    return __all__
