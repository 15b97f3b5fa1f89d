"""Two hands at work among thin glasses, bumping into them eighteen times: nine of the bumps are brief, the seed alone
decides when each comes, and every one is known from a formula.

The right hand stirs in a beaker with a glass rod and then taps things with it; the left raps its knuckles against
glasses, carries a graduated cylinder, clinks it against a flask and sets it down too hard.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from sessions.model.constants import HEADSET_HZ
from sessions.model.event import Event, Interval
from sessions.model.scene import Scene
from sessions.model.session import Session
from sessions.synthetic.assembly import START_NS, Recorded, Recording, recorded
from sessions.synthetic.bench import Instruments, Placed, declared_bench, made_session, with_text
from sessions.synthetic.bump_scripts import BumpPlan, left_hand, right_hand, watching
from sessions.synthetic.paths import Poses, point
from sessions.synthetic.rng import random_stream
from sessions.synthetic.things import Held, PosesAt, Standing, placed_by
from sessions.synthetic.truth import Fact, Truth

NAME = "bench-bumps"
VERSION = 2
"""Of the choreography: another one has other poses for the same seed."""

SECONDS = 60.0
FACES = 3000

DECLARED = declared_bench(Path(__file__).with_name("bench-bumps.toml"))
PLACED: dict[str, Placed] = DECLARED["placed"]


def make_bench_bumps(
    seed: int = 0,
    rate_hz: float = HEADSET_HZ,
    noise: str = "vive",
    *,
    jitter: str = "steady",
    faces: int = FACES,
) -> tuple[Session, Truth]:
    """Make the session and its truth, about 60 s; the same arguments give the same session.

    Noise is what the trackers of hands and headset add. Glasses are placed by the program: they stand exactly, and
    while held they ride on the recorded hand. Truth is about the recorded poses: with noise, ``surely`` and
    ``possibly`` leave five sigma (1 mm) open, and tracking is lost only between bumps.

    Raises ``SessionError``: an unknown noise or jitter; a rate that is not positive.
    """
    how = Recording(seed=seed, rate_hz=rate_hz, seconds=SECONDS, noise=noise, jitter=jitter)
    layout = Instruments(PLACED, faces)
    plan = BumpPlan(layout, how, random_stream(seed, NAME))
    scripts = {"hand-right": right_hand(plan), "hand-left": left_hand(plan)}  # in this order: both draw from one stream
    hands = {name: script.path(random_stream(seed, "tremor", name)) for name, script in scripts.items()}
    seen = recorded({**hands, "headset": watching(plan)}, how, keep=plan.keep)
    facts = [*plan.facts, *(_with_held(fact) for fact in seen.facts)]
    truth = Truth(NAME, seed, START_NS, SECONDS, noise, plan.episodes, facts)
    scene = with_text(Scene(NAME, layout.bodies(), effects=DECLARED["effects"]), DECLARED["remarks"])
    happened = {"events": _events(truth), "intervals": _intervals()}
    return made_session(
        truth, seen, _things(plan, seen), layout, plan.buttons, scene, version=VERSION, **happened
    ), truth


def _things(plan: BumpPlan, seen: Recorded) -> dict[str, Poses]:
    """Poses of what the program places: it stands, or rides on the hand that holds it."""
    times = seen.stamps.astype(np.float64) * 1e-9
    stands = {
        name: Standing(item.position, item.quaternion)
        for name, item in PLACED.items() if item.moves and name not in seen.poses
    }  # fmt: skip
    phases: dict[str, list[tuple[float, PosesAt]]] = {name: [(0.0, standing)] for name, standing in stands.items()}
    phases["rod"] = [(0.0, Held("hand-right", point(plan.rod_in_hand)))]
    riding, goal = Held("hand-left", point(plan.cylinder_in_hand)), Standing(point(plan.cylinder_goal))
    phases["cylinder"] += [(plan.grasped, riding), (plan.released, goal)]
    return {name: placed_by(parts, times, seen.poses) for name, parts in phases.items()}


def _with_held(fact: Fact) -> Fact:
    """While the right hand is lost, so is the rod that rides on it."""
    return replace(fact, bodies=("hand-right", "rod")) if fact.bodies == ("hand-right",) else fact


def _events(truth: Truth) -> list[Event]:
    words = {"grasp": "takes the cylinder", "release": "lets the cylinder go"}
    return [
        Event(START_NS + round(fact.start * 1e9), fact.kind, words[fact.kind], "cylinder")
        for fact in truth.facts
        if fact.kind in words
    ]


def _intervals() -> list[Interval]:
    spans = (("stir the beaker", 3.0, 27.0), ("carry the cylinder", 22.0, 44.0), ("tap the glasses", 28.0, 56.0))
    return [Interval(START_NS + round(a * 1e9), START_NS + round(b * 1e9), "task", name, {}) for name, a, b in spans]
