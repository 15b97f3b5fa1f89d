from types import SimpleNamespace

import numpy as np
import pytest

from replay.comparison.outcome import Comparison
from replay.pipeline.headline import headline, invented, price


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


def took(seconds, *, online=True, name="discrete"):
    return {"name": name, "online": online, "seconds": {"per_frame_mean": seconds}}


def priced(**detectors):
    summary = {"detectors": {"exact": took(5.69e-5, online=False, name="exact"), **detectors}}
    return SimpleNamespace(oracle="exact", comparisons=dict.fromkeys(detectors), summary=summary)


def test_the_price_of_every_contact_stands_beside_what_those_took_that_were_audited():
    engine = took(1e-7, name="recorded")
    assert price(priced(slow=took(1.63e-4), engine=engine, box=took(2e-5, online=False))) == [
        "Every contact counted here was found by exact in 0.0569 ms a frame, the whole recording at once; "
        "slow took 0.163 ms, frame by frame; box 0.02 ms. At 90 Hz a frame lasts 11.1 ms."
    ]
    assert price(priced()) == []


def test_who_reports_contact_where_there_is_none_is_told_so_however_little_it_misses():
    shares = {
        label: Comparison(label, "exact", np.array([outcomes], dtype=np.uint8))
        for label, outcomes in {"true": [1, 1, 2], "hull": [1] + [3] * 29, "always": [3, 3]}.items()
    }
    lines = invented(SimpleNamespace(comparisons=shares))
    told = {"hull": "96.7", "always": "100"}
    assert lines == [
        f"{label} invents {share} % of the contact that it reports, counted in pair-frames."
        for label, share in told.items()
    ]
