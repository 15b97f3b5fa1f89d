import pytest

from replay.errors import PolicyError
from replay.prepare.policy import ACTIONS_BY_KIND, DEFAULT_LIMIT_S, PolicyRule, parse_policy
from sessions.doctor.finding import CODES


def test_every_policy_kind_is_a_doctor_code():
    """A policy acts on findings of the doctor, which are named by their codes."""
    assert ACTIONS_BY_KIND.keys() <= CODES.keys()


def test_every_kind_has_its_default_without_a_policy():
    """A policy says what to do about each kind of finding; the default is its first action: an open mesh is kept."""
    policy = parse_policy()
    assert policy.as_json() == {kind: actions[0] for kind, actions in ACTIONS_BY_KIND.items()}
    assert policy.rule("mesh-open").action == "keep"


def test_action_without_seconds_has_the_default_limit():
    """The last pose stands in for a lost body ("hold"), and nobody says for how long."""
    assert parse_policy(["tracking-lost=hold"]).rule("tracking-lost").limit == DEFAULT_LIMIT_S


@pytest.mark.parametrize(
    "policy_as_given",
    [
        pytest.param(["frozen=interpolate:0.2", "gap=refuse"], id="strings"),
        pytest.param({"frozen": "interpolate:0.2", "gap": "refuse"}, id="mapping"),
    ],
)
def test_strings_and_mappings_change_the_kinds_they_name(policy_as_given):
    """Frozen poses are interpolated over at most 0.2 s, and gaps refused; a teleport keeps its default."""
    policy = parse_policy(policy_as_given)
    assert policy.rule("frozen") == PolicyRule("interpolate", 0.2)
    assert policy.rule("gap").action == "refuse"
    assert policy.rule("teleport").action == "keep"


def test_policy_is_read_from_itself_and_from_its_json():
    """A policy that is one already stays; its JSON gives an equal one."""
    policy = parse_policy(["frozen=interpolate:0.2", "gap=refuse"])
    assert parse_policy(policy) is policy
    assert parse_policy(policy.as_json()) == policy


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        pytest.param("frozen", "policy 'frozen' is not KIND=ACTION", id="no action"),
        pytest.param("frozen=hold:0", "frozen=hold:0: a limit is a positive number of seconds", id="0 s"),
        pytest.param("frozen=hold:-1", "frozen=hold:-1: a limit is a positive number of seconds", id="negative"),
        pytest.param("frozen=hold:86401", "frozen=hold:86401: a limit is .* up to a day", id="more than a day"),
        pytest.param("frozen=hold:soon", "frozen=hold:soon: a limit is a positive number of seconds", id="a word"),
        pytest.param(
            "frozen=drop:1", "frozen=drop:1: a limit is .* after hold: or interpolate:", id="an action without limits"
        ),
        pytest.param("x=keep", "no kind of finding 'x'; there are: ", id="unknown kind"),
        pytest.param("gap=1", "gap cannot be met with '1'; it can with: ", id="unknown action"),
    ],
)
def test_policy_with_a_wrong_kind_action_or_limit_is_refused(override, reason):
    """The error says what is wrong, and what could stand there."""
    with pytest.raises(PolicyError, match=reason):
        parse_policy([override])


def test_limit_of_a_whole_day_is_accepted():
    """The last pose of a frozen body may stand in for 86,400 s, a day; 86,401 s are refused."""
    assert parse_policy(["frozen=hold:86400"]).rule("frozen").limit == 86_400.0
