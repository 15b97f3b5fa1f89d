"""A run cites the detectors and effects it used, each once, and no others."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from cdcore.detectors.detector_table import DETECTORS, OPTIONAL, load_detector
from replay.cli.main import main
from replay.detection.recorded import RECORDED_DETECTOR
from replay.document.citations import citations, sources_behind
from replay.effects import load_effect
from sessions import write_session
from sessions.model.event import LiveContact


def test_each_detector_and_effect_is_cited_once():
    """The run has ``discrete`` twice; expected are the sources that classes and the effect's spec name themselves."""
    contact = SimpleNamespace(spec=load_effect("contact"))
    sources = sources_behind(["sphere", "discrete", "discrete", "hybrid"], [("contact", contact)])
    assert sources == {
        "detector sphere": load_detector("sphere").sources,
        "detector discrete": load_detector("discrete").sources,
        "detector hybrid": load_detector("hybrid").sources,
        "effect contact": tuple(contact.spec.sources),
    }


def test_detector_without_sources_is_cited_as_naming_no_sources(monkeypatch):
    """The class of ``sphere`` loses its attribute ``sources``, as a user's own class may have none."""
    monkeypatch.delattr(load_detector("sphere"), "sources")
    assert sources_behind(["sphere"])["detector sphere"] == ("names no sources",)


@pytest.mark.parametrize("name", [*DETECTORS, *OPTIONAL, RECORDED_DETECTOR])
def test_every_detector_of_a_run_can_be_cited(name):
    """Built in, of an extra, or an engine's recorded reports: each has at least one source, a text."""
    sources = sources_behind([name])[f"detector {name}"]
    assert sources and all(isinstance(source, str) and source for source in sources)
    assert sources != ("names no sources",)


def test_a_verbose_run_cites_the_reports_of_an_engine(tmp_path, capsys):
    """The recording has a contact that an engine reported from 40 to 50 ms."""
    reports = (
        LiveContact(time_ns=40_000_000, body_a="a", body_b="b", phase="enter"),
        LiveContact(time_ns=50_000_000, body_a="a", body_b="b", phase="exit"),
    )
    write_session(replace(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), live_contacts=reports), tmp_path / "s.mcap")
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "recorded", "-v"]) == 0
    assert f"detector {RECORDED_DETECTOR}" in capsys.readouterr().out


def test_citations_list_sources_below_each_detector_and_effect():
    """Two sources of a detector, and one of an effect."""
    text = citations({"detector x": ("A, 1996", "B, 1997"), "effect y": ("C, 2001",)})
    assert text.splitlines() == ["sources", "  detector x", "    A, 1996", "    B, 1997", "  effect y", "    C, 2001"]
