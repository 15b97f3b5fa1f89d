"""Tables of a run in a terminal."""

import json
from types import SimpleNamespace

import pytest
from support.report_states import RUN_OF_STATE, run_with_steady_times
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from cdcore.detectors.detector_table import settings_of
from replay.cli.run_markdown import run_markdown
from replay.cli.run_report import answer_cited
from replay.cli.run_tables import answer_lines, effect_renderables
from replay.cli.terminal import MARK_STYLES, Paragraph
from replay.detection.detector_spec import parse_detectors
from replay.document.citations import sources_behind
from replay.document.tables import GOOD, IN_RED, IN_YELLOW, markdown_text
from replay.engine import compute
from replay.show.sections import SectionName, section_of


def test_measured_fix_equals_a_run_of_the_fixed_detector():
    """Two cubes meet in frame 4 and in frames 8 to 10 of 12, at 100 Hz; sampled at 20 Hz both contacts may be missed.

    The fix that the answer proposes is to sample in every frame, which misses nothing: measured beside the run, and in
    a run of its own of the detector without a rate.
    """
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=20]")
    (answer,) = result.answers
    assert answer.fix.measured and "missed up to 2 -> 0," in answer.fix.change
    fixed = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="often=discrete")
    audit, measured = fixed.document.audit["often"], result.phases["slow"].every_frame
    assert (measured.contacts_missed, measured.late_or_cut_short, measured.false_contact.count) == (0, 0, 0)
    assert (audit.contacts_missed, audit.late_or_cut_short, audit.false_contact) == (0, 0, measured.false_contact)


def test_unmeasured_fix_names_a_valid_detector_setting():
    """Unit cubes come to gaps of 1 and 2 cm; box colliders with skins of 5 cm touch there, which is false contact.

    The answer about them proposes up to 16 convex pieces, not measured, and a command whose detector can be parsed.
    """
    gap = unit_cubes_on_x({"a": [0.0] * 6, "b": [3.0, 1.02, 1.01, 1.02, 3.0, 3.0]})
    of_box, _of_hybrid = compute(gap, detectors="box=collider[shape=box,skin_m=0.05],hybrid").answers
    assert "are worst" in of_box.sentence
    assert not of_box.fix.measured and "not measured" in of_box.fix.text
    _before, quoted_detector, _after = of_box.fix.command.split('"')
    (spec,) = parse_detectors(quoted_detector)
    assert settings_of(spec.name, spec.settings).pieces == 16


def test_a_single_search_is_worst_and_not_are():
    """A search by an ant colony with a budget of one sample misses most, and is called by a singular.

    Other detectors are called by a plural, as meshes are.
    """
    detectors = "search=qaco[budget=1,seed=3],often=discrete"
    of_search, _of_often = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors=detectors).answers
    assert of_search.sentence.startswith("Ant colony (search) is worst: ")


@pytest.mark.parametrize(
    ("state", "mark"),
    [
        ("one missed", IN_RED),
        ("only false", IN_YELLOW),
        ("undecided", IN_YELLOW),
        ("nothing wrong", GOOD),
        ("no contact", ""),
    ],
)
def test_headline_colour_matches_its_worst_error(state, mark):
    """``state``: what the worst detector of a run did wrong; the first sentence of the answer has the colour of it.

    Only a missed contact is red.
    """
    headline, *_ = (line for line in answer_lines(RUN_OF_STATE[state](), "run.rrd") if isinstance(line, Paragraph))
    assert headline.style == MARK_STYLES[mark]


@pytest.mark.parametrize("sources", [sources_behind(["exact"], {}.items()), {}], ids=["sources of exact", "no sources"])
def test_sources_are_within_json(sources, capsys):
    """Sources are the papers behind the detectors of a run, by key."""
    answer_cited(as_json=True, json_value={"answer": 42}, render=list, sources=sources)
    reported = json.loads(capsys.readouterr().out)
    assert reported["answer"] == 42
    assert reported.get("sources", {}).keys() == sources.keys()


def test_sources_are_printed_after_text(capsys):
    """Behind the exact detector is a paper of Shewchuk; without sources the text stands alone."""
    sources = sources_behind(["exact"], {}.items())
    answer_cited(as_json=False, json_value={}, render=lambda: "the answer", sources=sources)
    output = capsys.readouterr().out
    assert output.startswith("the answer") and "Shewchuk" in output
    answer_cited(as_json=False, json_value={}, render=lambda: "the answer", sources={})
    assert capsys.readouterr().out == "the answer\n"


def test_markdown_gives_every_heading_of_the_answer():
    """A run in which a contact was missed, as Markdown: each heading with its text, its figures and its command."""
    result = run_with_steady_times("one missed")
    answer = section_of(result, SectionName.ANSWER)
    page = run_markdown(result, ())
    assert [reason.heading for reason in answer.reasons] == ["What", "When", "Why", "Do", "Cost", "Sure", "Or"]
    for reason in answer.reasons:
        assert f"- **{reason.heading}** {markdown_text(reason.text)}" in page
        assert markdown_text(reason.figures) in page
        assert f"`{reason.command}`" in page or not reason.command


def test_line_of_effects_names_those_with_events_but_contact():
    """A run with a detector: of three kinds of effect, two have events, and contacts have tables of their own."""
    events_of_kind = {"contact": {"contact": 2}, "breakage": {}, "pour": {"spill": 3}}
    effects = {kind: SimpleNamespace(events=events) for kind, events in events_of_kind.items()}
    result = SimpleNamespace(detections={"exact": None}, effects=effects, document=SimpleNamespace(effects=effects))
    (paragraph,) = effect_renderables(result)
    assert "pour (spill: 3)" in paragraph.text and "contact" not in paragraph.text and "breakage" not in paragraph.text


def test_run_without_detectors_and_effects_lists_no_events():
    """Nothing is printed about effects, not even a line that says so."""
    result = SimpleNamespace(detections={}, effects={}, document=SimpleNamespace(effects={}))
    assert effect_renderables(result) == []
