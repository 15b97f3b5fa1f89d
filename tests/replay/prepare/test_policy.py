import pytest

from replay.prepare.policy import KINDS, LIMIT_S, PolicyRule, parse_policy
from sessions.doctor.finding import CODES


def test_every_policy_kind_is_a_doctor_code():
    assert KINDS.keys() <= CODES.keys()


def test_without_words_every_kind_is_met_with_its_default():
    policy = parse_policy()
    assert policy.as_json() == {kind: actions[0] for kind, actions in KINDS.items()}
    assert policy.rule("mesh-open").action == "keep"
    assert parse_policy(["tracking-lost=hold"]).rule("tracking-lost").limit == LIMIT_S


@pytest.mark.parametrize(
    "words", [["frozen=interpolate:0.2", "gap=refuse"], {"frozen": "interpolate:0.2", "gap": "refuse"}]
)
def test_words_and_mappings_change_what_they_name(words):
    policy = parse_policy(words)
    assert policy.rule("frozen") == PolicyRule("interpolate", 0.2) and policy.rule("gap").action == "refuse"
    assert policy.rule("teleport").action == "keep"
    assert parse_policy(policy) is policy and parse_policy(policy.as_json()) == policy
