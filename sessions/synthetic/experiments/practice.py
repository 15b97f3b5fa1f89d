"""Practice at the bench: one beaker is taken and put back, touched by accident and nearly touched, given times.

It is meant for classes of many sessions: half a minute, few things, a pseudonym, and a given clumsiness.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sessions.model.session import Session
from sessions.synthetic.bench import declared_bench
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import come_close, rap
from sessions.synthetic.truth import Truth

FACES = 800
HEIGHT_M = 0.045
CLEARANCE_M = 0.004


def make_practice(
    touches: Sequence[float] = (), near: int = 0, *, pseudonym: str = "S01", **settings: Any
) -> tuple[Session, Truth]:
    """Make a session of the student ``pseudonym`` and its truth.

    ``touches``: seconds that each accidental touch lasts; ``near``: how often the hand stops short of the glass;
    ``settings``: those of every made-up session (``seed``, ``rate_hz``, ``noise`` ...).
    """

    def perform(lab: Lab) -> None:
        lab.stage("practice")
        with lab.task("take the beaker and put it back"):
            lab.grasp("right", "beaker", (0.0, 0.05, 0.0))
            lab.put_back("right", rest=True)
        with lab.task("read the scale of a standing glass"):
            for _ in range(near):
                come_close(lab, "left", "glass", HEIGHT_M, CLEARANCE_M)
            for seconds in touches:
                rap(lab, "left", "glass", HEIGHT_M, seconds, note="knuckles touch the glass")
            lab.wait(0.5)
            lab.rest("left")

    declared = declared_bench(Path(__file__).with_name("practice.toml"))
    experiment = Experiment(name="practice", perform=perform, **declared)
    session, truth = experiment(**{"faces": FACES, **settings})
    return replace(session, facts={**session.facts, "pseudonym": pseudonym}), truth
