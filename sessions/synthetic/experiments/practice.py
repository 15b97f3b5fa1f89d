"""Practice at the bench: one beaker is taken and put back, touched by accident and nearly touched, given times.

It is meant for classes of many sessions: half a minute, few things, a pseudonym, and a given clumsiness.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from sessions.model.session import Session
from sessions.synthetic.experiments.record import experiment
from sessions.synthetic.truth import Truth

FACES = 800
KNUCKLES = {"side": "left", "target": "glass", "height": 0.045}
NEAR_MISS = {"do": "come_close", **KNUCKLES, "clearance": 0.004}
TOUCH = {"do": "rap", **KNUCKLES, "note": "knuckles touch the glass"}


def make_practice(
    touches: Sequence[float] = (), near: int = 0, *, pseudonym: str = "S01", **settings: Any
) -> tuple[Session, Truth]:
    """Make a session of the student ``pseudonym`` and its truth.

    ``touches``: seconds that each accidental touch lasts; ``near``: how often the hand stops short of the glass;
    ``settings``: those of every made-up session (``seed``, ``rate_hz``, ``noise`` ...).
    """
    practice = experiment("practice")
    first, reading = practice.tasks
    clumsy = [NEAR_MISS] * near + [{**TOUCH, "seconds": seconds} for seconds in touches]
    tasks = (first, {**reading, "steps": [*clumsy, *reading["steps"]]})
    session, truth = replace(practice, tasks=tasks)(**{"faces": FACES, **settings})
    return replace(session, facts={**session.facts, "pseudonym": pseudonym}), truth
