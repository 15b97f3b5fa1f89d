"""From a finished procedure to a session with its scene, and the truth to put beside it."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.model.constants import HEADSET_HZ
from sessions.model.event import Event
from sessions.model.scene import Scene, SceneEffect
from sessions.model.session import Session
from sessions.synthetic.assembly import MADE_UP, START_NS, Recording, record_paths
from sessions.synthetic.bench import SIDES, Declaration, Placed, with_text
from sessions.synthetic.choreography import Script, controllers
from sessions.synthetic.experiments import bench_bumps, steps
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.paths import KeyPath, OnHand, placed_by
from sessions.synthetic.rng import random_stream
from sessions.synthetic.truth import Fact, Truth

FACES = 3000
EYES = np.array([0.0, 1.55, 0.62])


class Experiment(Declaration):
    """A declared experiment, and the functions that make sessions of it."""

    def __call__(
        self,
        *,
        seed: int = 0,
        rate_hz: float = HEADSET_HZ,
        noise: str = "vive",
        jitter: str = "steady",
        faces: int = FACES,
    ) -> tuple[Session, Truth]:
        """Do the procedure and record it: the session and its truth; the same arguments give the same session.

        Noise is what the trackers of hands and headset add. Things are placed by the program: they stand exactly, and
        while held they ride on the recorded hand. Truth is about the recorded poses: with noise, ``surely`` and
        ``possibly`` leave five sigma (1 mm) open, and tracking is lost only between what is planted.

        SessionError for an unknown noise or jitter, or a rate that is not positive.
        """
        how = Recording(seed=seed, rate_hz=rate_hz, noise=noise, jitter=jitter)
        lab = Lab(self, how, faces)
        for task in self.tasks:
            _perform(lab, task)
        seconds = self.seconds or float(np.ceil(lab.together() + 1.0))
        lab.finish(seconds)
        paths = {
            f"hand-{side}": lab.hands[side].path(
                random_stream(seed, "tremor", f"hand-{side}" if self.seconds else side)
            )
            for side in SIDES
        }
        observed = record_paths(
            {**paths, "headset": _path_of_the_eyes(lab)}, replace(how, seconds=seconds), keep=lab.keep
        )
        times = observed.stamps.astype(np.float64) * 1e-9
        things = {name: placed_by(phases, times, observed.poses) for name, phases in lab.things.items()}
        facts = [*lab.facts, *(_with_grasped(lab, fact) for fact in observed.facts)]
        truth = Truth(self.name, seed, START_NS, seconds, noise, lab.episodes(seconds), facts)
        tracks = observed.tracks(things)
        session = Session.from_tracks(
            {name: tracks[name] for name in lab.layout.placed if name in tracks},
            meshes=lab.layout.meshes,
            scene=self.scene(faces),
            events=[_event(fact, self.event_texts[fact.kind]) for fact in truth.facts if fact.kind in self.event_texts],
            intervals=sorted(lab.intervals, key=lambda span: (span.start_ns, span.kind, span.name)),
            facts={
                "synthetic": self.name,
                "seed": str(seed),
                "noise": noise,
                **MADE_UP,
                "choreography": str(self.version),
                "vr_type": "immersive",
            },
        )
        return replace(session, hands=controllers(lab.presses, observed.stamps + START_NS)), truth

    def scene(self, faces: int = FACES) -> Scene:
        """The scene of the experiment, with its text."""
        return with_text(Scene(self.name, tuple(self.layout(faces).bodies()), effects=self.effects), self.remarks)


def experiment(name: str) -> Experiment:
    """The experiment of this name, from its TOML file."""
    file = Path(__file__).with_name(f"{name}.toml")
    declared = tomllib.loads(file.read_text(encoding="utf-8"))
    bodies = {body: Placed(**_as_tuples(item)) for body, item in declared.pop("bodies").items()}
    effects = tuple(SceneEffect(effect.pop("kind"), effect) for effect in declared.pop("effect"))
    tasks = declared.pop("task")
    return Experiment(name=name, bodies=bodies, effects=effects, tasks=tasks, **_as_tuples(declared))


def _as_tuples(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}


def _perform(lab: Lab, task: Mapping[str, Any]) -> None:
    start = task["from"] if "from" in task else lab.together()
    if "stage" in task:
        lab.stages.append((start, task["stage"]))
    for step in task["steps"]:
        settings = dict(step)
        verb = settings.pop("do")
        if "side" in step and hasattr(Script, verb):
            getattr(lab.hands[settings.pop("side")], verb)(**settings)
            continue
        room = next(room for room in (Lab, steps, bench_bumps) if hasattr(room, verb))
        getattr(room, verb)(lab, **settings)
    lab.note_interval("task", task["name"], start, task["to"] if "to" in task else lab.together())


def _with_grasped(lab: Lab, loss: Fact) -> Fact:
    """While a hand is lost, so is what it holds from first to last."""
    (hand,) = loss.bodies
    first = {thing: phases[0][1] for thing, phases in lab.things.items()}
    grasped = [thing for thing, placing in first.items() if isinstance(placing, OnHand) and placing.hand == hand]
    return replace(loss, bodies=(hand, *grasped))


def _path_of_the_eyes(lab: Lab) -> KeyPath:
    """The eyes go to where the work is, half a second after it went there."""
    if lab.gaze:
        return lab.gaze
    rng = random_stream(lab.how.seed, "eyes", lab.name)
    keys, last = [], -1.0
    for time, position in lab.attention:
        moment = time + 0.4 if time > 0.0 else 0.0
        if moment - last < 0.8:
            continue
        keys.append(steps.looking_key(moment, EYES + rng.uniform(-0.03, 0.03, 3), position))
        last = moment
    return KeyPath(keys)


def _event(fact: Fact, text: str) -> Event:
    """The event that a program logs: it knows what was taken, let go and broken, not what was poured."""
    thing = next((body for body in fact.bodies if not body.startswith("hand-")), "")
    return Event(START_NS + round(fact.start * 1e9), fact.kind, text.format(thing), thing)
