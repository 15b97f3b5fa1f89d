import pytest

from replay.errors import StudyError
from replay.study.refusals import RULES, RefusedError


@pytest.mark.parametrize("rule", RULES)
def test_a_refusal_names_its_rule_its_reason_and_what_lifts_it(rule):
    refused = RefusedError(rule, "this figure")
    text = str(refused)
    assert text.startswith("this figure: ") and rule in text
    assert RULES[rule].reason in text and RULES[rule].lift in text
    assert isinstance(refused, StudyError)


def test_an_unknown_rule_is_no_refusal():
    with pytest.raises(KeyError):
        RefusedError("because", "this figure")
