import pytest

from replay.errors import PolicyError
from replay.prepare.policy import ACTIONS_BY_KIND, DEFAULT_LIMIT_S, PolicyRule, parse_policy
from sessions.doctor.finding import CODES


def test_every_policy_kind_is_a_doctor_code():
    """A policy acts on findings of the doctor, which are named by their codes."""
    assert ACTIONS_BY_KIND.keys() <= CODES.keys()


def test_every_kind_has_its_default_without_a_policy():
    """The default is the first action of a kind; an action without seconds has DEFAULT_LIMIT_S."""
    policy = parse_policy()
    assert policy.as_json() == {kind: actions[0] for kind, actions in ACTIONS_BY_KIND.items()}
    assert policy.rule("mesh-open").action == "keep"
    assert parse_policy(["tracking-lost=hold"]).rule("tracking-lost").limit == DEFAULT_LIMIT_S


@pytest.mark.parametrize(
    "text", [["frozen=interpolate:0.2", "gap=refuse"], {"frozen": "interpolate:0.2", "gap": "refuse"}]
)
def test_strings_and_mappings_change_the_kinds_they_name(text):
    """Frozen poses are interpolated over at most 0.2 s, and gaps refused; a teleport keeps its default."""
    policy = parse_policy(text)
    assert policy.rule("frozen") == PolicyRule("interpolate", 0.2) and policy.rule("gap").action == "refuse"
    assert policy.rule("teleport").action == "keep"
    assert parse_policy(policy) is policy and parse_policy(policy.as_json()) == policy


@pytest.mark.parametrize(
    "override",
    [
        "frozen",
        "frozen=hold:0",
        "frozen=hold:-1",
        "frozen=hold:86401",
        "frozen=hold:soon",
        "frozen=drop:1",
        "x=keep",
        "gap=1",
    ],
)
def test_policy_with_a_wrong_kind_action_or_limit_is_refused(override):
    """Wrong are: no action, limits beyond 0 to 86,400 s (a day), a limit of ``drop``, an unknown kind or action."""
    with pytest.raises(PolicyError):
        parse_policy([override])
    assert parse_policy(["frozen=hold:86400"]).rule("frozen").limit == 86400.0
