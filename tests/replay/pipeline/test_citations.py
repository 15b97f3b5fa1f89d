"""A run cites the detectors and effects it used, each once, and no others."""

from types import SimpleNamespace

from cdcore.detectors import load_detector
from replay.effects import load_effect
from replay.pipeline.citations import citations, sources_behind


def test_each_detector_and_effect_of_a_run_is_cited_once_with_its_own_sources():
    contact = SimpleNamespace(spec=load_effect("contact"))
    behind = sources_behind(["sphere", "discrete", "discrete", "hybrid"], [("contact", contact)])
    detectors = {f"detector {name}": load_detector(name).sources for name in ("sphere", "discrete", "hybrid")}
    assert behind == {**detectors, "effect contact": tuple(contact.spec.sources)}


def test_a_detector_from_outside_without_sources_is_said_to_have_none(monkeypatch):
    monkeypatch.delattr(load_detector("sphere"), "sources")
    assert sources_behind(["sphere"])["detector sphere"] == ("names no sources",)


def test_the_text_puts_sources_below_what_they_are_of():
    text = citations({"detector x": ("A, 1996", "B, 1997"), "effect y": ("C, 2001",)})
    assert text.splitlines() == ["sources", "  detector x", "    A, 1996", "    B, 1997", "  effect y", "    C, 2001"]
