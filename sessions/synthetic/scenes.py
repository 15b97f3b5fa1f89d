"""Every synthetic session by name: `make_scene_session("bench-bumps")` gives the session and what is planted in it."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from sessions.errors import SessionError
from sessions.model.constants import HEADSET_HZ
from sessions.model.session import Session
from sessions.synthetic.truth import Truth

_EXPERIMENTS = "sessions.synthetic.experiments"

SCENES: dict[str, str] = {
    "bench-bumps": "sessions.synthetic.bench_bumps:make_bench_bumps",
    "titration": f"{_EXPERIMENTS}.titration:TITRATION",
    "silver-chloride": f"{_EXPERIMENTS}.silver_chloride:SILVER_CHLORIDE_EXPERIMENT",
    "acid-dilution": f"{_EXPERIMENTS}.acid_dilution:ACID_DILUTION",
    "gas-collection": f"{_EXPERIMENTS}.gas_collection:GAS_COLLECTION",
    "copper-sulfate": f"{_EXPERIMENTS}.copper_sulfate:COPPER_SULFATE",
    "flame-test": f"{_EXPERIMENTS}.flame_test:FLAME_TEST",
    "carbonate-titration": f"{_EXPERIMENTS}.carbonate_titration:CARBONATE_TITRATION",
    "marble": f"{_EXPERIMENTS}.marble:MARBLE",
    "ammonia-calorimetry": f"{_EXPERIMENTS}.ammonia_calorimetry:AMMONIA_CALORIMETRY",
}
"""Name -> what, called with seed, rate_hz, noise and more, returns (Session, Truth)."""


def make_scene_session(
    name: str, seed: int = 0, rate_hz: float = HEADSET_HZ, noise: str = "vive", **settings: Any
) -> tuple[Session, Truth]:
    """Make the session of a scene and its truth; the same arguments give the same session.

    Parameters
    ----------
    name : a name of `SCENES`.
    noise : ``vive`` or ``off``.
    **settings : ``jitter`` (``even``, ``steady``, ``browser``), ``losses`` (``flagged``, ``identity``, ``off``),
        ``faces`` (resolution of the meshes).

    Raises ``SessionError``: no such scene, noise, jitter or losses; a rate that is not positive.
    """
    return scene_maker(name)(seed=seed, rate_hz=rate_hz, noise=noise, **settings)


def scene_maker(name: str) -> Callable[..., tuple[Session, Truth]]:
    """The function that makes a scene; ``SessionError``: there is none of this name."""
    if name not in SCENES:
        raise SessionError(f"no scene {name!r}; there are: {', '.join(SCENES)}")
    module, function = SCENES[name].split(":")
    return getattr(import_module(module), function)
