"""Every made-up session by its name, so that a command line can offer them all."""

from __future__ import annotations

from typing import Final

from sessions import Session
from sessions.errors import SessionError
from sessions.synthetic import ANALYTIC, make_analytic, make_bench_bumps

BENCH_BUMPS: Final = "bench-bumps"


def made_up_names() -> tuple[str, ...]:
    """Names that ``made_up_session`` takes."""
    return (BENCH_BUMPS, *ANALYTIC)


def made_up_session(name: str, seed: int = 0) -> Session:
    """The session of this name; the same name and seed give the same session.

    Raises
    ------
    SessionError
        Lists the names there are.
    """
    if name == BENCH_BUMPS:
        return make_bench_bumps(seed)[0]
    if name in ANALYTIC:
        return make_analytic(name, seed=seed)[0]
    raise SessionError(f"no made-up session {name!r}; there are: {', '.join(made_up_names())}")
