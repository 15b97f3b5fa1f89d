"""The oracle's answer about a session, to which the answers of other detectors are held."""

from dataclasses import dataclass
from functools import cached_property

from cdcore import Detection
from replay.comparison.compare import compare
from replay.comparison.episodes import episodes
from replay.comparison.holding import holdings
from replay.comparison.outcome import Comparison, Episode
from replay.comparison.tolerance import Tolerance
from replay.prepare.assembly import Assembly
from sessions import Session


@dataclass(frozen=True, eq=False)
class Reference:
    """What the oracle said, its contacts, the stretches in which a hand holds a body, and what is within tolerance."""

    truth: Detection
    episodes: tuple[Episode, ...]
    holdings: tuple[Episode, ...]
    tolerance: Tolerance

    @classmethod
    def of(cls, truth: Detection, assembly: Assembly, session: Session | None, tolerance: Tolerance) -> "Reference":
        """The reference of a detection of an assembly; hands are those of the ``session``."""
        contacts = episodes(truth, assembly.motion.valid)
        return cls(truth, contacts, holdings(assembly, session, contacts), tolerance)

    @cached_property
    def contacts(self) -> tuple[Episode, ...]:
        """The contacts that count: all but those of a hand with what it holds."""
        held = set(self.holdings)
        return tuple(contact for contact in self.episodes if contact not in held)

    def compare(self, subject: Detection, labels: tuple[str, str] | None = None) -> Comparison:
        """Hold a detection to it; ``labels`` as for ``compare``."""
        within = self.tolerance.judge(subject, self.truth)
        return compare(subject, self.truth, labels, within, self.holdings)
