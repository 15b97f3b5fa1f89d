"""A student at the bench: two hands that grasp, carry, pour, stir and drop; every step is noted as truth.

A `Lab` has a method for each step of a procedure. It turns steps into paths of the hands and phases of the
things, and keeps the truth: facts on the recorded clock, tasks, stages and features as intervals.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sessions.geometry.rotations import IDENTITY, Array, quaternion_inverse, quaternion_product, rotated_vectors
from sessions.model.event import Interval
from sessions.synthetic.analytic import ROUNDING_M
from sessions.synthetic.assembly import START_NS, Recording
from sessions.synthetic.bench import BENCH_TOP, SIDES, Declaration
from sessions.synthetic.choreography import Script
from sessions.synthetic.paths import Dent, Falling, KeyPath, OnHand, PosesAt, Standing, Tap
from sessions.synthetic.rng import random_stream
from sessions.synthetic.sections import Approach, approach
from sessions.synthetic.truth import Fact, Level, Pair, PlantedEpisode, levelled_episodes, ordered_pair
from sessions.synthetic.truth import Interval as Span

UP = np.array([0.0, 1.0, 0.0])
AWAY = (0.0, 0.0, -1.0)

# A grasped thing snaps to the hand's grip point, this far above where it stood, and is let go as far above where it
# will stand: more than tremor and noise of a hand together, so that neither grasp nor release scrapes.
SNAP = 0.002

# A dropped thing comes to rest this far inside the bench, as in a program without a solver for contacts: so its
# impact is a contact, and breakage has something to find.
LANDS_BELOW = 0.0005


class Lab:
    """The bench, the hands and the record of one session of what was ``declared``."""

    def __init__(self, declared: Declaration, how: Recording, faces: int) -> None:
        self.name, self.how, self.travel, self.effects = declared.name, how, declared.travel, declared.effects
        self.layout = declared.layout(faces)
        purpose = () if declared.seconds else ("procedure",)
        self.rng = random_stream(how.seed, *purpose, declared.name)
        pace = 1.0 if declared.seconds else float(self.rng.uniform(0.9, 1.15))
        self.hands = {side: Script(self.layout.at(f"hand-{side}"), pace=pace) for side in SIDES}
        self.late = how.latency_s  # seconds from a motion to the stamp it is recorded at
        self.noise_m = how.tracker.margin(declared.lever, 1) if how.tracker else 0.0
        self._contacts: list[tuple[Pair, Level, float, float, str]] = []
        self.facts: list[Fact] = []
        self.presses: dict[str, list[Span]] = {side: [] for side in SIDES}
        self.keep: dict[str, list[Span]] = {f"hand-{side}": [] for side in SIDES}
        self.grasped: dict[str, str] = {}
        self.intervals: list[Interval] = []
        self.attention: list[tuple[float, ArrayLike]] = [(0.0, UP)]
        self.gaze: KeyPath | None = None  # of the headset, where it does not follow ``attention``
        self.stages: list[tuple[float, str]] = []
        self.volumes: dict[str, float] = {}
        self.where: dict[str, tuple[Array, Array]] = {}
        self.things: dict[str, list[tuple[float, PosesAt]]] = {}  # phases: begin, and where the thing is from then on
        for body, item in self.layout.placed.items():
            self.volumes[body] = item.properties.get("liquid", {}).get("volume_ml", 0.0)
            self.where[body] = (np.array(item.position), np.array(item.quaternion))
            if item.moves and not item.instrument.startswith(("hand", "proxy")):
                self.things[body] = [(0.0, Standing(*self.where[body]))]

    def fact(self, kind: str, start: float, end: float, bodies: Iterable[str], **values: float | str) -> None:
        """Write down a fact; times are those of the recording."""
        self.facts.append(Fact(kind, start, end, tuple(sorted(bodies)), values))

    def contact(self, a: str, b: str, level: Level, *, error_m: float = 0.0, late: float = 0.0, note: str = "") -> None:
        """Write down the contacts of two bodies; ``error_m`` in metres beside rounding, ``late`` in seconds."""
        self._contacts.append((ordered_pair(a, b), level, 10.0 * ROUNDING_M + error_m, late, note))

    def episodes(self, seconds: float) -> list[PlantedEpisode]:
        """The contacts of a session that lasts so long, in the order they were written down."""
        return [
            replace(episode, note=note)
            for pair, level, noise_m, late, note in self._contacts
            for episode in levelled_episodes(pair, "contact", level, noise_m, 0.0, (late, seconds))
        ]

    def tapped(self, a: str, b: str, dent: Dent, tap: Tap, slack: float, note: str) -> None:
        """Write down the contact of a tap; ``slack`` in metres is what the bounds of first contact leave open."""
        error_m = slack + self.noise_m
        self.contact(a, b, lambda level: dent.intervals(tap, level), error_m=error_m, late=self.late, note=note)

    def approach(
        self, mover: str, target: str, height: float, direction: ArrayLike = AWAY, rotation: ArrayLike = IDENTITY
    ) -> Approach:
        """Bounds the first contact of ``mover``, ``height`` metres over the target's base, with ``target``."""
        return approach(self.layout.meshes[mover], rotation, self.layout.meshes[target], direction, height)

    def declared(self, kind: str) -> Mapping[str, Any]:
        """The settings of the scene's first effect of a kind."""
        return next(effect.settings for effect in self.effects if effect.kind == kind)

    def initial_contents(self, body: str) -> Mapping[str, Any]:
        """The declared properties of a body, the contents of a vessel among them."""
        return self.layout.placed[body].properties

    @property
    def now(self) -> float:
        """The later of both hands' clocks."""
        return max(script.now for script in self.hands.values())

    def together(self) -> float:
        """Let the earlier hand wait for the other."""
        now = self.now
        for script in self.hands.values():
            script.wait_until(now)
        return now

    def wait(self, seconds: float) -> None:
        """Both hands rest."""
        self.together()
        for script in self.hands.values():
            script.wait(seconds)

    def last(self, kind: str, body: str = "") -> Fact:
        """The fact of this kind, and of this body if given, that was written down last."""
        return next(fact for fact in reversed(self.facts) if fact.kind == kind and body in (*fact.bodies, ""))

    def grasp(self, side: str, thing: str, at: ArrayLike | str, below: float = 0.0) -> None:
        """Reach over a thing, come down, close the hand: it rides on the hand now.

        The hand closes at the point ``at`` of the thing's frame, or ``below`` metres under its site of that name.
        """
        script, (position, quaternion) = self.hands[side], self.where[thing]
        grip_point = self.layout.site(thing, at) - below * UP if isinstance(at, str) else at
        grip = position + rotated_vectors(quaternion, grip_point)
        self.gaze_at(grip)
        script.over(grip, self.travel, quaternion=IDENTITY)
        script.wait(0.3)
        lifted = position + SNAP * UP
        back = quaternion_inverse(script.quaternion)
        in_hand = rotated_vectors(back, lifted - script.position), quaternion_product(back, quaternion)
        moment = script.now + self.late
        self.things[thing].append((moment, OnHand(f"hand-{side}", *in_hand)))
        self.where[thing] = (lifted, quaternion)
        self.grasped[side] = thing
        self.fact("grasp", moment, moment, (thing, f"hand-{side}"))
        script.wait(0.25)

    def carry(
        self,
        side: str,
        position: ArrayLike,
        seconds: float | None = None,
        *,
        quaternion: ArrayLike | None = None,
        height: float | None = None,
    ) -> None:
        """Move the grasped thing until its origin is at ``position``; with ``height`` up to it and over first."""
        thing = self.grasped[side]
        rotation = self.where[thing][1] if quaternion is None else np.asarray(quaternion)
        self.gaze_at(position)
        hand, hand_rotation = self._hand_for(side, position, rotation)
        if height is None:
            self.hands[side].go(hand, seconds, quaternion=hand_rotation)
        else:
            above = height + float(hand[1]) - float(np.asarray(position)[1])
            self.hands[side].over(hand, above, quaternion=hand_rotation)
        self.where[thing] = (np.asarray(position), rotation)

    def put_down(self, side: str, position: ArrayLike, *, height: float | None = None) -> None:
        """Put the held thing down at ``position`` and open the hand: it settles by `SNAP` to where it stands."""
        goal = np.asarray(position, dtype=np.float64)
        self.carry(side, goal + 0.05 * UP, height=height)
        self.carry(side, goal + SNAP * UP, 0.7)
        thing = self.grasped[side]
        lifted, quaternion = self.where[thing]
        self.hands[side].wait(0.25)
        self.where[thing] = (lifted - SNAP * UP, quaternion)
        self.things[thing].append((self._let_go(side), Standing(*self.where[thing])))
        self.hands[side].wait(0.25)

    def put_back(self, side: str, height: float | None = None, by: float = 0.12, *, rest: bool = False) -> None:
        """Put the held thing where it stood at first; lift the empty hand off it by ``by`` metres, or bring it home."""
        home = self.layout.placed[self.grasped[side]].position
        self.put_down(side, home, height=self.travel - 0.1 if height is None else height)
        self.leave(side, by)
        if rest:
            self.rest(side)

    def leave(self, side: str, by: float = 0.12) -> None:
        """Lift the empty hand straight up off what it held."""
        x, y, z = self.hands[side].position
        self.hands[side].go((x, y + by, z))

    def rest(self, side: str) -> None:
        """Bring a hand back to where it rests."""
        script, home = self.hands[side], self.layout.at(f"hand-{side}")
        script.over(home, min(self.travel, max(script.position[1], home[1] + 0.05)), quaternion=IDENTITY)

    def drop(self, side: str) -> None:
        """Open the hand in mid-air: the thing falls on the bench, breaks if it is fast and lies there in contact.

        The program places a falling thing, so that no noise is in it.
        """
        thing = self.grasped[side]
        moment, threshold_speed = self._let_go(side), self.declared("breakage")["speed_m_s"]
        fall = Falling(moment, *self.where[thing], BENCH_TOP - LANDS_BELOW)
        self.things[thing].append((moment, fall))
        x, y, z = fall.position
        impact, speed = fall.time_at(BENCH_TOP), fall.speed_at(BENCH_TOP)
        self.fact("drop", moment, impact, (thing,), height_m=y - BENCH_TOP, impact_speed_m_s=speed)
        if speed > threshold_speed:
            self.fact("break", impact, impact, (thing,), speed_m_s=speed, threshold_m_s=threshold_speed)
        self.contact("bench", thing, lambda level: [(fall.time_at(BENCH_TOP + level), np.inf)])
        self.where[thing] = (np.array([x, fall.floor, z]), fall.quaternion)
        self.hands[side].wait(impact - moment + 0.8)

    def gaze_at(self, at: ArrayLike | str, *, after: float = 0.0) -> None:
        """The eyes turn to a place, or to where a body stood at first, when both hands have rested for ``after`` s."""
        if after:
            self.wait(after)
        at = self.layout.at(at) if isinstance(at, str) else at
        time = self.now
        if time - self.attention[-1][0] > 1.5:
            self.attention.append((time, at))

    def follow(self, side: str, times: Array, positions: Array, quaternions: Array) -> None:
        """Let the held thing follow poses given at close times (seconds of the motion, after now)."""
        thing = self.grasped[side]
        script = self.hands[side]
        hands, rotations = self._hand_for(side, positions, quaternions)
        for time, hand, rotation in zip(times.tolist(), hands, rotations, strict=True):
            script.go(hand, time - script.now, quaternion=rotation, ease="linear")
        self.where[thing] = (positions[-1], quaternions[-1])

    def secure(self, start: float, end: float) -> None:
        """Neither hand is lost in this time of the recording."""
        for windows in self.keep.values():
            windows.append((start - 0.2, end + 0.2))

    def note_interval(self, kind: str, name: str, start: float, end: float) -> None:
        """Write down a task, stage or feature of the session, in seconds of the recording."""
        a, b = (START_NS + round(time * 1e9) for time in (start, end))
        self.intervals.append(Interval(a, b, kind, name))

    def finish(self, seconds: float) -> None:
        """Close stages and features at the end of the session."""
        if not self.stages:
            return
        ends = [start for start, _ in self.stages[1:]] + [seconds]
        for (start, name), end in zip(self.stages, ends, strict=True):
            self.note_interval("stage", name, start, end)
        self.note_interval("feature", "immersion", 0.0, seconds)
        holds = sorted((fact.start, fact.end) for fact in self.facts if fact.kind == "hold")
        if holds:
            self.note_interval("feature", "interactivity", holds[0][0], min(seconds, max(end for _, end in holds)))
        self.note_interval("feature", "conception", self.stages[0][0], ends[0])

    def _let_go(self, side: str) -> float:
        thing = self.grasped.pop(side)
        moment = self.hands[side].now + self.late
        start = self.last("grasp", thing).start
        self.presses[side].append((start, moment))
        self.fact("release", moment, moment, (thing, f"hand-{side}"))
        self.fact("hold", start, moment, (thing, f"hand-{side}"))
        self.keep[f"hand-{side}"].append((start - 0.5, moment + 0.3))
        return moment

    def _hand_for(self, side: str, position: ArrayLike, quaternion: ArrayLike) -> tuple[Array, Array]:
        """Poses (..., 3) and (..., 4) of the hand that puts what it holds there."""
        placing = self.things[self.grasped[side]][-1][1]
        assert isinstance(placing, OnHand)
        rotation = quaternion_product(quaternion, quaternion_inverse(placing.rotation))
        return np.asarray(position, dtype=np.float64) - rotated_vectors(rotation, placing.offset), rotation
