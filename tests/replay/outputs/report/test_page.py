"""What the page says is what the result and its tables say, in every state."""

import re
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.report_states import STATES, read_page, state_of
from support.small_worlds import cubes

from replay.outputs.report.markup import environment
from replay.outputs.report.page import report_html, write_report
from replay.outputs.report.run_view import RunView
from replay.pipeline.engine import compute
from replay.studies.synthetic_sessions import synthetic_session


@pytest.fixture(scope="module")
def several():
    return state_of("several")


@pytest.mark.parametrize("state", STATES)
def test_the_page_reads_as_it_did(state, snapshot):
    assert read_page(state_of(state)[1]) == snapshot


def test_every_fault_has_one_place_with_its_own_address(several):
    result, page = several
    asked = [
        f"{kind}={fault.number}" + ("" if label == "slow" else f"&by={label}")
        for kind, found in (("miss", result.misses), ("false", result.false))
        for label in ("slow", "more")
        for fault in found[label]
    ]
    there = re.findall(r' id="((?:miss|false)=[^"]*)"', page.replace("&amp;", "&"))
    assert len(asked) > 5 and sorted(there) == sorted(asked)
    cards = re.findall(
        r'<article class="card" id="([^"]*)".*?<code>([^<]*)</code>', page.replace("&amp;", "&"), re.DOTALL
    )
    for at, words in cards:
        kind, _, rest = at.partition("=")
        number, _, by = rest.partition("&by=")
        assert words == f"replay view RUN --{kind} {number} --by {by or 'slow'}"
    first = result.answers[0].moment
    told = f"replay view RUN --{first.kind} {first.number} --by {result.answers[0].label}"
    assert cards and f"<code>{told}</code></dd>" in page


def test_a_card_is_of_the_longest_fault_of_its_pair_and_there_are_at_most_six():
    result, page = state_of("nine pairs")
    cards = re.findall(r'<article class="card" id="(\w+)=(\d+)"', page)
    faults = [*result.misses["slow"], *result.false["slow"]]
    assert len(cards) == 6 < len({fault.pair for fault in faults}) and "more pairs of bodies" in page
    for kind, number in cards:
        found = result.misses if kind == "miss" else result.false
        (shown,) = (fault for fault in found["slow"] if fault.number == int(number))
        alike = [fault for fault in found["slow"] if fault.pair == shown.pair]
        assert shown.frames == max(fault.frames for fault in alike)


@pytest.mark.parametrize(
    ("state", "mark"), [("only false", "worst false"), ("one missed", "worst missed"), ("nothing wrong", "")]
)
def test_the_row_of_the_worst_detector_is_marked_by_its_larger_fault(state, mark):
    assert re.findall(r'<tr class="(worst \w+)"', state_of(state)[1]) == ([mark] if mark else [])


def test_what_a_hand_holds_is_no_contact_of_the_reference():
    rows = [{"detector": label, "held": held} for label in ("exact", "it") for held in (False, True)]
    run = SimpleNamespace(summary={"detectors": {"exact": {}, "it": {}}}, oracle="exact")
    contacts = RunView(run, lambda _: rows, "s").contacts
    assert [len(contacts[label]) for label in ("exact", "it")] == [1, 2]


def test_the_moment_of_the_sentence_is_that_of_picture_caption_command_and_timeline(several):
    result, page = several
    moment = result.answers[0].moment
    first = page[: page.index('<section id="faults"')]
    assert f"{moment.seconds:.3f} s: " in first and f"--{moment.kind} {moment.number} --by more<" in first
    marks = set(re.findall(r'class="now" d="M([\d.]+) 0V20"', page))
    assert {float(mark) for mark in marks} == {round(moment.seconds, 3)}


def test_the_page_needs_nothing_from_outside_and_runs_no_script(several):
    page = several[1]
    assert all(place.startswith(("data:", "#")) for place in re.findall(r'(?:src|href)="([^"]*)"', page))
    assert "@import" not in page and "<script" not in page
    (allowed,) = re.findall('<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    assert allowed.startswith("default-src 'none'; ") and "script" not in allowed and "http" not in allowed


def test_the_same_result_gives_the_same_bytes(several, tmp_path):
    write_report(several[0], tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == several[1]


@pytest.mark.parametrize(
    ("scene", "curve", "headline"),
    [
        ("ammonia-calorimetry", "The temperature of calorimeter: 20.00 to 24.4", "warms from 20.00 to 24.4"),
        ("titration", "over what came in; the line is its end point, ", "equivalent in flask after 25.0"),
    ],
)
def test_an_experiment_has_its_result_as_headline_and_as_the_first_curve(scene, curve, headline):
    page = report_html(compute(synthetic_session(scene)[0], detectors=()))
    captions = re.findall(r"<figcaption>(The (?:temperature|pH)[^<]*)</figcaption>", page)
    assert curve in "".join(captions) and headline in page[: page.index(captions[0])]


def test_hostile_names_stay_words():
    session = cubes({"<script>alert(1)</script>": [0] * 30, 'b"&\u202e': [3, 2, 0.9, 2, 3] * 6})
    text = report_html(compute(session, detectors="slow=discrete[rate_hz=5]"))
    assert "<script" not in text and "&lt;script&gt;" in text and "\u202e" not in text


@given(st.text())
def test_no_text_becomes_an_element(text):
    page = environment().from_string('<p title="{{ text }}">{{ text }}</p>').render(text=text)
    assert page.count("<") == page.count(">") == page.count('"') == 2
