"""From a finished procedure to a session with its scene, and the truth to put beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.geometry.rotations import quaternion_facing
from sessions.model.constants import HEADSET_HZ
from sessions.model.event import Event
from sessions.model.scene import Scene, SceneEffect
from sessions.model.session import Session
from sessions.synthetic.assembly import START_NS, Recording, recorded
from sessions.synthetic.bench import Instruments, Placed, declared_bench, made_session, with_text
from sessions.synthetic.experiments import steps
from sessions.synthetic.experiments.lab import Lab, layout_of
from sessions.synthetic.paths import Key, KeyPath, Poses, point, quaternion_of
from sessions.synthetic.planting import SIDES
from sessions.synthetic.rng import random_stream
from sessions.synthetic.things import placed_by
from sessions.synthetic.truth import Fact, PlantedEpisode, Truth
from sessions.synthetic.truth import Interval as Span

FACES = 3000
# A procedure tells its own length when it is done; until then nothing is cut off before ten minutes.
LONGEST_S = 600.0
EYES = (0.0, 1.55, 0.62)
EVENT_WORDS = {
    "grasp": "takes", "release": "lets go of", "drop": "drops", "break": "breaks", "end_point": "sees the end point in",
}  # fmt: skip


@dataclass(frozen=True)
class Experiment:
    """One experiment: what stands on the bench, what is done, which effects the scene calls for."""

    name: str
    remarks: tuple[str, ...]
    placed: Mapping[str, Placed]
    """Instruments by body name, without bench, hands and headset."""
    grips: tuple[float, float]
    """Radii of what the left and the right hand hold."""
    tasks: Sequence[Mapping[str, Any]]
    """What is done: each has a ``name``, a ``stage`` where a stage of learning begins with it, and ``steps``, which
    ``do`` what a method of `Lab` or a function of `steps` does with the step's other keys."""
    effects: tuple[SceneEffect, ...]
    """Of the scene, in the words of the catalogue of effects."""
    travel: float = 1.25
    """Height at which hands cross the bench."""
    parents: Mapping[str, str] = field(default_factory=dict)
    """Body name -> body that its pose is relative to."""
    version: int = 1
    """Of the choreography: another one has other poses for the same seed."""

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

        SessionError for an unknown noise or jitter, or a rate that is not positive.
        """
        layout = layout_of(self.placed, self.grips, faces)
        how = Recording(seed=seed, rate_hz=rate_hz, seconds=LONGEST_S, noise=noise, jitter=jitter)
        lab = Lab(self.name, layout, how, travel=self.travel, effects=self.effects)
        for task in self.tasks:
            _perform(lab, task)
        seconds = float(np.ceil(lab.together() + 1.0))
        lab.finish(seconds)
        hands = {f"hand-{side}": lab.hands[side].path(random_stream(seed, "tremor", side)) for side in SIDES}
        seen = recorded({**hands, "headset": _watching(lab)}, replace(how, seconds=seconds), keep=lab.keep)
        times = seen.stamps.astype(np.float64) * 1e-9
        things: dict[str, Poses] = {name: placed_by(phases, times, seen.poses) for name, phases in lab.things.items()}
        things.update({name: path(times) for name, path in lab.joints.items()})
        facts = [*lab.facts, *seen.facts]
        truth = Truth(self.name, seed, START_NS, seconds, noise, _until(lab.episodes, seconds), facts)
        intervals = sorted(lab.intervals, key=lambda span: (span.start_ns, span.kind, span.name))
        scene = self._scene(layout)
        happened: dict[str, Any] = {"events": _events(truth.facts), "intervals": intervals}
        return made_session(truth, seen, things, layout, lab.buttons, scene, self.version, **happened), truth

    def _scene(self, layout: Instruments) -> Scene:
        bodies = tuple(replace(body, parent=self.parents.get(body.id, "")) for body in layout.bodies())
        return with_text(Scene(self.name, bodies, effects=self.effects), self.remarks)


def experiment(name: str) -> Experiment:
    """The experiment of this name, from its TOML file."""
    return Experiment(name=name, **declared_bench(Path(__file__).with_name(f"{name}.toml")))


def _perform(lab: Lab, task: Mapping[str, Any]) -> None:
    start = lab.together()
    if "stage" in task:
        lab.stages.append((start, task["stage"]))
    for step in task["steps"]:
        settings = dict(step)
        verb = settings.pop("do")
        # What a `Lab` does itself, or a function of `steps`.
        (getattr(Lab, verb, None) or getattr(steps, verb))(lab, **settings)
    lab.note_interval("task", task["name"], start, lab.together())


def _until(episodes: Sequence[PlantedEpisode], seconds: float) -> list[PlantedEpisode]:
    """Episodes that last to the end of the procedure end with the session."""

    def cut(span: Span | None) -> Span | None:
        return None if span is None else (span[0], min(span[1], seconds))

    return [
        replace(e, nominal=cut(e.nominal), surely=cut(e.surely), possibly=(e.possibly[0], min(e.possibly[1], seconds)))
        for e in episodes
    ]


def _watching(lab: Lab) -> KeyPath:
    """The eyes go to where the work is, half a second after it went there."""
    rng = random_stream(lab.how.seed, "eyes", lab.name)
    keys, last = [], -1.0
    for time, place in lab.attention:
        moment = time + 0.4 if time > 0.0 else 0.0
        if moment - last < 0.8:
            continue
        eyes = np.array(EYES) + rng.uniform(-0.03, 0.03, 3)
        keys.append(Key(moment, point(eyes), quaternion_of(quaternion_facing(np.array(place) - eyes))))
        last = moment
    return KeyPath(keys)


def _events(facts: Sequence[Fact]) -> list[Event]:
    """What a program would log: it knows what was taken, let go and broken, not what was poured."""
    return [
        Event(START_NS + round(fact.start * 1e9), fact.kind, f"{EVENT_WORDS[fact.kind]} {_thing(fact)}", _thing(fact))
        for fact in facts
        if fact.kind in EVENT_WORDS
    ]


def _thing(fact: Fact) -> str:
    return next((body for body in fact.bodies if not body.startswith("hand-")), "")
