from types import SimpleNamespace

import pytest

from replay.audit.headline import headline


def told(contacts, kinds):
    misses = tuple(SimpleNamespace(episode=episode, kind=kind) for episode, kind in kinds)
    return SimpleNamespace(oracle="exact", episodes={"exact": (None,) * contacts}, misses={"slow": misses})


@pytest.mark.parametrize(
    ("contacts", "kinds", "words"),
    [
        (18, [(k, "never found") for k in range(1, 10)], "9 of 18 contacts missed by slow"),
        (9, [(1, "never found"), (2, "found late")], "1 of 9 contacts missed by slow, 1 more in part"),
        (5, [(1, "interrupted"), (1, "found late")], "1 of 5 contacts missed in part by slow"),
        (5, [], "None of 5 contacts missed by slow"),
        (1, [(1, "never found")], "1 of 1 contact missed by slow"),
        (0, [], "No contact found by exact, so none for slow to miss"),
    ],
)
def test_the_headline_counts_contacts_and_not_numbers(contacts, kinds, words):
    assert headline(told(contacts, kinds), "slow") == words
