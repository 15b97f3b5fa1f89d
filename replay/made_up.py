"""Every made-up session by its name, so that a command line can offer them all."""

from __future__ import annotations

from typing import Any

from sessions import Session
from sessions.errors import SessionError
from sessions.synthetic.analytic import ANALYTIC, make_analytic
from sessions.synthetic.scenes import SCENES, make_scene_session
from sessions.synthetic.truth import Truth


def made_up_names() -> tuple[str, ...]:
    """Names that ``made_up_session`` takes."""
    return (*SCENES, *ANALYTIC)


def made_up_session(name: str, seed: int = 0, noise: str | None = None) -> tuple[Session, Truth]:
    """The session of this name and what was planted in it; the same arguments give the same session.

    Parameters
    ----------
    noise : ``vive`` or ``off``; ``None``: as a tracker would record a bench, and none for an analytic session.

    Raises
    ------
    SessionError
        Lists the names there are.
    """
    chosen: dict[str, Any] = {} if noise is None else {"noise": noise}
    if name in SCENES:
        return make_scene_session(name, seed=seed, **chosen)
    if name in ANALYTIC:
        return make_analytic(name, seed=seed, **chosen)
    raise SessionError(f"no made-up session {name!r}; there are: {', '.join(made_up_names())}")
