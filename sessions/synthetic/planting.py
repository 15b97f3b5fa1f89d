"""What is planted in a session at the bench: contacts from formulas, facts, presses, and times of sure tracking."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from numpy.typing import ArrayLike

from sessions.geometry.rotations import IDENTITY
from sessions.synthetic.analytic import ROUNDING_M
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import Instruments
from sessions.synthetic.choreography import Buttons
from sessions.synthetic.paths import Point, Tap, knock_interval
from sessions.synthetic.sections import Approach, approach
from sessions.synthetic.truth import Fact, Interval, Level, PlantedEpisode, levelled, ordered

SIDES = ("left", "right")
AWAY = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class Dent:
    """How a tap goes in: ``depth`` metres beyond first contact, in contact for ``seconds``.

    ``amplitude`` is the whole way out, so ``amplitude - depth`` lies between the resting place and first contact.
    """

    depth: float
    seconds: float
    amplitude: float

    @property
    def period(self) -> float:
        """Duration of the whole knock: sin^2 is beyond 1 - depth / amplitude for this share of it."""
        share = 2.0 / math.pi * math.asin(math.sqrt(self.depth / self.amplitude))
        return self.seconds / share

    @property
    def apart(self) -> float:
        """How far from first contact the body rests before and after."""
        return self.amplitude - self.depth

    def intervals(self, tap: Tap, level: float) -> list[Interval]:
        """When the tapping body is at most ``level`` short of contact."""
        share = knock_interval((self.apart - level) / self.amplitude)
        return [] if share is None else [(tap.start + share[0] * tap.period, tap.start + share[1] * tap.period)]

    def tap(self, deepest: float) -> Tap:
        """The tap of a radius, farthest out at the time ``deepest``."""
        return Tap(deepest - self.period / 2.0, self.period, (0.0, 0.0, 0.0), self.amplitude)


class Planting:
    """Everything planted so far, and the bench and the recording that it is planted in.

    ``lever``: how far from its origin, in metres, a hand's surface may be.
    """

    def __init__(self, layout: Instruments, how: Recording, lever: float) -> None:
        self.layout, self.how = layout, how
        self.noise_m = how.tracker.margin(lever, 1) if how.tracker else 0.0
        self.episodes: list[PlantedEpisode] = []
        self.facts: list[Fact] = []
        self.buttons = Buttons()
        self.keep: dict[str, list[Interval]] = {f"hand-{side}": [] for side in SIDES}

    @property
    def late(self) -> float:
        """Seconds from a motion to the stamp it is recorded at."""
        return self.how.latency_s

    def fact(self, kind: str, start: float, end: float, bodies: Iterable[str], **values: float | str) -> None:
        """Write down a fact; times are those of the recording."""
        self.facts.append(Fact(kind, start, end, tuple(sorted(bodies)), dict(values)))

    def contact(self, a: str, b: str, level: Level, *, blur: float = 0.0, late: float = 0.0, note: str = "") -> None:
        """Write down the contacts of two bodies; ``blur`` in metres beside rounding, ``late`` in seconds."""
        clock = (late, self.how.seconds)
        found = levelled(ordered(a, b), "contact", level, 10.0 * ROUNDING_M + blur, 0.0, clock)
        self.episodes += [replace(episode, note=note) for episode in found]

    def tapped(self, a: str, b: str, dent: Dent, tap: Tap, slack: float, note: str) -> None:
        """Write down the contact of a tap; ``slack`` in metres is what the bounds of first contact leave open."""
        blur = slack + self.noise_m
        self.contact(a, b, lambda level: dent.intervals(tap, level), blur=blur, late=self.late, note=note)

    def approach(
        self, mover: str, target: str, height: float, direction: Point = AWAY, turn: ArrayLike = IDENTITY
    ) -> Approach:
        """Where ``mover``, ``height`` metres over the target's base, begins to touch ``target``."""
        return approach(self.layout.mesh(mover), turn, self.layout.mesh(target), direction, height)
