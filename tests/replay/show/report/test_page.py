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

SERIES_NAMES = ("dish/temperature", "lid/temperature", "dish", "dish/mass")


@pytest.mark.parametrize("state", RUN_OF_STATE)
def test_the_page_reads_as_it_did(state, snapshot):
    """The text of a reviewed page is stored; times are set, so that it is the same on every machine."""
    assert read_page(report_html(run_with_steady_times(state))) == snapshot


def test_report_counts_contact_of_bounding_spheres_as_unconfirmed():
    """Unit cubes at 1.2 are apart, but spheres around them overlap."""
    page = report_html(
        compute(unit_cubes_on_x({"a": [0.0] * 6, "b": [3.0, 3.0, 1.2, 1.2, 3.0, 3.0]}), detectors="sphere")
    )
    assert "1 unconfirmed contact" in page


def test_report_leaves_grasped_contacts_out_of_the_reference():
    """The reference has one of two contacts, since the other is grasped; a detector has both."""
    free_and_grasped = [SimpleNamespace(grasped=grasped) for grasped in (False, True)]
    run = SimpleNamespace(oracle="exact", contacts={"exact": free_and_grasped, "slow": free_and_grasped})
    contacts = RunView(run, "s").contacts
    assert [len(contacts[label]) for label in ("exact", "slow")] == [1, 2]


@pytest.mark.parametrize(("count", "last_line"), [(6, "6.000 s: spilt"), (9, "and 3 more")])
def test_report_lists_six_events_and_counts_the_rest(count, last_line):
    """Events come in order of time, though they are listed backwards in the run: one at each second."""
    events = [
        EventRecord(stamp_ns=k, source="effect/spill", name="spill", time=float(k), message="spilt")
        for k in range(count, 0, -1)
    ]
    run = SimpleNamespace(document=EMPTY, answers=(), oracle="", ranking=(), events=events)
    lines = RunView(run, "s").hero.lines
    assert lines[0] == "1.000 s: spilt" and lines[-2] == last_line  # the last says that contacts were not computed


def test_page_loads_nothing_and_runs_its_own_script_only():
    """Addresses are data or places on the page; the policy allows the script by its SHA-256, of at most 25 kB."""
    page = report_html(run_with_steady_times("several"))
    assert all(place.startswith(("data:", "#")) for place in re.findall(r'(?:src|href)="([^"]*)"', page))
    assert "@import" not in page
    (allowed,) = re.findall('<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    (script,) = re.findall("<script>(.*?)</script>", page, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert allowed.startswith("default-src 'none'; ") and allowed.endswith(f"; script-src 'sha256-{digest}'")
    assert "http" not in allowed and len(script.encode()) <= 25_000


def test_page_script_has_no_comments_or_blank_lines():
    """The sources of the script have comments."""
    assert "//" in file_text("show/report/script/tools.js")
    lines = page_script(REPORT_SCRIPTS).text.splitlines()
    assert [line for line in lines if not line or line != line.strip() or line.startswith("//")] == []


def test_report_draws_temperatures_of_warmed_bodies_only():
    """The dish becomes warmest; no event tells of the lid, and a series of another name is no temperature."""
    series = {name: Series(np.array([0.0, 1.0]), np.array([20.0, 24.0])) for name in SERIES_NAMES}
    output = EffectOutput(events=(EffectEvent(1.0, "warmest", ("dish",)),), series=series)
    spec = EffectSpec("heat", "x", lambda _: None)
    heat = EffectRun(spec, ("declared",), output, seconds=0.1, counters={}, frames=2, frames_run=2)
    page = report_html(replace(run_with_steady_times("effects"), effects={"heat": heat}))
    captions = re.findall(r"<figcaption>(The temperature[^<]*)</figcaption>", page)
    assert captions == ["The temperature of dish: 20.00 to 24.00 degC."]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "curve", "headline"),
    [
        ("ammonia-calorimetry", "The temperature of calorimeter: 20.00 to 24.4", "warms from 20.00 to 24.4"),
        ("titration", "over what came in; a line marks each end point: ", "equivalent in flask after 25.0"),
    ],
)
def test_experiment_result_is_headline_and_first_curve(scene, curve, headline):
    """25 mL of acid need 25 mL of base as strong; acid warms ammonia by 4.4 K, as ``ammonia-calorimetry.toml`` plants.

    Each page shows one curve of its effect, and its headline stands before the caption of that curve.
    """
    page = report_html(compute(synthetic_session(scene)[0], detectors=()))
    captions = re.findall(r"<figcaption>(The (?:temperature|pH)[^<]*)</figcaption>", page)
    assert curve in "".join(captions) and headline in page[: page.index(captions[0])]


def test_hostile_names_stay_text():
    """One body is named like a script, the other has a quote and the sign that turns the direction of text.

    The only script is that of the page.
    """
    session = unit_cubes_on_x({"<script>alert(1)</script>": [0] * 30, 'b"&\u202e': [3, 2, 0.9, 2, 3] * 6})
    text = report_html(compute(session, detectors="slow=discrete[rate_hz=5]"))
    assert text.count("<script") == 1 and "&lt;script&gt;" in text and "\u202e" not in text


@given(st.text("a<>&\"'/\n\0ä\u202e杯"))
def test_no_text_becomes_an_element(text):
    """The template has one element with one attribute: two angle brackets of each kind, and two quotes."""
    page = environment().from_string('<p title="{{ text }}">{{ text }}</p>').render(text=text)
    assert page.count("<") == page.count(">") == page.count('"') == 2


def test_report_names_no_path_and_no_session_file(tmp_path):
    """The run folder is called like a person; commands of the page call it a dot."""
    out = tmp_path / "anna-smith"
    run(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=5]", out=out, picture=False)
    page = (out / "report.html").read_text("utf-8")
    assert "replay view . --" in page
    assert "anna-smith" not in page and str(tmp_path) not in page
