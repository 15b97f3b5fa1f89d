"""Sessions made up with a known truth: analytic ones, a bench with planted bumps, six experiments.

Nothing here asks a geometry engine: truth comes from formulas, so it cannot share an error with what is audited.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "ANALYTIC": "sessions.synthetic.analytic",
    "Episode": "sessions.synthetic.truth",
    "Fact": "sessions.synthetic.truth",
    "Prediction": "sessions.synthetic.looks",
    "SCENES": "sessions.synthetic.scenes",
    "Truth": "sessions.synthetic.truth",
    "looks": "sessions.synthetic.looks",
    "make_analytic": "sessions.synthetic.analytic",
    "make_bench_bumps": "sessions.synthetic.bench_bumps",
    "make_scene_session": "sessions.synthetic.scenes",
    "predicted": "sessions.synthetic.looks",
    "read_truth": "sessions.synthetic.truth",
    "write_truth": "sessions.synthetic.truth",
}

__all__ = [
    "ANALYTIC", "SCENES", "Episode", "Fact", "Prediction", "Truth", "looks", "make_analytic", "make_bench_bumps",
    "make_scene_session", "predicted", "read_truth", "write_truth",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sessions.synthetic' has no attribute {name!r}; it has: {', '.join(__all__)}")
    home = import_module(_HOME[name])
    return getattr(home, name)
