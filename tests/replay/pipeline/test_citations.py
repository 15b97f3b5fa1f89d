"""A run cites the detectors and effects it used, each once, and no others."""

from types import SimpleNamespace

import pytest
from support.small_worlds import cubes

import replay
from cdcore.detectors import load_detector
from replay.effects import load_effect
from replay.pipeline.citations import citations, sources_behind

PLACES = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]}


@pytest.fixture(scope="module")
def result():
    return replay.run(cubes(PLACES), detectors="sphere,first=discrete,second=discrete[rate_hz=30]", oracle="hybrid")


def test_each_detector_and_effect_of_a_run_is_cited_once_with_its_own_sources(result):
    contact = SimpleNamespace(spec=load_effect("contact"))
    names = (detector["name"] for detector in result.summary["detectors"].values())
    behind = sources_behind(names, [("contact", contact)])
    assert behind.pop("effect contact") == tuple(contact.spec.sources)
    assert set(behind) == {"detector sphere", "detector discrete", "detector hybrid"}
    for what, sources in behind.items():
        assert sources == load_detector(what.removeprefix("detector ")).sources


def test_a_detector_from_outside_without_sources_is_said_to_have_none(monkeypatch):
    monkeypatch.delattr(load_detector("sphere"), "sources")
    assert sources_behind(["sphere"])["detector sphere"] == ("names no sources",)


def test_the_text_puts_sources_below_what_they_are_of():
    text = citations({"detector x": ("A, 1996", "B, 1997"), "effect y": ("C, 2001",)})
    assert text.splitlines() == ["sources", "  detector x", "    A, 1996", "    B, 1997", "  effect y", "    C, 2001"]
