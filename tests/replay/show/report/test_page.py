"""The page says what the result and its tables say, in every state."""

import base64
import hashlib
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.report_states import EMPTY, RUN_OF_STATE, read_page, run_with_steady_times
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay import run
from replay.document.contact import EventRecord
from replay.effects.effects_runner import EffectRun
from replay.effects.output import EffectEvent, EffectOutput, Series
from replay.effects.protocol import EffectSpec
from replay.engine import compute
from replay.show.report.markup import environment, file_text
from replay.show.report.page import report_html
from replay.show.report.page_script import REPORT_SCRIPTS, page_script
from replay.show.report.run_view import RunView
from replay.studies.synthetic_sessions import synthetic_session


@pytest.mark.parametrize("state", RUN_OF_STATE)
def test_the_page_reads_as_it_did(state, snapshot):
    """The visible text of the report of a run in each state equals the stored one, which people reviewed.

    Times of detectors are set, so that the text is the same on every machine.
    """
    assert read_page(report_html(run_with_steady_times(state))) == snapshot


def test_report_counts_contact_of_bounding_spheres_as_unconfirmed():
    """Unit cubes, 1.2 m from middle to middle in two frames, are 0.2 m apart; spheres around them (0.87 m) overlap.

    The detector ``sphere`` reports only that bounding spheres overlap: no false contact, but an unconfirmed one.
    """
    session = unit_cubes_on_x({"a": [0.0] * 6, "b": [3.0, 3.0, 1.2, 1.2, 3.0, 3.0]})
    assert "1 unconfirmed contact" in report_html(compute(session, detectors="sphere"))


def test_report_leaves_grasped_contacts_out_of_the_reference():
    """One of two contacts is grasped: a hand holds the body. Lanes of the reference (exact) leave that one out.

    Those of a detector (slow) have both.
    """
    free_and_grasped = [SimpleNamespace(grasped=grasped) for grasped in (False, True)]
    run = SimpleNamespace(oracle="exact", contacts={"exact": free_and_grasped, "slow": free_and_grasped})
    contacts = RunView(run, "s").contacts
    assert [contact.grasped for contact in contacts["exact"]] == [False]
    assert [contact.grasped for contact in contacts["slow"]] == [False, True]


@pytest.mark.parametrize(
    ("count", "line_before_last"),
    [pytest.param(6, "6.000 s: spilt", id="six"), pytest.param(9, "and 3 more", id="nine")],
)
def test_report_lists_six_events_and_counts_the_rest(count, line_before_last):
    """An event of an effect at each of so many seconds, in the run in falling order of time; nothing was compared.

    The report lists six from the first on, then how many more there are; a last line says that no contact was computed.
    """
    events = [
        EventRecord(stamp_ns=second, source="effect/spill", name="spill", time=float(second), message="spilt")
        for second in range(count, 0, -1)
    ]
    run = SimpleNamespace(document=EMPTY, answers=(), oracle="", ranking=(), events=events)
    lines = RunView(run, "s").hero.lines
    assert lines[0] == "1.000 s: spilt"
    assert lines[-2] == line_before_last
    assert lines[-1].startswith("Contacts were not computed")


def test_page_loads_nothing_from_elsewhere():
    """Every address in the report is data or a place on the page (#...)."""
    page = report_html(run_with_steady_times("several"))
    addresses = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert addresses
    assert [address for address in addresses if not address.startswith(("data:", "#"))] == []
    assert "@import" not in page


