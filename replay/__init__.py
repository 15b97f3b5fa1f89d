"""Replay recorded VR laboratory sessions: see what your collision detection missed, and what catching it costs."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "run": "replay.runner",
    "audit": "replay.auditor",
    "plan": "replay.plan",
    "RunResult": "replay.run_result",
}
"""Public name -> module; loaded on first use, so that ``replay --help`` answers at once."""

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'replay' has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
