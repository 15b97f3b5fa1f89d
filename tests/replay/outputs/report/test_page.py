"""The page says what the result says, and what accuracy costs."""

import re
from dataclasses import replace

import numpy as np
import pytest
from support.browser import opened, serious_faults
from support.headless import photographed
from support.page_cells import Cells
from support.small_worlds import cubes, jumping

from replay.outputs.report.page import report_html, write_report
from replay.pipeline.engine import compute
from replay.pipeline.headline import headline


def test_the_headline_counts_what_the_result_counts(run, page):
    never = {miss.episode for miss in run.misses["slow"] if miss.kind == "never found"}
    (row,) = [rank for rank in run.ranking if rank.label == "slow"]
    smallest, largest = row.missed_counts
    assert smallest <= len(never) <= largest
    assert f"{smallest}-{largest} of {len(run.episodes['exact'])} contacts missed" in headline(run, "slow")
    assert never and headline(run, "slow") in page


def test_every_miss_is_a_row_with_its_numbers_and_the_command_that_shows_it(run, page):
    rows = Cells(page).tables["What slow missed"]
    ordered = sorted(run.misses["slow"], key=lambda miss: (-miss.cut_length, miss.number))
    assert [row[0] for row in rows] == [str(miss.number) for miss in ordered]
    for row, miss in zip(rows, ordered, strict=True):
        assert row[2] == f"{miss.body_a} - {miss.body_b}" and row[3:5] == [miss.kind, miss.cause]
        assert row[8] == f"replay view RUN --miss {miss.number}"
        assert row[9] == f"look at every frame, {1e3 * run.at_every_frame['slow']:.2g} ms each"
        assert [float(cell) for cell in (row[1], *row[5:8])] == pytest.approx(
            [miss.start, miss.last - miss.first + 1, miss.cut_length * 1e3, miss.face_pairs], abs=0.051
        )
        assert f'href="#miss={miss.number}"' in page and f'id="miss={miss.number}"' in page


def test_a_miss_between_frames_is_listed_and_drawn_at_the_moment_of_its_touch():
    session = jumping()
    text = report_html(compute(session, detectors="exact", oracle="continuous"))
    tables = Cells(text).tables
    (caption,) = (one for one in tables if one.startswith("What exact missed"))
    assert "between frames: no frame shows it" in caption
    ((number, at, _, kind, cause, after, *_),) = tables[caption]
    assert (number, kind, cause, after) == ("1", "never found", "between frames", "1")
    assert float(at) == pytest.approx(0.01 + 0.01 * 2 / 6, abs=5e-4)
    assert "red: the faces that touch first, between frames 1 and 2" in text


def test_the_page_needs_nothing_from_outside(page):
    places = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert all(place.startswith(("data:", "#")) for place in places)
    assert "@import" not in page and "<script" not in page


def test_the_same_result_gives_the_same_bytes(run, page, tmp_path):
    write_report(run, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page


def test_hostile_names_stay_words():
    session = cubes({"<script>alert(1)</script>": [0] * 30, 'b"&\u202e': [3, 2, 0.9, 2, 3] * 6})
    text = report_html(compute(session, detectors="slow=discrete[rate_hz=5]"))
    assert "<script" not in text and "&lt;script&gt;" in text and "\u202e" not in text


def test_a_page_allows_a_browser_no_script_and_no_other_address(page):
    (allowed,) = re.findall('<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    assert allowed.startswith("default-src 'none'; ") and "script" not in allowed and "http" not in allowed


def test_a_run_without_detectors_says_so(run):
    session = run.session
    text = report_html(compute(session, detectors=()))
    assert "No contact was looked for" in text


def test_a_run_without_an_oracle_lists_contacts(run):
    text = report_html(compute(run.session, detectors="hybrid", oracle="none"))
    assert "Contacts found by hybrid" in text and "contacts found by hybrid</h1>" in text


def test_proxies_are_named_as_such(run):
    text = report_html(replace(run, assembly=replace(run.assembly, proxies=("ball",))))
    assert "stand in for the real ones of ball" in text


@pytest.mark.slow
def test_a_browser_shows_the_page(page, tmp_path):
    picture, said = photographed(page, tmp_path, "1280,3000")
    colours = np.unique(picture.reshape(-1, 3), axis=0).tolist()
    assert [255, 45, 85] in colours and len(colours) > 500, "the red of the missed and the pictures are on the page"
    assert "CONSOLE" not in said


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_a_checker_of_accessibility_finds_no_serious_fault(page, tmp_path, scheme, width):
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    with opened((tmp_path / "page.html").as_uri(), tmp_path, (width, 800), scheme) as browser:
        browser.ask("for (const one of document.querySelectorAll('details')) one.open = true")
        assert serious_faults(browser, tmp_path) == []
