"""Every row of the table of detectors says where it comes from, when to choose it and what it cannot do."""

import pytest

from cdcore import DETECTORS
from cdcore.detectors import load_detector


@pytest.mark.parametrize("name", DETECTORS)
def test_it_names_sources_that_can_be_looked_up(name):
    sources = load_detector(name).sources
    assert isinstance(sources, tuple) and sources
    assert all(isinstance(source, str) and len(source.split()) >= 4 for source in sources)
    assert len(set(sources)) == len(sources)


@pytest.mark.parametrize("name", DETECTORS)
def test_it_says_when_to_choose_it_and_what_it_cannot_do(name):
    detector = load_detector(name)
    for words in (detector.choose_when, detector.cannot):
        assert isinstance(words, str) and words == words.strip() and len(words.split()) >= 2
        assert "\n" not in words and not words.endswith(".")
    assert detector.__doc__


def test_no_two_rows_are_to_be_chosen_for_the_same_reason():
    reasons = [load_detector(name).choose_when for name in DETECTORS]
    assert len(set(reasons)) == len(reasons)