def test_content_policy_of_a_page_allows_its_own_script_only():
    """The policy forbids all but a script with this SHA-256, that of the only one in the page; no address is allowed.

    The script has at most 25 kB.
    """
    page = report_html(run_with_steady_times("several"))
    (policy,) = re.findall('<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    (script,) = re.findall("<script>(.*?)</script>", page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.startswith("default-src 'none'; ")
    assert policy.endswith(f"; script-src 'sha256-{digest}'")
    assert "http" not in policy
    assert len(script.encode()) <= 25_000


def test_page_script_has_no_comments_or_blank_lines():
    """The script of a page is made of files, of which ``tools.js`` at least has comments (//)."""
    assert "//" in file_text("show/report/script/tools.js")
    lines = page_script(REPORT_SCRIPTS).text.splitlines()
    assert lines
    assert [line for line in lines if not line or line != line.strip() or line.startswith("//")] == []


def test_report_draws_temperatures_of_warmed_bodies_only():
    """An effect has four series, which rise by 4, and two events: when the dish is warmest, and a spill on the lid.

    Only the temperature of the dish is drawn: no event is about that of the lid, and "dish" and "dish/mass" are none.
    """
    first_values = {"dish/temperature": 20.0, "lid/temperature": 30.0, "dish": 40.0, "dish/mass": 50.0}
    series = {
        name: Series(np.array([0.0, 1.0]), np.array([first, first + 4.0])) for name, first in first_values.items()
    }
    events = (EffectEvent(0.5, "spill", ("lid",)), EffectEvent(1.0, "warmest", ("dish",)))
    output = EffectOutput(events=events, series=series)
    spec = EffectSpec("heat", "x", lambda _: None)
    heat = EffectRun(spec, ("declared",), output, seconds=0.1, counters={}, frames=2, frames_run=2)
    page = report_html(replace(run_with_steady_times("effects"), effects={"heat": heat}))
    captions = re.findall(r"<figcaption>(The temperature[^<]*)</figcaption>", page)
    assert captions == ["The temperature of dish: 20.00 to 24.00 degC."]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "caption", "headline"),
    [
        pytest.param(
            "ammonia-calorimetry",
            "The temperature of calorimeter: 20.00 to 24.4",
            "warms from 20.00 to 24.4",
            id="calorimetry",
        ),
        pytest.param(
            "titration",
            "over what came in; a line marks each end point: ",
            "equivalent in flask after 25.0",
            id="titration",
        ),
    ],
)
def test_experiment_result_is_headline_and_first_curve(scene, caption, headline):
    """The report of a made-up experiment has its result as headline, and a curve (pH or temperature) below that.

    Planted are 25 mL of acid, neutralised by 25 mL of base as strong, and acid that warms ammonia by 4.4 K.
    """
    session, _truth = synthetic_session(scene)
    page = report_html(compute(session, detectors=()))
    captions = re.findall(r"<figcaption>(The (?:temperature|pH)[^<]*)</figcaption>", page)
    assert any(caption in text for text in captions)
    assert headline in page[: page.index(captions[0])]


def test_hostile_names_stay_text():
    """One body is named like a script, the other has a quote and U+202E, which turns the direction of text.

    The only script of the report is its own; the name stands there as text, and U+202E is taken out.
    """
    session = unit_cubes_on_x({"<script>alert(1)</script>": [0] * 30, 'b"&\u202e': [3, 2, 0.9, 2, 3] * 6})
    page = report_html(compute(session, detectors="slow=discrete[rate_hz=5]"))
    assert page.count("<script") == 1
    assert "&lt;script&gt;" in page
    assert "\u202e" not in page


@given(st.text("a<>&\"'/\n\0ä\u202e杯"))
def test_no_text_becomes_an_element(text):
    """A template has one element with one attribute: two angle brackets of each kind, and two quotes.

    Any text filled into both adds none of these characters.
    """
    page = environment().from_string('<p title="{{ text }}">{{ text }}</p>').render(text=text)
    assert page.count("<") == page.count(">") == page.count('"') == 2


def test_report_names_no_path_of_its_run_folder(tmp_path):
    """The run folder, called like a person, has the report in it: commands of the page call the folder "."."""
    out = tmp_path / "anna-smith"
    run(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=5]", out=out, picture=False)
    page = (out / "report.html").read_text("utf-8")
    assert "replay view . --" in page
    assert "anna-smith" not in page
    assert str(tmp_path) not in page
