"""Actions of a run for each kind of finding: a table of defaults, and overrides for one run.

The summary lists every action, and the verdicts concerned carry a flag.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from replay.errors import PolicyError
from sessions.doctor.finding import CODES

DROP: Final = "drop"
"""The body has no pose there: verdicts are NO_POSE; frames that are dropped are left out."""
HOLD: Final = "hold"
"""The last good pose is used instead, for at most the limit; then there is none."""
INTERPOLATE: Final = "interpolate"
"""A pose between the last good one and the next, if they are at most the limit apart; else there is none."""
REFUSE: Final = "refuse"
"""The run does not start."""
KEEP: Final = "keep"
"""Used as recorded, and flagged."""

DEFAULT_LIMIT_S: Final = 0.05
"""Seconds that a pose is held or bridged when no limit is given: those between two samples (`BRIDGE_NS`)."""

_STAND_IN: Final = (DROP, HOLD, INTERPOLATE)


@dataclass(frozen=True)
class PolicyRule:
    """An action on one kind of finding; ``limit`` in seconds belongs to ``hold`` and ``interpolate``."""

    action: str
    limit: float = DEFAULT_LIMIT_S

    def __str__(self) -> str:
        return f"{self.action}:{self.limit:g}" if self.action in (HOLD, INTERPOLATE) else self.action


ACTIONS_BY_KIND: Final[dict[str, tuple[str, ...]]] = {
    # Refused by default: a program that writes such a sample as a pose may have written other wrong ones.
    "not-finite": (REFUSE, *_STAND_IN),
    "zero-quaternion": (REFUSE, *_STAND_IN),
    "non-unit-quaternion": (REFUSE, *_STAND_IN),
    "out-of-space": (*_STAND_IN, REFUSE, KEEP),
    "identity-while-lost": (*_STAND_IN, REFUSE, KEEP),
    "tracking-lost": (*_STAND_IN, REFUSE),
    # Kept by default: the position may be right, and only a person can tell.
    "frozen": (KEEP, *_STAND_IN, REFUSE),
    "teleport": (KEEP, DROP, REFUSE),
    "gap": (KEEP, REFUSE),
    # A motion needs stamps that increase, so these frames cannot be kept.
    "time-backwards": (DROP, REFUSE),
    "duplicate-stamps": (DROP, REFUSE),
}
"""Kinds with a choice of their own: their actions, the default first. Every other code is kept unless it is refused."""

PolicyLike = Mapping[str, str] | Sequence[str] | str


@dataclass(frozen=True)
class Policy:
    """The rules of one run: kind -> rule; complete for `ACTIONS_BY_KIND`; other codes only where requested."""

    rules: Mapping[str, PolicyRule]

    def rule(self, kind: str) -> PolicyRule:
        """Rule for this kind of finding."""
        return self.rules.get(kind) or PolicyRule(KEEP)

    def as_json(self) -> dict[str, str]:
        """Kind -> words, as ``--policy`` takes them."""
        return {kind: str(rule) for kind, rule in self.rules.items()}


def parse_policy(overrides: PolicyLike | Policy | None = None) -> Policy:
    """Defaults, changed by ``KIND=ACTION`` or ``KIND=ACTION:SECONDS``, or by a mapping from kind to action.

    Several stand in a sequence, or in one text between commas.

    Raises ``PolicyError``: an unknown kind or action, one that makes no sense for the kind, or a limit that is no
    positive number.

    Examples
    --------
    >>> str(parse_policy(["frozen=interpolate:0.2"]).rule("frozen"))
    'interpolate:0.2'
    """
    if isinstance(overrides, Policy):
        return overrides
    if isinstance(overrides, str):
        overrides = overrides.split(",")
    rules = {kind: PolicyRule(actions[0]) for kind, actions in ACTIONS_BY_KIND.items()}
    pairs = (
        overrides.items() if isinstance(overrides, Mapping) else [_kind_and_action(word) for word in overrides or ()]
    )
    for kind, action in pairs:
        rules[kind] = _parsed_rule(kind, action)
    return Policy(rules)


def _kind_and_action(override: str) -> tuple[str, str]:
    kind, equals, action = override.partition("=")
    if not equals:
        raise PolicyError(f"policy {override!r} is not KIND=ACTION; write for example frozen=drop")
    return kind.strip(), action.strip()


LONGEST_LIMIT_S: Final = 86_400.0  # nobody holds a pose for longer than a day


def _parsed_rule(kind: str, rule_text: str) -> PolicyRule:
    if kind not in CODES:
        raise PolicyError(
            f"no kind of finding {kind!r}; there are: {', '.join(ACTIONS_BY_KIND)}, and every code of the doctor"
        )
    action, colon, limit = rule_text.partition(":")
    allowed_actions = ACTIONS_BY_KIND.get(kind, (KEEP, REFUSE))
    if action not in allowed_actions:
        raise PolicyError(f"{kind} cannot be met with {action!r}; it can with: {', '.join(allowed_actions)}")
    if not colon:
        return PolicyRule(action)
    try:
        seconds = float(limit)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds <= LONGEST_LIMIT_S or action not in (HOLD, INTERPOLATE):
        limit_syntax = "a limit is a positive number of seconds, up to a day, after hold: or interpolate:"
        raise PolicyError(f"{kind}={rule_text}: {limit_syntax}")
    return PolicyRule(action, seconds)
