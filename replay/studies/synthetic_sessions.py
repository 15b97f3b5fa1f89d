"""Every synthetic session by its name, so that a command line can offer them all."""

from typing import Any

from sessions import Session
from sessions.errors import SessionError
from sessions.synthetic.analytic import ANALYTIC, make_analytic
from sessions.synthetic.crowded import NAME as CROWDED
from sessions.synthetic.crowded import make_crowded_lab
from sessions.synthetic.scenes import SCENES, make_scene_session
from sessions.synthetic.truth import Truth


def made_up_names() -> tuple[str, ...]:
    """Names that ``synthetic_session`` takes."""
    return (*SCENES, *ANALYTIC, CROWDED)


def synthetic_session(name: str, seed: int = 0, noise: str | None = None) -> tuple[Session, Truth]:
    """The session of this name and its ground truth; the same arguments give the same session.

    ``noise`` is ``vive`` or ``off``; by default a scene has it and an analytic session has not. An unknown name is a
    ``SessionError`` that lists the names.
    """
    noise_option: dict[str, Any] = {} if noise is None else {"noise": noise}
    if name in SCENES:
        return make_scene_session(name, seed=seed, **noise_option)
    if name in ANALYTIC:
        return make_analytic(name, seed=seed, **noise_option)
    if name == CROWDED:
        return make_crowded_lab(seed=seed, **noise_option)
    raise SessionError(f"no made-up session {name!r}; there are: {', '.join(made_up_names())}")
