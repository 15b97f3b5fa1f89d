"""The page says what the result says, and what accuracy costs."""

import base64
import json
import re
from dataclasses import replace
from html import escape
from importlib.resources import files

import numpy as np
import pytest
from support.browser import opened, serious_faults
from support.headless import photographed
from support.page_cells import NUMBER, Cells, said_in, shown_as, values_of
from support.small_worlds import cubes, jumping

from replay.outputs.price_plot import subtitle
from replay.outputs.report.drawing import DARK, LIGHT
from replay.outputs.report.markup import rendered
from replay.outputs.report.page import _telling, report_html, write_report
from replay.outputs.report.tradeoff import tradeoff_parts
from replay.outputs.results.run_folder import write_run_folder
from replay.outputs.tradeoff_table import AT_PHASE, how_measured
from replay.pipeline.engine import compute
from replay.pipeline.headline import beside, headline, price
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


def test_the_headline_counts_what_the_result_counts(run, page):
    never = {miss.episode for miss in run.misses["slow"] if miss.kind == "never found"}
    assert f"{len(never)} of {len(run.episodes['exact'])} contacts here" in headline(run, "slow")
    assert never and headline(run, "slow") in page


def test_the_answer_and_its_price_come_before_the_facts(run, page):
    told = [escape(one) for one in (*beside(run), *price(run), "To do for slow: look at every frame.")]
    assert len(told) == 3 and "".join(f'<p class="price">{one}</p>' for one in told) + "</div>" in page.replace(
        "\n", ""
    )
    titles = re.findall("<h2>([^<]*)</h2>", page)
    assert titles[0] == "Every miss of slow" and titles[-2:] == ["The session", "How to get the same again"]


def brightness(colour):
    """Relative luminance of #rgb or #rrggbb. Source: WCAG 2.2."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * one for one in colour[1:])
    parts = [int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)]
    linear = [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_words_can_be_read_on_light_pages_and_on_dark_ones():
    style = files("replay.outputs.report").joinpath("style.css").read_text(encoding="utf-8")
    light, dark = (dict(re.findall(r"--(\w+): (#\w+);", one)) for one in re.findall(r":root \{([^}]*)\}", style))
    assert light.keys() == dark.keys() and brightness(light["paper"]) > 0.9 and brightness(dark["paper"]) < 0.05
    for colours in (light, dark):
        for words in ("ink", "faint", "link"):
            for behind in ("paper", "code"):
                low, high = sorted(brightness(colours[one]) for one in (words, behind))
                assert (high + 0.05) / (low + 0.05) >= 4.5, (words, behind, colours)
    rules = re.sub(r":root \{[^}]*\}", "", style)
    assert re.findall("#[0-9a-f]{3,6}", rules) == ["#fff"], "all else follows the scheme"


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


def test_contacts_and_times_are_those_of_the_result(run, page):
    tables = Cells(page).tables
    (contacts,) = [rows for caption, rows in tables.items() if caption.startswith("Contacts (exact)")]
    assert sum(int(row[1]) for row in contacts) == len(run.episodes["exact"])
    assert sum(int(row[6]) for row in contacts) == int((run.comparisons["slow"].outcome == 2).sum())
    times = {row[0]: float(row[2]) for row in tables["Time of each detector"]}
    told = run.summary["detectors"]
    assert times == pytest.approx({label: told[label]["seconds"]["detect"] for label in told}, abs=5e-4)
    assert all(run.summary["detectors"][label]["digest"] in page for label in run.detections)


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


def test_every_detector_that_missed_something_has_a_picture_before_any_has_a_second_of_a_pair(run):
    (one, *_), label = run.misses["slow"], "slow"
    shown = [(label, replace(one, number=k, cut_length=1.0 - 0.1 * k)) for k in range(1, 6)]
    shown.append(("fast", replace(one, number=1, cut_length=0.01)))
    assert [(who, miss.number) for who, miss in _telling(shown)][:3] == [("slow", 1), ("fast", 1), ("slow", 2)]


@pytest.mark.slow
def test_the_page_holds_the_curve_the_advice_and_a_row_per_setting(run, tmp_path):
    tried = [Setting("hybrid", "as it comes", ""), Setting("discrete", "step rate", "20 Hz", {"rate_hz": 20.0})]
    done = replace(tradeoff(run.session, settings=tried, repeats=1), cut=("image-space",))
    part = "\n".join(map(rendered, tradeoff_parts(done)))
    assert (
        "data:image/svg+xml;base64," in part
        and "<summary>1 setting not tried, for want of time</summary><p>image-space.</p>" in part
    )
    themes = [base64.b64decode(one).decode().upper() for one in re.findall(r"svg\+xml;base64,([^\"]+)", part)]
    assert [[theme.grid in one for theme in (DARK, LIGHT)] for one in themes] == [[True, False], [False, True]]
    assert part.index("(prefers-color-scheme: dark)") < part.index("<img")
    for sentence in done.advice:
        assert sentence in part
    # A reader finds which times are live, passes, phases, what intervals are over, containment and faces.
    for sentence in (AT_PHASE, *subtitle(done), *how_measured(done)):
        assert escape(sentence) in part
    assert part.count("<tr") == 1 + len(tried)
    hybrid = next(row for row in done.rows if row["detector"] == "hybrid")
    counted = [f">{count} {name.replace('_', ' ')}<" for name, count in hybrid["work"].items() if count]
    assert any(one in part for one in counted) and "skipped" not in part and done.about["machine"]["processor"] in part
    page = report_html(replace(run, tradeoff=done))
    write_run_folder(replace(run, tradeoff=done), tmp_path / "run")
    told = json.loads((tmp_path / "run" / "summary.json").read_text())["tradeoff"]
    minute = [row["seconds_per_minute"] / row["ms_per_frame"] * row[end] for row in told["rows"]
              for end in ("ms_low", "ms_high") if row[end] is not None]  # fmt: skip
    numbers = {*values_of(told), *minute, 95.0, 90.0, told["seconds"] / 60, 1000 / 90}
    numbers |= {1 - row["precision"] for row in told["rows"] if row["precision"] is not None}
    assert [one for one in NUMBER.findall(said_in(part)) if not shown_as(one, numbers)] == []
    assert part in page and "What accuracy costs" in page and "What accuracy costs" not in report_html(run)
    assert f"<h1>{done.answer}</h1>" in page and page.index(part) < page.index("<h2>When: slow")
