"""From a finished procedure to a session with its scene, and the truth to put beside it."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.model.constants import HEADSET_HZ
from sessions.model.event import Event
from sessions.model.scene import Scene, SceneEffect
from sessions.model.session import Session
from sessions.synthetic.assembly import MADE_UP, START_NS, Recording, recorded
from sessions.synthetic.bench import Placed, with_text
from sessions.synthetic.choreography import Script
from sessions.synthetic.experiments import bench_bumps, steps
from sessions.synthetic.experiments.lab import SIDES, Lab, layout_of
from sessions.synthetic.paths import KeyPath, Poses
from sessions.synthetic.rng import random_stream
from sessions.synthetic.things import Held, placed_by
from sessions.synthetic.truth import Fact, PlantedEpisode, Truth
from sessions.synthetic.truth import Interval as Span

FACES = 3000
# A procedure tells its own length when it is done; until then nothing is cut off before ten minutes.
LONGEST_S = 600.0
EYES = np.array([0.0, 1.55, 0.62])
EVENT_WORDS = {
    "grasp": "takes {}", "release": "lets go of {}", "drop": "drops {}", "break": "breaks {}",
    "end_point": "sees the end point in {}",
}  # fmt: skip


@dataclass(frozen=True)
class Experiment:
    """One experiment: what stands on the bench, what is done, which effects the scene calls for."""

    name: str
    remarks: tuple[str, ...]
    bodies: Mapping[str, Placed]
    """Instruments by body name, without bench, hands and headset where there are ``grips``."""
    tasks: Sequence[Mapping[str, Any]]
    """What is done: each has a ``name``, a ``stage`` where a stage of learning begins with it, and ``steps``, which
    ``do`` what a method of `Lab`, or of the `Script` of one side, or a function of `steps` or `bench_bumps` does with
    the step's other keys."""
    effects: tuple[SceneEffect, ...]
    """Of the scene, in the words of the catalogue of effects."""
    grips: tuple[float, ...] = ()
    """Radii of what the left and the right hand hold."""
    travel: float = 1.25
    """Height at which hands cross the bench."""
    lever: float = 0.25
    """How far from its origin the surface of a hand, or of what it holds, may be."""
    seconds: float = 0.0
    """Length where the steps say when things are done (then a task tells ``from`` when ``to`` when it lasts); 0: as
    long as the procedure takes."""
    words: Mapping[str, str] = field(default_factory=lambda: EVENT_WORDS)
    """What the program logs of a fact of this kind."""
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

        Noise is what the trackers of hands and headset add. Things are placed by the program: they stand exactly, and
        while held they ride on the recorded hand. Truth is about the recorded poses: with noise, ``surely`` and
        ``possibly`` leave five sigma (1 mm) open, and tracking is lost only between what is planted.

        SessionError for an unknown noise or jitter, or a rate that is not positive.
        """
        layout, timed = layout_of(self.bodies, self.grips, faces), self.seconds > 0.0
        how = Recording(seed=seed, rate_hz=rate_hz, seconds=self.seconds or LONGEST_S, noise=noise, jitter=jitter)
        lab = Lab(self.name, layout, how, travel=self.travel, effects=self.effects, timed=timed, lever=self.lever)
        for task in self.tasks:
            _perform(lab, task)
        seconds = self.seconds or float(np.ceil(lab.together() + 1.0))
        lab.finish(seconds)
        paths = {
            f"hand-{side}": lab.hands[side].path(random_stream(seed, "tremor", f"hand-{side}" if timed else side))
            for side in SIDES
        }
        seen = recorded({**paths, "headset": _watching(lab)}, replace(how, seconds=seconds), keep=lab.keep)
        times = seen.stamps.astype(np.float64) * 1e-9
        things: dict[str, Poses] = {name: placed_by(phases, times, seen.poses) for name, phases in lab.things.items()}
        things.update({name: path(times) for name, path in lab.joints.items()})
        facts = [*lab.facts, *(_with_held(lab, fact) for fact in seen.facts)]
        truth = Truth(self.name, seed, START_NS, seconds, noise, _until(lab.episodes, seconds), facts)
        tracks = seen.tracks(things)
        session = Session.from_tracks(
            {name: tracks[name] for name in layout.placed if name in tracks},
            meshes=layout.meshes,
            scene=self.scene(faces),
            events=[_event(fact, self.words[fact.kind]) for fact in truth.facts if fact.kind in self.words],
            intervals=sorted(lab.intervals, key=lambda span: (span.start_ns, span.kind, span.name)),
            facts={
                "synthetic": self.name, "seed": str(seed), "noise": noise, **MADE_UP,
                "choreography": str(self.version), "vr_type": "immersive",
            },
        )  # fmt: skip
        return replace(session, hands=lab.buttons.tracks(seen.stamps + START_NS)), truth

    def scene(self, faces: int = FACES) -> Scene:
        """What the experiment declares, with its text."""
        bodies = layout_of(self.bodies, self.grips, faces).bodies()
        return with_text(Scene(self.name, bodies, effects=self.effects), self.remarks)


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


def _with_held(lab: Lab, loss: Fact) -> Fact:
    """While a hand is lost, so is what it holds from first to last."""
    (hand,) = loss.bodies
    held = [
        thing
        for thing, ((_, placing), *later) in lab.things.items()
        if isinstance(placing, Held) and placing.hand == hand and not later
    ]
    return replace(loss, bodies=(hand, *held))


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
    if lab.gaze:
        return lab.gaze
    rng = random_stream(lab.how.seed, "eyes", lab.name)
    keys, last = [], -1.0
    for time, place in lab.attention:
        moment = time + 0.4 if time > 0.0 else 0.0
        if moment - last < 0.8:
            continue
        keys.append(steps.looking(moment, EYES + rng.uniform(-0.03, 0.03, 3), place))
        last = moment
    return KeyPath(keys)


def _event(fact: Fact, words: str) -> Event:
    """What a program would log: it knows what was taken, let go and broken, not what was poured."""
    thing = next((body for body in fact.bodies if not body.startswith("hand-")), "")
    return Event(START_NS + round(fact.start * 1e9), fact.kind, words.format(thing), thing)
