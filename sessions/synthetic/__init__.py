"""Sessions made up with a known truth: analytic ones, a bench with planted bumps, six experiments.

Nothing here asks a geometry engine: truth comes from formulas, so it cannot share an error with what is audited.
"""

from importlib import import_module
from typing import Any

_NAMES = {
    "analytic": "ANALYTIC make_analytic",
    "bench_bumps": "make_bench_bumps",
    "scenes": "SCENES make_scene_session",
    "truth": "PlantedEpisode Fact Truth write_truth",
}
_HOME = {name: f"sessions.synthetic.{module}" for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "ANALYTIC", "SCENES", "Fact", "PlantedEpisode", "Truth", "make_analytic", "make_bench_bumps",
    "make_scene_session", "write_truth",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sessions.synthetic' has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)
