"""Every synthetic session by name: `make_scene_session("bench-bumps")` gives the session and what is planted in it."""

from typing import Any

from sessions.errors import SessionError
from sessions.model.constants import HEADSET_HZ
from sessions.model.session import Session
from sessions.synthetic.truth import Truth

SCENES = (
    "bench-bumps",
    "titration",
    "silver-chloride",
    "acid-dilution",
    "gas-collection",
    "copper-sulfate",
    "flame-test",
    "carbonate-titration",
    "marble",
    "ammonia-calorimetry",
)


def make_scene_session(
    name: str, seed: int = 0, rate_hz: float = HEADSET_HZ, noise: str = "vive", **settings: Any
) -> tuple[Session, Truth]:
    """Make the session of a scene and its truth; the same arguments give the same session.

    Parameters
    ----------
    name : a name of `SCENES`.
    noise : ``vive`` or ``off``.
    **settings : ``jitter`` (``even``, ``steady``, ``browser``), ``faces`` (resolution of the meshes).

    Raises ``SessionError``: no such scene, noise or jitter; a rate that is not positive.
    """
    if name not in SCENES:
        raise SessionError(f"no scene {name!r}; there are: {', '.join(SCENES)}")
    from sessions.synthetic.experiments.record import experiment

    return experiment(name)(seed=seed, rate_hz=rate_hz, noise=noise, **settings)
