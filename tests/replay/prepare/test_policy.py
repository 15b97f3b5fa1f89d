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
    ("override", "reason"),
    [
        ("frozen", "policy 'frozen' is not KIND=ACTION"),
        ("frozen=hold:0", "frozen=hold:0: a limit is a positive number of seconds"),
        ("frozen=hold:-1", "frozen=hold:-1: a limit is a positive number of seconds"),
        ("frozen=hold:86401", "frozen=hold:86401: a limit is .* up to a day"),
        ("frozen=hold:soon", "frozen=hold:soon: a limit is a positive number of seconds"),
        ("frozen=drop:1", "frozen=drop:1: a limit is .* after hold: or interpolate:"),
        ("x=keep", "no kind of finding 'x'; there are: "),
        ("gap=1", "gap cannot be met with '1'; it can with: "),
    ],
)
def test_policy_with_a_wrong_kind_action_or_limit_is_refused(override, reason):
    """Wrong are: no action, limits beyond 0 to 86,400 s (a day), a limit of ``drop``, an unknown kind or action."""
    with pytest.raises(PolicyError, match=reason):
        parse_policy([override])
    assert parse_policy(["frozen=hold:86400"]).rule("frozen").limit == 86400.0
